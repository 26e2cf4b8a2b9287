"""A second process that compiles what a command needs later, where this is the first one after the installation.

Numba compiles one function at a time. The process draws small pictures, and all that it has compiled for them is on the
disk by the time that the command asks for it.
"""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
from typing import Any

allowed = False
"""True in a process of its own, where nobody else counts on the processor's cores."""

ENOUGH = 3
"""So many functions are compiled before this is taken for the first start: one or two may always be new."""


def may_start() -> bool:
    """Return whether there is a core for a second process."""
    return allowed and (os.cpu_count() or 1) >= 2


def begin() -> None:
    """Start the process as soon as functions have to be compiled, if there is a core for it."""
    if not may_start():
        return
    from numba.core import event

    from ..geometry.compilation import is_own

    class Counting(event.Listener):
        """Starts the process once."""

        def __init__(self) -> None:
            self.count = 0

        def on_start(self, event: Any) -> None:
            self.count += is_own(event)
            if self.count == ENOUGH:
                self.count += 1
                _start()

        def on_end(self, event: Any) -> None:
            pass

    event.register("numba:compile", Counting())


def _start() -> None:
    nothing = subprocess.DEVNULL
    command = [sys.executable, "-m", __name__]
    process = subprocess.Popen(command, stdin=nothing, stdout=nothing, stderr=nothing)
    atexit.register(process.kill)  # an interrupted command leaves nothing behind that works on


def compile_ahead() -> None:
    """Draw what commands draw, pictures first: what moves the skin the command itself compiles meanwhile."""
    from ..anatomy.fitting import default_face
    from ..plotting import Style, picture
    from ..simulation import Simulation

    face = default_face()
    picture(face.mesh, face, Style((64, 64)))
    sim = Simulation(face, folds="paper")
    sim.express("surprise")
    *_, frame = sim.run(2)
    picture(frame, face, Style((64, 64), "forehead"))


if __name__ == "__main__":
    compile_ahead()
