"""Machine code for normals, interpolation, heights, and the triangles of a mesh that are too coarse."""

from __future__ import annotations

import numpy as np

from .compilation import njit


@njit(cache=True)
def accumulate(points, triangles, out):
    """Sum the normals of the triangles at each vertex, weighted by area; not normalised."""
    out[:] = 0.0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        for v in (i, j, k):
            out[v, 0] += nx
            out[v, 1] += ny
            out[v, 2] += nz


@njit(cache=True)
def normalise(vectors):
    """Scale vectors (n, 3) to unit length in place; zero vectors stay."""
    for v in range(vectors.shape[0]):
        x, y, z = vectors[v, 0], vectors[v, 1], vectors[v, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            vectors[v, 0] = x / length
            vectors[v, 1] = y / length
            vectors[v, 2] = z / length


@njit(cache=True)
def detail(bare, displaced, triangles, smooth, scratch, out):
    """Normals `smooth` plus the change from the normals of the bare to those of the displaced mesh."""
    accumulate(bare, triangles, scratch)
    normalise(scratch)
    accumulate(displaced, triangles, out)
    normalise(out)
    for v in range(out.shape[0]):
        for k in range(3):
            out[v, k] += smooth[v, k] - scratch[v, k]
    normalise(out)


@njit(cache=True)
def interpolate(values, corners, barycentric, out):
    """Linear interpolation of values (n0, d) at points with three corners and weights each."""
    for i in range(corners.shape[0]):
        a, b, c = corners[i, 0], corners[i, 1], corners[i, 2]
        wa, wb, wc = barycentric[i, 0], barycentric[i, 1], barycentric[i, 2]
        for k in range(values.shape[1]):
            out[i, k] = wa * values[a, k] + wb * values[b, k] + wc * values[c, k]


@njit(cache=True)
def displace(points, heights, directions, out):
    """points + heights * directions, row by row."""
    for i in range(points.shape[0]):
        for k in range(3):
            out[i, k] = points[i, k] + heights[i] * directions[i, k]


@njit(cache=True)
def mark_triangles(
    triangles, level, max_level, normals, rest_normals, points, need, across, active, bends, gamma_c, hysteresis,
    split, fine, largest,
):  # fmt: skip
    """Mark the triangles to split, and those that are finer than they have to be.

    Triangles are split where Eq. 19 (its denominator bounded, for rest normals that are nearly orthogonal) exceeds
    `gamma_c` at vertices that count bends, and where a half cycle of a wrinkle would have too few vertices.
    """
    for f in range(triangles.shape[0]):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        split[f] = False
        fine[f] = True
        if not (active[a] or active[b] or active[c]):
            continue
        for s in range(3):
            i, j = triangles[f, s], triangles[f, (s + 1) % 3]
            if not (active[i] or active[j]):
                continue
            rest = rest_normals[i, 0] * rest_normals[j, 0]
            rest += rest_normals[i, 1] * rest_normals[j, 1] + rest_normals[i, 2] * rest_normals[j, 2]
            now = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2]
            gamma = (rest - now) / max(abs(rest), 0.1)
            largest[i] = max(largest[i], gamma)
            largest[j] = max(largest[j], gamma)
            # Where one end counts bends and the other is active without, the bend is of a layer that does not count it.
            counts = (bends[i] and (bends[j] or not active[j])) or (bends[j] and not active[i])
            bend = gamma if counts else 0.0
            excess = 0.0
            for v in (i, j):
                if need[v] < np.inf:
                    span = (points[j, 0] - points[i, 0]) * across[v, 0] + (points[j, 1] - points[i, 1]) * across[v, 1]
                    span += (points[j, 2] - points[i, 2]) * across[v, 2]
                    excess = max(excess, abs(span) / need[v])
            if level[f] < max_level and (bend > gamma_c or excess > 1.0):
                split[f] = True
            if bend > hysteresis * gamma_c or 2.0 * excess > 1.0 - hysteresis:
                fine[f] = False


@njit(cache=True)
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


@njit(cache=True)
def heights_above(points, up, points_of_mesh, triangles, near, tolerance, deep, out):
    """Heights above each point, along its direction, of the highest of the triangles near it that face that way."""
    for i in range(points.shape[0]):
        out[i] = -np.inf
        p, d = points[i], up[i]
        for f in near[i]:
            a, b, c = (
                points_of_mesh[triangles[f, 0]],
                points_of_mesh[triangles[f, 1]],
                points_of_mesh[triangles[f, 2]],
            )
            ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            gx, gy, gz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
            nx, ny, nz = ey * gz - ez * gy, ez * gx - ex * gz, ex * gy - ey * gx
            facing = nx * d[0] + ny * d[1] + nz * d[2]
            if facing <= 0.0:
                continue
            ox, oy, oz = a[0] - p[0], a[1] - p[1], a[2] - p[2]
            bx, by, bz = oy * d[2] - oz * d[1], oz * d[0] - ox * d[2], ox * d[1] - oy * d[0]
            u = (bx * gx + by * gy + bz * gz) / facing
            v = -(bx * ex + by * ey + bz * ez) / facing
            if u > -tolerance and v > -tolerance and u + v < 1.0 + tolerance:
                rise = (nx * ox + ny * oy + nz * oz) / facing
                if abs(rise) < deep and rise > out[i]:
                    out[i] = rise
