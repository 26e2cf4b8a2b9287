"""Machine code for interpolation from some of the vertices of a mesh to all."""

from __future__ import annotations

from heapq import heappop, heappush

import numpy as np
from numba import njit

MOST = 96
"""The most nodes that are looked at for a vertex."""

RINGS = 3
"""Rings of nodes around the nearest one that may have a weight."""

SINGULAR = 0.05
"""Distance from a node, relative to its radius, within which its weight grows no further."""

DETOUR, DETOUR_FADE = 0.7, 0.7
"""Nodes count in full if the way to them on the surface is longer than the straight line by less than the first, and
not at all from the sum of both on; relative to half the radius of the node.
"""

RIDGE_LINEAR, RIDGE_QUADRATIC = 1e-9, 1e-4
"""Penalties that keep the polynomials determinate where nodes are few or on a line."""

LEAST = 1e-9
"""Smaller weights are left out."""

TERMS = 6
"""Of a polynomial of degree 2 in the plane."""


@njit(cache=True)
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


@njit(cache=True)
def _gather(seed, offsets, ring, mark, stamp, found):
    """Write the nodes within some rings of a seed to `found`; return their count and that of the first ring."""
    found[0], count, begin, first = seed, 1, 0, 1
    mark[seed] = stamp
    for level in range(RINGS):
        end = count
        for i in range(begin, end):
            for e in range(offsets[found[i]], offsets[found[i] + 1]):
                w = ring[e]
                if mark[w] != stamp and count < len(found):
                    mark[w] = stamp
                    found[count] = w
                    count += 1
        begin = end
        if level == 0:
            first = count
    return count, first


@njit(cache=True)
def _links(count, found, offsets, ring, place, points, pairs, length):
    """Write the edges between gathered nodes to `pairs`, and their lengths; return their number."""
    for i in range(count):
        place[found[i]] = i
    n = 0
    for i in range(count):
        a = found[i]
        for e in range(offsets[a], offsets[a + 1]):
            j = place[ring[e]]
            if j > i and n < len(pairs):
                pairs[n, 0], pairs[n, 1] = i, j
                length[n] = np.sqrt(((points[a] - points[ring[e]]) ** 2).sum())
                n += 1
    for i in range(count):
        place[found[i]] = -1
    return n


@njit(cache=True)
def _kernel(d, detour):
    """Weight at a distance d < 1 from a node; smooth, 0 at 1, large near 0."""
    t = min(max((detour - DETOUR) / DETOUR_FADE, 0.0), 1.0)
    fade = 1.0 - t * t * (3.0 - 2.0 * t)
    return fade * (1.0 - d) ** 4 * (4.0 * d + 1.0) / (d * d + SINGULAR * SINGULAR)


@njit(cache=True)
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


@njit(cache=True)
def _tangents(normal, one, two):
    """Two directions that complete a unit normal to a frame."""
    k = np.argmin(np.abs(normal))
    one[:] = -normal[k] * normal
    one[k] += 1.0
    one /= np.sqrt((one * one).sum())
    two[0] = normal[1] * one[2] - normal[2] * one[1]
    two[1] = normal[2] * one[0] - normal[0] * one[2]
    two[2] = normal[0] * one[1] - normal[1] * one[0]


@njit(cache=True)
def _ways(point, count, first, found, nodes, pairs, length, n_links, straight, way):
    """Distances of the gathered nodes from a point: straight, and over the edges between them from the first ring."""
    for i in range(count):
        square = 0.0
        for k in range(3):
            square += (point[k] - nodes[found[i], k]) ** 2
        straight[i] = np.sqrt(square)
        way[i] = straight[i] if i < first else np.inf
    for _ in range(RINGS):
        for e in range(n_links):
            i, j = pairs[e, 0], pairs[e, 1]
            way[j] = min(way[j], way[i] + length[e])
            way[i] = min(way[i], way[j] + length[e])


@njit(cache=True)
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


@njit(cache=True)
def weights(points, seeds, order, nodes, normals, radius, offsets, ring):
    """Rows (indptr, indices, values) of the weights of nodes at each vertex, in an order of the vertices by seed."""
    mark, place = np.full(len(nodes), -1, np.int64), np.full(len(nodes), -1, np.int64)
    found, chosen = np.empty(MOST, np.int64), np.empty(MOST, np.int64)
    straight, way, share = np.empty(MOST), np.empty(MOST), np.empty(MOST)
    pairs, length = np.empty((6 * MOST, 2), np.int64), np.empty(6 * MOST)
    basis, matrix, right = np.empty((MOST, TERMS)), np.empty((TERMS, TERMS)), np.empty(TERMS)
    normal, frame = np.empty(3), np.empty((2, 3))
    indptr = np.zeros(len(order) + 1, np.int64)
    indices, values = np.empty(20 * len(order) + MOST, np.uint32), np.empty(20 * len(order) + MOST)
    before, count, first, n_links, at = -1, 0, 0, 0, 0
    for row in range(len(order)):
        v = order[row]
        seed = seeds[v]
        if seed != before:
            count, first = _gather(seed, offsets, ring, mark, seed, found)
            n_links = _links(count, found, offsets, ring, place, nodes, pairs, length)
            before = seed
        _ways(points[v], count, first, found, nodes, pairs, length, n_links, straight, way)
        kept, scale, total = 0, 0.0, 0.0
        normal[:] = 0.0
        for i in range(count):
            w = found[i]
            if straight[i] >= radius[w]:
                continue
            weight = _kernel(straight[i] / radius[w], 2.0 * (way[i] - straight[i]) / radius[w])
            if weight > LEAST:
                chosen[kept], share[kept] = w, weight
                for k in range(3):
                    normal[k] += weight * normals[w, k]
                scale += weight * radius[w]
                total += weight
                kept += 1
        if kept == 0:  # as far off the nodes as no vertex of a mesh that was decimated to them is
            kept, chosen[0], share[0] = 1, seed, 1.0
        else:
            for i in range(kept):
                share[i] /= total
            normal /= max(np.sqrt((normal * normal).sum()), 1e-300)
            _fit(points[v], kept, chosen, nodes, share, normal, scale / total, frame, basis, matrix, right)
        if at + kept > len(indices):
            indices = np.concatenate((indices, np.empty(len(indices) // 2, np.uint32)))
            values = np.concatenate((values, np.empty(len(values) // 2)))
        for i in range(kept):
            indices[at], values[at] = chosen[i], share[i]
            at += 1
        indptr[row + 1] = at
    return indptr, indices[:at].copy(), values[:at].copy()


@njit(cache=True)
def interpolate(order, indptr, indices, weights, values, out):
    """Sum weighted values (k, 3) for each row, which is that of a vertex."""
    for row in range(len(order)):
        x, y, z = 0.0, 0.0, 0.0
        for e in range(indptr[row], indptr[row + 1]):
            i, w = indices[e], weights[e]
            x += w * values[i, 0]
            y += w * values[i, 1]
            z += w * values[i, 2]
        v = order[row]
        out[v, 0], out[v, 1], out[v, 2] = x, y, z
