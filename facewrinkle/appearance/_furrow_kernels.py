"""Machine code for the shading of furrows."""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import njit


@njit(cache=True)
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
    gradient = np.empty(3)
    for n in range(count):
        i, j, k = triangles[near[n]]
        a, b, c = points[i], points[j], points[k]
        x = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
        y = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
        z = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        double = max(np.sqrt(x * x + y * y + z * z), 1e-300)
        x, y, z = x / double, y / double, z / double
        u = height[i] * (c[0] - b[0]) + height[j] * (a[0] - c[0]) + height[k] * (b[0] - a[0])
        v = height[i] * (c[1] - b[1]) + height[j] * (a[1] - c[1]) + height[k] * (b[1] - a[1])
        w = height[i] * (c[2] - b[2]) + height[j] * (a[2] - c[2]) + height[k] * (b[2] - a[2])
        gradient[0], gradient[1], gradient[2] = y * w - z * v, z * u - x * w, x * v - y * u
        size[n], m = double, 0
        for r in range(3):
            for s in range(r, 3):
                tensor[n, m] = gradient[r] * gradient[s] / (double * double)
                m += 1
        for v in (i, j, k):
            area[v] += double
    for ring in range(rings):
        if ring:
            for n in range(count):
                i, j, k = triangles[near[n]]
                for m in range(6):
                    tensor[n, m] = (mean[i, m] / area[i] + mean[j, m] / area[j] + mean[k, m] / area[k]) / 3.0
            mean[:] = 0.0
        for n in range(count):
            for v in triangles[near[n]]:
                for m in range(6):
                    mean[v, m] += size[n] * tensor[n, m]
    for v in range(len(points)):
        out[v] = 1.0
        if area[v] > 0.0:
            xx, xy, xz, yy, yz, zz = mean[v]
            trace = xx + yy + zz
            squares = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)
            out[v] = min(max(2.0 * squares / max(trace * trace, 1e-300) - 1.0, 0.0), 1.0)
