"""Inner loops of the labels: the triangles that pixels show, and where lines of sight meet them."""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import njit


@njit(cache=True, inline="always")
def volume(a, b, c):
    """Six times the volume that three vectors span."""
    x = a[0] * (b[1] * c[2] - b[2] * c[1])
    return x + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@njit(cache=True)
def cover(points, triangles, intrinsic, near, first, numbers, inverse):
    """Write the number of each triangle, from `first`, into the pixels whose middles it covers in front of all before.

    `inverse` (h, w) is 1 / z of what a pixel shows, which is linear in the picture; 0 for nothing. Triangles that reach
    beyond the near plane are left out.
    """
    rows, columns = numbers.shape
    x, y, z = np.empty(len(points)), np.empty(len(points)), np.empty(len(points))
    for p in range(len(points)):
        z[p] = 1.0 / points[p, 2] if points[p, 2] > near else 0.0
        x[p] = intrinsic[0, 0] * points[p, 0] * z[p] + intrinsic[0, 2] - 0.5  # whole in the middle of a pixel
        y[p] = intrinsic[1, 1] * points[p, 1] * z[p] + intrinsic[1, 2] - 0.5
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if z[a] == 0.0 or z[b] == 0.0 or z[c] == 0.0:
            continue
        left, right = max(min(x[a], x[b], x[c]), 0.0), min(max(x[a], x[b], x[c]), columns - 1.0)
        top, bottom = max(min(y[a], y[b], y[c]), 0.0), min(max(y[a], y[b], y[c]), rows - 1.0)
        if np.ceil(left) > right or np.ceil(top) > bottom:
            continue
        bx, by, cx, cy = x[b] - x[a], y[b] - y[a], x[c] - x[a], y[c] - y[a]
        double = bx * cy - cx * by
        if double == 0.0:
            continue
        for i in range(int(np.ceil(top)), int(bottom) + 1):
            for j in range(int(np.ceil(left)), int(right) + 1):
                v = ((j - x[a]) * cy - cx * (i - y[a])) / double
                w = (bx * (i - y[a]) - (j - x[a]) * by) / double
                if v >= -1e-9 and w >= -1e-9 and v + w <= 1.0 + 1e-9:
                    nearness = z[a] + v * (z[b] - z[a]) + w * (z[c] - z[a])
                    if nearness > inverse[i, j]:
                        numbers[i, j], inverse[i, j] = first + t, nearness


@njit(cache=True)
def meet(points, corners, rays, weights, depth):
    """Barycentric weights (p, 3) and depths (p,) at which rays (p, 3) from the origin meet triangles (p, 3) of points.

    A ray meets the plane of a triangle where its volumes with two corners each tell the weights. A pixel at an edge may
    be given to the triangle beside the one that its ray meets: the place is moved to the edge.
    """
    for i in range(len(corners)):
        a, b, c = points[corners[i, 0]], points[corners[i, 1]], points[corners[i, 2]]
        ray = rays[i]
        u, v, w = volume(ray, b, c), volume(ray, c, a), volume(ray, a, b)
        total = u + v + w
        if abs(total) < 1e-300:
            u, v, w = 1.0, 1.0, 1.0
        elif total < 0.0:
            u, v, w = -u, -v, -w
        u, v, w = max(u, 0.0), max(v, 0.0), max(w, 0.0)
        total = u + v + w
        weights[i, 0], weights[i, 1], weights[i, 2] = u / total, v / total, w / total
        depth[i] = (u * a[2] + v * b[2] + w * c[2]) / total


@njit(cache=True)
def nearest(places, points, numbers, far, out):
    """Write the number of the point (k, 3) that is nearest to each place (p, 3), if it is within a distance."""
    for i in range(len(places)):
        best = far * far
        for k in range(len(points)):
            square = 0.0
            for c in range(3):
                square += (places[i, c] - points[k, c]) ** 2
            if square < best:
                best = square
                out[i] = numbers[k]
