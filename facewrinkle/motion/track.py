"""Values over time, and between the times at which they are known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..errors import LARGEST, ParameterError, unknown_name

Array = npt.NDArray[np.float64]
Interpolation = Literal["linear", "step", "cubic"]
INTERPOLATIONS = ("linear", "step", "cubic")


@dataclass(frozen=True, eq=False)
class Track:
    """Values at some times, and between them.

    Attributes
    ----------
    times : ndarray, shape (f,)
        Increasing, s.
    values : ndarray, shape (f, ...)
    interpolation : {"linear", "step", "cubic"}
        "step" holds each value until the next; "cubic" is the Hermite spline of `slopes`.
    slopes : ndarray, shape (2, f, ...), optional
        Derivatives before and after each time.

    Examples
    --------
    >>> Track(np.array([0.0, 2.0]), np.array([[1.0], [5.0]])).at(0.5)
    array([2.])
    """

    times: Array
    values: Array
    interpolation: Interpolation = "linear"
    slopes: Array | None = None

    def __post_init__(self) -> None:
        for name in ("times", "values") + (("slopes",) if self.slopes is not None else ()):
            object.__setattr__(self, name, finite(name, getattr(self, name)))
        if self.interpolation not in INTERPOLATIONS:
            raise unknown_name("interpolation", self.interpolation, INTERPOLATIONS)
        if self.times.ndim != 1 or not len(self.times) or not (np.diff(self.times) > 0.0).all():
            raise ParameterError(f"times must be a list of increasing seconds, received {self.times[:8]}.")
        if self.values.ndim < 1 or len(self.values) != len(self.times):
            raise ParameterError(
                f"there must be as many values as times, received {len(self.times)} times and values of the shape "
                f"{self.values.shape}."
            )
        if self.interpolation == "cubic" and (self.slopes is None or self.slopes.shape != (2, *self.values.shape)):
            raise ParameterError("cubic interpolation needs the slopes before and after each time, as (2, f, ...).")

    def at(self, time: float) -> Array:
        """The value at a time; before the first and after the last time it is theirs."""
        i, share, length = self.place(time)
        a = self.values[i]
        if share == 0.0 or self.interpolation == "step":
            return a
        b = self.values[i + 1]
        if self.interpolation == "linear" or self.slopes is None:
            return np.asarray(a + share * (b - a))
        s, s2, s3 = share, share**2, share**3
        out, into = length * self.slopes[1, i], length * self.slopes[0, i + 1]
        return np.asarray(a + (3 * s2 - 2 * s3) * (b - a) + (s3 - 2 * s2 + s) * out + (s3 - s2) * into)

    def place(self, time: float) -> tuple[int, float, float]:
        """The interval that a time lies in, how far in it as a share of its length, and that length."""
        times = self.times
        if time >= times[-1]:
            return len(times) - 1, 0.0, 1.0
        i = max(int(np.searchsorted(times, time, side="right")) - 1, 0)
        length = float(times[i + 1] - times[i])
        return i, max((time - float(times[i])) / length, 0.0), length


def finite(name: str, values: object) -> Array:
    """An array of numbers that are finite and not huge; a ParameterError for other things."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{name} must be numbers in rows of one length, received {type(values).__name__}."
        ) from None
    if not (np.abs(array) < LARGEST).all():
        broken = np.argwhere(~(np.abs(array) < LARGEST))[0].tolist()
        raise ParameterError(f"{name} must be finite; entry {broken} is {array[tuple(broken)]}. Record it again.")
    return array
