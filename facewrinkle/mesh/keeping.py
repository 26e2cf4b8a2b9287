"""Arrays that take long to find and never change, kept in the user's cache folder for the next start.

A file is found by a digest of all that went into its arrays: the inputs, the modules and data of this package, the
versions of those that compute with it, and the processor that its loops are compiled for. Under another digest it is
not found, so that a file does not go out of date: it is of no use, and gives way to others in time.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite  # comes with numba
import numba
import numpy as np
import pyvista as pv
import scipy
from llvmlite import binding

from .. import __version__
from ..errors import OutputError
from ..files import written
from ..geometry.compilation import temporary_folder

Arrays = dict[str, np.ndarray]

FOLDER = "FACEWRINKLE_CACHE_DIR"
"""Environment variable with another folder; if it is empty, nothing is kept."""

MOST, WHOLE = 40, 500_000_000
"""Files that are kept, and bytes of all together: of more, those that were not used for longest are removed."""

SHARE = 0.25
"""Share of all bytes beyond which arrays are not kept: they would push out too many others."""

OWN = re.compile(r"(\.\d+\.)?facewrinkle-[a-z]+-[0-9a-f]{32}\.npz")
"""Names of our files, with a number before them while they are written; none other in the folder is ever touched."""

NAMES = "names of all"
"""The array with the names of the others: where the list of arrays is damaged, some are overlooked."""

ROOMS = ("geometry", "mesh", "anatomy", "motion", "layers", "simulation")
"""Rooms whose modules and data may have a part in what is kept."""


def kept(name: str, inputs: object, make: Callable[[], Arrays]) -> Arrays:
    """Return arrays that `make` returns, or those that it returned from the same inputs at an earlier start.

    Inputs that cannot be told apart by their content, such as objects of a user's own classes, keep nothing; nor does
    a folder that cannot be written, or a damaged file. Whatever goes wrong with a file, the arrays are made.

    Parameters
    ----------
    name : str
        What the arrays are, in small letters: a part of the file's name.
    inputs : object
        All that the arrays depend on besides the package itself; see :func:`digest`.
    make : callable
        Without arguments.

    Examples
    --------
    >>> import tempfile
    >>> from unittest.mock import patch
    >>> with tempfile.TemporaryDirectory() as folder, patch.dict(os.environ, {FOLDER: folder}):
    ...     first = kept("squares", 3, lambda: {"squares": np.arange(3) ** 2})
    ...     again = kept("squares", 3, lambda: {"squares": "not asked for"})
    ...     first["squares"].tolist(), again["squares"].tolist(), len(os.listdir(folder))
    ([0, 1, 4], [0, 1, 4], 1)
    """
    folders = _folders()
    key = digest((_package(), _computing(), inputs)) if folders else None
    if key is None:
        return make()
    file = f"facewrinkle-{name}-{key}.npz"
    for folder in folders:
        found = _read(folder / file)
        if found is not None:
            return found
    arrays = make()
    if name not in _UNKEPT.get() and sum(array.nbytes for array in arrays.values()) <= SHARE * WHOLE:
        any(_wrote(folder / file, arrays) for folder in folders)
    return arrays


_UNKEPT: ContextVar[tuple[str, ...]] = ContextVar("_UNKEPT", default=())
"""Names of which no new arrays are kept."""


@contextmanager
def unkept(*names: str) -> Iterator[None]:
    """Keep no new arrays of these names within: for faces that never come again, which would push out all others.

    Examples
    --------
    >>> import tempfile
    >>> from unittest.mock import patch
    >>> with tempfile.TemporaryDirectory() as folder, patch.dict(os.environ, {FOLDER: folder}), unkept("squares"):
    ...     arrays = kept("squares", 3, lambda: {"squares": np.arange(3) ** 2})
    ...     os.listdir(folder)
    []
    """
    token = _UNKEPT.set((*_UNKEPT.get(), *names))
    try:
        yield
    finally:
        _UNKEPT.reset(token)


def digest(value: object, decimals: int | None = None) -> str | None:
    """Return a digest of the content of numbers, strings, arrays, meshes, this package's dataclasses, and collections.

    None if there is anything else in it, such as an object of a user's class, whose methods could be others next time.

    Parameters
    ----------
    value : object
    decimals : int, optional
        Numbers are rounded so far, for what other computers round otherwise in the last digits.

    Examples
    --------
    >>> digest([1, 2.0, {"a": np.zeros(3)}]) == digest([1, 2.0, {"a": np.zeros(3)}])
    True
    >>> digest(np.zeros(3)) == digest(np.zeros((3, 1))), digest(lambda: 1)
    (False, None)
    >>> digest([0.1 + 0.2], 9) == digest([0.3], 9), digest(0.1 + 0.2) == digest(0.3)
    (True, False)
    """
    content = hashlib.blake2b(digest_size=16)
    try:
        _feed(content.update, value, decimals)
    except TypeError:
        return None
    return content.hexdigest()


def _feed(update: Callable[[Any], None], value: Any, decimals: int | None) -> None:
    """Feed bytes to a digest that no other content has."""
    kind = type(value)
    if decimals is not None and (kind is float or (isinstance(value, np.ndarray) and value.dtype.kind == "f")):
        value = (round(value, decimals) if kind is float else np.round(value, decimals)) + 0.0  # no minus before 0
    if value is None or kind in (bool, int, float, str):
        text = repr(value).encode()
        update(b"%s %d %s" % (kind.__name__.encode(), len(text), text))
    elif isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "biufU":
        update(f"array {value.dtype.str} {value.shape} ".encode())
        update(value.tobytes())
    elif isinstance(value, list | tuple):
        update(b"list %d " % len(value))
        for each in value:
            _feed(update, each, decimals)
    elif isinstance(value, Mapping):
        update(b"mapping %d " % len(value))
        for name, each in value.items():
            _feed(update, name, decimals)
            _feed(update, each, decimals)
    elif isinstance(value, pv.PolyData):
        update(b"mesh ")
        _feed(update, [np.asarray(each) for each in (value.points, value.faces, value.lines, value.verts)], decimals)
        for data in (value.point_data, value.cell_data, value.field_data):
            _feed(update, {name: np.asarray(data[name]) for name in sorted(data)}, decimals)
    elif dataclasses.is_dataclass(kind) and kind.__module__.partition(".")[0] == __package__.partition(".")[0]:
        _feed(update, f"{kind.__module__}.{kind.__qualname__}", decimals)
        _feed(update, {each.name: getattr(value, each.name) for each in dataclasses.fields(value)}, decimals)
    else:
        raise TypeError(kind)


@cache
def _package() -> list[tuple[str, int, int]]:
    """Return the version of the package, and sizes and times of its files that may have a part in the arrays."""
    home = Path(__file__).parents[1]
    found = [(__version__, 0, 0)]
    for room in ROOMS:
        for folder, inner, names in os.walk(home / room):
            inner[:] = sorted(set(inner) - {"__pycache__"})
            for name in sorted(names):
                if not name.endswith((".nbi", ".nbc", ".pyc")):
                    status = os.stat(os.path.join(folder, name))
                    found.append((f"{folder}/{name}", status.st_size, status.st_mtime_ns))
    return found


@cache
def _computing() -> tuple[str, ...]:
    """Return the versions of the packages that compute the arrays, and the processor that numba compiles for."""
    versions = [package.__version__ for package in (np, scipy, numba, llvmlite, pv)]
    cpu, features = numba.config.CPU_NAME, numba.config.CPU_FEATURES  # type: ignore[attr-defined]  # None: the machine's
    processor = (
        binding.get_process_triple(),
        binding.get_host_cpu_name() if cpu is None else cpu,
        binding.get_host_cpu_features().flatten() if features is None else features,
    )
    return (*versions, str(pv.vtk_version_info), *processor)


def _folders() -> list[Path]:
    """Return the folders to look into, and to write to if those before cannot be written."""
    chosen = os.environ.get(FOLDER)
    if chosen is not None:
        folder = os.path.expanduser(chosen)
        return [Path(folder)] if folder and not folder.startswith("~") else []
    from platformdirs import user_cache_path

    folders = []
    with suppress(Exception):  # nobody's home: some versions raise an error, others return a folder below this one
        home = user_cache_path("facewrinkle", appauthor=False)
        folders += [home] if home.is_absolute() else []
    temporary = temporary_folder()
    return folders if temporary is None else [*folders, temporary]


def _read(file: Path) -> Arrays | None:
    """Return the arrays of a file; None if there is none, or it is damaged."""
    try:
        with file.open("rb") as opened, np.load(opened, allow_pickle=False) as stored:  # checks each checksum
            arrays = {name: stored[name] for name in stored.files}
        if arrays.pop(NAMES).tolist() != list(arrays):
            return None
    except Exception:  # every part of a file can be damaged in its own way
        return None
    with suppress(OSError):
        os.utime(file)
    return arrays


def _wrote(file: Path, arrays: Arrays) -> bool:
    """Write arrays, and make room for them; return False if that was not possible."""
    try:
        with written(file) as whole:
            np.savez(whole, **arrays, **{NAMES: np.array(list(arrays), np.str_)})  # type: ignore[arg-type]
    except (OSError, OutputError):
        return file.exists()
    with suppress(OSError):
        _make_room(file.parent)
    return True


def _make_room(folder: Path) -> None:
    """Remove those of our files that were not used for longest, until what is left is not too much."""
    own = []
    for name in os.listdir(folder):
        with suppress(OSError):  # another process has removed it
            if OWN.fullmatch(name):
                status = os.stat(folder / name)
                own.append((status.st_mtime_ns, name, status.st_size))
    own.sort(reverse=True)
    whole = 0
    for number, (_, name, size) in enumerate(own):
        whole += size
        if number >= MOST or whole > WHOLE:
            with suppress(OSError):
                os.unlink(folder / name)
