"""Files that are whole, or not there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_made: set[Path] = set()
"""Folders that were made for files."""


@contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """Where to write a file: beside it, under the same ending. It takes its place when all went well.

    After an error, or when the user ends the program, what was there before is still there, and nothing else; folders
    that were made for files and stayed empty are removed.
    """
    path = Path(os.path.expanduser(path)).absolute()
    parents = path.parents
    _made.update(folder for folder in parents if not folder.exists())
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{os.getpid()}.{path.name[-100:]}")
    try:
        yield beside
        beside.replace(path)
    except BaseException:
        with suppress(OSError):  # what went wrong before matters more
            beside.unlink(missing_ok=True)
        with suppress(OSError):  # something else came into it
            for folder in parents:
                if folder not in _made:
                    break
                folder.rmdir()
        raise
