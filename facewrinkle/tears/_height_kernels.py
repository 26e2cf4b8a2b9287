"""Inner loops of how high a tear may stand: never in other skin."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..geometry._closest_point_kernels import closest_in_triangle
from ._subdivision_kernels import distance, overlapping


@njit(cache=True)
def limit_heights(base, rest, normals, height, under, skin, skin_rest, triangles, cell):
    """Lower heights so that no vertex goes half the way to the skin that it would meet, nor to other skin near it.

    Other skin, such as the other lid of an eye that closes, is far from the vertex at rest. `under` is the triangle of
    the skin that a vertex stands on; those around it are looked up in a grid of this cell size, once for all vertices
    in a row that stand on it.
    """
    low, high, tallest = base[0].copy(), base[0].copy(), np.zeros(len(triangles))
    for i in range(len(base)):
        tallest[under[i]] = max(tallest[under[i]], height[i])
    for t in range(len(triangles)):
        if tallest[t] > 0.0:
            for s in range(3):
                for k in range(3):
                    x = skin[triangles[t, s], k]
                    low[k], high[k] = min(low[k], x - 2.5 * tallest[t]), max(high[k], x + 2.5 * tallest[t])
    near = overlapping(skin, triangles, low, high)
    bounds, home = np.empty((len(near), 6)), np.zeros((len(near), 4))
    boxes, shape = np.empty((len(near), 6), np.int32), np.empty(3, np.int64)
    for k in range(3):
        shape[k] = int((high[k] - low[k]) / cell) + 1
    for i in range(len(near)):
        a, b, c = triangles[near[i], 0], triangles[near[i], 1], triangles[near[i], 2]
        for k in range(3):
            x, y, z = skin[a, k], skin[b, k], skin[c, k]
            bounds[i, k], bounds[i, 3 + k] = min(x, y, z), max(x, y, z)
            boxes[i, 2 * k] = int(max(bounds[i, k] - low[k], 0.0) / cell)
            boxes[i, 2 * k + 1] = int((min(bounds[i, 3 + k], high[k]) - low[k]) / cell)
            home[i, k] = (skin_rest[a, k] + skin_rest[b, k] + skin_rest[c, k]) / 3.0
        for v in (a, b, c):
            home[i, 3] = max(home[i, 3], distance(home[i, 0], home[i, 1], home[i, 2], skin_rest, v))
    start, content = _sorted_in(boxes, shape)
    least = 6e-08 * cell  # nearer is the triangle that the ray starts from
    weights, seen, around = np.empty(3), np.full(len(near), -1, np.int32), np.empty(len(near), np.int32)
    rising, here, count, boxed = np.empty(len(near), np.bool_), -1, 0, np.empty((len(near), 6))
    nx, ny, nz = 0.0, 0.0, 0.0
    for i in range(len(base)):
        if under[i] != here:
            here = under[i]
            nx, ny, nz = _normal(skin, triangles[here, 0], triangles[here, 1], triangles[here, 2])
            count = _around(
                here, 2.5 * tallest[here], nx, ny, nz, (start, content, low, shape, cell), skin, triangles, near,
                bounds, least, seen, around, rising, boxed,
            )  # fmt: skip
        px, py, pz, dx, dy, dz = base[i, 0], base[i, 1], base[i, 2], normals[i, 0], normals[i, 1], normals[i, 2]
        leaning = dx * nx + dy * ny + dz * nz <= 0.0
        nearest = 3.0 * height[i]
        for at in range(count):
            x = max(boxed[at, 0] - px, px - boxed[at, 3], 0.0)
            y = max(boxed[at, 1] - py, py - boxed[at, 4], 0.0)
            z = max(boxed[at, 2] - pz, pz - boxed[at, 5], 0.0)
            if x * x + y * y + z * z > nearest * nearest:
                continue
            j = around[at]
            t = near[j]
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            if rising[at] or leaning:  # what lies below the plane of its own triangle is never met
                nearest = _met(px, py, pz, dx, dy, dz, skin, a, b, c, least, nearest)
            if distance(home[j, 0], home[j, 1], home[j, 2], rest, i) > home[j, 3] + 4.0 * height[i]:
                nearest = min(nearest, np.sqrt(closest_in_triangle(base[i], skin[a], skin[b], skin[c], weights)))
        height[i] = min(height[i], 0.45 * nearest)


@njit(cache=True)
def _around(here, reach, nx, ny, nz, grid, skin, triangles, near, bounds, least, seen, around, rising, boxed):
    """What may be met within `reach` of triangle `here` of normal n: how many there are, and which rise above it.

    What is joined to it and does not rise above its plane is never met.
    """
    start, content, low, shape, cell = grid
    a, b, c = triangles[here, 0], triangles[here, 1], triangles[here, 2]
    x0, x1, i0, i1 = _span(skin, a, b, c, 0, reach, low, cell)
    y0, y1, j0, j1 = _span(skin, a, b, c, 1, reach, low, cell)
    z0, z1, k0, k1 = _span(skin, a, b, c, 2, reach, low, cell)
    count = 0
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            row = (i * shape[1] + j) * shape[2]
            for at in range(start[row + k0], start[row + k1 + 1]):
                other = content[at]
                if seen[other] == here:
                    continue
                seen[other] = here
                apart = (bounds[other, 0] > x1) | (bounds[other, 1] > y1) | (bounds[other, 2] > z1)
                apart |= (bounds[other, 3] < x0) | (bounds[other, 4] < y0) | (bounds[other, 5] < z0)
                if apart or near[other] == here:
                    continue
                above, joined = False, False
                for s in range(3):
                    v = triangles[near[other], s]
                    up = (skin[v, 0] - skin[a, 0]) * nx + (skin[v, 1] - skin[a, 1]) * ny
                    above |= up + (skin[v, 2] - skin[a, 2]) * nz > least
                    joined |= (v == a) | (v == b) | (v == c)
                if above or not joined:
                    around[count], rising[count] = other, above
                    for k in range(6):
                        boxed[count, k] = bounds[other, k]
                    count += 1
    return count


@njit(cache=True)
def _span(points, a, b, c, k, reach, low, cell):
    """What a triangle and `reach` around it take up along axis k, and the cells of a grid there."""
    x, y, z = points[a, k], points[b, k], points[c, k]
    first, last = min(x, y, z) - reach, max(x, y, z) + reach
    return first, last, int((first - low[k]) / cell), int((last - low[k]) / cell)


@njit(cache=True)
def _sorted_in(boxes, shape):
    """What is in each cell of a grid: where it starts, and the numbers of the boxes (n, 6)."""
    start = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int32)
    where, content = start, np.empty(0, np.int32)
    for fill in range(2):
        if fill:
            for i in range(1, len(start)):
                start[i] += start[i - 1]
            where, content = start.copy(), np.empty(start[-1], np.int32)
        for i in range(len(boxes)):
            for x in range(boxes[i, 0], boxes[i, 1] + 1):
                for y in range(boxes[i, 2], boxes[i, 3] + 1):
                    for z in range(boxes[i, 4], boxes[i, 5] + 1):
                        g = (x * shape[1] + y) * shape[2] + z
                        if fill:
                            content[where[g]] = i
                            where[g] += 1
                        else:
                            start[g + 1] += 1
    return start, content


@njit(cache=True)
def _normal(points, i, j, k):
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    ex, ey, ez = points[j, 0] - ax, points[j, 1] - ay, points[j, 2] - az
    fx, fy, fz = points[k, 0] - ax, points[k, 1] - ay, points[k, 2] - az
    x, y, z = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    size = np.sqrt(x * x + y * y + z * z) + 1e-300
    return x / size, y / size, z / size


@njit(cache=True)
def _met(px, py, pz, dx, dy, dz, skin, i, j, k, least, most):
    """Distance along the ray p + x d at which it meets the triangle of vertices i, j, k; `most` where it does not."""
    ax, ay, az = skin[i, 0], skin[i, 1], skin[i, 2]
    ex, ey, ez = skin[j, 0] - ax, skin[j, 1] - ay, skin[j, 2] - az
    fx, fy, fz = skin[k, 0] - ax, skin[k, 1] - ay, skin[k, 2] - az
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
