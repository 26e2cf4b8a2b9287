"""Bones that carry the points of a mesh: linear blend skinning."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bones:
    """What carries the points of a mesh: ``p(t) = S(t) S(rest)^-1 p(rest)``, where ``S = sum_b w_b B_b`` of each point.

    Attributes
    ----------
    weights : sparse array, shape (n, b)
        How much each bone carries of each point; they add up to 1.
    matrices : callable
        The matrices (b, 4, 4) of the bones at a time.
    rest : ndarray, shape (b, 4, 4)
        The same at rest.

    Examples
    --------
    >>> half = csr_array(np.array([[1.0, 0.0], [0.5, 0.5]]))  # of two bones, of which one rises
    >>> still, risen = np.eye(4), np.eye(4)
    >>> risen[1, 3] = 2.0
    >>> bones = Bones(half, lambda time: np.array([still, risen]), np.array([still, still]))
    >>> bones.carried(np.zeros((2, 3)), 1.0).tolist()
    [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """

    weights: csr_array
    matrices: Callable[[float], Array]
    rest: Array

    def carried(self, points: Array, time: float, which: npt.NDArray[np.int64] | slice = slice(None)) -> Array:
        """Where the points `which` are at a time that are at rest, or displaced by shapes, at `points` (n, 3)."""
        turn = self._blended(self.matrices(time))[which] @ self._back[which]
        return np.asarray(np.einsum("nij,nj->ni", turn[:, :3, :3], points) + turn[:, :3, 3])

    def _blended(self, matrices: Array) -> Array:
        return np.asarray((self.weights @ matrices.reshape(-1, 16)).reshape(-1, 4, 4))

    @cached_property
    def _back(self) -> Array:
        """From rest to the coordinates that the bones carry; what has no size there stays without."""
        return np.asarray(np.linalg.pinv(self._blended(self.rest)))
