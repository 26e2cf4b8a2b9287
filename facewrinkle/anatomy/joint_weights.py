"""Turns of the skin with bones and the plates of lids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..array_types import Array


@dataclass(frozen=True, eq=False)
class JointWeights:
    """Turn of each vertex with a bone or a lid at full contraction.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
    angles : ndarray, shape (k,)
        Turn about `axis`, radians; downwards positive.
    hold : ndarray, shape (k,)
        In [0, 1]: 1 on the stiff plates of the lids (tarsi), which follow exactly, falling to 0 in the skin around.
    centre, axis : ndarray, shape (3,)
    bone : bool
        True if a bone turns, and with it the anchors of the tethers; False for a lid, to whose plate the skin is
        tethered as well.
    yields : tuple of str
        Names of muscles whose contraction takes the place of this one's: a lid that closes does not follow the eye, and
        one that goes with the eye is not lifted more.

    Examples
    --------
    Two vertices 10 mm in front of an axis, of which the second follows by half, at half a contraction:

    >>> weights = JointWeights(np.array([1, 2]), np.array([0.4, 0.2]), np.zeros(2), np.zeros(3), np.array([1.0, 0, 0]))
    >>> weights.turned(np.array([[0.0, 0, 0], [0, 0, 10], [0, 0, 10]]), rate=0.5)[:, 1].round(1)
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
        """Displacement (k, 3) of the `vertices` at a contraction rate, for rest positions (n, 3) of all vertices."""
        return turned(points[self.vertices] - self.centre, self.axis, rate * self.angles)


def turned(vectors: Array, axis: Array, angles: Array) -> Array:
    """Change of vectors (k, 3) that turn by angles (k,) about an axis (Rodrigues)."""
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    axial = axis * (vectors @ axis)[:, None]
    (a, b, c), (x, y, z) = axis, vectors.T
    across = np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=1)  # np.cross takes three times as long
    return np.asarray((vectors - axial) * (cos - 1.0) + across * sin)
