"""Files that are read. They must be ordinary ones, and a command does not replace what it has read."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from stat import S_ISREG

LARGEST_TEXT = 2**28
"""Most bytes of a file of settings: atlases, landmarks, specifications."""

_kept: ContextVar[set[tuple[int, int]] | None] = ContextVar("inputs_kept", default=None)
"""Device and number of each file that was read, where these are kept."""


@contextmanager
def inputs_kept() -> Iterator[None]:
    """Keep whatever is read within a block from being replaced within it.

    A command makes up the names of its files, and one may be that of a file it was given. Programs name theirs.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder, inputs_kept():
    ...     path = Path(folder) / "scan.obj"
    ...     _ = path.write_text("v 0 0 0")
    ...     note_input(path.stat())
    ...     is_input(path.stat())
    True
    """
    token = _kept.set(set())
    try:
        yield
    finally:
        _kept.reset(token)


def note_input(status: os.stat_result) -> None:
    """Note that a file is read."""
    kept = _kept.get()
    if kept is not None:
        kept.add((status.st_dev, status.st_ino))


def is_input(status: os.stat_result) -> bool:
    """Return True if a file was read, and is kept."""
    return (status.st_dev, status.st_ino) in (_kept.get() or ())


def settings_of(path: str | Path, *, encoding: str = "utf-8", kept: bool = True) -> str:
    """Return the text of a file of settings; unless `kept`, it may be replaced.

    Raises
    ------
    OSError
        Also for what is no ordinary file, such as a pipe, which may never end, and for a file that is far too large.

    Examples
    --------
    >>> settings_of("/dev/null")
    Traceback (most recent call last):
    OSError: [Errno 22] it is no ordinary file: '/dev/null'
    """
    path = Path(os.path.expanduser(path))
    status = path.stat()
    if not S_ISREG(status.st_mode) and not path.is_dir():
        raise OSError(errno.EINVAL, "it is no ordinary file", str(path))
    if status.st_size > LARGEST_TEXT:
        raise OSError(errno.EFBIG, f"it is larger than {LARGEST_TEXT // 2**20} MB", str(path))
    if kept:
        note_input(status)
    return path.read_text(encoding=encoding)
