"""A guard of what only one thread may use at a time."""

from __future__ import annotations

import threading
from types import TracebackType

from ..errors import ParameterError


class OneThread:
    """Lets one thread at a time do its work; another one gets an error, as it would meet arrays that are half changed.

    The same thread may come again while it is inside. A copy, also a pickled one, begins with nobody inside.

    Parameters
    ----------
    what, remedy : str
        What is used, and what another thread should use in its place, for the error.

    Examples
    --------
    >>> alone = OneThread("this simulation", "fw.Simulation(face)")
    >>> with alone, alone:
    ...     print("inside")
    inside
    """

    def __init__(self, what: str, remedy: str) -> None:
        self._what, self._remedy = what, remedy
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        if not self._lock.acquire(blocking=False):
            raise ParameterError(
                f"{self._what} is at work in another thread. Give each thread its own: {self._remedy}."
            )

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._lock.release()

    def __reduce__(self) -> tuple[type[OneThread], tuple[str, str]]:
        return type(self), (self._what, self._remedy)
