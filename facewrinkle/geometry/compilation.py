"""Compiling loops to machine code, which numba keeps on the disk for the next start."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numba
from numba.core import event

from ..errors import warn
from ..progress import tell


def compiled(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile a function with `numba.njit`, and keep its machine code for the next start.

    Where neither the package nor the home can be written, as in some containers, it is not kept.

    Warns
    -----
    FaceWrinkleWarning
        Once, if machine code cannot be kept.

    Examples
    --------
    Loops of the package are declared so, as the one that gives vectors the length 1:

    >>> import numpy as np
    >>> from facewrinkle.geometry.normals import normalize
    >>> vectors = np.array([[0.0, 3, 4]])
    >>> normalize(vectors)
    >>> vectors.tolist()
    [[0.0, 0.6, 0.8]]
    """
    if function is None:
        return partial(compiled, **options)
    options["no_cfunc_wrapper"] = True  # a pointer for C, for which each would be compiled a second time
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # numba has no folder for it
        _tell_not_kept()
        return numba.njit(**options)(function)


@cache
def _tell_not_kept() -> None:
    warn(
        "machine code can be kept neither beside the package nor in your home folder, which cannot be written: every "
        "start takes half a minute more. Set the environment variable NUMBA_CACHE_DIR to a folder that you may write "
        "to."
    )


class _FirstUse(event.Listener):
    """Says once in a process why it waits: a loop is compiled, and no start before kept any beside it."""

    def __init__(self) -> None:
        self._told = False

    def on_start(self, event: event.Event) -> None:
        dispatcher = event.data["dispatcher"]
        if self._told or dispatcher.py_func.__module__.partition(".")[0] != __name__.partition(".")[0]:
            return
        folder = dispatcher.stats.cache_path
        if folder is not None and not any(Path(folder).glob("*.nbi")):
            self._told = True
            tell("compiling for the first time, which takes up to a minute; later starts take seconds ...")

    def on_end(self, event: event.Event) -> None:
        pass


event.register("numba:compile", _FirstUse())
