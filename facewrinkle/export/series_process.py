"""Time series written by a process of its own: the file is compressed while the next frame is made and drawn.

VTK compresses with the interpreter's lock held, and two threads of one process must not both use VTK. The frames go to
the process through a pipe, and wait there while it is busy. It answers twice: when it is ready, and with what went
wrong. If the pipe ends before the last frame, nobody waits for the file any more, and it removes what there is of it.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import Any

import pyvista as pv

from .series_file import problem_of

PIPE = 2**20
"""Bytes of frames that may wait for the process, where the system allows so many."""


def problem_aside(frames: Iterator[pv.PolyData], times: list[float], path: Path) -> OSError | str | None:
    """Do what :func:`problem_of` does, in a process of its own; in this one, where none can be started."""
    process = _started()
    if process is None:
        return problem_of(frames, times, path)
    try:
        frames = chain([next(frames)], frames)  # while the process starts
        if _heard(process) is not None:
            return problem_of(frames, times, path)
        for thing in chain([(times, path)], frames):
            if not _sent(process, thing):
                break
        return _heard(process)
    finally:
        process.kill()
        _close(process)


def _started() -> subprocess.Popen[bytes] | None:
    """Start a process; return None if that is not possible."""
    try:
        return subprocess.Popen(
            [sys.executable, "-m", __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            pipesize=PIPE, start_new_session=True,  # Ctrl-C is for the command, which ends the process by itself
        )  # fmt: skip
    except OSError:
        return None


def _sent(process: subprocess.Popen[bytes], thing: Any) -> bool:
    """Send something to a process, and return whether it is still there."""
    assert process.stdin is not None
    try:
        pickle.dump(thing, process.stdin, pickle.HIGHEST_PROTOCOL)
        process.stdin.flush()
    except OSError:
        return False
    return True


def _heard(process: subprocess.Popen[bytes]) -> Any:
    """Return the next answer of a process."""
    assert process.stdout is not None
    try:
        return pickle.load(process.stdout)
    except (EOFError, pickle.UnpicklingError):
        return "the process that writes it came to an end"


def _close(process: subprocess.Popen[bytes]) -> None:
    """Wait for the end of a process."""
    assert process.stdin is not None
    with suppress(OSError):  # what is left in the pipe reaches nobody
        process.stdin.close()
    with process:
        pass


def main() -> None:
    """Write the file that the standard input tells of, and answer on the standard output."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Windows sends it to all processes of a console
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no answer

    def answer(thing: Any) -> None:
        with suppress(OSError):
            pickle.dump(thing, answers)
            answers.flush()

    answer(None)
    times, path = pickle.load(sys.stdin.buffer)
    try:
        problem = problem_of(_received(len(times)), times, path)
    except Exception as error:
        problem = error if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
    if problem is not None:
        path.unlink(missing_ok=True)
    answer(problem)
    os._exit(0)  # after an error HDF5 would not let go of the file


def _received(count: int) -> Iterator[pv.PolyData]:
    for _ in range(count):
        yield pickle.load(sys.stdin.buffer)


if __name__ == "__main__":
    main()
