"""Machine code for interpolation from some of the vertices of a mesh to all."""

from __future__ import annotations

from heapq import heappop, heappush

import numpy as np

from .compilation import compiled

SINGULAR = 0.05
"""Distance from a node, relative to its radius, within which its weight grows no further."""

DETOUR, DETOUR_FADE = 0.2, 0.2
"""Nodes count in full if the way to them along the edges is longer than the straight line by less than the first share
of their radius, and not at all from the sum of both on.
"""

RIDGE_LINEAR, RIDGE_QUADRATIC = 1e-12, 1e-6
"""Penalties that keep the polynomials determinate where nodes are few or on a line."""

LEAST = 1e-9
"""Smaller weights are left out."""

MOST = 256
"""The most nodes that have a weight at a vertex."""

TERMS = 6
"""Of a polynomial of degree 2 in the plane."""


@compiled
def nearest_nodes(points, offsets, ring, nodes):
    """Number of the node, in `nodes`, that is nearest to each vertex along the edges of the mesh; -1 without a way."""
    n = len(points)
    owner, distance, done = np.full(n, -1, np.int64), np.full(n, np.inf), np.zeros(n, np.bool_)
    heap = [(0.0, 0)]
    heap.clear()
    for i in range(len(nodes)):
        owner[nodes[i]], distance[nodes[i]] = i, 0.0
        heappush(heap, (0.0, nodes[i]))
    while len(heap):
        far, v = heappop(heap)
        if done[v]:
            continue
        done[v] = True
        for e in range(offsets[v], offsets[v + 1]):
            w = np.int64(ring[e])
            if done[w]:
                continue
            way = 0.0
            for k in range(3):
                way += (points[v, k] - points[w, k]) ** 2
            way = far + np.sqrt(way)
            if way < distance[w]:
                distance[w], owner[w] = way, owner[v]
                heappush(heap, (way, w))
    return owner


@compiled
def _kernel(d, detour):
    """Weight at a distance d < 1 from a node; smooth, 0 at 1, large near 0."""
    t = min(max((detour - DETOUR) / DETOUR_FADE, 0.0), 1.0)
    fade = 1.0 - t * t * (3.0 - 2.0 * t)
    return fade * (1.0 - d) ** 4 * (4.0 * d + 1.0) / (d * d + SINGULAR * SINGULAR)


