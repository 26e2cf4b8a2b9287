"""Inner loops of tears: drops and streams kept off the skin."""

from __future__ import annotations

import numpy as np

from ..geometry.closest_point import closest_in_triangle
from ..geometry.compilation import compiled


@compiled
def farthest_behind(drop, skin, triangles, margin):
    """Return how far points (k, 3) must move along the third axis to be `margin` in front of the skin, at least 0."""
    lowest, highest = drop[0].copy(), drop[0].copy()
    for p in range(len(drop)):
        for k in range(3):
            lowest[k] = min(lowest[k], drop[p, k])
            highest[k] = max(highest[k], drop[p, k])
    out = 0.0
    for t in range(len(triangles)):
        a, b, c = skin[triangles[t, 0]], skin[triangles[t, 1]], skin[triangles[t, 2]]
        if (
            max(a[0], b[0], c[0]) < lowest[0]
            or min(a[0], b[0], c[0]) > highest[0]
            or max(a[1], b[1], c[1]) < lowest[1]
            or min(a[1], b[1], c[1]) > highest[1]
            or max(a[2], b[2], c[2]) + margin < lowest[2] + out
        ):
            continue
        det = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if det == 0.0:
            continue
        for p in range(len(drop)):
            x, y = drop[p, 0] - a[0], drop[p, 1] - a[1]
            v = (x * (c[1] - a[1]) - y * (c[0] - a[0])) / det
            w = (y * (b[0] - a[0]) - x * (b[1] - a[1])) / det
            if v >= 0.0 and w >= 0.0 and v + w <= 1.0:
                depth = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2])
                out = max(out, depth + margin - drop[p, 2])
    return out


@compiled
def limit_heights(bottom, rest, normals, vertex, triangle, corners, balls, balls_at_rest, least, height):
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
