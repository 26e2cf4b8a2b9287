"""Machine code for normals, interpolation, heights, and the triangles of a mesh that are too coarse.

Numbers of vertices are made unsigned in the loops of every frame: none counts from the end, and looking for that
takes a third of the time.
"""

from __future__ import annotations

import numpy as np

from .compilation import compiled
from .equations import split_criterion


@compiled(inline="always")
def area_vector(points, i, j, k):
    """Normal of the triangle of three points, twice its area long."""
    ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@compiled
def accumulate(points, triangles, out):
    """Sum the normals of the triangles at each vertex, weighted by area; not normalised."""
    out[:] = 0.0
    for f in range(triangles.shape[0]):
        i, j, k = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        nx, ny, nz = area_vector(points, i, j, k)
        for v in (i, j, k):
            out[v, 0] += nx
            out[v, 1] += ny
            out[v, 2] += nz


@compiled
def double_areas(points, triangles, out):
    """Twice the area of the triangles at each vertex."""
    out[:] = 0.0
    for f in range(triangles.shape[0]):
        i, j, k = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        nx, ny, nz = area_vector(points, i, j, k)
        area = np.sqrt(nx * nx + ny * ny + nz * nz)
        out[i] += area
        out[j] += area
        out[k] += area


@compiled
def normalise(vectors):
    """Scale vectors (n, 3) to unit length in place; zero vectors stay."""
    for v in range(vectors.shape[0]):
        x, y, z = vectors[v, 0], vectors[v, 1], vectors[v, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            vectors[v, 0] = x / length
            vectors[v, 1] = y / length
            vectors[v, 2] = z / length


@compiled
def interpolate(values, corners, barycentric, out):
    """Linear interpolation of values (n0, d) at points with three corners and weights each."""
    for i in range(corners.shape[0]):
        a, b, c = np.uint32(corners[i, 0]), np.uint32(corners[i, 1]), np.uint32(corners[i, 2])
        wa, wb, wc = barycentric[i, 0], barycentric[i, 1], barycentric[i, 2]
        for k in range(values.shape[1]):
            out[i, k] = wa * values[a, k] + wb * values[b, k] + wc * values[c, k]


@compiled
def take_finest(own_spacing, own_across, own_active, spacing, across, active):
    """Take over where a layer is active, and the spacing that it needs at each vertex there, where it is finer."""
    for v in range(len(spacing)):
        if own_active[v] and own_spacing[v] < spacing[v]:
            spacing[v] = own_spacing[v]
            for c in range(3):
                across[v, c] = own_across[v, c]
        active[v] |= own_active[v]


@compiled
def excesses(triangles, points, need, across):
    """The longest edge (k,) of each triangle across the folds, relative to the spacing (n,) that its ends need."""
    steps, out = np.zeros_like(across), np.zeros(len(triangles))
    for v in range(len(need)):
        if need[v] < np.inf:
            for c in range(3):
                steps[v, c] = across[v, c] / need[v]
    for f in range(len(triangles)):
        a, b, c = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        for i, j in ((a, b), (b, c), (c, a)):
            x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            first = abs(x * steps[i, 0] + y * steps[i, 1] + z * steps[i, 2])
            second = abs(x * steps[j, 0] + y * steps[j, 1] + z * steps[j, 2])
            out[f] = max(out[f], first, second)
    return out


@compiled
def bends(triangles, normals, rest_normals, active):
    """The largest bend, Eq. 19, over the edges of each triangle (m,) and vertex (n,), where any end is active.

    The denominator is bounded, for rest normals that are nearly orthogonal.
    """
    out, largest = np.zeros(len(triangles)), np.zeros(len(normals))
    for f in range(len(triangles)):
        a, b, c = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        for i, j in ((a, b), (b, c), (c, a)):
            if active[i] or active[j]:
                rest = rest_normals[i, 0] * rest_normals[j, 0]
                rest += rest_normals[i, 1] * rest_normals[j, 1] + rest_normals[i, 2] * rest_normals[j, 2]
                now = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2]
                gamma = split_criterion(rest, now)
                out[f] = max(out[f], gamma)
                largest[i] = max(largest[i], gamma)
                largest[j] = max(largest[j], gamma)
    return out, largest


