"""Values that are known at some times, and interpolated between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ..array_types import Array
from ..checks import finite
from ..errors import ParameterError, unknown_name

Interpolation = Literal["linear", "step", "cubic"]
INTERPOLATIONS = ("linear", "step", "cubic")


@dataclass(frozen=True, eq=False)
class Track:
    """Values at some times, interpolated between them.

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
            raise ParameterError(f"times must be a list of increasing seconds, received {np.ravel(self.times)[:8]}.")
        if self.values.ndim < 1 or len(self.values) != len(self.times):
            raise ParameterError(
                f"there must be as many values as times, received {len(self.times)} times and values of the shape "
                f"{self.values.shape}."
            )
        if self.interpolation == "cubic" and (self.slopes is None or self.slopes.shape != (2, *self.values.shape)):
            raise ParameterError("cubic interpolation needs the slopes before and after each time, as (2, f, ...).")

    def at(self, time: float) -> Array:
        """Return the value at a time; the first value before the first time, and the last one after the last."""
        i, share = self.place(time)
        if share == 0.0 or self.interpolation == "step":
            return self.values[i]
        if self.interpolation == "cubic":
            return np.asarray(self._spline(time))
        # SciPy's splines take three times as long for the positions of a whole face.
        return np.asarray(self.values[i] + share * (self.values[i + 1] - self.values[i]))

    def place(self, time: float) -> tuple[int, float]:
        """Return the interval that a time lies in, and the share of the interval that has passed, in [0, 1]."""
        times = self.times
        if time <= times[0]:
            return 0, 0.0
        if time >= times[-1]:
            return len(times) - 1, 0.0
        i = int(np.searchsorted(times, time, side="right")) - 1
        return i, (time - float(times[i])) / float(times[i + 1] - times[i])

    @cached_property
    def _spline(self) -> Any:
        """Hermite cubics between the times as Bezier curves: SciPy's CubicHermiteSpline has one slope at each time."""
        from scipy.interpolate import BPoly  # takes a fifth of a second to import

        arriving, leaving = np.asarray(self.slopes)
        third = np.diff(self.times).reshape(-1, *[1] * (self.values.ndim - 1)) / 3.0
        start, end = self.values[:-1], self.values[1:]
        return BPoly(np.stack([start, start + third * leaving[:-1], end - third * arriving[1:], end]), self.times)
