"""Values carried from the vertices of the base mesh to those of a refined one."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]


@njit(cache=True)
def _carry(values, corners, barycentric, out):  # type: ignore[no-untyped-def]
    for i in range(corners.shape[0]):
        a, b, c = corners[i, 0], corners[i, 1], corners[i, 2]
        wa, wb, wc = barycentric[i, 0], barycentric[i, 1], barycentric[i, 2]
        for k in range(values.shape[1]):
            out[i, k] = wa * values[a, k] + wb * values[b, k] + wc * values[c, k]


def carried(values: Array, corners: npt.NDArray[np.int32], barycentric: Array) -> Array:
    """Linear interpolation of (n0, d) values at n points with barycentric coordinates in three base vertices each.

    Examples
    --------
    >>> carried(np.array([[0.0], [1.0], [4.0]]), np.array([[0, 1, 2]], np.int32), np.array([[0.5, 0.25, 0.25]]))
    array([[1.25]])
    """
    out = np.empty((len(corners), values.shape[1]))
    _carry(values, corners, barycentric, out)
    return out


def nearest_carried(values: np.ndarray, corners: npt.NDArray[np.int32], barycentric: Array) -> np.ndarray:
    """Values of the base vertex of the largest weight: for labels and other values that cannot be averaged."""
    return np.asarray(values[corners[np.arange(len(corners)), np.argmax(barycentric, axis=1)]])
