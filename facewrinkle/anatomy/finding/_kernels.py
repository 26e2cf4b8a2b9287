"""Inner loops of the search for a face: depth maps, and round maps about noses compared with the template's."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def rasterise(points, triangles, x0, y0, step, low, high, depth):
    """Largest z of the triangles over every grid point (x0 + j step, y0 + i step) that lies in [low, high]."""
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


@njit(cache=True)
def round_map(points, nose, axes, radius, heights):
    """Largest height of the points over the rings and sectors about a nose; -inf where there is none.

    `axes` are two directions across and the direction of looking; the rings are of equal width up to `radius`.
    """
    rings, sectors = heights.shape
    heights[:] = -np.inf
    for p in range(points.shape[0]):
        dx, dy, dz = points[p, 0] - nose[0], points[p, 1] - nose[1], points[p, 2] - nose[2]
        x = dx * axes[0, 0] + dy * axes[0, 1] + dz * axes[0, 2]
        y = dx * axes[1, 0] + dy * axes[1, 1] + dz * axes[1, 2]
        ring = int(np.sqrt(x * x + y * y) / radius * rings)
        if ring < rings:
            turn = np.arctan2(y, x) / (2.0 * np.pi)
            sector = int((turn - np.floor(turn)) * sectors) % sectors
            z = (dx * axes[2, 0] + dy * axes[2, 1] + dz * axes[2, 2]) / radius
            heights[ring, sector] = max(heights[ring, sector], z)


@njit(cache=True)
def mismatch(heights, template, weights, turn, cap, missing):
    """Mean difference of two round maps, one turned by `turn` sectors, without what they differ by as a whole."""
    rings, sectors = heights.shape
    offset, total = 0.0, 1e-12
    for i in range(rings):
        for j in range(sectors):
            z, w = heights[i, (j + turn) % sectors], weights[i, j]
            if w > 0.0 and z > -np.inf:
                offset += w * max(-cap, min(cap, z - template[i, j]))
                total += w
    offset /= total
    cost, total = 0.0, 0.0
    for i in range(rings):
        for j in range(sectors):
            z, w = heights[i, (j + turn) % sectors], weights[i, j]
            if w > 0.0:
                cost += w * (min(abs(z - template[i, j] - offset), cap) if z > -np.inf else missing)
                total += w
    return cost / total


@njit(cache=True)
def compare(points, offsets, noses, axes, radius, template, weights, cap, missing):
    """Mismatch and sector of the best roll of every candidate: nose k (its points offsets[k] to offsets[k + 1]),
    looking along axes[k, a, 2].
    """
    rings, sectors = template.shape
    cost = np.full(axes.shape[:2], np.inf)
    roll = np.zeros(axes.shape[:2], np.int64)
    heights = np.empty((rings, sectors))
    for k in range(axes.shape[0]):
        around = points[offsets[k] : offsets[k + 1]]
        for a in range(axes.shape[1]):
            round_map(around, noses[k], axes[k, a], radius, heights)
            for turn in range(0, sectors, 2):
                value = mismatch(heights, template, weights, turn, cap, missing)
                if value < cost[k, a]:
                    cost[k, a], roll[k, a] = value, turn
            best = roll[k, a]
            for turn in (best - 1, best + 1):
                value = mismatch(heights, template, weights, turn, cap, missing)
                if value < cost[k, a]:
                    cost[k, a], roll[k, a] = value, turn
    return cost, roll
