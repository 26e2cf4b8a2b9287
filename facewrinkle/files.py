"""Files: read whole and only if they are ordinary ones, written whole or not at all, and looked for beside others."""

from __future__ import annotations

import errno
import os
import re
import reprlib
import shutil
import tomllib
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from io import BufferedReader
from itertools import count
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from tempfile import TemporaryFile
from typing import Any

from .errors import FaceWrinkleError, MeshError, OutputError, ParameterError

LARGEST_SETTINGS = 2**28
"""Most bytes of a file of settings: atlases, landmarks, specifications."""

PARTS = 64
"""The most parts of a name in a file of settings."""

_inside_only: ContextVar[bool] = ContextVar("inside_only", default=False)

_inputs: dict[tuple[int, int], str] | None = None
"""Paths of the files that were read, by device and number, while these are kept."""

_number = count()
"""So that two threads may write files of the same name."""

_unfinished: dict[Path, list[Path]] = {}
"""Files that `replaced` has not put into their place yet, with the folders that were made for each."""


# --- Reading -------------------------------------------------------------------------------------


@contextmanager
def inputs_kept() -> Iterator[None]:
    """Refuse to replace, within a block, whatever is read within it.

    A command makes up the names of its files, and one may be that of a file it was given. Programs name theirs.
    """
    global _inputs
    _inputs = {}
    try:
        yield
    finally:
        _inputs = None


def _is_input(status: os.stat_result) -> bool:
    """Return True for a file that was read and is still there; numbers of those that are gone are used again."""
    path = (_inputs or {}).get((status.st_dev, status.st_ino), "")
    return os.path.exists(path) and os.path.samestat(os.stat(path), status)


def path_of(path: str | Path) -> Path:
    """Return a path with the user's folder in place of ``~``.

    Raises
    ------
    ParameterError
        For what is no path.

    Examples
    --------
    >>> path_of(None)
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: a path must be a text or a Path, received None.
    """
    if not isinstance(path, str | os.PathLike):
        raise ParameterError(f"a path must be a text or a Path, received {reprlib.repr(path)}.")
    return Path(os.path.expanduser(path))  # Path.expanduser fails for unknown users


@contextmanager
def opened(path: str | Path, *, kept: bool = True) -> Iterator[BufferedReader]:
    """Open an ordinary file; unless `kept`, a command may replace it.

    Raises
    ------
    OSError
        Also for what is no ordinary file, such as a pipe, which may never end.

    Examples
    --------
    >>> with opened("/dev/null"):
    ...     pass
    Traceback (most recent call last):
    OSError: [Errno 22] it is not a regular file: '/dev/null'
    """
    path = str(path_of(path))
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        status = os.fstat(descriptor)
        if S_ISDIR(status.st_mode):
            raise OSError(errno.EISDIR, "it is a folder, and a file is needed", path)
        if not S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "it is not a regular file", path)
        if kept and _inputs is not None:
            _inputs[status.st_dev, status.st_ino] = path
        with open(descriptor, "rb", closefd=False) as file:
            yield file
    finally:
        os.close(descriptor)


def bytes_of(path: str | Path, most: int | None = None, *, kept: bool = True) -> bytes:
    """Return the content of an ordinary file of `most` bytes; see :func:`opened`."""
    with opened(path, kept=kept) as file:
        if most is not None and os.fstat(file.fileno()).st_size > most:
            raise OSError(errno.EFBIG, f"it is larger than {most // 2**20} MB", str(path))
        return file.read()


def text_of(path: str | Path) -> str:
    """Return the text of a file in UTF-16 with a byte order mark, in UTF-8 with or without one, or in Latin-1."""
    data = bytes_of(path)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def toml_of(path: str | Path) -> dict[str, Any]:
    """Return the content of a file of settings.

    Raises
    ------
    OSError
        If it cannot be read.
    ValueError
        If it is no TOML, or has a name of very many parts, ``a.b.c...``, for which memory runs out.
    """
    text = bytes_of(path, LARGEST_SETTINGS).decode()
    if re.search(rf"(?:[^.,=\[\]{{}}\n]{{1,100}}+\.){{{PARTS}}}", text):
        raise ValueError(f"a name has more than {PARTS} parts")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("its tables are nested too deeply") from None


