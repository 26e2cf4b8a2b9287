"""Compiling all that is listed, before it is needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from typing import Any

Progress = Callable[[Iterable[None], int], Iterable[None]]
"""Called with steps and their number, returns the steps, and shows progress as they are done."""


def compile_ahead(progress: Progress | None = None) -> None:
    """Compile what the package needs, in all cores, so that nothing has to wait for it later.

    numba compiles a function when it is first called, one after the other, and keeps it on the disk. Call this once
    after an installation, such as while an image of a container is built. What is on the disk is not compiled again.

    Parameters
    ----------
    progress : callable, optional
        Shows progress: called with the steps and their number, returns the steps, to be done one by one. Default: a bar
        on stderr if that is a terminal.

    Notes
    -----
    In the other cores, processes of their own compile, which end before it returns. The command ``facewrinkle compile``
    does the same.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> fw.compile_ahead(lambda steps, n: steps)
    """
    from .helpers import end_helpers, start_helpers
    from .listed import missing

    wanted = missing("")
    if not wanted:
        return
    helpers = start_helpers("")
    try:
        for _ in (progress or _bar)(_compiled(wanted), len(wanted)):
            pass
    finally:
        end_helpers(helpers)


def _compiled(wanted: Sequence[tuple[Any, Any]]) -> Iterator[None]:
    """Compile functions, as far as others have not done it."""
    from ..geometry.compilation import is_kept

    for compiled, types in wanted:
        if not is_kept(compiled, types):
            with suppress(Exception):  # the list is of another version: whoever needs it is told
                compiled.compile(types)
        yield


def _bar(steps: Iterable[None], n: int) -> Iterable[None]:
    """Return the steps, with a bar on stderr if that is a terminal."""
    from rich.console import Console
    from rich.progress import track

    console = Console(stderr=True)
    return track(steps, "Compiling", n, console=console, transient=True) if console.is_terminal else steps
