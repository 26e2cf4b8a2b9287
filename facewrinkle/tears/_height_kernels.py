"""Inner loops that limit the height of a tear, so that it never enters other skin."""

from __future__ import annotations

import numpy as np

from ..geometry._closest_point_kernels import closest_in_triangle
from ..geometry.compilation import njit
from ._subdivision_kernels import distance, overlapping

REACH = 2.5
"""Distance from the skin, in heights of the tear, within which other skin is looked up."""

SAME = 6e-08
"""Distance along a ray, in cells of the grid, below which it only meets the triangle that it starts on."""


@njit(cache=True)
def limit_heights(bottom, rest, normals, height, under, skin, cell):
    """Lower heights so that every vertex stays less than half way to the skin ahead of it, and to other skin near it.

    Other skin, such as the other lid of an eye that closes, is far from the vertex at rest. `under` is the triangle of
    the skin that a vertex of the bottom stands on; those around it are looked up in a grid of this cell size, once for
    all vertices in a row that stand on it. `skin` is its points, its points at rest, and its triangles.
    """
    points, _, triangles = skin
    tallest, low, high = _tallest(bottom, height, under, points, triangles)
    near = overlapping(points, triangles, low, high)
    bounds, balls, boxes, shape = _boxes(near, skin, low, high, cell)
    grid, least = (*_cell_lists(boxes, shape), low, shape, cell), SAME * cell
    seen, around = np.full(len(near), -1, np.int32), np.empty(len(near), np.int32)
    rising, boxed = np.empty(len(near), np.bool_), np.empty((len(near), 6))
    here, count, up, weights = -1, 0, np.zeros(3), np.empty(3)
    for i in range(len(bottom)):
        if under[i] != here:
            here = under[i]
            up[:] = _normal(points, triangles[here, 0], triangles[here, 1], triangles[here, 2])
            count = _around(
                here, REACH * tallest[here], up, grid, points, triangles, near, bounds, least,
                (seen, around, rising, boxed),
            )  # fmt: skip
        px, py, pz, dx, dy, dz = bottom[i, 0], bottom[i, 1], bottom[i, 2], normals[i, 0], normals[i, 1], normals[i, 2]
        leaning = dx * up[0] + dy * up[1] + dz * up[2] <= 0.0
        nearest = 3.0 * height[i]
        for at in range(count):
            x = max(boxed[at, 0] - px, px - boxed[at, 3], 0.0)
            y = max(boxed[at, 1] - py, py - boxed[at, 4], 0.0)
            z = max(boxed[at, 2] - pz, pz - boxed[at, 5], 0.0)
            if x * x + y * y + z * z > nearest * nearest:
                continue
            j = around[at]
            a, b, c = triangles[near[j], 0], triangles[near[j], 1], triangles[near[j], 2]
            if rising[at] or leaning:  # below the plane of its own triangle nothing is ever met
                nearest = _met(px, py, pz, dx, dy, dz, points, a, b, c, least, nearest)
            if distance(balls[j, 0], balls[j, 1], balls[j, 2], rest, i) > balls[j, 3] + 4.0 * height[i]:
                away = closest_in_triangle(bottom[i], points[a], points[b], points[c], weights)
                nearest = min(nearest, np.sqrt(away))
        height[i] = min(height[i], 0.45 * nearest)


@njit(cache=True)
def _tallest(bottom, height, under, points, triangles):
    """Greatest height on each triangle of the skin, and the corners of a box around all that it may reach."""
    low, high, tallest = bottom[0].copy(), bottom[0].copy(), np.zeros(len(triangles))
    for i in range(len(bottom)):
        tallest[under[i]] = max(tallest[under[i]], height[i])
    for t in range(len(triangles)):
        if tallest[t] > 0.0:
            for s in range(3):
                for k in range(3):
                    x = points[triangles[t, s], k]
                    low[k], high[k] = min(low[k], x - REACH * tallest[t]), max(high[k], x + REACH * tallest[t])
    return tallest, low, high


