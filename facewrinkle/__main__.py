"""``python -m facewrinkle``, and the command ``facewrinkle``.

Ctrl-C, SIGTERM and SIGHUP end the process at once, and leave no unfinished files. A KeyboardInterrupt would be raised
anywhere: inside imports, in callbacks of VTK, which drop it, and in finalizers.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import NoReturn

SIGNALS = tuple(int(getattr(signal, name)) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that end the process; Windows has no SIGHUP."""


def program() -> NoReturn:
    """Run the command line and end the process with its code."""
    end_at_signals()  # before anything else is imported, which takes a moment
    from .cli import main

    sys.exit(main())


def end_at_signals() -> None:
    """Let signals end this process; those that it was told to ignore, as by nohup, stay ignored."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _ended)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    threading.Thread(target=_watch, args=(reading,), daemon=True).start()


def _ended(number: int, frame: FrameType | None = None) -> None:
    """End the process: no object is destroyed, as VTK may be at work."""
    if threading.current_thread() is threading.main_thread():
        for other in SIGNALS:
            signal.signal(other, signal.SIG_IGN)
    for act in getattr(sys.modules.get("facewrinkle.commands.studio"), "before_the_end", ()):
        with suppress(Exception):  # the process must end all the same
            act()
    _end_children()
    files = sys.modules.get("facewrinkle.files")
    if files is not None and hasattr(files, "drop_unfinished"):
        files.drop_unfinished()
    with suppress(OSError):
        os.write(2, b"facewrinkle: interrupted.\n")
    os._exit(128 + number)


def _end_children() -> None:
    """End the processes that this one has started, such as ffmpeg, which would go on to write its file."""
    with suppress(OSError):
        for children in Path("/proc/self/task").glob("*/children"):
            for child in children.read_text().split():
                with suppress(OSError):
                    os.kill(int(child), signal.SIGKILL)


def _watch(reading: int) -> None:
    """Wait for a signal, and see to it that it takes effect."""
    while received := os.read(reading, 1):
        number: int = received[0]
        if number in SIGNALS:
            time.sleep(1.0)  # if a long computation keeps the main thread from it
            _ended(number)


if __name__ == "__main__":
    program()