def check_file(path: Path) -> None:
    """Raise a MeshError if a file is not there, cannot be opened, or is empty."""
    try:
        with opened(path) as file:
            size = os.fstat(file.fileno()).st_size
    except (FileNotFoundError, NotADirectoryError, ValueError):  # a null byte is a ValueError
        raise MeshError(
            f"there is no file {str(path)!r}. Check the path; it is relative to {str(Path.cwd())!r}."
        ) from None
    except OSError as problem:
        raise MeshError(f"{str(path)!r} cannot be opened: {problem.strerror}.") from None
    if size == 0:
        raise MeshError(f"{path.name} is empty (0 bytes). Export it again.")


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn whatever goes wrong while a file is read into a MeshError: every format can be damaged in its own ways."""
    try:
        yield
    except FaceWrinkleError:
        raise
    except MemoryError as problem:
        raise MeshError(
            f"{path.name} cannot be read: there is not enough memory for what it announces. If the file is whole, use "
            "a machine with more memory, or a mesh with fewer triangles."
        ) from problem
    except OSError as problem:
        raise MeshError(f"{str(path)!r} cannot be read: {problem.strerror or problem}. Check the file.") from problem
    except Exception as problem:
        reason = " ".join(traceback.format_exception_only(problem)[-1].split())  # str fails for some errors of USD
        raise MeshError(
            f"{path.name} cannot be read: its content makes no sense ({reason[:300]}). The file is damaged or of "
            "another format: export it again."
        ) from problem


# --- Files that other files name -----------------------------------------------------------------


@contextmanager
def inside_only(wanted: bool = True) -> Iterator[None]:
    """Within a block, if `wanted`, read nothing that a file names outside of its own folder (``../textures/skin.png``).

    For files that come from anyone: they could have any other file shown that this process may read.

    Examples
    --------
    >>> with inside_only():
    ...     sibling_file(Path("/usr"), "../etc/passwd")
    Traceback (most recent call last):
    facewrinkle.errors.MeshError: it names the file '../etc/passwd', which is outside its folder and is not read. ...
    """
    token = _inside_only.set(wanted)
    try:
        yield
    finally:
        _inside_only.reset(token)


def is_inside_only() -> bool:
    """Return True within a block of :func:`inside_only`; other threads and processes are to be told."""
    return _inside_only.get()


def is_outside(folder: Path, file: str | Path) -> bool:
    """Return True if a file lies neither in a folder nor below it; links in the folder are its owner's, and followed.

    Examples
    --------
    >>> is_outside(Path("scans"), "scans/maps/skin.png"), is_outside(Path("scans"), "scans/../skin.png")
    (False, True)
    """
    return not Path(os.path.abspath(file)).is_relative_to(os.path.abspath(folder))


def check_inside(folder: Path, file: str | Path, where: str, name: str) -> None:
    """Raise a MeshError for a file that is named in `where` and lies outside of a folder, where this is not allowed."""
    if is_inside_only() and is_outside(folder, file):
        raise MeshError(
            f"{where} names the file {name!r}, which is outside its folder and is not read. Put it beside the mesh, "
            "or, if you trust the file, read it without --no-outside."
        )


def sibling_file(folder: Path, name: str) -> Path | None:
    """Find a file by the name that another one gives it, even with folders of another machine or in another case.

    Raises
    ------
    MeshError
        If it is found only outside the folder, within :func:`inside_only`.
    """
    name = name.replace("\\", "/")
    wanted = Path(name).name
    refusal: MeshError | None = None
    for candidate in (folder / name, folder / wanted):
        try:
            if os.path.isfile(candidate):  # Path.is_file fails for names that no file can have
                check_inside(folder, candidate, "it", name)
                return candidate
        except MeshError as problem:
            refusal = problem
    alike = (file for file in sorted(folder.iterdir()) if file.name.casefold() == wanted.casefold() and file.is_file())
    found = next(alike, None)
    if found is None and refusal is not None:
        raise refusal
    return found


# --- Writing -------------------------------------------------------------------------------------


@contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder, with the same ending; at the end that file replaces `path`.

    Where `path` is a link, what it leads to is replaced. After an error or an interrupt, the old file is untouched, and
    nothing else is left; folders that were made and stayed empty are removed.
    """
    name = path_of(path).name
    path = output_target(path)
    temporary = path.with_name(f".{os.getpid()}.{next(_number)}.{name[-100:]}")
    _unfinished[temporary] = [folder for folder in path.parents if not folder.exists()]
    try:
        with _refusals(path):
            path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        with _refusals(path):
            _synchronize(temporary)
            if path.exists():
                shutil.copymode(path, temporary)  # a private file stays private
            temporary.replace(path)
    finally:
        _remove([temporary])  # if it is still there


