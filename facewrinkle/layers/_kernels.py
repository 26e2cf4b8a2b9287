"""Inner loops of the muscle wrinkles: compression of the skin and height of the folds."""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import compiled

TAUT = 0.15
"""Stretch that smooths out the lines of old skin."""


@compiled
def change_of_metric(points, triangles, products, dual_a, dual_b, share, out):
    """Add the change of the metric (n, 6) of each triangle to its vertices, by their shares in the area.

    The two sides a and b of a triangle had the `products` a.a, b.b and a.b at rest, and the dual vectors given.
    """
    for f in range(triangles.shape[0]):
        i, j, k = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
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
            s, n = share[f, c], np.uint32(triangles[f, c])
            out[n, 0] += s * xx
            out[n, 1] += s * yy
            out[n, 2] += s * zz
            out[n, 3] += s * yz
            out[n, 4] += s * xz
            out[n, 5] += s * xy


@compiled
def amplitudes(folds, epsilon, k0, kept, smallest, relief):
    """Sum of (k0 A + kept) H At over the entries of each vertex, the same with blunt H (`shown`), and the half cycle of
    the finest fold that matters.

    What is `kept` (k,) of each muscle's folds stays at rest, and goes as the skin is stretched across them. From bulge
    to furrow an entry is k0 A steep / sqrt(epsilon) times as deep as skin of fixed length allows. Where the entries
    together ask for more than that, each gets the `share` for which the skin suffices.
    """
    starts, muscle, unit, blunt, swing, steep, cycle, _, direction, _ = folds
    height, shown, spacing, across, active, share = relief
    for i in range(len(starts) - 1):
        total, mild, asked, finest, lead, on = 0.0, 0.0, 0.0, np.inf, -1, False
        for p in range(starts[i], starts[i + 1]):
            depth, old = k0[muscle[p]], kept[muscle[p]]
            if depth > 0.0 or old > 0.0:
                on = True
                deep = old * max(0.0, 1.0 + min(epsilon[p], 0.0) / TAUT)
                if epsilon[p] > 0.0 and depth > 0.0:
                    new = depth * np.sin(0.5 * np.pi * min(epsilon[p], 1.0))
                    asked += new * steep[p] / np.sqrt(epsilon[p])
                    deep += new
                if deep > 0.0:
                    total += deep * unit[p]
                    mild += deep * blunt[p]
                    if cycle[p] < finest and deep * swing[p] > smallest:
                        finest, lead = cycle[p], p
        share[i] = 1.0 / max(asked, 1.0)
        height[i], shown[i], spacing[i], active[i] = total * share[i], mild * share[i], finest, on
        if lead >= 0:
            for c in range(3):
                across[i, c] = direction[lead, c]
