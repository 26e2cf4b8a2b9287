"""Who compiles a function, where several processes work together: each function is claimed by one at a time."""

from __future__ import annotations

import hashlib
import tempfile
from contextlib import suppress
from typing import IO, Any

fcntl: Any
try:
    import fcntl
except ImportError:  # Windows
    fcntl = None


class Claims:
    """Names that processes claim, one of them at a time.

    Each name is a byte of a file without a name, which is locked by the process that has the name. The system drops a
    lock with its process, and the file with the last of them, however they end.

    Parameters
    ----------
    file : file
        Shared by the processes.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self.file = file

    @classmethod
    def new(cls) -> Claims | None:
        """Return claims on nothing yet; None where the system has no such locks, or no room for a file."""
        with suppress(OSError):
            return None if fcntl is None else cls(tempfile.TemporaryFile())
        return None

    def close(self) -> None:
        """Leave all names to the others, for good."""
        self.file.close()

    def take(self, name: str) -> bool:
        """Claim a name, and return True, unless another process has it."""
        try:
            fcntl.lockf(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, _place(name))
        except (OSError, ValueError):  # another has it, or this is closed
            return False
        return True

    def take_in_turn(self, name: str) -> bool:
        """Claim a name, after another process that has it; return True if there was one."""
        if self.take(name):
            return False
        with suppress(OSError, ValueError):  # they wait for each other: both go on without
            fcntl.lockf(self.file, fcntl.LOCK_EX, 1, _place(name))
        return True

    def drop(self, name: str) -> None:
        """Leave a name to the others."""
        with suppress(OSError, ValueError):
            fcntl.lockf(self.file, fcntl.LOCK_UN, 1, _place(name))


def _place(name: str) -> int:
    """Return the byte of a name, the same in all processes."""
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:7], "big")
