"""Machine code for hairs: lines on the skin, strands beside them, and ribbons along these."""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import compiled


@compiled
def on_skin(corners, weights, heights, points, normals, lines, up):
    """Points (k, p, 3) of hairs at heights (p,) above points of triangles, and the normals there."""
    for i in range(corners.shape[0]):
        for j in range(corners.shape[1]):
            for c in range(3):
                place = normal = 0.0
                for n in range(3):
                    share, v = weights[i, j, n], corners[i, j, n]
                    place += share * points[v, c]
                    normal += share * normals[v, c]
                lines[i, j, c] = place + heights[j] * normal
                up[i, j, c] = normal


@compiled
def slide(hairs, below, share, knots, up, lines):
    """Move points of hairs over the skin, by motions of the knots (m, 3) along their brow, in place."""
    for n in range(len(hairs)):
        i = hairs[n]
        for j in range(lines.shape[1]):
            k, t = below[n, j], share[n, j]
            rise = 0.0
            for c in range(3):
                rise += (knots[k, c] * (1.0 - t) + knots[k + 1, c] * t) * up[i, j, c]
            for c in range(3):
                lines[i, j, c] += knots[k, c] * (1.0 - t) + knots[k + 1, c] * t - rise * up[i, j, c]


@compiled
def across(lines, towards, out):
    """Unit vectors across lines (k, p, 3) and directions (k, p, 3), by differences of the points of each line."""
    last = lines.shape[1] - 1
    for i in range(lines.shape[0]):
        for j in range(last + 1):
            before, after = max(j - 1, 0), min(j + 1, last)
            x, y, z = (
                lines[i, after, 0] - lines[i, before, 0],
                lines[i, after, 1] - lines[i, before, 1],
                lines[i, after, 2] - lines[i, before, 2],
            )
            u, v, w = towards[i, j, 0], towards[i, j, 1], towards[i, j, 2]
            a, b, c = y * w - z * v, z * u - x * w, x * v - y * u
            length = max(np.sqrt(a * a + b * b + c * c), 1e-12)
            out[i, j, 0], out[i, j, 1], out[i, j, 2] = a / length, b / length, c / length


@compiled
def lashes(root, centre, upwards, path, droop, lines, out):
    """Lashes (k, p, 3) along paths [aside, up, ahead] from roots (k, 3), and the directions (k, p, 3) ahead.

    Ahead is away from the `centre` of the eye, aside is along the row of roots, and up, which `droop` (k, p) is added
    to, across both, on the side of `upwards`.
    """
    last, rise = len(root) - 1, 0.0
    up, along = np.empty((2, len(root), 3))
    for i in range(last + 1):
        before, after = max(i - 1, 0), min(i + 1, last)
        x, y, z = (
            root[after, 0] - root[before, 0],
            root[after, 1] - root[before, 1],
            root[after, 2] - root[before, 2],
        )
        u, v, w = root[i, 0] - centre[0], root[i, 1] - centre[1], root[i, 2] - centre[2]
        length = max(np.sqrt(u * u + v * v + w * w), 1e-12)
        u, v, w = u / length, v / length, w / length
        for j in range(lines.shape[1]):
            out[i, j, 0], out[i, j, 1], out[i, j, 2] = u, v, w
        a, b, c = y * w - z * v, z * u - x * w, x * v - y * u
        length = max(np.sqrt(a * a + b * b + c * c), 1e-12)
        up[i, 0], up[i, 1], up[i, 2] = a / length, b / length, c / length
        rise += up[i, 0] * upwards[0] + up[i, 1] * upwards[1] + up[i, 2] * upwards[2]
        length = max(np.sqrt(x * x + y * y + z * z), 1e-12)
        ahead = (x * u + y * v + z * w) / length
        along[i, 0], along[i, 1], along[i, 2] = x / length - ahead * u, y / length - ahead * v, z / length - ahead * w
    sign = np.sign(rise)
    for i in range(last + 1):
        for j in range(lines.shape[1]):
            for c in range(3):
                aside = path[i, j, 0] * along[i, c] + (path[i, j, 1] + droop[i, j]) * sign * up[i, c]
                lines[i, j, c] = root[i, c] + aside + path[i, j, 2] * out[i, j, c]


@compiled
def strands(lines, side, up, length, aside, points, sides, ups):
    """Strands beside hairs: s of them (k s, p, 3) for each, with lengths (k, s), shifted aside by (k, s, p)."""
    each = length.shape[1]
    for i in range(lines.shape[0]):
        for s in range(each):
            for j in range(lines.shape[1]):
                for c in range(3):
                    along = lines[i, 0, c] + length[i, s] * (lines[i, j, c] - lines[i, 0, c])
                    points[i * each + s, j, c] = along + aside[i, s, j] * side[i, j, c]
                    sides[i * each + s, j, c] = side[i, j, c]
                    ups[i * each + s, j, c] = up[i, j, c]


@compiled
def ribbons(lines, side, up, half, places, normals):
    """Both borders (k, p, 2, 3) of ribbons along lines (k, p, 3), `half` (k, p) of their width from them."""
    for i in range(lines.shape[0]):
        for j in range(lines.shape[1]):
            for c in range(3):
                aside = half[i, j] * side[i, j, c]
                places[i, j, 0, c] = lines[i, j, c] - aside
                places[i, j, 1, c] = lines[i, j, c] + aside
                normals[i, j, 0, c] = normals[i, j, 1, c] = up[i, j, c]
