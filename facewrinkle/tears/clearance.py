"""The room between a tear and other skin: the other lid of an eye that closes, or the other side of a fold."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np

from ..array_types import Array, IntArray
from ..geometry.closest_point import closest_in_triangle
from ..geometry.compilation import compiled
from ..geometry.interpolation import overlapping

SHARE = 0.45
"""Share of the way to other skin that a tear is high at most."""


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
    if not len(height):
        return height.copy()
    lowered, reach = np.empty_like(height), height.max() / SHARE
    beside = triangles[overlapping(points, triangles, bottom.min(axis=0) - reach, bottom.max(axis=0) + reach)]
    axis = int(np.ptp(bottom, axis=0).argmax())
    order = np.argsort(bottom[:, axis])
    least = 6e-8 * width  # nearer along its ray, a vertex only meets the triangle that it lies on
    limits = height[order]
    _limit_heights(bottom[order], rest[order], normals[order], axis, points[beside], at_rest[beside], least, limits)
    lowered[order] = limits
    return lowered


@compiled
def _limit_heights(bottom, rest, normals, axis, corners, corners_at_rest, least, height):
    """Lower heights so that every vertex stays less than half way to the skin ahead of it, and to other skin near it.

    Vertices are sorted along an axis, in which they spread most; triangles have these corners (k, 3, 3).
    """
    weights, ball, ball_at_rest = np.empty(3), np.empty(4), np.empty(4)
    asked, along, most = height.copy(), bottom[:, axis].copy(), height.max() / SHARE
    for j in range(len(corners)):
        ball_around(corners[j], ball)
        ball_around(corners_at_rest[j], ball_at_rest)
        reach = ball[3] + most
        first, last = np.searchsorted(along, ball[axis] - reach), np.searchsorted(along, ball[axis] + reach)
        for i in range(first, last):
            nearest = height[i] / SHARE
            away, apart = 0.0, 0.0
            for k in range(3):
                away += (bottom[i, k] - ball[k]) ** 2
                apart += (rest[i, k] - ball_at_rest[k]) ** 2
            if away > (nearest + ball[3]) ** 2:
                continue
            nearest = _met(bottom[i], normals[i], corners[j], least, nearest)
            if np.sqrt(apart) > ball_at_rest[3] + 4.0 * asked[i]:
                square = closest_in_triangle(bottom[i], corners[j, 0], corners[j, 1], corners[j, 2], weights)
                nearest = min(nearest, np.sqrt(square))
            height[i] = min(height[i], SHARE * nearest)


@compiled
def ball_around(corners, out):
    """Write the centre and the radius (4,) of a ball around the corners (3, 3) of a triangle."""
    largest = 0.0
    for k in range(3):
        out[k] = (corners[0, k] + corners[1, k] + corners[2, k]) / 3.0
    for c in range(3):
        square = 0.0
        for k in range(3):
            square += (corners[c, k] - out[k]) ** 2
        largest = max(largest, square)
    out[3] = np.sqrt(largest)


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
