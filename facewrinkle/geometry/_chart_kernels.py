"""Inner loops of charts: the closest point of a mesh, and polar coordinates that run over its triangles."""

from __future__ import annotations

import numpy as np
from numba import njit

OUTSIDE = 4
"""Triangles through which nothing came yet: a neighbour's distance plus the edge, the worst that is taken."""


@njit(cache=True)
def closest(points, triangles, query):
    """Triangle and barycentric coordinates of the point of a mesh that is closest to `query`."""
    best, found = np.inf, 0
    weights, w = np.empty(3), np.empty(3)
    for f in range(triangles.shape[0]):
        a, b, c = points[triangles[f, 0]], points[triangles[f, 1]], points[triangles[f, 2]]
        distance = _closest_in(a, b, c, query, w)
        if distance < best:
            best, found = distance, f
            weights[:] = w
    return found, weights, np.sqrt(best)


@njit(cache=True)
def _closest_in(a, b, c, p, w):
    """Squared distance of p from a triangle; the weights of the closest point go to w."""
    ab, ac, ap = b - a, c - a, p - a
    d00, d01, d11 = (ab * ab).sum(), (ab * ac).sum(), (ac * ac).sum()
    d20, d21 = (ap * ab).sum(), (ap * ac).sum()
    determinant = d00 * d11 - d01 * d01
    if determinant > 0.0:
        v, u = (d11 * d20 - d01 * d21) / determinant, (d00 * d21 - d01 * d20) / determinant
        if v >= 0.0 and u >= 0.0 and v + u <= 1.0:
            w[0], w[1], w[2] = 1.0 - v - u, v, u
            rest = ap - v * ab - u * ac
            return (rest * rest).sum()
    best = np.inf
    corners = (a, b, c)
    for s in range(3):  # on the border
        start, side = corners[s], corners[(s + 1) % 3] - corners[s]
        length = (side * side).sum()
        t = 0.0 if length == 0.0 else min(max(((p - start) * side).sum() / length, 0.0), 1.0)
        rest = p - start - t * side
        distance = (rest * rest).sum()
        if distance < best:
            best = distance
            w[:] = 0.0
            w[s], w[(s + 1) % 3] = 1.0 - t, t
    return best


@njit(cache=True)
def _push(heap, keys, size, vertex, key):
    i = size
    while i > 0 and keys[(i - 1) // 2] > key:
        heap[i], keys[i] = heap[(i - 1) // 2], keys[(i - 1) // 2]
        i = (i - 1) // 2
    heap[i], keys[i] = vertex, key


@njit(cache=True)
def _pop(heap, keys, size):
    """Take the smallest away; what remains has size - 1 entries."""
    top, key = heap[0], keys[0]
    vertex, last = heap[size - 1], keys[size - 1]
    i, n = 0, size - 1
    while True:
        child = 2 * i + 1
        if child >= n:
            break
        if child + 1 < n and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= last:
            break
        heap[i], keys[i] = heap[child], keys[child]
        i = child
    heap[i], keys[i] = vertex, last
    return top, key


@njit(cache=True)
def _through(points, i, j, k, distance, angle):
    """Distance and angle at i of the straight line that comes through the edge j k, and how far beside the edge it is.

    Both triangles, that of the source with the edge and that of the edge with i, are laid flat side by side; j k i is a
    triangle of the mesh in its own orientation, so the source has k to the right of j: angles fall from j to k.
    """
    e, r = points[k] - points[j], points[i] - points[j]
    length = np.sqrt((e * e).sum())
    ix = (r * e).sum() / length
    iy = np.sqrt(max((r * r).sum() - ix * ix, 0.0))
    uj, uk = distance[j], distance[k]
    sx = (uj * uj - uk * uk + length * length) / (2.0 * length)
    sy = -np.sqrt(max(uj * uj - sx * sx, 0.0))
    at_j, at_k, at_i = np.arctan2(-sy, -sx), np.arctan2(-sy, length - sx), np.arctan2(iy - sy, ix - sx)
    beside = max(at_i - at_j, at_k - at_i, 0.0)
    wide = at_j - at_k
    turn = angle[k] - angle[j]
    turn -= 2.0 * np.pi * np.round((turn + wide) / (2.0 * np.pi))
    u = np.hypot(ix - sx, iy - sy)
    if at_i > at_j:  # beside the edge the plane is continued
        return u, angle[j] + at_i - at_j, beside
    if at_i < at_k:
        return u, angle[k] + at_i - at_k, beside
    share = (at_j - at_i) / wide if wide > 1e-12 else 0.5
    return u, angle[j] + share * turn, beside


@njit(cache=True)
def polar(points, triangles, offsets, around, first, reach, distance, angle):
    """Fill in distances and angles from those of the triangle `first`, nearest vertices first, up to `reach`.

    `around[offsets[v]:offsets[v + 1]]` are the triangles at v. A vertex takes its values through the edge that the
    straight line to it crosses or, where none is known yet, misses by least.
    """
    n = points.shape[0]
    quality, done = np.full(n, np.inf), np.zeros(n, np.bool_)
    heap, keys = np.empty(8 * triangles.shape[0] + 8, np.int64), np.empty(8 * triangles.shape[0] + 8)
    size = 0
    for c in range(3):
        v = triangles[first, c]
        quality[v] = -1.0
        _push(heap, keys, size, v, distance[v])
        size += 1
    while size > 0:
        v, key = _pop(heap, keys, size)
        size -= 1
        if done[v] or key > distance[v] or key > reach:
            continue
        done[v] = True
        for q in range(offsets[v], offsets[v + 1]):
            f = around[q]
            for c in range(3):
                i, j, k = triangles[f, c], triangles[f, (c + 1) % 3], triangles[f, (c + 2) % 3]
                if i == v or done[i]:
                    continue
                if done[j] and done[k]:
                    u, a, beside = _through(points, i, j, k, distance, angle)
                else:
                    edge = points[i] - points[v]
                    u, a, beside = distance[v] + np.sqrt((edge * edge).sum()), angle[v], OUTSIDE + distance[v]
                if beside < quality[i] or (beside == quality[i] and u < distance[i]):
                    quality[i], distance[i], angle[i] = beside, u, a
                    _push(heap, keys, size, i, u)
                    size += 1
    for v in range(n):
        if not done[v]:
            distance[v] = np.inf
