"""Machine code for closest points."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def closest(points, triangles, query):
    """Triangle, barycentric coordinates and distance of the point of a mesh that is closest to `query`."""
    best, found = np.inf, 0
    weights = np.empty(3)
    for f in range(triangles.shape[0]):
        u, v, w, distance = barycentric_of_closest(
            query, points[triangles[f, 0]], points[triangles[f, 1]], points[triangles[f, 2]]
        )
        if distance < best:
            best, found = distance, f
            weights[0], weights[1], weights[2] = u, v, w
    return found, weights, np.sqrt(best)


@njit(cache=True)
def closest_in_triangle(p, a, b, c, out):
    """Squared distance of p from the triangle abc; the closest point goes to `out`."""
    _, v, w, distance = barycentric_of_closest(p, a, b, c)
    for k in range(3):
        out[k] = a[k] + v * (b[k] - a[k]) + w * (c[k] - a[k])
    return distance


@njit(cache=True)
def barycentric_of_closest(p, a, b, c):
    """Barycentric coordinates of the point of triangle abc that is closest to p, and the squared distance.

    The triangle may be degenerate.
    """
    d00 = d01 = d11 = d20 = d21 = 0.0
    for k in range(3):  # numbers, not small arrays, which would be allocated
        ab, ac, ap = b[k] - a[k], c[k] - a[k], p[k] - a[k]
        d00 += ab * ab
        d01 += ab * ac
        d11 += ac * ac
        d20 += ap * ab
        d21 += ap * ac
    determinant = d00 * d11 - d01 * d01
    if determinant > 0.0:
        v, w = (d11 * d20 - d01 * d21) / determinant, (d00 * d21 - d01 * d20) / determinant
        if v >= 0.0 and w >= 0.0 and v + w <= 1.0:
            distance = 0.0
            for k in range(3):
                distance += (p[k] - a[k] - v * (b[k] - a[k]) - w * (c[k] - a[k])) ** 2
            return 1.0 - v - w, v, w, distance
    t, distance = _closest_on_segment(p, a, b)
    u, v, w = 1.0 - t, t, 0.0
    t, other = _closest_on_segment(p, b, c)
    if other < distance:
        u, v, w, distance = 0.0, 1.0 - t, t, other
    t, other = _closest_on_segment(p, c, a)
    if other < distance:
        u, v, w, distance = t, 0.0, 1.0 - t, other
    return u, v, w, distance


@njit(cache=True)
def _closest_on_segment(p, a, b):
    """Share of the way from a to b of the point closest to p, and its squared distance."""
    length = along = 0.0
    for k in range(3):
        length += (b[k] - a[k]) ** 2
        along += (p[k] - a[k]) * (b[k] - a[k])
    t = 0.0 if length == 0.0 else min(max(along / length, 0.0), 1.0)
    distance = 0.0
    for k in range(3):
        distance += (p[k] - a[k] - t * (b[k] - a[k])) ** 2
    return t, distance
