"""Triangles of a texture, texel by texel. The loops are compiled."""

from __future__ import annotations

import numpy as np

from .compilation import compiled


@compiled
def rasterise(corners, triangle, shares, hits):
    """Fill in the triangle (h, w) that each texel's middle lies in, its barycentric coordinates (h, w, 3), and the
    number of triangles there; `corners` (m, 3, 2) are in texels from the lower left.
    """
    height, width = triangle.shape
    for k in range(len(corners)):
        (ax, ay), (bx, by), (cx, cy) = corners[k, 0], corners[k, 1], corners[k, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        left, right = int(np.floor(min(ax, bx, cx))), int(np.ceil(max(ax, bx, cx)))
        low, high = int(np.floor(min(ay, by, cy))), int(np.ceil(max(ay, by, cy)))
        for row in range(max(low, 0), min(high, height)):
            for column in range(max(left, 0), min(right, width)):
                x, y = column + 0.5, row + 0.5
                b = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                c = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                a = 1.0 - b - c
                if a < 0.0 or b < 0.0 or c < 0.0:
                    continue
                hits[row, column] += 1
                triangle[row, column] = k
                shares[row, column, 0], shares[row, column, 1], shares[row, column, 2] = a, b, c
