"""Compiling loops to machine code, which is kept for the next start wherever a folder can be written."""

from __future__ import annotations

import gc
import os
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numba
from numba.core import event

from ..errors import warn
from .claims import Claims

settings: Any = numba.config

WITHOUT: dict[str, Any] = {"no_cfunc_wrapper": True}
"""Options of all functions. None is handed on as a pointer for C, for which each would be compiled a second time."""

functions: dict[str, Any] = {}
"""Compiled functions whose machine code is kept, by their full names, as far as their modules have been imported."""

claims: Claims | None = None
"""Of the processes that compile what one command needs; None where this process compiles alone."""

saving = threading.Lock()
"""Held while machine code is written."""

_told: set[str] = set()


def is_own(event: Any) -> bool:
    """Return True if the function of numba's event of compiling is of this package."""
    with suppress(Exception):  # others compile, too, and functions need not have a module: an error would be theirs
        return bool(event.data["dispatcher"].py_func.__module__.startswith(f"{__name__.partition('.')[0]}."))
    return False


class _Uncollected(event.Listener):
    """Keeps Python from collecting garbage while a function of this package is compiled, which takes a tenth less so.

    Numba makes millions of small objects then, nearly all of which stay in use until the function is ready.
    """

    def __init__(self) -> None:
        self._compiling = 0
        self._collects = False

    def on_start(self, event: Any) -> None:
        if self._compiling or is_own(event):  # what it calls is compiled within
            if not self._compiling:
                self._collects = gc.isenabled()
                gc.disable()
            self._compiling += 1

    def on_end(self, event: Any) -> None:
        if self._compiling:
            self._compiling -= 1
            if not self._compiling and self._collects:
                gc.enable()


event.register("numba:compile", _Uncollected())


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function as `numba.njit` does, also where neither the package nor the home can be written.

    There, as in containers and on clusters, the machine code is kept in a folder of the user's own among the temporary
    ones, or not at all. A disk that is full keeps nothing either. What was kept and is damaged is compiled anew.

    Warns
    -----
    FaceWrinkleWarning
        Once, if the code is kept among temporary files, or not at all.

    Examples
    --------
    >>> @njit()
    ... def doubled(number):
    ...     return 2 * number
    >>> doubled(4)
    8
    """

    def decorated(function: Callable[..., Any]) -> Any:
        try:
            return _shared(numba.njit(**WITHOUT, **options)(function))
        except RuntimeError:  # no folder for the cache
            if not options.get("cache"):
                raise
        folder = temporary_folder()
        if folder is not None:
            before, settings.CACHE_DIR = settings.CACHE_DIR, str(folder)
            try:
                compiled = _shared(numba.njit(**WITHOUT, **options)(function))
                _tell(f"in {str(folder)!r}")
                return compiled
            except (RuntimeError, OSError):
                pass
            finally:
                settings.CACHE_DIR = before
        _tell("nowhere, so that every start takes half a minute more")
        return numba.njit(**{**WITHOUT, **options, "cache": False})(function)

    return decorated


def temporary_folder() -> Path | None:
    """Return a folder among the temporary ones that only this user can write to; None if there is none."""
    user = os.getuid() if hasattr(os, "getuid") else None
    try:
        folder = Path(tempfile.gettempdir()) / f"facewrinkle-{'cache' if user is None else user}"
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return None
    if user is not None and (folder.is_symlink() or status.st_uid != user or status.st_mode & 0o077):
        return None  # others could put code of theirs there
    return folder


def full_name(compiled: Any) -> str:
    """Return the name of a compiled function, with its module."""
    return f"{compiled.py_func.__module__}.{compiled.py_func.__qualname__}"


def is_kept(compiled: Any, types: tuple[Any, ...]) -> bool:
    """Return True if the disk has the machine code of a function for arguments of these types of numba's."""
    with suppress(Exception):  # these parts of numba are its own, and files may be damaged
        cache = compiled._cache
        return cache._index_key(types, compiled.targetctx.codegen()) in cache._cache_file._load_index()
    return False


def _shared(compiled: Any) -> Any:
    """Return a compiled function that shares machine code with other processes, by way of the disk.

    It runs also if its machine code is damaged, or cannot be kept: the disk is full. While another process of the same
    command compiles it, it waits for that.
    """
    cache: Any = getattr(compiled, "_cache", None)
    save, load = getattr(cache, "save_overload", None), getattr(cache, "load_overload", None)
    if save is None or load is None:
        return compiled
    name = full_name(compiled)
    functions[name] = compiled

    def save_if_possible(*arguments: Any) -> None:
        with suppress(OSError), saving:
            save(*arguments)
        if (shared := claims) is not None:
            shared.drop(name)

    def load_if_whole(*arguments: Any) -> Any:
        try:
            return load(*arguments)
        except Exception:  # every part of a file can be damaged in its own way: it is compiled anew, and kept again
            with suppress(Exception):
                cache.flush()
            return None

    def load_or_claim(*arguments: Any) -> Any:
        found = load_if_whole(*arguments)
        if found is None and (shared := claims) is not None and shared.take_in_turn(name):
            found = load_if_whole(*arguments)  # another process had it, and has compiled it or ended
            if found is not None:
                shared.drop(name)
        return found

    cache.save_overload, cache.load_overload = save_if_possible, load_or_claim
    return compiled


def _tell(where: str) -> None:
    """Say once where machine code is kept."""
    if not _told:
        _told.add(where)
        warn(
            "machine code can be kept neither beside the package nor in your home folder, which cannot be written; it "
            f"is kept {where}. Set the environment variable NUMBA_CACHE_DIR to a folder that you may write to."
        )
