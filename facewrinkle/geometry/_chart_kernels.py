"""Machine code for charts: polar coordinates that spread over the triangles of a mesh."""

from __future__ import annotations

import numpy as np

from .compilation import compiled

SWEEPS = 2
"""Further passes over all vertices, once each has a first value."""


@compiled
def _push(heap, keys, size, vertex, key):
    i = size
    while i > 0 and keys[(i - 1) // 2] > key:
        heap[i], keys[i] = heap[(i - 1) // 2], keys[(i - 1) // 2]
        i = (i - 1) // 2
    heap[i], keys[i] = vertex, key


@compiled
def _pop(heap, keys, size):
    """Remove and return the smallest of `size` entries."""
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


@compiled
def _wrapped(angle):
    """The angle, less whole turns, in [-pi, pi]."""
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))


@compiled
def _through(points, i, j, k, distance, angle):
    """Distance and angle at i of the straight line through the edge j k, and the angle by which it misses the edge.

    The triangle of the source and the edge and the triangle j k i of the mesh are unfolded into one plane. As j k i is
    oriented, a source beyond the edge sees k to the right of j. Distance and miss are infinite where no line leads
    through the edge: for a source on the near side, for lines that lead back, and for lines longer than by way of j.
    """
    e, r = points[k] - points[j], points[i] - points[j]
    length = np.sqrt((e * e).sum())
    ix = (r * e).sum() / length
    iy = np.sqrt(max((r * r).sum() - ix * ix, 0.0))
    uj, uk = distance[j], distance[k]
    turn = _wrapped(angle[k] - angle[j])
    sx = (uj * uj - uk * uk + length * length) / (2.0 * length)
    sy = -np.sqrt(max(uj * uj - sx * sx, 0.0))
    to_j, to_k, to_i = np.arctan2(-sy, -sx), np.arctan2(-sy, length - sx), np.arctan2(iy - sy, ix - sx)
    from_j, from_k = _wrapped(to_i - to_j), _wrapped(to_i - to_k)
    u = np.hypot(ix - sx, iy - sy)
    longest = uj + np.sqrt((r * r).sum())
    if turn > 0.0 or u < min(uj, uk) or u > longest * (1.0 + 1e-9):
        return np.inf, 0.0, np.inf
    if from_j > 0.0:  # past an end of the edge the plane is continued
        return u, angle[j] + from_j, from_j
    if from_k < 0.0:
        return u, angle[k] + from_k, -from_k
    wide = from_k - from_j
    share = -from_j / wide if wide > 1e-12 else 0.5
    return u, angle[j] + share * turn, 0.0


@compiled
def polar(points, triangles, offsets, around, first, reach, distance, angle):
    """Fill in distances and angles, from those at the triangle `first` outwards to `reach`, nearest vertices first.

    `around[offsets[v]:offsets[v + 1]]` are the triangles at v. A vertex takes its values through the edge that the
    straight line to it crosses or, if no such edge is known yet, through the one that the line misses by least.
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
                if i == v or done[i] or not (done[j] and done[k]):
                    continue
                u, a, miss = _through(points, i, j, k, distance, angle)
                if miss < quality[i] or (miss == quality[i] and u < distance[i]):
                    quality[i], distance[i], angle[i] = miss, u, a
                    _push(heap, keys, size, i, u)
                    size += 1
    for v in range(n):
        if not done[v]:
            distance[v] = np.inf
    # Now that all neighbours are known, each vertex takes the edge that its line really crosses.
    order = np.argsort(distance)
    for _ in range(SWEEPS):
        for v in order:
            if not done[v]:
                break
            for q in range(offsets[v], offsets[v + 1]):
                f = around[q]
                c = 0 if triangles[f, 0] == v else 1 if triangles[f, 1] == v else 2
                j, k = triangles[f, (c + 1) % 3], triangles[f, (c + 2) % 3]
                if done[j] and done[k]:
                    u, a, miss = _through(points, v, j, k, distance, angle)
                    if miss < quality[v]:
                        quality[v], distance[v], angle[v] = miss, u, a
