"""Inner loops of tears: drops kept off the skin, steps of a descent, and the footprint of a stream."""

from __future__ import annotations

import numpy as np

from ..geometry._closest_point_kernels import closest_in_triangle
from ..geometry._mesh_kernels import normalise
from ..geometry.compilation import njit
from ._subdivision_kernels import put


@njit(cache=True)
def farthest_behind(drop, skin, triangles, margin):
    """Return how far points (k, 3) must move along the third axis to be `margin` in front of the skin, at least 0."""
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


@njit(cache=True)
def _walked(p, first, points, triangles, fans, out):
    """Walk from triangle `first` to the one nearest to p; return it, with its point nearest to p in `out`."""
    offsets, around = fans
    here, w, weights = first, np.empty(3), np.empty(3)
    a, b, c = points[triangles[here, 0]], points[triangles[here, 1]], points[triangles[here, 2]]
    best = closest_in_triangle(p, a, b, c, weights)
    while True:
        at = here
        for k in range(3):
            v = triangles[at, k]
            for i in range(offsets[v], offsets[v + 1]):
                t = around[i]
                a, b, c = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
                d = closest_in_triangle(p, a, b, c, w)
                if d < best * (1.0 - 1e-9):
                    best, here = d, t
                    weights[:] = w
        if here == at:
            break
    for k in range(3):
        a, b, c = points[triangles[here, 0], k], points[triangles[here, 1], k], points[triangles[here, 2], k]
        out[k] = a + weights[1] * (b - a) + weights[2] * (c - a)
    return here


@njit(cache=True)
def descend(surface, fans, start, first, heading, down, step, inertia, flat, path):
    """Write steps down the surface from `start` on triangle `first` into `path`; return how many points it has.

    `surface` is its points, triangles and normals, `fans` the triangles around each point: offsets and triangles.
    The path ends where the surface is level (its slope below `flat`), where it rises, or at its border.
    """
    points, triangles, normals = surface
    p, t, v = start.copy(), first, heading.copy()
    path[0] = p
    out, count = np.empty(3), 1
    while count < len(path):
        a, b, c = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
        areas = np.empty(3)
        for k, (x, y) in enumerate(((b, c), (c, a), (a, b))):
            e, f = x - p, y - p
            n0, n1, n2 = e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]
            areas[k] = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2) + 1e-300
        n = (
            areas[0] * normals[triangles[t, 0]]
            + areas[1] * normals[triangles[t, 1]]
            + areas[2] * normals[triangles[t, 2]]
        )
        n /= np.sqrt((n * n).sum()) + 1e-300
        d = down - (down * n).sum() * n
        slope = np.sqrt((d * d).sum())
        if slope < flat:
            break
        v = (1.0 - inertia) * d / slope + inertia * v
        v -= (v * n).sum() * n
        v /= np.sqrt((v * v).sum()) + 1e-300
        q = p + step * v
        t = _walked(q, t, points, triangles, fans, out)
        moved = out - p
        if ((out - q) ** 2).sum() > (0.5 * step) ** 2 or (moved * down).sum() < 0.02 * step:
            break
        p = out.copy()
        path[count] = p
        count += 1
    return count


