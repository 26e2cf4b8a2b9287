"""Ctrl-C and SIGTERM, heard even where Python, or a library, drops the exception that they raise."""

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
    """The Ctrl-C and SIGTERM that came meanwhile, by number; each raises KeyboardInterrupt as Ctrl-C ever does, and
    again where Python had to drop it.
    """
    dropping, raised = False, True
    _seen.clear()

    def interrupted(number: int, _: object) -> None:
        nonlocal raised
        _seen.append(number)
        if dropping:  # not within the hook below: what it starts asks again
            return
        raised = True
        logging.disable()  # VTK, where it is in the middle of something, would complain at length
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
        threading.Thread(target=insist, daemon=True).start()  # it fell into a finalizer: once more, outside of it
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
    """The items, up to an interrupt that was dropped while one was made or used: a library's callbacks may do so."""
    for item in items:
        yield item
        if _seen:
            raise KeyboardInterrupt
