"""A process that compiles beside another: ``python -m facewrinkle.compiling.worker SECTION SHARE OF CLAIMS``."""

from __future__ import annotations

import os
import sys
import threading
from contextlib import suppress

from ..geometry import compilation
from ..geometry.claims import Claims
from .listed import Listed, listed


def main(section: str, share: int, count: int, file: int) -> None:
    """Compile what a section names, "" all of it, beside the process that needs it and comes from its beginning.

    Each takes its share, such as every second function, and then from the end on what the others have left: where all
    went on to the next function, one would always wait for the other.
    """
    threading.Thread(target=_watch, daemon=True).start()
    if file >= 0:
        compilation.claims = Claims(os.fdopen(file, "r+b"))
    wanted = listed(section)
    for entry in wanted[1 + share :: 1 + count] + wanted[::-1]:
        compile_unless_claimed(entry)


def compile_unless_claimed(entry: Listed) -> None:
    """Compile a function, unless it is on the disk or another process has it."""
    found = entry.found()
    if found is None or compilation.is_kept(*found):
        return
    compiled, types = found
    name, claims = compilation.full_name(compiled), compilation.claims
    if claims is None or claims.take(name):
        with suppress(Exception):  # whoever needs it is told
            compiled.compile(types)
        if claims is not None:
            claims.drop(name)


def _watch() -> None:
    """End with the process that has started this one, however that ends: then the pipe to it is closed."""
    sys.stdin.read()
    with compilation.saving:  # no file is left half written
        os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
