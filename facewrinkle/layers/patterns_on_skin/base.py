"""What all kinds of patterns share.

Each kind lays the plane of its formula (:mod:`facewrinkle.layers.patterns`) on a region, whose own coordinates (u, v)
are -1 to 1 from border to border, and scales its relief to 1 from bulge to furrow (a dimple or pouch: 1 deep or high).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ..base import Array

Heights = Callable[[float, float, Array], None]
"""Adds the relief at a strength and a t to an array of heights."""


@dataclass(frozen=True, kw_only=True)
class Pattern:
    """What all kinds share: they are asked for places in a plane, and for heights there.

    A kind has `plane`, which maps (u, v) to its own (x, y), given the region's height over its width; `relief`, the
    height at a strength in [0, 1] and a t; `waves`, the gradient of its phase in (x, y); and `prepared`, a faster form
    of `relief` for places that do not change. `moving` tells whether its wavelengths change with t, `timed` whether it
    has a t other than its strength.

    Examples
    --------
    A kind of one's own needs a relief and the gradient of its phase:

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Grooves(Pattern):
    ...     number: float = 6.0
    ...     def relief(self, x, y, strength, t, aspect):
    ...         return 0.5 * strength * np.cos(np.pi * self.number * x)
    ...     def waves(self, x, y, t, aspect):
    ...         return np.full_like(x, np.pi * self.number), np.zeros_like(y)
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> layer = fw.PatternLayer(Grooves(), face.landmarks["forehead_mid"], size=30.0, depth=0.5)
    >>> frame = fw.Simulation(face, layers=[layer], motion=fw.Still(face)).step()
    >>> round(float(np.ptp(frame["W"])), 1)
    0.5
    """

    moving: ClassVar[bool] = False
    timed: ClassVar[bool] = True

    def sized(self, size: Array) -> Pattern:
        """The pattern on a region of this width and height, mm."""
        return self

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """The (x, y) of places (k, 2) in the region."""
        return uv[:, 0], uv[:, 1]

    def time(self, seconds: float) -> float:
        """The t of a moment, where none was asked for."""
        return 0.0

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """Heights (k,), 0 at strength 0."""
        raise NotImplementedError

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """Gradient of the phase along x and y."""
        raise NotImplementedError

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """The same as `relief`, times `weight`, added where told."""

        def heights(strength: float, t: float, out: Array) -> None:
            out[where] += weight * self.relief(x, y, strength, t, aspect)

        return heights
