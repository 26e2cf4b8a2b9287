"""Inner loops of the muscle wrinkles: compression of the skin and height of the folds."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def edge_epsilon(rest, deformed, indptr, ring, entries, directions, out):
    """Eq. 9 for the entries of each vertex: entry p of vertex i (entries[i] <= p < entries[i + 1]) has its own
    direction.
    """
    for i in range(rest.shape[0]):
        first, last = entries[i], entries[i + 1]
        if first == last:
            continue
        for p in range(first, last):
            weighted, total = 0.0, 0.0
            for q in range(indptr[i], indptr[i + 1]):
                j = ring[q]
                dx, dy, dz = rest[j, 0] - rest[i, 0], rest[j, 1] - rest[i, 1], rest[j, 2] - rest[i, 2]
                ex, ey, ez = (
                    deformed[j, 0] - deformed[i, 0],
                    deformed[j, 1] - deformed[i, 1],
                    deformed[j, 2] - deformed[i, 2],
                )
                length = np.sqrt(dx * dx + dy * dy + dz * dz)
                cosine = abs(dx * directions[p, 0] + dy * directions[p, 1] + dz * directions[p, 2]) / length
                total += cosine
                weighted += cosine * (1.0 - np.sqrt(ex * ex + ey * ey + ez * ez) / length)
            out[p] = weighted / total if total > 0.0 else 0.0


@njit(cache=True)
def change_of_metric(points, triangles, products, dual_a, dual_b, share, out):
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
        aa = ax * ax + ay * ay + az * az - products[f, 0]
        bb = bx * bx + by * by + bz * bz - products[f, 1]
        ab = ax * bx + ay * by + az * bz - products[f, 2]
        u, v = dual_a[f], dual_b[f]
        xx = aa * u[0] * u[0] + bb * v[0] * v[0] + 2.0 * ab * u[0] * v[0]
        yy = aa * u[1] * u[1] + bb * v[1] * v[1] + 2.0 * ab * u[1] * v[1]
        zz = aa * u[2] * u[2] + bb * v[2] * v[2] + 2.0 * ab * u[2] * v[2]
        yz = aa * u[1] * u[2] + bb * v[1] * v[2] + ab * (u[1] * v[2] + u[2] * v[1])
        xz = aa * u[0] * u[2] + bb * v[0] * v[2] + ab * (u[0] * v[2] + u[2] * v[0])
        xy = aa * u[0] * u[1] + bb * v[0] * v[1] + ab * (u[0] * v[1] + u[1] * v[0])
        for c in range(3):
            s, n = share[f, c], triangles[f, c]
            out[n, 0] += s * xx
            out[n, 1] += s * yy
            out[n, 2] += s * zz
            out[n, 3] += s * yz
            out[n, 4] += s * xz
            out[n, 5] += s * xy


@njit(cache=True)
def strain_epsilon(strain, corners, barycentric, entries, directions, rest, out):
    """``1 - |F m|`` for the entries of each refined vertex, from the strain (n0, 6) at the vertices of the base mesh.

    `rest` (p,) is m^T (rest metric) m: 1 for a tangent of a flat surface.
    """
    t = np.empty(6)
    for i in range(corners.shape[0]):
        first, last = entries[i], entries[i + 1]
        if first == last:
            continue
        a, b, c = corners[i, 0], corners[i, 1], corners[i, 2]
        wa, wb, wc = barycentric[i, 0], barycentric[i, 1], barycentric[i, 2]
        for k in range(6):
            t[k] = wa * strain[a, k] + wb * strain[b, k] + wc * strain[c, k]
        for p in range(first, last):
            x, y, z = directions[p, 0], directions[p, 1], directions[p, 2]
            change = x * x * t[0] + y * y * t[1] + z * z * t[2] + 2.0 * (y * z * t[3] + x * z * t[4] + x * y * t[5])
            out[p] = 1.0 - np.sqrt(max(1.0 + change / rest[p], 0.0))


@njit(cache=True)
def amplitudes(
    starts,
    muscle,
    unit,
    envelope,
    cycle,
    direction,
    epsilon,
    k0,
    swing,
    smallest,
    height,
    spacing,
    across,
    active,
):
    """Sum of k0 H At A over the entries of each vertex, and the finest half cycle that matters there."""
    for i in range(starts.shape[0] - 1):
        total, finest, lead = 0.0, np.inf, -1
        for p in range(starts[i], starts[i + 1]):
            k = muscle[p]
            if k0[k] == 0.0:
                continue
            active[i] = True
            e = epsilon[p]
            if e <= 0.0:
                continue
            share = k0[k] * np.sin(0.5 * np.pi * min(e, 1.0))
            total += share * unit[p]
            if share * swing[k] * envelope[p] > smallest and cycle[p] < finest:
                finest, lead = cycle[p], p
        height[i] = total
        if lead >= 0:
            spacing[i] = finest
            across[i, 0], across[i, 1], across[i, 2] = (
                direction[lead, 0],
                direction[lead, 1],
                direction[lead, 2],
            )
