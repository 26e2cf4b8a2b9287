"""Room on disks: how much is free, and room that is reserved for a file."""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import sys
from contextlib import suppress
from pathlib import Path

NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of a disk, or of a share of it, that is full."""


def reserve(path: Path, size: int) -> None:
    """Make sure that a file, which exists, can grow to this many bytes; its length stays as it is.

    `os.truncate` to its length gives back what was not used. Where the system cannot reserve room, the free space of
    the disk is looked at.

    Raises
    ------
    OSError
        If there is not so much room.
    """
    length = path.stat().st_size
    if length >= size:
        return
    if sys.platform.startswith("linux"):
        system = ctypes.CDLL(None, use_errno=True)
        with path.open("r+b") as file:
            kept_length = 1  # FALLOC_FL_KEEP_SIZE
            offsets = (ctypes.c_int64(0), ctypes.c_int64(size))
            if system.fallocate64(ctypes.c_int(file.fileno()), ctypes.c_int(kept_length), *offsets) == 0:
                return
        number = ctypes.get_errno()
        if number in NO_SPACE:
            raise OSError(number, os.strerror(number), str(path))
    if (free := free_bytes(path)) is not None and free < size - length:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))


def free_bytes(path: Path) -> int | None:
    """Return the free bytes where a file is, or is to be; None if the system does not tell."""
    for folder in path.parents:
        with suppress(OSError):
            return shutil.disk_usage(folder).free
    return None
