"""Machine code that finds where a mesh runs through itself."""

from __future__ import annotations

import numpy as np
from numba import njit

NEGLIGIBLE = 1e-12
"""Volumes below this share of the product of their sides are rounding errors."""


@njit(cache=True)
def boxes(points, triangles, order, leaf, low, high):
    """Bounding boxes of a complete binary tree over the triangles in order, with nodes numbered as in a heap.

    `low` and `high` are (2 b - 1, 3); each of the last b nodes holds `leaf` triangles.
    """
    first = low.shape[0] // 2
    low[:], high[:] = np.inf, -np.inf
    for i in range(order.shape[0]):
        node = first + i // leaf
        for s in range(3):
            for k in range(3):
                x = points[triangles[order[i], s], k]
                low[node, k] = min(low[node, k], x)
                high[node, k] = max(high[node, k], x)
    for node in range(first - 1, -1, -1):
        for k in range(3):
            low[node, k] = min(low[2 * node + 1, k], low[2 * node + 2, k])
            high[node, k] = max(high[2 * node + 1, k], high[2 * node + 2, k])


@njit(cache=True)
def _side(a, b, c, d):
    """The side of the plane (a, b, c) on which d lies: -1, 0 (within rounding) or 1."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    volume = ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)
    size = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz) * (wx * wx + wy * wy + wz * wz)
    if volume * volume <= NEGLIGIBLE * NEGLIGIBLE * size:
        return 0
    return 1 if volume > 0.0 else -1


@njit(cache=True)
def _pierces(p, q, a, b, c):
    """Return True if the segment pq runs through the inside of the triangle abc."""
    side = _side(a, b, c, p)
    if side == 0 or _side(a, b, c, q) != -side:
        return False
    turn = _side(p, q, a, b)
    return turn != 0 and _side(p, q, b, c) == turn and _side(p, q, c, a) == turn


@njit(cache=True)
def pierced(points, edges, triangles, order, leaf, low, high, out):
    """Write pairs of an edge and a triangle that it pierces to `out`, as many as fit; return how many there are."""
    first, count = low.shape[0] // 2, 0
    stack = np.empty(64, np.int64)
    for e in range(edges.shape[0]):
        v, w = edges[e, 0], edges[e, 1]
        p, q = points[v], points[w]
        x0, x1 = min(p[0], q[0]), max(p[0], q[0])
        y0, y1 = min(p[1], q[1]), max(p[1], q[1])
        z0, z1 = min(p[2], q[2]), max(p[2], q[2])
        stack[0], top = 0, 1
        while top > 0:
            top -= 1
            i = stack[top]
            if x0 > high[i, 0] or x1 < low[i, 0] or y0 > high[i, 1] or y1 < low[i, 1]:
                continue
            if z0 > high[i, 2] or z1 < low[i, 2]:
                continue
            if i < first:
                stack[top], stack[top + 1] = 2 * i + 1, 2 * i + 2
                top += 2
                continue
            begin = (i - first) * leaf
            for t in order[begin : min(begin + leaf, order.shape[0])]:
                a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
                if v in (a, b, c) or w in (a, b, c):
                    continue
                if _pierces(p, q, points[a], points[b], points[c]):
                    if count < out.shape[0]:
                        out[count, 0], out[count, 1] = e, t
                    count += 1
    return count
