"""Waves: the base class of all patterns of wrinkles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from ...array_types import Array
from ...errors import check_positive, check_range, check_whole, unknown_name
from .. import patterns
from .base import Pattern
from .variation import natural_variation

Furrows = Literal["sharp", "paper"]

FURROWS: tuple[Furrows, ...] = ("sharp", "paper")

SMALLEST_NUMBER, LARGEST_NUMBER = 0.1, 1000.0
"""The fewest and the most wrinkles from border to border."""

FLAT = 1e-6
"""Below this sharpness waves are plain sines."""


@dataclass(frozen=True, kw_only=True)
class Waves(Pattern):
    """Waves that follow one another over the region: wrinkles.

    Attributes
    ----------
    number : float
        Wrinkles from border to border.
    spacing : float, optional
        Distance from wrinkle to wrinkle, mm, in place of their number; where they fan out, in the middle of the region.
    sharpness : float
        Sharpness of the furrows; 0 is a plain sine.
    furrows : {"sharp", "paper"}
        "paper" has sharp ridges and round valleys, as printed.
    variation : float
        Differences of the wrinkles in length, depth, distance and bend, in [0, 1]; 0 is the paper's even pattern.
    seed : int
        Seed of the variation.

    Notes
    -----
    `across_axis` is 0 if the wrinkles follow each other across the region, 1 if they do so upwards.
    """

    across_axis: ClassVar[int] = 0
    number: float = 3.0
    spacing: float | None = None
    sharpness: float = 1.2
    furrows: Furrows = "sharp"
    variation: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        check_range("number", self.number, SMALLEST_NUMBER, LARGEST_NUMBER)
        check_range("sharpness", self.sharpness, 0.0, 20.0)
        if self.furrows not in FURROWS:
            raise unknown_name("kind of furrows", self.furrows, FURROWS)
        check_range("variation", self.variation, 0.0, 1.0, "0 is the paper's even pattern.")
        check_whole("seed", self.seed, 0, 2**63)
        if self.spacing is not None:
            check_positive("spacing", self.spacing, "It is the distance from wrinkle to wrinkle, mm.")

    def sized(self, size: Array) -> Waves:
        """See :class:`Pattern`."""
        if self.spacing is None:
            return self
        length, narrowest = float(size[self.across_axis]), float(size[self.across_axis]) / LARGEST_NUMBER
        remedy = f"The region is {length:.3g} mm long across the wrinkles."
        check_range("spacing", self.spacing, narrowest, length / SMALLEST_NUMBER, remedy)
        return replace(self, number=length / self.spacing, spacing=None)

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """Return the phase of the waves, radians: furrows are where its sine is -1."""
        raise NotImplementedError

    def place_along(self, x: Array, y: Array, aspect: float) -> Array:
        """Return the place along the wrinkles, -1 to 1 from border to border."""
        raise NotImplementedError

    def variation_at(self, x: Array, y: Array, aspect: float) -> tuple[Array | float, Array | float]:
        """Return the phase that natural variation adds, and the share of the height that it leaves.

        Like the marks of age, it belongs to the points of the skin: waves that move with time run through it.
        """
        if self.variation == 0.0:
            return 0.0, 1.0
        phase = self.phase(x, y, self.time(0.0), aspect)
        return natural_variation(phase, self.place_along(x, y, aspect), self.variation, self.seed)

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        return self.relief_over(x, y, aspect)(strength, t)

    def relief_over(self, x: Array, y: Array, aspect: float) -> Callable[[float, float], Array]:
        """See :class:`Pattern`."""
        shift, share = self.variation_at(x, y, aspect)
        full = share * self.amplitude(x, y)
        return lambda strength, t: full * self.height(np.sin(self.phase(x, y, t, aspect) + shift), strength)

    def amplitude(self, x: Array, y: Array) -> Array | float:
        """Return the share of the height that the pattern has at a place, before variation."""
        return 1.0

    def height(self, sine: Array, strength: float) -> Array:
        """Return the height of waves by the sine of their phase."""
        k = self.sharpness
        if self.furrows == "paper" and k >= FLAT:
            return np.asarray(strength * np.expm1(k * sine) / (2.0 * np.sinh(k)))
        return strength * patterns.sharpened(sine, k)

    def wave_vector(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        wx, wy = self.phase_gradient(x, y, t, aspect)
        finer = (1.0 + 0.4 * self.sharpness) * (1.0 + 0.1 * self.variation)
        return finer * wx, finer * wy

    def phase_gradient(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """Return the gradient of the phase, without variation."""
        raise NotImplementedError
