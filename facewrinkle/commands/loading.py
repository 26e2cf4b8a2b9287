"""The first sign of life of a command: what it imports takes longer than a user likes to look at nothing."""

from __future__ import annotations

import sys

MESSAGE = "Loading ..."

_shown = False


def begin() -> None:
    """Show on a terminal that the command has begun."""
    global _shown
    if not _shown and sys.stderr is not None and sys.stderr.isatty():
        _shown = True
        print(MESSAGE, end="\r", file=sys.stderr, flush=True)


def end() -> None:
    """Wipe it away, before anything else is printed."""
    global _shown
    if _shown:
        _shown = False
        print(" " * len(MESSAGE), end="\r", file=sys.stderr, flush=True)
