"""Inner loop of the depth buffer: the foremost triangle at each node of a grid."""

from __future__ import annotations

import numpy as np

from .compilation import compiled


@compiled
def rasterise(x, y, z, triangles, low, high, first, numbers, depth):
    """Write the z of triangles and their numbers, from `first`, into the nodes where they are in front of all before.

    The node in row i and column j is at (j, i) in the coordinates x and y (n,) of the points; z is linear in them. Only
    z in [low, high] counts, and no triangle that has a corner at -inf.
    """
    rows, columns = depth.shape
    for f in range(triangles.shape[0]):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        if z[a] == -np.inf or z[b] == -np.inf or z[c] == -np.inf:
            continue
        left, right = max(min(x[a], x[b], x[c]), 0.0), min(max(x[a], x[b], x[c]), columns - 1.0)
        bottom, top = max(min(y[a], y[b], y[c]), 0.0), min(max(y[a], y[b], y[c]), rows - 1.0)
        if not (np.ceil(left) <= right and np.ceil(bottom) <= top):
            continue
        bx, by, cx, cy = x[b] - x[a], y[b] - y[a], x[c] - x[a], y[c] - y[a]
        double = bx * cy - cx * by
        if double == 0.0:
            continue
        for i in range(int(np.ceil(bottom)), int(top) + 1):
            for j in range(int(np.ceil(left)), int(right) + 1):
                v = ((j - x[a]) * cy - cx * (i - y[a])) / double
                w = (bx * (i - y[a]) - (j - x[a]) * by) / double
                if v >= -1e-9 and w >= -1e-9 and v + w <= 1.0 + 1e-9:
                    height = z[a] + v * (z[b] - z[a]) + w * (z[c] - z[a])
                    if low <= height <= high and height > depth[i, j]:
                        numbers[i, j], depth[i, j] = first + f, height
