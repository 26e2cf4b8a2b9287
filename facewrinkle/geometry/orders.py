"""Orders of points: along a line where neighbours are mostly neighbours in space, and for elimination from a system."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import Array, BoolArray, IntArray

SMALLEST = 64
"""Parts with fewer vertices are not divided further."""


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


def nested_dissection(
    pattern: tuple[npt.NDArray[np.integer], npt.NDArray[np.integer]], points: Array
) -> npt.NDArray[np.int64]:
    """Order (n,) of elimination that keeps the factors of a symmetric matrix on a mesh sparse (George, 1973).

    Every part is halved at the median of its longest axis, and the vertices that link the halves come after both.

    Parameters
    ----------
    pattern : tuple of ndarray of int
        Nonzero entries of the matrix by rows, as (indptr, indices).
    points : ndarray, shape (n, 3)

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> chain = diags_array([1.0, 4.0, 1.0], offsets=[-1, 0, 1], shape=(255, 255)).tocsr()
    >>> order = nested_dissection((chain.indptr, chain.indices), np.arange(255.0)[:, None] * [1, 0, 0])
    >>> int(order[-1]), sorted(order.tolist()) == list(range(255))
    (126, True)
    """
    indptr, indices = pattern
    n = len(points)
    i, j = np.repeat(np.arange(n), np.diff(indptr)), indices
    i, j = i[i < j], j[i < j]
    place, part, undecided = np.zeros(n, np.int64), np.zeros(n, np.int64), np.arange(n)
    for _ in range(int(np.ceil(np.log2(max(n / SMALLEST, 1.0))))):
        upper = np.zeros(n, bool)
        upper[undecided] = _upper_halves(points[undecided], part[undecided])
        apart = upper[i] != upper[j]
        linking = np.zeros(n, bool)
        linking[np.where(upper[i[apart]], j[apart], i[apart])] = True
        # Digits to the base of 3: lower half, upper half, links between the two; links have no further digits.
        place *= 3
        place[undecided] += np.where(linking[undecided], 2, upper[undecided])
        part = 2 * part + upper
        undecided = undecided[~linking[undecided]]
        inner = ~(apart | linking[i] | linking[j])
        i, j = i[inner], j[inner]
    return np.argsort(place, kind="stable")


def _upper_halves(points: Array, part: npt.NDArray[np.int64]) -> BoolArray:
    """True (n,) for points in the upper half of their part along its longest axis."""
    _, part, counts = np.unique(part, return_inverse=True, return_counts=True)
    order = np.argsort(part, kind="stable")
    starts = np.cumsum(counts) - counts
    size = np.maximum.reduceat(points[order], starts) - np.minimum.reduceat(points[order], starts)
    along = points[np.arange(len(points)), size.argmax(axis=1)[part]]
    rank = np.empty(len(points), np.int64)
    rank[np.lexsort((along, part))] = np.arange(len(points))
    return np.asarray(rank - starts[part] >= counts[part] // 2)
