"""Machine code for the shading of furrows."""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import compiled


@compiled
def coherence(points, height, triangles, deep, rings, out):
    """Coherence of the directions in which a height rises, at the vertices `deep` (n,) and around them; else 1.

    That of the structure tensor, ((p - q) / (p + q))^2 with its two eigenvalues p and q, in means over `rings` rings of
    triangles: 1 on a furrow, 0 in a round pit.
    """
    near, around = np.empty(len(triangles), np.int64), deep.copy()
    count = 0
    for _ in range(rings):
        count = 0
        for f in range(len(triangles)):
            if around[triangles[f, 0]] or around[triangles[f, 1]] or around[triangles[f, 2]]:
                near[count] = f
                count += 1
        for n in range(count):
            for k in range(3):
                around[triangles[near[n], k]] = True
    size, tensor = np.empty(count), np.empty((count, 6))
    area, mean = np.zeros(len(points)), np.zeros((len(points), 6))
    for n in range(count):
        f = near[n]
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
        bx, by, bz = points[j, 0] - ax, points[j, 1] - ay, points[j, 2] - az
        cx, cy, cz = points[k, 0] - ax, points[k, 1] - ay, points[k, 2] - az
        x, y, z = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        double = max(np.sqrt(x * x + y * y + z * z), 1e-150)
        p, q = (height[j] - height[i]) / (double * double), (height[k] - height[i]) / (double * double)
        u, v, w = p * cx - q * bx, p * cy - q * by, p * cz - q * bz
        rx, ry, rz = y * w - z * v, z * u - x * w, x * v - y * u
        size[n] = double
        tensor[n, 0], tensor[n, 1], tensor[n, 2] = rx * rx, rx * ry, rx * rz
        tensor[n, 3], tensor[n, 4], tensor[n, 5] = ry * ry, ry * rz, rz * rz
        area[i] += double
        area[j] += double
        area[k] += double
    for ring in range(rings):
        if ring:
            for v in range(len(points)):
                for m in range(6):
                    mean[v, m] /= max(3.0 * area[v], 1e-300)
            for n in range(count):
                f = near[n]
                i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
                for m in range(6):
                    tensor[n, m] = mean[i, m] + mean[j, m] + mean[k, m]
            for v in range(len(points)):
                for m in range(6):
                    mean[v, m] = 0.0
        for n in range(count):
            f = near[n]
            i, j, k, share = triangles[f, 0], triangles[f, 1], triangles[f, 2], size[n]
            for m in range(6):
                part = share * tensor[n, m]
                mean[i, m] += part
                mean[j, m] += part
                mean[k, m] += part
    for v in range(len(points)):
        out[v] = 1.0
        if area[v] > 0.0:
            xx, xy, xz, yy, yz, zz = mean[v, 0], mean[v, 1], mean[v, 2], mean[v, 3], mean[v, 4], mean[v, 5]
            trace = xx + yy + zz
            squares = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)
            out[v] = min(max(2.0 * squares / max(trace * trace, 1e-300) - 1.0, 0.0), 1.0)
