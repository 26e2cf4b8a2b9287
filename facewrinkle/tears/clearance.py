"""The room between a tear and other skin: the other lid of an eye that closes, or the other side of a fold."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..array_types import Array, IntArray
from ..geometry.closest_point import closest_in_triangle
from ..geometry.compilation import compiled
from ..geometry.interpolation import balls_around, overlapping
from ..geometry.topology import pairs_of

REACH = 2.5
"""Distance from the skin, in heights of the tear, within which other skin is looked up."""


def kept_off(
    bottom: Array, rest: Array, normals: Array, height: Array, skin: tuple[Array, Array, IntArray], width: float
) -> Array:
    """Return heights so low that every vertex stays less than half way to skin ahead of it, and to other skin near it.

    Parameters
    ----------
    bottom, rest, normals : ndarray, shape (n, 3)
        Vertices on the skin, the same at rest, and unit normals.
    height : ndarray, shape (n,)
    skin : tuple of ndarray
        Its points, its points at rest, and its triangles. Other skin is far from a vertex at rest.
    width : float
        Width of the tear.

    Examples
    --------
    A vertex 2 mm high, with skin of the other side of a fold 1 mm above it that is far at rest:

    >>> flat = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    >>> points, at_rest = np.vstack([flat, flat + [0, 0, 1]]), np.vstack([flat, flat + [0, 50, 0]])
    >>> skin = points, at_rest, np.array([[0, 1, 2], [4, 3, 5]])
    >>> origin, up = np.zeros((1, 3)), np.array([[0.0, 0, 1]])
    >>> kept_off(origin, origin, up, np.array([2.0]), skin, width=3.0)
    array([0.45])
    """
    points, at_rest, triangles = skin
    lowered, reach = height.copy(), REACH * height.max(initial=0.0)
    beside = triangles[overlapping(points, triangles, bottom.min(axis=0) - reach, bottom.max(axis=0) + reach)]
    corners = points[beside]
    balls = balls_around(corners)
    near = cKDTree(bottom).query_ball_point(balls[:, :3], balls[:, 3] + reach, return_sorted=False)
    triangle, vertex = pairs_of(near)
    least = 6e-8 * width  # nearer along its ray, a vertex only meets the triangle that it lies on
    _limit_heights(
        bottom, rest, normals, vertex, triangle, corners, balls, balls_around(at_rest[beside]), least, lowered
    )
    return lowered


@compiled
def _limit_heights(bottom, rest, normals, vertex, triangle, corners, balls, balls_at_rest, least, height):
    """Lower heights so that every vertex stays less than half way to the skin ahead of it, and to other skin near it.

    Vertex `vertex[p]` is near triangle `triangle[p]` of those with these `corners` (k, 3, 3) and balls (k, 4), centres
    and radii, around them in the frame and at rest.
    """
    weights, asked = np.empty(3), height.copy()
    for p in range(len(vertex)):
        i, j = vertex[p], triangle[p]
        nearest = height[i] / 0.45
        away, apart = 0.0, 0.0
        for k in range(3):
            away += (bottom[i, k] - balls[j, k]) ** 2
            apart += (rest[i, k] - balls_at_rest[j, k]) ** 2
        if np.sqrt(away) - balls[j, 3] > nearest:
            continue
        nearest = _met(bottom[i], normals[i], corners[j], least, nearest)
        if np.sqrt(apart) > balls_at_rest[j, 3] + 4.0 * asked[i]:
            square = closest_in_triangle(bottom[i], corners[j, 0], corners[j, 1], corners[j, 2], weights)
            nearest = min(nearest, np.sqrt(square))
        height[i] = min(height[i], 0.45 * nearest)


@compiled
def _met(p, d, corners, least, most):
    """Return the x at which the ray p + x d meets a triangle (3, 3); `most` if it does not."""
    px, py, pz, dx, dy, dz = p[0], p[1], p[2], d[0], d[1], d[2]
    ax, ay, az = corners[0]
    ex, ey, ez = corners[1, 0] - ax, corners[1, 1] - ay, corners[1, 2] - az
    fx, fy, fz = corners[2, 0] - ax, corners[2, 1] - ay, corners[2, 2] - az
    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    det = -(dx * nx + dy * ny + dz * nz)
    if det == 0.0:
        return most
    qx, qy, qz = px - ax, py - ay, pz - az
    x = (qx * nx + qy * ny + qz * nz) / det
    if x < least or x > most:
        return most
    gx, gy, gz = qy * dz - qz * dy, qz * dx - qx * dz, qx * dy - qy * dx
    u, v = (fx * gx + fy * gy + fz * gz) / det, -(ex * gx + ey * gy + ez * gz) / det
    if u < -1e-9 or v < -1e-9 or u + v > 1.0 + 1e-9:
        return most
    return x