@compiled
def interpolate_corners(values, base, triangles, roots, hosts, weights, out):
    """Interpolate values (m0, 3, d) at corners of base triangles for the corners (m, 3, d) of the triangles in them.

    Vertex v lies in the base triangle with the vertices hosts[v], at weights[v]; that triangle may be a neighbour of
    the root of a triangle at v. Sums run over the corners of the root: on an edge one of the three terms is 0, so
    that both sides of the edge are rounded alike.
    """
    for t in range(len(triangles)):
        root = roots[t]
        for k in range(3):
            v = triangles[t, k]
            for c in range(values.shape[2]):
                out[t, k, c] = 0.0
            for j in range(3):
                share = 0.0
                for i in range(3):
                    if hosts[v, i] == base[root, j]:
                        share += weights[v, i]
                for c in range(values.shape[2]):
                    out[t, k, c] += share * values[root, j, c]


@compiled
def heights_above(place, up, local, triangles, step, deep, tolerance, out):
    """Heights above each place (k, 3), along its direction, of the highest of the triangles over or under it.

    Triangles are sorted into the cells, `step` wide, of a grid along x and y; those count that face z, and contain the
    place as seen along it. Their planes give the heights; `out` stays where there is none that is higher.
    """
    low, high = np.empty(3), np.empty(3)
    for k in range(3):
        low[k], high[k] = np.inf, -np.inf
        for i in range(len(place)):
            low[k], high[k] = min(low[k], place[i, k]), max(high[k], place[i, k])
    columns, rows = int((high[0] - low[0]) / step) + 1, int((high[1] - low[1]) / step) + 1
    first, box = np.zeros(columns * rows + 1, np.int64), np.empty((len(triangles), 4), np.int64)
    near = 0
    plane = np.empty((len(triangles), 10))
    for f in range(len(triangles)):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, az = local[i, 0], local[i, 1], local[i, 2]
        bx, by, bz = local[j, 0], local[j, 1], local[j, 2]
        cx, cy, cz = local[k, 0], local[k, 1], local[k, 2]
        if max(az, bz, cz) < low[2] - deep or min(az, bz, cz) > high[2] + deep:
            continue
        west, east, south, north = min(ax, bx, cx), max(ax, bx, cx), min(ay, by, cy), max(ay, by, cy)
        if east < low[0] or west > high[0] or north < low[1] or south > high[1]:
            continue
        ex, ey, ez, gx, gy, gz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        double = ex * gy - gx * ey
        if double <= 0.0:
            continue
        left, right = max(int((west - low[0]) / step), 0), min(int((east - low[0]) / step), columns - 1)
        bottom, top = max(int((south - low[1]) / step), 0), min(int((north - low[1]) / step), rows - 1)
        box[near, 0], box[near, 1], box[near, 2], box[near, 3] = left, right, bottom, top
        plane[near, 0], plane[near, 1], plane[near, 2] = ax, ay, az
        plane[near, 3], plane[near, 4] = ex / double, ey / double
        plane[near, 5], plane[near, 6] = gx / double, gy / double
        plane[near, 7], plane[near, 8], plane[near, 9] = ey * gz - ez * gy, ez * gx - ex * gz, double
        near += 1
        for row in range(bottom, top + 1):
            for column in range(left, right + 1):
                first[row * columns + column + 1] += 1
    for cell in range(columns * rows):
        first[cell + 1] += first[cell]
    cells, end = np.empty(first[columns * rows], np.int64), first.copy()
    for n in range(near):
        for row in range(box[n, 2], box[n, 3] + 1):
            for column in range(box[n, 0], box[n, 1] + 1):
                cell = row * columns + column
                cells[end[cell]] = n
                end[cell] += 1
    for i in range(len(place)):
        x, y, z = place[i, 0], place[i, 1], place[i, 2]
        cell = int((y - low[1]) / step) * columns + int((x - low[0]) / step)
        for at in range(first[cell], first[cell + 1]):
            n = cells[at]
            ox, oy = x - plane[n, 0], y - plane[n, 1]
            v, w = ox * plane[n, 6] - oy * plane[n, 5], oy * plane[n, 3] - ox * plane[n, 4]
            if v < -tolerance or w < -tolerance or v + w > 1.0 + tolerance:
                continue
            nx, ny, nz = plane[n, 7], plane[n, 8], plane[n, 9]
            facing = nx * up[i, 0] + ny * up[i, 1] + nz * up[i, 2]
            if facing > 0.0:
                rise = -(nx * ox + ny * oy + nz * (z - plane[n, 2])) / facing
                if abs(rise) < deep and rise > out[i]:
                    out[i] = rise