@njit(cache=True)
def _boxes(near, skin, low, high, cell):
    """Bounds (n, 6) of triangles, balls (n, 4) around them at rest, their cells (n, 6), and the shape of the grid."""
    points, rest, triangles = skin
    bounds, balls = np.empty((len(near), 6)), np.zeros((len(near), 4))
    boxes, shape = np.empty((len(near), 6), np.int32), np.empty(3, np.int64)
    for k in range(3):
        shape[k] = int((high[k] - low[k]) / cell) + 1
    for i in range(len(near)):
        a, b, c = triangles[near[i], 0], triangles[near[i], 1], triangles[near[i], 2]
        for k in range(3):
            x, y, z = points[a, k], points[b, k], points[c, k]
            bounds[i, k], bounds[i, 3 + k] = min(x, y, z), max(x, y, z)
            boxes[i, 2 * k] = int(max(bounds[i, k] - low[k], 0.0) / cell)
            boxes[i, 2 * k + 1] = int((min(bounds[i, 3 + k], high[k]) - low[k]) / cell)
            balls[i, k] = (rest[a, k] + rest[b, k] + rest[c, k]) / 3.0
        for v in (a, b, c):
            balls[i, 3] = max(balls[i, 3], distance(balls[i, 0], balls[i, 1], balls[i, 2], rest, v))
    return bounds, balls, boxes, shape


@njit(cache=True)
def _around(here, reach, up, grid, points, triangles, near, bounds, least, found):
    """Find the triangles that may be met within `reach` of triangle `here` of normal `up`; return how many there are.

    `found` gets the triangle that last saw each, and for those found their numbers, True where one rises above triangle
    `here`, and their bounds. A triangle that touches `here` and does not rise above its plane is never met.
    """
    start, content, low, shape, cell = grid
    seen, around, rising, boxed = found
    a, b, c, nx, ny, nz = triangles[here, 0], triangles[here, 1], triangles[here, 2], up[0], up[1], up[2]
    x0, x1, i0, i1 = _span(points, a, b, c, 0, reach, low, cell)
    y0, y1, j0, j1 = _span(points, a, b, c, 1, reach, low, cell)
    z0, z1, k0, k1 = _span(points, a, b, c, 2, reach, low, cell)
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
                above, touching = False, False
                for s in range(3):
                    v = triangles[near[other], s]
                    rise = (points[v, 0] - points[a, 0]) * nx + (points[v, 1] - points[a, 1]) * ny
                    above |= rise + (points[v, 2] - points[a, 2]) * nz > least
                    touching |= (v == a) | (v == b) | (v == c)
                if above or not touching:
                    around[count], rising[count] = other, above
                    for k in range(6):
                        boxed[count, k] = bounds[other, k]
                    count += 1
    return count


@njit(cache=True)
def _span(points, a, b, c, k, reach, low, cell):
    """Return the least and greatest coordinate k within `reach` of a triangle, and the cells of a grid there."""
    x, y, z = points[a, k], points[b, k], points[c, k]
    first, last = min(x, y, z) - reach, max(x, y, z) + reach
    return first, last, int((first - low[k]) / cell), int((last - low[k]) / cell)


@njit(cache=True)
def _cell_lists(boxes, shape):
    """Lists of the boxes (n, 6) in each cell of a grid: the first entry of each, and the entries, box numbers."""
    start = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int32)
    free, content = start, np.empty(0, np.int32)
    for fill in range(2):
        if fill:
            for i in range(1, len(start)):
                start[i] += start[i - 1]
            free, content = start.copy(), np.empty(start[-1], np.int32)
        for i in range(len(boxes)):
            for x in range(boxes[i, 0], boxes[i, 1] + 1):
                for y in range(boxes[i, 2], boxes[i, 3] + 1):
                    for z in range(boxes[i, 4], boxes[i, 5] + 1):
                        g = (x * shape[1] + y) * shape[2] + z
                        if fill:
                            content[free[g]] = i
                            free[g] += 1
                        else:
                            start[g + 1] += 1
    return start, content


@njit(cache=True)
def _normal(points, i, j, k):
    """Unit normal of a triangle."""
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    ex, ey, ez = points[j, 0] - ax, points[j, 1] - ay, points[j, 2] - az
    fx, fy, fz = points[k, 0] - ax, points[k, 1] - ay, points[k, 2] - az
    x, y, z = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    size = np.sqrt(x * x + y * y + z * z) + 1e-300
    return x / size, y / size, z / size


@njit(cache=True)
def _met(px, py, pz, dx, dy, dz, points, i, j, k, least, most):
    """Return the x at which the ray p + x d meets the triangle of vertices i, j, k; `most` if it does not."""
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    ex, ey, ez = points[j, 0] - ax, points[j, 1] - ay, points[j, 2] - az
    fx, fy, fz = points[k, 0] - ax, points[k, 1] - ay, points[k, 2] - az
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
