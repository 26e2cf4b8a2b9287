"""Ctrl-C and SIGTERM, which take effect even where Python or a library drops the exception that they raise."""

from __future__ import annotations

import _thread
import logging
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")

_seen: list[int] = []


@contextmanager
def interrupts() -> Iterator[list[int]]:
    """Yield the list of signals (Ctrl-C and SIGTERM, by number) that have come meanwhile.

    Each raises KeyboardInterrupt, as Ctrl-C always does, and raises it again where Python had to drop it.
    """
    dropping, raised = False, True
    _seen.clear()

    def interrupted(number: int, _: object) -> None:
        nonlocal raised
        _seen.append(number)
        if dropping:  # the hook below is at work: the thread that it starts raises it again
            return
        raised = True
        logging.disable()  # VTK would log at length that it was interrupted
        raise KeyboardInterrupt

    def insist() -> None:
        while not raised:
            _thread.interrupt_main()
            time.sleep(0.02)

    def dropped(unraisable: sys.UnraisableHookArgs) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            show(unraisable)
            return
        nonlocal dropping, raised
        dropping, raised = True, False
        threading.Thread(target=insist, daemon=True).start()  # it came inside a finalizer: once more, outside of it
        dropping = False

    if threading.current_thread() is not threading.main_thread():
        yield _seen
        return
    before = {number: signal.signal(number, interrupted) for number in (signal.SIGINT, signal.SIGTERM)}
    show, sys.unraisablehook = sys.unraisablehook, dropped
    try:
        yield _seen
    finally:
        raised = True
        for number, handler in before.items():
            signal.signal(number, handler)
        sys.unraisablehook = show
        logging.disable(logging.NOTSET)


def interruptible(items: Iterator[T]) -> Iterator[T]:
    """Yield the items, up to an interrupt that a callback of a library dropped while one was made or used."""
    for item in items:
        yield item
        if _seen:
            raise KeyboardInterrupt
