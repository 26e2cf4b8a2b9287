"""How strong a pattern is: set by the compression of the skin under it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import ParameterError, check_range
from ...geometry.smoothstep import smoothstep
from .region import vector


@dataclass(frozen=True)
class Compression:
    """A strength that the skin under the pattern sets: 0 up to a compression of `low`, 1 from `full` on.

    Attributes
    ----------
    low, full : float
        Share by which the skin is shortened, on average over the region.
    along : tuple of float, optional
        Direction in which it is measured; default: that of the largest compression at each place.

    Examples
    --------
    >>> Compression(low=0.0, full=0.25)(0.125)
    0.5
    """

    low: float = 0.03
    full: float = 0.2
    along: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        check_range("low", self.low, -10.0, 1.0)
        check_range("full", self.full, self.low + 1e-9, 1.0, "It has to be above low.")
        if self.along is not None and not np.any(vector("along", self.along)):
            raise ParameterError("along must be a direction, received three zeros.")

    def __call__(self, epsilon: float) -> float:
        """The strength at a compression."""
        return float(smoothstep((epsilon - self.low) / (self.full - self.low)))