@compiled
def _solve(matrix, right):
    """Solve a symmetric positive definite system in place (Cholesky)."""
    n = len(right)
    for j in range(n):
        for k in range(j):
            matrix[j, j] -= matrix[j, k] ** 2
        matrix[j, j] = np.sqrt(matrix[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] /= matrix[j, j]
    for i in range(n):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[k, i] * right[k]
        right[i] /= matrix[i, i]


@compiled
def _tangents(normal, one, two):
    """Two directions that complete a unit normal to a frame."""
    k = np.argmin(np.abs(normal))
    one[:] = -normal[k] * normal
    one[k] += 1.0
    one /= np.sqrt((one * one).sum())
    two[0] = normal[1] * one[2] - normal[2] * one[1]
    two[1] = normal[2] * one[0] - normal[0] * one[2]
    two[2] = normal[0] * one[1] - normal[1] * one[0]


@compiled
def _spread(node, points, radius, offsets, ring, length, way, queue, waiting, touched):
    """Write to `way` the lengths of ways along edges from a node to the vertices around, listed in `touched`; return
    their number. `way` is infinite, and no vertex `waiting`, before.
    """
    limit = (1.0 + DETOUR + DETOUR_FADE) * radius
    way[node], queue[0], touched[0] = 0.0, node, node
    first, queued, count, size = 0, 1, 1, len(queue)
    while queued > 0:
        v = queue[first]
        first, queued, waiting[v] = (first + 1) % size, queued - 1, False
        for e in range(offsets[v], offsets[v + 1]):
            w, far = ring[e], way[v] + length[e]
            if far >= limit or far >= way[w]:
                continue
            if way[w] == np.inf:
                touched[count] = w
                count += 1
            way[w] = far
            if not waiting[w]:
                waiting[w] = True
                queue[(first + queued) % size] = w
                queued += 1
    return count


@compiled
def shares(points, nodes, radius, offsets, ring):
    """Vertices, numbers of nodes and weights for all pairs of a vertex and a node that are near, by node."""
    n = len(points)
    length = np.empty(len(ring))
    for v in range(n):
        for e in range(offsets[v], offsets[v + 1]):
            square = 0.0
            for k in range(3):
                square += (points[v, k] - points[ring[e], k]) ** 2
            length[e] = np.sqrt(square)
    way, waiting = np.full(n, np.inf), np.zeros(n, np.bool_)
    queue, touched = np.empty(n, np.int64), np.empty(n, np.int64)
    vertices, numbers, values = np.empty(20 * n, np.int32), np.empty(20 * n, np.int32), np.empty(20 * n)
    at = 0
    for i in range(len(nodes)):
        node, reach = nodes[i], radius[i]
        count = _spread(node, points, reach, offsets, ring, length, way, queue, waiting, touched)
        if at + count > len(values):
            more = len(values) // 2 + count
            vertices = np.concatenate((vertices, np.empty(more, np.int32)))
            numbers = np.concatenate((numbers, np.empty(more, np.int32)))
            values = np.concatenate((values, np.empty(more)))
        for k in range(count):
            v = touched[k]
            square = 0.0
            for axis in range(3):
                square += (points[v, axis] - points[node, axis]) ** 2
            straight = np.sqrt(square)
            if straight < reach:
                share = _kernel(straight / reach, (way[v] - straight) / reach)
                if share > LEAST:
                    vertices[at], numbers[at], values[at] = v, i, share
                    at += 1
            way[v] = np.inf
    return vertices[:at], numbers[:at], values[:at]


@compiled
def _fit(point, count, found, nodes, share, normal, scale, frame, basis, matrix, right):
    """Replace the shares of nodes by their weights in the polynomial, of degree 2 in the tangent plane, that fits their
    values best by these shares; its value at the point is the sum of weighted values.
    """
    _tangents(normal, frame[0], frame[1])
    matrix[:], right[:] = 0.0, 0.0
    for i in range(count):
        x, y = 0.0, 0.0
        for k in range(3):
            offset = (nodes[found[i], k] - point[k]) / scale
            x += offset * frame[0, k]
            y += offset * frame[1, k]
        b = basis[i]
        b[0], b[1], b[2], b[3], b[4], b[5] = 1.0, x, y, x * x, np.sqrt(2.0) * x * y, y * y
        for p in range(TERMS):
            for q in range(p + 1):
                matrix[p, q] += share[i] * b[p] * b[q]
    for p in range(1, TERMS):
        matrix[p, p] += RIDGE_LINEAR if p < 3 else RIDGE_QUADRATIC
    right[0] = 1.0
    _solve(matrix, right)
    total = 0.0
    for i in range(count):
        fitted = 0.0
        for p in range(TERMS):
            fitted += basis[i, p] * right[p]
        share[i] *= fitted
        total += share[i]
    for i in range(count):
        share[i] /= total


@compiled
def fit_rows(points, nodes, normals, radius, indptr, indices, values):
    """Replace the shares of nodes at each vertex, in sparse rows, by their weights."""
    basis, matrix, right = np.empty((MOST, TERMS)), np.empty((TERMS, TERMS)), np.empty(TERMS)
    normal, frame = np.empty(3), np.empty((2, 3))
    for v in range(len(points)):
        begin, end = indptr[v], indptr[v + 1]
        if end == begin:
            continue
        values[begin + MOST : end] = 0.0
        scale, total = 0.0, 0.0
        normal[:] = 0.0
        for e in range(begin, end):
            for k in range(3):
                normal[k] += values[e] * normals[indices[e], k]
            scale += values[e] * radius[indices[e]]
            total += values[e]
        for e in range(begin, end):
            values[e] /= total
        normal /= max(np.sqrt((normal * normal).sum()), 1e-300)
        _fit(
            points[v], min(end - begin, MOST), indices[begin:end], nodes, values[begin:end], normal, scale / total,
            frame, basis, matrix, right,
        )  # fmt: skip


@compiled
def interpolate(indptr, indices, weights, values, out):
    """Sum weighted values (k, 3) for each vertex."""
    for v in range(len(out)):
        x, y, z = 0.0, 0.0, 0.0
        for e in range(indptr[v], indptr[v + 1]):
            i, w = indices[e], weights[e]
            x += w * values[i, 0]
            y += w * values[i, 1]
            z += w * values[i, 2]
        out[v, 0], out[v, 1], out[v, 2] = x, y, z
