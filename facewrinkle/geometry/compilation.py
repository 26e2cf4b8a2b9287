"""Compiling loops to machine code, which is kept for the next start wherever a folder can be written."""

from __future__ import annotations

import gc
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numba
from numba.core import event

from ..errors import warn

settings: Any = numba.config

WITHOUT: dict[str, Any] = {"no_cfunc_wrapper": True}
"""Options of all functions. None is handed on as a pointer for C, for which each would be compiled a second time."""

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
            return _forgiving(numba.njit(**WITHOUT, **options)(function))
        except RuntimeError:  # no folder for the cache
            if not options.get("cache"):
                raise
        folder = temporary_folder()
        if folder is not None:
            before, settings.CACHE_DIR = settings.CACHE_DIR, str(folder)
            try:
                compiled = _forgiving(numba.njit(**WITHOUT, **options)(function))
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


def _forgiving(compiled: Any) -> Any:
    """Return a compiled function that runs also if its machine code is damaged, or cannot be kept: the disk is full."""
    cache: Any = getattr(compiled, "_cache", None)
    save, load = getattr(cache, "save_overload", None), getattr(cache, "load_overload", None)
    if save is None or load is None:
        return compiled

    def save_if_possible(*arguments: Any) -> None:
        with suppress(OSError):
            save(*arguments)

    def load_if_whole(*arguments: Any) -> Any:
        try:
            return load(*arguments)
        except Exception:  # every part of a file can be damaged in its own way: it is compiled anew, and kept again
            with suppress(Exception):
                cache.flush()
            return None

    cache.save_overload, cache.load_overload = save_if_possible, load_if_whole
    return compiled


def _tell(where: str) -> None:
    """Say once where machine code is kept."""
    if not _told:
        _told.add(where)
        warn(
            "machine code can be kept neither beside the package nor in your home folder, which cannot be written; it "
            f"is kept {where}. Set the environment variable NUMBA_CACHE_DIR to a folder that you may write to."
        )
