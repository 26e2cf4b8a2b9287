"""Files that are whole, or not there, and the text in those of others."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_made: set[Path] = set()
"""Folders that were made for files."""


def text_of(path: Path) -> str:
    """What a text file says: UTF-8, with or without a mark at its beginning, or what western machines wrote before."""
    data = path.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


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
