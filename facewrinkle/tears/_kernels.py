"""Inner loops of the tears."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def farthest_behind(drop, skin, triangles, margin):
    """How far the drop's points (k, 3) must move along the third axis to lie `margin` before the skin, at least 0."""
    lowest, highest = drop[0].copy(), drop[0].copy()
    for p in range(len(drop)):
        for k in range(3):
            lowest[k] = min(lowest[k], drop[p, k])
            highest[k] = max(highest[k], drop[p, k])
    out = 0.0
    for t in range(len(triangles)):
        a, b, c = skin[triangles[t, 0]], skin[triangles[t, 1]], skin[triangles[t, 2]]
        if (
            max(a[0], b[0], c[0]) < lowest[0]
            or min(a[0], b[0], c[0]) > highest[0]
            or max(a[1], b[1], c[1]) < lowest[1]
            or min(a[1], b[1], c[1]) > highest[1]
            or max(a[2], b[2], c[2]) + margin < lowest[2] + out
        ):
            continue
        det = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if det == 0.0:
            continue
        for p in range(len(drop)):
            x, y = drop[p, 0] - a[0], drop[p, 1] - a[1]
            v = (x * (c[1] - a[1]) - y * (c[0] - a[0])) / det
            w = (y * (b[0] - a[0]) - x * (b[1] - a[1])) / det
            if v >= 0.0 and w >= 0.0 and v + w <= 1.0:
                depth = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2])
                out = max(out, depth + margin - drop[p, 2])
    return out