@contextmanager
def written(path: str | Path) -> Iterator[Path]:
    """Do what `replaced` does, with an OutputError also for errors of the disk while the file is written."""
    with _refusals(path), replaced(path) as whole:
        yield whole


def write_whole(path: str | Path, content: str | bytes) -> Path:
    """Write a file, text in UTF-8, whole or not at all, and return its path; see :func:`written`.

    Examples
    --------
    >>> write_whole("/dev/null", "text")
    Traceback (most recent call last):
    facewrinkle.errors.OutputError: '/dev/null' is not a regular file, so nothing is written to it. Name another file.
    """
    with written(path) as whole:
        whole.write_bytes(content.encode() if isinstance(content, str) else content)
    return Path(path)


@contextmanager
def _refusals(path: str | Path) -> Iterator[None]:
    try:
        yield
    except OSError as problem:
        raise not_written(path, problem) from None


def not_written(path: str | Path, problem: OSError | str) -> OutputError:
    """Return the error for a file that could not be written, which says so if there is no room for it."""
    path = path_of(path).absolute()
    number, reason = (None, problem) if isinstance(problem, str) else (problem.errno, problem.strerror or str(problem))
    free = _free_bytes(path)
    if number == errno.EFBIG:
        return OutputError(
            f"{str(path)!r} cannot be written: it would be larger than files may be here. What was there before is "
            "untouched. Raise the limit of file sizes (ulimit -f), or write less."
        )
    # With fewer free bytes, what could not be written is taken to have found no room.
    if number in (errno.ENOSPC, errno.EDQUOT) or (free is not None and free < 2**20):
        left = "" if free is None else f" ({free / 1e6:.1f} MB are free)"
        return OutputError(
            f"{str(path)!r} cannot be written: no space left on its disk{left}. What was there before is untouched. "
            "Free some space, or write to another disk."
        )
    return OutputError(f"{str(path)!r} cannot be written: {reason.rstrip('.')}. Name a file that you may write.")


def remove_stale(record: Path, files: Sequence[Path]) -> list[Path]:
    """Remove what the last run wrote and this one did not, as old and new files would look like one result; return it.

    Parameters
    ----------
    record : Path
        A hidden file in the folder of the results, which keeps their names for the next run.
    files : sequence of Path
        All that this run wrote.

    Notes
    -----
    Files that were changed since, or that were read by the command, stay.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     model, page = (write_whole(Path(folder) / name, "old") for name in ("head.glb", "head.html"))
    ...     before = remove_stale(Path(folder) / ".head.files", [model, page])
    ...     [path.name for path in remove_stale(Path(folder) / ".head.files", [write_whole(model, "new")])]
    ['head.html']
    """
    folder, stale = record.parent, list[Path]()
    with suppress(OSError, ValueError):  # there is no record, or someone's text
        written_at = record.stat().st_mtime_ns
        for path in (folder / name for name in record.read_text(encoding="utf-8").splitlines()):
            status = path.stat() if path.is_file() and not is_outside(folder, path) and path not in files else None
            if status is None or status.st_mtime_ns > written_at or _is_input(status):
                continue
            path.unlink()
            stale.append(path)
    for below in {path.parent for path in stale} - {folder}:
        with suppress(OSError):  # it is not empty
            below.rmdir()
    names = sorted(path.relative_to(folder).as_posix() for path in files if path.is_relative_to(folder))
    write_whole(record, "".join(f"{name}\n" for name in names))
    return stale


