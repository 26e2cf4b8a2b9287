"""An order of points along a line, where neighbors are mostly neighbors in space."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import IntArray


def morton_order(cells: npt.NDArray[np.integer], bits: int) -> IntArray:
    """Return the order (n,) of the cells of a grid along the curve of Morton (1966).

    Parameters
    ----------
    cells : ndarray of int, shape (n, d)
        Position of each cell along the d axes of the grid, from 0 to ``2**bits - 1``. The last axis counts most.
    bits : int
        Bits per axis; at most 63 for all axes together.

    Examples
    --------
    >>> morton_order(np.array([[1, 1], [0, 1], [1, 0], [0, 0]]), 1).tolist()
    [3, 2, 1, 0]
    """
    cells = np.asarray(cells, np.int64)
    code, axes = np.zeros(len(cells), np.int64), cells.shape[1]
    for bit in range(bits):
        for axis in range(axes):
            code |= ((cells[:, axis] >> bit) & 1) << (axes * bit + axis)
    return np.argsort(code, kind="stable")
