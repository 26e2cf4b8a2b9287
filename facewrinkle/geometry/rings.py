"""Triangles between rings of points: tubes, strips and closed surfaces of revolution."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ..array_types import IntArray


def ring_quads(n: int, rings: int, *, closed: bool = True, start: int = 0) -> IntArray:
    """Quadrilaterals between consecutive rings of points, which are numbered ring by ring.

    Parameters
    ----------
    n : int
        Points of each ring.
    rings : int
        At least two.
    closed : bool
        Join the last point of each ring to its first one.
    start : int
        Number of the first point of the first ring.

    Returns
    -------
    ndarray of int, shape (k, 4)
        Two points a and b of a ring that follow each other, and those next to them on the next ring, as [a, b, c, d].

    Examples
    --------
    >>> ring_quads(3, 2).tolist()
    [[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]]
    >>> ring_quads(3, 2, closed=False).tolist()
    [[0, 1, 4, 3], [1, 2, 5, 4]]
    """
    here = np.arange(n if closed else n - 1)
    after = np.where(here == n - 1, 0, here + 1)
    ring = start + n * np.arange(rings - 1)[:, None]
    quads = np.stack([ring + here, ring + after, ring + n + after, ring + n + here], axis=-1)
    return quads.reshape(-1, 4).astype(np.int32)


def ring_triangles(
    n: int,
    rings: int,
    *,
    closed: bool = True,
    start: int = 0,
    first: int | None = None,
    last: int | None = None,
    diagonal: Literal["bd", "ac"] = "bd",
) -> IntArray:
    """Triangles between consecutive rings of points and, if they are given, to points that close the ends.

    Seen from outside they are counter-clockwise, if the rings are counter-clockwise seen from beyond the last one.

    Parameters
    ----------
    n, rings, closed, start
        As for :func:`ring_quads`.
    first, last : int, optional
        Points that close the surface before the first and after the last ring. Default: it is open there.
    diagonal : {"bd", "ac"}
        Corners between which the quadrilaterals [a, b, c, d] are split.

    Returns
    -------
    ndarray of int, shape (m, 3)
        One half of each quadrilateral, then the other halves, then the ends.

    Examples
    --------
    >>> ring_triangles(3, 2).tolist()
    [[0, 1, 3], [1, 2, 4], [2, 0, 5], [1, 4, 3], [2, 5, 4], [0, 3, 5]]
    >>> ring_triangles(3, 2, last=6)[6:].tolist()
    [[3, 4, 6], [4, 5, 6], [5, 3, 6]]
    """
    quads = ring_quads(n, rings, closed=closed, start=start)
    a, b, c, d = quads.T
    parts = [(a, b, d), (b, c, d)] if diagonal == "bd" else [(a, b, c), (a, c, d)]
    size = n if closed else n - 1
    if first is not None:
        parts.append((b[:size], a[:size], np.full(size, first)))
    if last is not None:
        parts.append((d[-size:], c[-size:], np.full(size, last)))
    return np.concatenate([np.stack(corners, axis=1) for corners in parts]).astype(np.int32)
