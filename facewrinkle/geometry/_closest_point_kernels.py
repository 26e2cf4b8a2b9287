"""Machine code for closest points."""

from __future__ import annotations

import numpy as np

from .compilation import compiled


@compiled
def closest(points, triangles, query):
    """Triangle, barycentric coordinates and distance of the point of a mesh that is closest to `query`."""
    best, found = np.inf, 0
    weights, w = np.empty(3), np.empty(3)
    for f in range(triangles.shape[0]):
        a, b, c = points[triangles[f, 0]], points[triangles[f, 1]], points[triangles[f, 2]]
        distance = closest_in_triangle(query, a, b, c, w)
        if distance < best:
            best, found = distance, f
            for k in range(3):  # as a whole, numba would compile the text of an error for it: three seconds
                weights[k] = w[k]
    return found, weights, np.sqrt(best)


@compiled
def closest_in_triangle(p, a, b, c, weights):
    """Squared distance of p from the triangle abc; the barycentric coordinates of the closest point go to `weights`.

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
            weights[0], weights[1], weights[2] = 1.0 - v - w, v, w
            distance = 0.0
            for k in range(3):
                distance += (p[k] - a[k] - v * (b[k] - a[k]) - w * (c[k] - a[k])) ** 2
            return distance
    on_bc = on_ca = bc = ca = 0.0
    for k in range(3):
        on_bc += (p[k] - b[k]) * (c[k] - b[k])
        on_ca += (p[k] - c[k]) * (a[k] - c[k])
        bc += (c[k] - b[k]) ** 2
        ca += (a[k] - c[k]) ** 2
    r, s, t = _share(d20, d00), _share(on_bc, bc), _share(on_ca, ca)
    from_ab = from_bc = from_ca = 0.0
    for k in range(3):
        from_ab += (p[k] - a[k] - r * (b[k] - a[k])) ** 2
        from_bc += (p[k] - b[k] - s * (c[k] - b[k])) ** 2
        from_ca += (p[k] - c[k] - t * (a[k] - c[k])) ** 2
    if from_ab <= from_bc and from_ab <= from_ca:
        weights[0], weights[1], weights[2] = 1.0 - r, r, 0.0
        return from_ab
    if from_bc <= from_ca:
        weights[0], weights[1], weights[2] = 0.0, 1.0 - s, s
        return from_bc
    weights[0], weights[1], weights[2] = t, 0.0, 1.0 - t
    return from_ca


@compiled
def _share(along, length):
    """Position on a side, from 0 to 1, given the dot product of an offset with the side, and the side squared."""
    return 0.0 if length == 0.0 else min(max(along / length, 0.0), 1.0)
