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
def heights_above(places, up, corners, deep, tolerance, out):
    """Raise `out` (n,) to the heights of triangles, with `corners` (m, 3, 3), above places (n, 3) that are sorted by x.

    Those triangles count that face z and contain the place as seen along it; their planes give the heights.
    """
    x = places[:, 0].copy()
    for f in range(len(corners)):
        ax, ay, az = corners[f, 0, 0], corners[f, 0, 1], corners[f, 0, 2]
        ex, ey, ez = corners[f, 1, 0] - ax, corners[f, 1, 1] - ay, corners[f, 1, 2] - az
        gx, gy, gz = corners[f, 2, 0] - ax, corners[f, 2, 1] - ay, corners[f, 2, 2] - az
        nx, ny, nz = ey * gz - ez * gy, ez * gx - ex * gz, ex * gy - ey * gx
        if nz <= 0.0:
            continue
        margin = tolerance * (abs(ex) + abs(gx))
        first, last = min(ax, ax + ex, ax + gx) - margin, max(ax, ax + ex, ax + gx) + margin
        for i in range(np.searchsorted(x, first), np.searchsorted(x, last)):
            ox, oy = x[i] - ax, places[i, 1] - ay
            v, w = (ox * gy - oy * gx) / nz, (oy * ex - ox * ey) / nz
            if v < -tolerance or w < -tolerance or v + w > 1.0 + tolerance:
                continue
            facing = nx * up[i, 0] + ny * up[i, 1] + nz * up[i, 2]
            if facing > 0.0:
                rise = -(nx * ox + ny * oy + nz * (places[i, 2] - az)) / facing
                if abs(rise) < deep:
                    out[i] = max(out[i], rise)
