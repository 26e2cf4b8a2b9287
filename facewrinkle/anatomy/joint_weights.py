"""What carries the skin bodily: bones and lid plates that turn about an axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JointWeights:
    """How far the tethers of each vertex turn with a bone or a lid at full contraction.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
    angles : ndarray, shape (k,)
        Turn about `axis`, radians; downwards positive.
    hold : ndarray, shape (k,)
        In [0, 1]: 1 on the stiff plates of the lids (tarsi), which follow exactly; falls to 0 in the skin around.
    centre, axis : ndarray, shape (3,)
    bone : bool
        Whether the bone itself turns, and the feet of all tethers with it; else plates are added to the tethers.
    yields : tuple of str
        Names of muscles whose contraction takes the place of this one's: a lid that closes does not follow the eye, and
        one that goes with the eye is not lifted more.

    Examples
    --------
    Two vertices 10 mm in front of an axis, of which the second follows by half, at half a contraction:

    >>> guide = JointWeights(np.array([1, 2]), np.array([0.4, 0.2]), np.zeros(2), np.zeros(3), np.array([1.0, 0, 0]))
    >>> guide.turned(np.array([[0.0, 0, 0], [0, 0, 10], [0, 0, 10]]), rate=0.5)[:, 1].round(1)
    array([-2., -1.])
    """

    vertices: npt.NDArray[np.int64]
    angles: Array
    hold: Array
    centre: Array
    axis: Array
    bone: bool = False
    yields: tuple[str, ...] = ()

    def turned(self, points: Array, rate: float) -> Array:
        """Displacement (k, 3) of the feet at a contraction rate, for rest positions (n, 3) in the unit of `centre`."""
        return turned(points[self.vertices] - self.centre, self.axis, rate * self.angles)


def turned(vectors: Array, axis: Array, angles: Array) -> Array:
    """By how much vectors (k, 3) change when they turn by angles (k,) about an axis (Rodrigues)."""
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    axial = axis * (vectors @ axis)[:, None]
    return np.asarray((vectors - axial) * (cos - 1.0) + np.cross(axis, vectors) * sin)
