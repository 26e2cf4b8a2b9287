"""Inner loops of the search for a face: polar maps about noses compared with the template's, alignment, and warps."""

from __future__ import annotations

import numpy as np

from ...geometry.compilation import compiled


@compiled
def protrusion(points, pairs):
    """Offsets of points from the mean of themselves and of those that they are paired with."""
    total, count = np.zeros_like(points), np.ones(len(points))
    for this, other in ((0, 1), (1, 0)):
        for k in range(len(pairs)):
            p, q = pairs[k, this], pairs[k, other]
            count[p] += 1.0
            for d in range(3):
                total[p, d] += points[q, d]
    return points - (points + total) / count[:, None]


@compiled
def within(points, place, reach):
    """True for points that lie within reach of a place."""
    inside = np.empty(len(points), np.bool_)
    for p in range(len(points)):
        x, y, z = points[p, 0] - place[0], points[p, 1] - place[1], points[p, 2] - place[2]
        inside[p] = x * x + y * y + z * z <= reach * reach
    return inside


@compiled
def polar_map(points, nose, axes, radius, heights):
    """Largest height of the points over the rings and sectors about a nose, over the radius; -inf where there is none.

    `axes` are two directions across and the direction in which the nose looks; the rings are of equal width.
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


@compiled
def mismatch(heights, template, weights, cap, missing):
    """Mean difference (sectors,) of two polar maps, with the first turned by every number of sectors.

    A common difference of their heights does not count.
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


@compiled
def best_rolls(points, noses, axes, reach, radius, template, weights, cap, missing):
    """Mismatch (k, a) of every candidate at its best roll, and that roll in sectors: nose k looks along axes[k, a, 2].

    Only points within reach of a nose are compared.
    """
    cost, roll = np.empty(axes.shape[:2]), np.empty(axes.shape[:2], np.int64)
    heights = np.empty(template.shape)
    for k in range(axes.shape[0]):
        around = points[within(points, noses[k], reach)]
        for a in range(axes.shape[1]):
            polar_map(around, noses[k], axes[k, a], radius, heights)
            values = mismatch(heights, template, weights, cap, missing)
            even = 2 * np.argmin(values[::2])
            best = even
            for turn in (even - 1, even + 1):
                if values[turn] < values[best]:
                    best = turn
            cost[k, a], roll[k, a] = values[best], best
    return cost, roll


@compiled
def local_coordinates(points, origin, axes):
    """Return (points - origin) @ axes.T."""
    out = np.empty_like(points)
    for p in range(points.shape[0]):
        x, y, z = points[p, 0] - origin[0], points[p, 1] - origin[1], points[p, 2] - origin[2]
        for k in range(3):
            out[p, k] = x * axes[k, 0] + y * axes[k, 1] + z * axes[k, 2]
    return out


@compiled
def alignment_sums(depth, model, weight, x, y, tolerance):
    """Sums for a Gauss-Newton step that aligns depths (rows, columns), at x (columns,) and y (rows,), with a model's.

    Returns the number of nodes near the model, their weight, and the sums of c c^T (9, 9) and c d (9,) for differences
    d with derivatives c: by turns and shifts (3 each), growth, and stretch upward and forward.
    """
    rows, columns = depth.shape
    count, total, square, right, c = 0, 0.0, np.zeros((9, 9)), np.zeros(9), np.empty(9)
    for i in range(rows):
        for j in range(columns):
            d, z = depth[i, j] - model[i, j], depth[i, j]
            if not (weight[i, j] > 0.0 and abs(d) < 3.0 * tolerance):  # none is near where the depth is not known
                continue
            low, high = max(i - 1, 0), min(i + 1, rows - 1)
            left, far = max(j - 1, 0), min(j + 1, columns - 1)
            v = (depth[high, j] - depth[low, j]) / (y[high] - y[low])
            u = (depth[i, far] - depth[i, left]) / (x[far] - x[left])
            if not (np.isfinite(u) and np.isfinite(v)):
                continue
            w = weight[i, j] / (1.0 + (d / tolerance) ** 2) ** 2 / (1.0 + u * u + v * v)
            c[0], c[1], c[2] = y[i] + v * z, -x[j] - u * z, u * y[i] - v * x[j]
            c[3], c[4], c[5] = -u, -v, 1.0
            c[6], c[7], c[8] = z - u * x[j] - v * y[i], -v * y[i], z
            count += 1
            total += w
            for a in range(9):
                right[a] += w * c[a] * d
                for b in range(a + 1):
                    square[a, b] += w * c[a] * c[b]
    for a in range(9):
        for b in range(a):
            square[b, a] = square[a, b]
    return count, total, square, right


@compiled
def gauss_newton_sums(faces, slopes, template, shown, weight, field):
    """Sums over the channels for a Gauss-Newton step of a warp.

    Returns slopes times differences (2, rows, columns), and slopes times slopes (3, rows, columns): x and x, x and y, y
    and y. The channels of a face, with their slopes (2, c, rows, columns), are read at the template's places shifted by
    a field (2, rows, columns), x and y in steps of the grid; beyond the border, the value at the border counts.
    """
    rows, columns = weight.shape
    pull, metric = np.zeros((2, rows, columns)), np.zeros((3, rows, columns))
    for i in range(rows):
        for j in range(columns):
            if weight[i, j] == 0.0:
                continue
            y = min(max(i + field[1, i, j], 0.0), rows - 1.0)
            x = min(max(j + field[0, i, j], 0.0), columns - 1.0)
            k, l = min(int(y), rows - 2), min(int(x), columns - 2)
            v, u = y - k, x - l
            w = weight[i, j] * bilinear(shown, k, l, v, u)
            for c in range(faces.shape[0]):
                difference = bilinear(faces[c], k, l, v, u) - template[c, i, j]
                slope_x, slope_y = bilinear(slopes[0, c], k, l, v, u), bilinear(slopes[1, c], k, l, v, u)
                robust = w / (1.0 + difference * difference)
                pull[0, i, j] += robust * slope_x * difference
                pull[1, i, j] += robust * slope_y * difference
                metric[0, i, j] += robust * slope_x * slope_x
                metric[1, i, j] += robust * slope_x * slope_y
                metric[2, i, j] += robust * slope_y * slope_y
    return pull, metric


@compiled
def bilinear(image, k, l, v, u):
    """An image at row k + v and column l + u, interpolated bilinearly."""
    upper = image[k, l] + u * (image[k, l + 1] - image[k, l])
    lower = image[k + 1, l] + u * (image[k + 1, l + 1] - image[k + 1, l])
    return upper + v * (lower - upper)
