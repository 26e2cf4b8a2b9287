"""Machine code for closest points."""

from __future__ import annotations

import numpy as np
from numba import njit


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