@njit(cache=True)
def look_up(s, w, wobble, noise, out_wobble, out_noise):
    """Interpolate linearly in a row at s (n,), and at s, w (n,) in a grid whose second axis is 0 in the middle."""
    last, wide = len(wobble) - 1, noise.shape[1] - 1
    for i in range(len(s)):
        x, y = min(max(s[i], 0.0), float(last)), min(max(w[i] + wide // 2, 0.0), float(wide))
        j, k = min(int(x), last - 1), min(int(y), wide - 1)
        x, y = x - j, y - k
        out_wobble[i] = wobble[j] + x * (wobble[j + 1] - wobble[j])
        near, far = noise[j, k] + y * (noise[j, k + 1] - noise[j, k]), noise[j + 1, k]
        far += y * (noise[j + 1, k + 1] - noise[j + 1, k])
        out_noise[i] = near + x * (far - near)


@njit(cache=True)
def adjacency(edges, sides, n):
    """Return the neighbours of n vertices (offsets (n + 1,) and vertices), and the edges and vertices at the border.

    Edges at the border are of one triangle only.
    """
    offsets, neighbours = np.zeros(n + 1, np.int32), np.empty(2 * len(edges), np.int32)
    triangles = np.zeros(len(edges), np.int32)
    for t in range(len(sides)):
        for k in range(3):
            triangles[sides[t, k]] += 1
    border_edges, border = triangles == 1, np.zeros(n, np.bool_)
    for e in range(len(edges)):
        border[edges[e, 0]] |= border_edges[e]
        border[edges[e, 1]] |= border_edges[e]
        for k in range(2):
            offsets[edges[e, k] + 1] += 1
    for v in range(1, len(offsets)):
        offsets[v] += offsets[v - 1]
    at = offsets.copy()
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        neighbours[at[a]], neighbours[at[b]] = b, a
        at[a] += 1
        at[b] += 1
    return (offsets, neighbours), border_edges, border


@njit(cache=True)
def interpolate(points, normals, corners, weights, rest, between, out_points, out_normals, out_rest):
    """Write points and unit normals of a mesh at a share of the way between two vertices of a footprint, and at rest.

    `between` is the first vertex, the second, and the share.
    """
    first, second, share = between
    for i in range(len(first)):
        v, w, part = first[i], second[i], share[i]
        a, b, c, x, y, z = corners[v, 0], corners[v, 1], corners[v, 2], weights[v, 0], weights[v, 1], weights[v, 2]
        for k in range(3):
            out_points[i, k] = x * points[a, k] + y * points[b, k] + z * points[c, k]
            out_normals[i, k] = x * normals[a, k] + y * normals[b, k] + z * normals[c, k]
            out_rest[i, k] = rest[v, k] + part * (rest[w, k] - rest[v, k])
        if v == w:
            continue
        a, b, c, x, y, z = corners[w, 0], corners[w, 1], corners[w, 2], weights[w, 0], weights[w, 1], weights[w, 2]
        for k in range(3):
            out_points[i, k] += part * (x * points[a, k] + y * points[b, k] + z * points[c, k] - out_points[i, k])
            out_normals[i, k] += part * (x * normals[a, k] + y * normals[b, k] + z * normals[c, k] - out_normals[i, k])
    normalise(out_normals)


@njit(cache=True)
def thicken(s, w, front, sizes, tapering, drained, pooling, wobble, rough, depth, level, height):
    """Write level and height of a tear at s, w (n,), see :func:`facewrinkle.tears.shape.thickness`."""
    wide, tall, narrow, thin = sizes
    for i in range(len(s)):
        behind, head, left = (front - s[i]) / wide, 0.0, 1.0
        if behind < 1.0:
            head = 1.0
        elif behind < 1.0 + tapering:
            head = 0.5 + 0.5 * np.cos(np.pi * (behind - 1.0) / tapering)
        if behind > 0.0:
            left = drained + (1.0 - drained) * np.exp(-behind / 15.0)
        half = narrow * (1.0 + wobble[i]) * left
        half += (wide - half) * head
        cap, start = max(1.0 - behind, 0.0), max(1.0 - s[i] / narrow, 0.0)
        level[i] = 1.0 - (w[i] / half) ** 2 - cap * cap - start * start
        film = thin * (1.0 + rough[i]) * (1.0 + pooling * wobble[i])
        height[i] = (film + (tall - film) * head * np.sqrt(head)) * max(level[i], 0.0 - depth)


@njit(cache=True)
def make_disk(level, triangles, edges, neighbours, border, least):
    """Change `level` so that the vertices above 0 are connected and have no holes; return how many there are.

    Afterwards no level is nearer to 0 than `least`.
    """
    for v in range(len(level)):
        if abs(level[v]) < least:
            level[v] = least
    label, queue = np.full(len(level), -1, np.int32), np.empty(len(level), np.int32)
    largest, kept = 0, -1
    for seed in range(len(level)):
        if level[seed] > 0.0 and label[seed] < 0:
            size, _ = _flood(seed, level, neighbours, border, label, queue)
            if size > largest:
                largest, kept = size, seed
    euler = largest
    for v in range(len(level)):
        if level[v] > 0.0 and label[v] != kept:
            level[v] = -least
    for e in range(len(edges)):
        euler -= (level[edges[e, 0]] > 0.0) & (level[edges[e, 1]] > 0.0)
    for t in range(len(triangles)):
        euler += (level[triangles[t, 0]] > 0.0) & (level[triangles[t, 1]] > 0.0) & (level[triangles[t, 2]] > 0.0)
    if euler == 1:
        return largest
    label[:] = -1
    for seed in range(len(level)):
        if level[seed] <= 0.0 and label[seed] < 0:
            size, outside = _flood(seed, level, neighbours, border, label, queue)
            if not outside:
                for i in range(size):
                    level[queue[i]] = least
                largest += size
    return largest


@njit(cache=True)
def _flood(seed, level, neighbours, border, label, queue):
    """Label the vertices joined to `seed` on its side of 0; return their number, and True if one is at a border."""
    offsets, others = neighbours
    wet, size, at, outside = level[seed] > 0.0, 1, 0, False
    queue[0], label[seed] = seed, seed
    while at < size:
        v = queue[at]
        at += 1
        outside = outside or border[v]
        for i in range(offsets[v], offsets[v + 1]):
            j = others[i]
            if label[j] < 0 and (level[j] > 0.0) == wet:
                label[j] = seed
                queue[size] = j
                size += 1
    return size, outside


@njit(cache=True)
def clip(triangles, sides, edges, border_edges, level, out, rim, vertices):
    """Cut out the part of a mesh where the linear function `level` is above 0.

    Write its triangles into `out`, the sides of its outline into `rim`, and its vertices into `vertices`: the two of
    the mesh between which each lies, its share of the way, and a triangle that it lies in. Return the numbers of
    all three. Edges at the border of the mesh belong to the outline.
    """
    first, second, share, inside = vertices
    n, m, r = len(level), 0, 0
    vertex, between, count = np.full(n, -1, np.int32), np.full(len(edges), -1, np.int32), 0
    ring, side = np.empty(4, np.int64), np.empty(4, np.bool_)
    for t in range(len(triangles)):
        if level[triangles[t, 0]] <= 0.0 and level[triangles[t, 1]] <= 0.0 and level[triangles[t, 2]] <= 0.0:
            continue
        size = 0
        for k in range(3):
            v, w, e = triangles[t, k], triangles[t, (k + 1) % 3], sides[t, k]
            if level[v] > 0.0:
                if vertex[v] < 0:
                    vertex[v] = count
                    first[count], second[count], share[count], inside[count] = v, v, 0.0, t
                    count += 1
                ring[size], side[size] = vertex[v], border_edges[e]
                size += 1
            if (level[v] > 0.0) != (level[w] > 0.0):
                if between[e] < 0:
                    between[e] = count
                    i, j = edges[e, 0], edges[e, 1]
                    first[count], second[count], inside[count] = i, j, t
                    share[count] = min(max(level[i] / (level[i] - level[j]), 0.03), 0.97)
                    count += 1
                ring[size], side[size] = between[e], level[v] > 0.0 or border_edges[e]
                size += 1
        for k in range(1, size - 1):
            m = put(out, m, ring[0], ring[k], ring[k + 1])
        for k in range(size):
            if side[k]:
                rim[r, 0], rim[r, 1] = ring[k], ring[(k + 1) % size]
                r += 1
    return m, r, count


@njit(cache=True)
def close(triangles, rim, n, out):
    """Write the triangles (2 m + 2 b, 3) of a solid: top, bottom (its vertices are numbered from n on), and walls."""
    m = len(triangles)
    for t in range(m):
        for k in range(3):
            out[t, k] = triangles[t, k]
            out[m + t, k] = triangles[t, 2 - k] + n
    at = 2 * m
    for i in range(len(rim)):
        a, b = rim[i, 0], rim[i, 1]
        at = put(out, put(out, at, a + n, b + n, b), a + n, b, a)
