"""Progress of what takes a while: what functions are given to show it, and a bar."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import parent_process
from typing import Any, Protocol

_only_bars = False
"""For all threads."""


SHORTEST, LONGEST = 5.0, 60.0
"""Seconds between lines in a log: at least, and, where a tenth of the work takes longer, about at most."""


class Progress(Protocol):
    """Yields items, such as the steps of a search, while it shows what is done, and how many there are."""

    def __call__(self, items: Iterable[Any], what: str, total: int, /) -> Iterable[Any]: ...


def bar(items: Iterable[Any], what: str, total: int) -> Iterable[Any]:
    """Return the items; while they are done, a bar shows progress on stderr if that is a terminal.

    The environment variable FACEWRINKLE_PROGRESS asks for lines, such as ``Shapes 3/26``, which a program can read.
    """
    if os.environ.get("FACEWRINKLE_PROGRESS"):
        return _counted(items, what, total)
    from rich.console import Console
    from rich.progress import track

    console = Console(stderr=True)
    return track(items, what, total, console=console, transient=True) if console.is_terminal else items


def bar_or_lines(items: Iterable[Any], what: str, total: int) -> Iterable[Any]:
    """Return the items as :func:`bar` does; where stderr is no terminal, as in a log, say now and then how far it is.

    A line comes with each tenth of the work or each minute, never within five seconds of another one.
    """
    from rich.console import Console

    if os.environ.get("FACEWRINKLE_PROGRESS") or Console(stderr=True).is_terminal:
        return bar(items, what, total)
    return _said(items, what, total)


def _said(items: Iterable[Any], what: str, total: int) -> Iterator[Any]:
    """Yield the items, with a line at a pace that suits a log."""
    before, said = time.monotonic(), 0
    for number, item in enumerate(items):
        now = time.monotonic()
        if now - before >= SHORTEST and (10 * (number - said) >= total or now - before >= LONGEST):
            print(f"{what} {number}/{total}", file=sys.stderr, flush=True)
            before, said = now, number
        yield item


def _counted(items: Iterable[Any], what: str, total: int) -> Iterator[Any]:
    """Yield the items, with a line before each."""
    for number, item in enumerate(items):
        print(f"{what} {number}/{total}", file=sys.stderr, flush=True)
        yield item


@contextmanager
def only_bars() -> Iterator[None]:
    """Keep :func:`tell` silent within a block, as in commands: their stderr has errors and progress alone."""
    global _only_bars
    before, _only_bars = _only_bars, True
    try:
        yield
    finally:
        _only_bars = before


def tell(what: str) -> None:
    """Print a line on stderr about what takes a while, in a program that is not a worker of another one.

    Examples
    --------
    >>> with only_bars():
    ...     tell("compiling")
    """
    if not _only_bars and parent_process() is None and sys.stderr is not None:
        print(f"facewrinkle: {what}", file=sys.stderr, flush=True)
