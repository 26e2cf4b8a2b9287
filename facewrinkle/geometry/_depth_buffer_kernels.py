"""Inner loop of the depth buffer: heights of triangles at the nodes of a grid."""

from __future__ import annotations

import numpy as np

from .compilation import njit


@njit(cache=True)
def rasterise(points, triangles, x0, y0, step, low, high, depth):
    """Write the largest z in [low, high] of the triangles at every node (x0 + j step, y0 + i step); -inf for none."""
    rows, columns = depth.shape
    depth[:] = -np.inf
    for f in range(triangles.shape[0]):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay = (points[a, 0] - x0) / step, (points[a, 1] - y0) / step
        bx, by = (points[b, 0] - x0) / step, (points[b, 1] - y0) / step
        cx, cy = (points[c, 0] - x0) / step, (points[c, 1] - y0) / step
        left, right = max(min(ax, bx, cx), 0.0), min(max(ax, bx, cx), columns - 1.0)
        bottom, top = max(min(ay, by, cy), 0.0), min(max(ay, by, cy), rows - 1.0)
        if not (left <= right and bottom <= top):
            continue
        double = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if double == 0.0:
            continue
        az, bz, cz = points[a, 2], points[b, 2], points[c, 2]
        for i in range(int(np.ceil(bottom)), int(top) + 1):
            for j in range(int(np.ceil(left)), int(right) + 1):
                v = ((j - ax) * (cy - ay) - (cx - ax) * (i - ay)) / double
                w = ((bx - ax) * (i - ay) - (j - ax) * (by - ay)) / double
                if v >= -1e-9 and w >= -1e-9 and v + w <= 1.0 + 1e-9:
                    z = az + v * (bz - az) + w * (cz - az)
                    if low <= z <= high and z > depth[i, j]:
                        depth[i, j] = z
