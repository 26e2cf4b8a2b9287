"""Processes that compile what a command needs later, where this is the first one after the installation."""

from __future__ import annotations

from typing import Any

allowed = False
"""True in a process of its own, where nobody else counts on the processor's cores."""

ENOUGH = 5
"""With so many functions that are not on the disk, this is taken for the first start: one or two may always be new."""


def may_start() -> bool:
    """Return whether there is a core for a second process."""
    from .helpers import helpers

    return allowed and helpers() > 0


def begin(section: str) -> None:
    """Start the processes as soon as a function has to be compiled, if much of a section of the list has to be."""
    if not allowed:
        return
    from numba.core import event

    from ..geometry.compilation import is_own
    from .helpers import start_helpers
    from .listed import missing

    class First(event.Listener):
        """Waits for the first function."""

        def __init__(self) -> None:
            self.waits = True

        def on_start(self, event: Any) -> None:
            if self.waits and is_own(event):
                self.waits = False
                if len(missing(section)) >= ENOUGH:
                    start_helpers(section)

        def on_end(self, event: Any) -> None:
            pass

    event.register("numba:compile", First())
