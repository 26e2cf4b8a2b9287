"""What carries the skin bodily: bones and lid plates that turn about an axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Guide:
    """How far the ties of each vertex turn with a bone or a lid at full contraction.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
    angles : ndarray, shape (k,)
        Turn about `axis`, radians; downwards positive.
    hold : ndarray, shape (k,)
        In [0, 1]: 1 on the stiff plates of the lids (tarsi), which follow exactly; falls to 0 in the skin around.
    centre, axis : ndarray, shape (3,)
    bone : bool
        Whether the bone itself turns, and the feet of all ties with it; else plates are added to the ties.
    """

    vertices: npt.NDArray[np.int64]
    angles: Array
    hold: Array
    centre: Array
    axis: Array
    bone: bool = False

    def turned(self, points: Array, rate: float) -> Array:
        """Displacement (k, 3) of the feet at a contraction rate, for rest positions (n, 3) in the unit of `centre`."""
        offset = points[self.vertices] - self.centre
        angles = rate * self.angles
        cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
        axial = self.axis * (offset @ self.axis)[:, None]
        return np.asarray((offset - axial) * (cos - 1.0) + np.cross(self.axis, offset) * sin)
