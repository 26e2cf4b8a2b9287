"""Bones that carry the points of a mesh: linear blend skinning."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from ..array_types import Array, IntArray


@dataclass(frozen=True, eq=False)
class Bones:
    """Bones that carry the points of a mesh: ``p(t) = S(t) S(rest)^-1 p(rest)``, with ``S = sum_b w_b B_b`` per point.

    Attributes
    ----------
    weights : sparse array, shape (n, b)
        Share of each bone in the motion of each point; those of a point add up to 1.
    matrices : callable
        Gives the matrices (b, 4, 4) of the bones at a time.
    rest : ndarray, shape (b, 4, 4)
        Matrices of the bones at rest.

    Examples
    --------
    >>> half = csr_array(np.array([[1.0, 0.0], [0.5, 0.5]]))  # two bones, of which one rises
    >>> still, risen = np.eye(4), np.eye(4)
    >>> risen[1, 3] = 2.0
    >>> bones = Bones(half, lambda time: np.array([still, risen]), np.array([still, still]))
    >>> bones.positions_at(1.0, np.zeros((2, 3))).tolist()
    [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """

    weights: csr_array
    matrices: Callable[[float], Array]
    rest: Array

    def positions_at(self, time: float, rest: Array, numbers: IntArray | slice = slice(None)) -> Array:
        """Return positions (n, 3) of the points `numbers` at a time; `rest` (n, 3) is where they are without bones."""
        turn = self._blended(self.matrices(time))[numbers] @ self._back[numbers]
        return np.asarray(np.einsum("nij,nj->ni", turn[:, :3, :3], rest) + turn[:, :3, 3])

    def _blended(self, matrices: Array) -> Array:
        return np.asarray((self.weights @ matrices.reshape(-1, 16)).reshape(-1, 4, 4))

    @cached_property
    def _back(self) -> Array:
        """Matrices from rest to the coordinates of the bones; directions that the rest pose flattens stay flat."""
        return np.asarray(np.linalg.pinv(self._blended(self.rest)))