def drop_unfinished() -> None:
    """Remove all files that are being written, and the folders made for them: the process is about to end."""
    _remove(list(_unfinished))


def _remove(files: list[Path]) -> None:
    """Remove unfinished files, and then the folders that were made for them."""
    for file in files:
        with suppress(OSError):  # the first error matters more
            file.unlink(missing_ok=True)
    for file in files:
        for folder in _unfinished.pop(file, ()):
            with suppress(OSError):  # it is no longer empty
                folder.rmdir()


def _synchronize(path: Path) -> None:
    """Bring a file onto the disk: some systems tell only now that it did not fit."""
    with path.open("r+b") as file:
        try:
            os.fsync(file.fileno())
        except OSError as problem:
            if problem.errno not in (errno.EINVAL, errno.ENOTSUP):  # it cannot be asked for here
                raise


def _free_bytes(path: Path) -> int | None:
    """Return the free bytes where a file is to be; None if the system does not tell."""
    for folder in path.parents:
        with suppress(OSError, ValueError):
            return shutil.disk_usage(folder).free
    return None


def output_folder(path: str | Path, make: bool = True) -> Path:
    """Return the folder, made if need be, after checking that a file can be written to it.

    Parameters
    ----------
    path : str or Path
    make : bool
        If False, only check that the folder could be made, before long work.

    Raises
    ------
    OutputError
        If a file stands in the folder's place or on the way to it, or if the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as parent:
    ...     output_folder(f"{parent}/pictures/smile").name
    'smile'
    """
    folder = path_of(path)
    try:
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        there = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
        with TemporaryFile(dir=there):  # permission bits say little: root ignores them
            pass
    except (FileExistsError, NotADirectoryError):
        raise OutputError(
            f"{str(folder)!r} cannot be an output folder: a file stands there or on the way to it. Name another folder."
        ) from None
    except (OSError, ValueError) as problem:
        raise OutputError(
            f"{str(folder)!r} cannot be written: {getattr(problem, 'strerror', problem)}. "
            "Name a folder that you may write to."
        ) from None
    return folder


def output_file(path: str | Path, endings: Sequence[str]) -> Path:
    """Return the path of a file with one of these endings, after checking that it can be written.

    Raises
    ------
    OutputError
        For another ending, a folder, what is no ordinary file, or one that a command has read; or if the folder cannot
        be written.
    """
    path = path_of(path)
    if path.suffix.lower() not in endings:
        raise OutputError(f"the file must end in {' or '.join(endings)}, received {path.name!r}.")
    output_folder(path.parent, make=False)
    output_target(path)
    return path


def output_target(path: str | Path) -> Path:
    """Return the path that a file is to be written to, with links followed.

    Raises
    ------
    OutputError
        If a folder or no ordinary file stands there, or one that a command has read.

    Examples
    --------
    >>> output_target("/dev/null")
    Traceback (most recent call last):
    facewrinkle.errors.OutputError: '/dev/null' is not a regular file, so nothing is written to it. Name another file.
    """
    path = path_of(path)
    try:
        target = Path(os.path.realpath(path))
        status = target.stat()
    except FileNotFoundError:
        return target
    except (OSError, ValueError) as problem:
        raise OutputError(f"{str(path)!r} cannot be written: {problem}. Name another file.") from None
    if S_ISDIR(status.st_mode):
        raise OutputError(f"{str(path)!r} is a folder, and a file is to be written. Name a file in it.")
    if not S_ISREG(status.st_mode):  # it would become one
        raise OutputError(f"{str(path)!r} is not a regular file, so nothing is written to it. Name another file.")
    if _is_input(status):
        raise OutputError(
            f"{str(path)!r} was read, and would be replaced by what is made of it. Write to another folder: --out."
        )
    return target
