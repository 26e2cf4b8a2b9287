"""Inner loops of the search for a face: depth maps, round maps about noses compared with the template's, and warps."""

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
def protrusion(points, pairs):
    """Where points lie from the middle of those that they are paired with, and of themselves."""
    total, count = np.zeros_like(points), np.ones(len(points))
    for this, other in ((0, 1), (1, 0)):
        for k in range(len(pairs)):
            p, q = pairs[k, this], pairs[k, other]
            count[p] += 1.0
            for d in range(3):
                total[p, d] += points[q, d]
    return points - (points + total) / count[:, None]


@njit(cache=True)
def within(points, place, reach):
    """Which points lie within reach of a place."""
    inside = np.empty(len(points), np.bool_)
    for p in range(len(points)):
        x, y, z = points[p, 0] - place[0], points[p, 1] - place[1], points[p, 2] - place[2]
        inside[p] = x * x + y * y + z * z <= reach * reach
    return inside


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
def mismatch(heights, template, weights, cap, missing):
    """Mean difference of two round maps without what they differ by as a whole, the first turned by every number of
    sectors.
    """
    rings, sectors = heights.shape
    twice = np.concatenate((heights, heights), axis=1)
    offset, total = np.zeros(sectors), np.full(sectors, 1e-12)
    for i in range(rings):
        for j in range(sectors):
            z, w = template[i, j], weights[i, j]
            if w > 0.0:
                turned = twice[i, j : j + sectors]
                for turn in range(sectors):
                    known = w if turned[turn] > -np.inf else 0.0
                    offset[turn] += known * max(-cap, min(cap, turned[turn] - z))
                    total[turn] += known
    offset /= total
    cost = np.zeros(sectors)
    for i in range(rings):
        for j in range(sectors):
            z, w = template[i, j], weights[i, j]
            if w > 0.0:
                turned = twice[i, j : j + sectors]
                for turn in range(sectors):
                    off = min(abs(turned[turn] - z - offset[turn]), cap)
                    cost[turn] += w * (off if turned[turn] > -np.inf else missing)
    return cost / weights.sum()


@njit(cache=True)
def compare(points, noses, axes, reach, radius, template, weights, cap, missing):
    """Mismatch and sector of the best roll of every candidate: nose k, looking along axes[k, a, 2], with the points
    within reach of it.
    """
    cost, roll = np.empty(axes.shape[:2]), np.empty(axes.shape[:2], np.int64)
    heights = np.empty(template.shape)
    for k in range(axes.shape[0]):
        around = points[within(points, noses[k], reach)]
        for a in range(axes.shape[1]):
            round_map(around, noses[k], axes[k, a], radius, heights)
            values = mismatch(heights, template, weights, cap, missing)
            even = 2 * np.argmin(values[::2])
            best = even
            for turn in (even - 1, even + 1):
                if values[turn] < values[best]:
                    best = turn
            cost[k, a], roll[k, a] = values[best], best
    return cost, roll


@njit(cache=True)
def attraction(faces, slopes, template, seen, weight, field):
    """Sums over the channels of a Gauss-Newton step of a warp: slopes times differences (2, rows, columns), and slopes
    times slopes (2, 2, rows, columns).

    The channels of a face, with their slopes (2, c, rows, columns), are read at the places that a field (2, rows,
    columns) of shifts in steps of the grid, x and y, makes of those of the template's; beyond a border, at it.
    """
    rows, columns = weight.shape
    pull, metric = np.zeros((2, rows, columns)), np.zeros((2, 2, rows, columns))
    for i in range(rows):
        for j in range(columns):
            if weight[i, j] == 0.0:
                continue
            y = min(max(i + field[1, i, j], 0.0), rows - 1.0)
            x = min(max(j + field[0, i, j], 0.0), columns - 1.0)
            k, l = min(int(y), rows - 2), min(int(x), columns - 2)
            v, u = y - k, x - l
            w = weight[i, j] * between(seen, k, l, v, u)
            for c in range(faces.shape[0]):
                difference = between(faces[c], k, l, v, u) - template[c, i, j]
                slope_x, slope_y = between(slopes[0, c], k, l, v, u), between(slopes[1, c], k, l, v, u)
                robust = w / (1.0 + difference * difference)
                pull[0, i, j] += robust * slope_x * difference
                pull[1, i, j] += robust * slope_y * difference
                metric[0, 0, i, j] += robust * slope_x * slope_x
                metric[0, 1, i, j] += robust * slope_x * slope_y
                metric[1, 1, i, j] += robust * slope_y * slope_y
    metric[1, 0] = metric[0, 1]
    return pull, metric


@njit(cache=True)
def between(image, k, l, v, u):
    """An image at row k + v and column l + u."""
    upper = image[k, l] + u * (image[k, l + 1] - image[k, l])
    lower = image[k + 1, l] + u * (image[k + 1, l + 1] - image[k + 1, l])
    return upper + v * (lower - upper)
