"""Processes that compile beside this one, each function once: who compiles it has claimed it."""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
from contextlib import suppress

from ..geometry import compilation
from ..geometry.claims import Claims
from ..processes import environment

MOST = 7
"""So many at most: each takes 200 MB, and soon there is nothing left that is not needed first."""


def helpers() -> int:
    """Return how many processes there are cores for, beside this one."""
    return min(_cores() - 1, MOST) if sys.executable else 0


def _cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def start_helpers(section: str) -> list[subprocess.Popen[bytes]]:
    """Start processes that compile what a section of the list names; "" names all.

    They end with this process; :func:`end_helpers` ends them before.
    """
    count = helpers()
    if not count or compilation.claims is not None or not compilation.functions:
        return []  # there is no core for them, they are there, or nothing that they compile would be kept
    claims = Claims.new()
    file = -1 if claims is None else claims.file.fileno()
    processes = []
    with suppress(OSError):  # without them it takes longer
        for share in range(count):
            process = subprocess.Popen(
                [sys.executable, "-P", "-m", f"{__package__}.worker", section, str(share), str(count), str(file)],
                stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                env=environment(), pass_fds=() if file < 0 else (file,),
            )  # fmt: skip
            processes.append(process)
    if not processes and claims is not None:
        claims.close()
    elif processes:
        compilation.claims = claims
        atexit.register(end_helpers, processes)
    return processes


def end_helpers(processes: list[subprocess.Popen[bytes]]) -> None:
    """Let processes end, which they do when their input ends: also where this one has no time to ask them."""
    if processes and compilation.claims is not None:
        claims, compilation.claims = compilation.claims, None
        claims.close()
    for process in processes:
        assert process.stdin is not None
        with suppress(OSError):
            process.stdin.close()
    for process in processes:
        try:
            process.wait(timeout=2.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
