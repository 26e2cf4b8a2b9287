"""The base class of all kinds of patterns.

Each kind lays the plane of its formula (:mod:`facewrinkle.layers.patterns`) on a region, whose own coordinates (u, v)
run from -1 to 1 between its borders, and scales its relief to 1 from bulge to furrow (a dimple or pouch: 1 deep or
high).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from ...array_types import Array


@dataclass(frozen=True, kw_only=True)
class Pattern:
    """A pattern: a plane, and heights over it.

    A kind has `plane`, which maps (u, v) to its own (x, y), given the region's height over its width (`aspect`);
    `relief`, the height at a strength in [0, 1] and a t; and `wave_vector`, the gradient of its phase. `moving` is
    True if its wavelengths change with t, `timed` if it has a t other than its strength.

    Examples
    --------
    A kind of one's own needs a relief and a wave vector:

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Grooves(Pattern):
    ...     number: float = 6.0
    ...     def relief(self, x, y, strength, t, aspect):
    ...         return 0.5 * strength * np.cos(np.pi * self.number * x)
    ...     def wave_vector(self, x, y, t, aspect):
    ...         return np.full_like(x, np.pi * self.number), np.zeros_like(y)
    >>> import numpy as np, facewrinkle as fw
    >>> face = fw.default_face()
    >>> layer = fw.PatternLayer(Grooves(), face.landmarks["forehead_mid"], size=30.0, depth=0.5)
    >>> frame = fw.Simulation(face, layers=[layer], motion=fw.Still(face)).step()
    >>> round(float(np.ptp(frame["W"])), 1)
    0.5
    """

    moving: ClassVar[bool] = False
    timed: ClassVar[bool] = True

    def sized(self, size: Array) -> Pattern:
        """Return the pattern for a region of this width and height, mm."""
        return self

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """Return the (x, y) of points (k, 2) in the region."""
        return uv[:, 0], uv[:, 1]

    def time(self, seconds: float) -> float:
        """Return the t at a time, where the user gave none."""
        return 0.0

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """Return heights (k,), 0 at strength 0."""
        raise NotImplementedError

    def relief_over(self, x: Array, y: Array, aspect: float) -> Callable[[float, float], Array]:
        """Return `relief` as a function of strength and t: what does not change with these is computed once."""
        return lambda strength, t: self.relief(x, y, strength, t, aspect)

    def wave_vector(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """Return the gradient of the phase along x and y: 2 pi over the wavelength of the finest detail."""
        raise NotImplementedError
