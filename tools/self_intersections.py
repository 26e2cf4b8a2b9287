"""Triangles of a mesh that run through each other, for tests and for what measures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facewrinkle.array_types import Array, IntArray
from facewrinkle.geometry import topology
from facewrinkle.geometry.topology import morton_order

from . import _self_intersection_kernels as kernels

PER_BOX = 4
"""Triangles in each of the smallest boxes of the tree."""

BITS = 10
"""Triangles are sorted in a grid of 2^10 cells along each axis."""


def self_intersections(points: Array, triangles: NDArray[np.integer]) -> IntArray:
    """Pairs (k, 2) of triangles in which an edge of the first runs through the inside of the second.

    Triangles that only touch or lie in one plane do not count, nor do neighbors at an edge.

    Examples
    --------
    >>> import pyvista as pv
    >>> sheets = pv.Plane(i_resolution=1, j_resolution=1).triangulate()
    >>> sheets = sheets.append_polydata(sheets.rotate_x(90).rotate_z(20))
    >>> points, triangles = np.asarray(sheets.points, float), np.asarray(sheets.regular_faces)
    >>> np.unique(self_intersections(points, triangles)).tolist()
    [0, 1, 2, 3]
    """
    triangles = np.ascontiguousarray(triangles, dtype=np.int64)
    points = np.ascontiguousarray(points, dtype=np.float64)
    if not len(triangles):
        return np.zeros((0, 2), np.int64)
    edges, sides = topology.unique_edges(triangles)
    order = _near_each_other(points[triangles].mean(axis=1))
    leaves = 1 << max(0, int(np.ceil(np.log2(len(triangles) / PER_BOX))))
    low, high = np.empty((2, 2 * leaves - 1, 3))
    kernels.boxes(points, triangles, order, PER_BOX, low, high)
    room = len(triangles)
    while True:
        found = np.empty((room, 2), np.int64)
        count = kernels.pierced(points, edges, triangles, order, PER_BOX, low, high, found)
        if count <= room:
            break
        room = count
    found = found[:count]
    offsets, around = topology.incident_triangles(sides)
    counts = np.diff(offsets)[found[:, 0]]
    place = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    first = around[np.repeat(offsets[found[:, 0]], counts) + place]
    return np.unique(np.column_stack([first, np.repeat(found[:, 1], counts)]), axis=0).astype(np.int64)


def _near_each_other(places: Array) -> IntArray:
    """Order in which places (n, 3) that are near each other mostly follow each other."""
    span = float(np.ptp(places, axis=0).max()) or 1.0
    steps = ((places - places.min(axis=0)) / span * (2**BITS - 1.0)).astype(np.int64)
    return morton_order(steps, BITS)
