"""Inner loops of the tears."""

from __future__ import annotations

import numpy as np
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


@njit(cache=True)
def _nearest_in(p, a, b, c, out):
    """Nearest point of triangle abc to p (Ericson, Real-Time Collision Detection, 5.1.5) into `out`."""
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for k in range(3):  # numbers, not small arrays, which would be allocated
        e, f = b[k] - a[k], c[k] - a[k]
        d1 += e * (p[k] - a[k])
        d2 += f * (p[k] - a[k])
        d3 += e * (p[k] - b[k])
        d4 += f * (p[k] - b[k])
        d5 += e * (p[k] - c[k])
        d6 += f * (p[k] - c[k])
    vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w = d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    for k in range(3):
        out[k] = a[k] + v * (b[k] - a[k]) + w * (c[k] - a[k])


@njit(cache=True)
def _walked(p, first, points, triangles, offsets, around, out):
    """The triangle with the nearest point to p that a walk from triangle `first` finds; the point in `out`."""
    here, found = first, np.empty(3)
    _nearest_in(p, points[triangles[here, 0]], points[triangles[here, 1]], points[triangles[here, 2]], out)
    best = ((out - p) ** 2).sum()
    while True:
        at = here
        for k in range(3):
            v = triangles[at, k]
            for i in range(offsets[v], offsets[v + 1]):
                t = around[i]
                _nearest_in(p, points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]], found)
                d = ((found - p) ** 2).sum()
                if d < best * (1.0 - 1e-9):
                    best, here = d, t
                    out[:] = found
        if here == at:
            return here


@njit(cache=True)
def descend(points, triangles, normals, offsets, around, start, first, heading, down, step, inertia, flat, path):
    """Steps down the surface from `start` on triangle `first` into `path`; how many points it has then.

    It ends where the surface is level (its slope below `flat`), where it rises, or where it ends.
    """
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
        t = _walked(q, t, points, triangles, offsets, around, out)
        moved = out - p
        if ((out - q) ** 2).sum() > (0.5 * step) ** 2 or (moved * down).sum() < 0.02 * step:
            break
        p = out.copy()
        path[count] = p
        count += 1
    return count


@njit(cache=True)
def near_course(points, triangles, course, spacing, reach, near):
    """Which triangles may hold points within `reach` of a polyline with points `spacing` apart."""
    low, high = course[0].copy(), course[0].copy()
    for k in range(len(course)):
        for i in range(3):
            low[i], high[i] = min(low[i], course[k, i]), max(high[i], course[k, i])
    gap, hint = _widest_gap(course), 0
    centre = np.empty(3)
    for t in range(len(triangles)):
        square = 0.0
        for s in range(3):
            v, w = triangles[t, s], triangles[t, (s + 1) % 3]
            x, y, z = points[v, 0] - points[w, 0], points[v, 1] - points[w, 1], points[v, 2] - points[w, 2]
            square = max(square, x * x + y * y + z * z)
        far = reach + 0.6 * np.sqrt(square) + 0.5 * spacing  # from the centroid no corner is farther than 0.58 sides
        near[t] = False
        away = False
        for i in range(3):
            centre[i] = (points[triangles[t, 0], i] + points[triangles[t, 1], i] + points[triangles[t, 2], i]) / 3.0
            away = away or centre[i] < low[i] - far or centre[i] > high[i] + far
        if away:
            continue
        if _apart(centre[0], centre[1], centre[2], course, hint) < far:
            near[t] = True
            continue
        k = 0
        while k < len(course):
            apart = _apart(centre[0], centre[1], centre[2], course, k)
            if apart < far:
                near[t], hint = True, k  # the next triangle is often beside this one
                break
            k += max(1, int(0.999 * (apart - far) / gap))  # no point before that one is close enough


@njit(cache=True)
def _apart(x, y, z, points, k):
    """How far x, y, z is from point k."""
    x, y, z = x - points[k, 0], y - points[k, 1], z - points[k, 2]
    return np.sqrt(x * x + y * y + z * z)


@njit(cache=True)
def _widest_gap(course):
    gap = 1e-300
    for k in range(1, len(course)):
        gap = max(gap, _length(course, k, k - 1))
    return gap


@njit(cache=True)
def _balls(course):
    """Centres and radii of balls around BLOCK points in a row."""
    out = np.zeros(((len(course) + BLOCK - 1) // BLOCK, 4))
    for b in range(len(out)):
        row = course[b * BLOCK : (b + 1) * BLOCK]
        for k in range(len(row)):
            for i in range(3):
                out[b, i] += row[k, i] / len(row)
        for k in range(len(row)):
            out[b, 3] = max(out[b, 3], _apart(out[b, 0], out[b, 1], out[b, 2], row, k))
    return out


BLOCK = 8


@njit(cache=True)
def _nearest_sample(x, y, z, course, balls, close):
    """The point of a polyline nearest to x, y, z; the nearer the point `close` is, the sooner it is found."""
    best = _apart(x, y, z, course, close)
    for b in range(len(balls)):
        dx, dy, dz, far = x - balls[b, 0], y - balls[b, 1], z - balls[b, 2], balls[b, 3] + best
        if dx * dx + dy * dy + dz * dz < far * far:
            for k in range(b * BLOCK, min((b + 1) * BLOCK, len(course))):
                d = _apart(x, y, z, course, k)
                if d < best:
                    best, close = d, k
    return close


@njit(cache=True)
def _along(x, y, z, nx, ny, nz, course, lengths, balls, guess):
    """Arc length of the nearest point of a polyline, distance to its side (positive on the right), and from it.

    The ends go on straight to the side, so that heads and starts are round; `guess` is an arc length nearby.
    """
    last = len(course) - 1
    close = _nearest_sample(x, y, z, course, balls, min(max(int(guess / lengths[last] * last), 0), last))
    least, s, w = np.inf, 0.0, 0.0
    for k in range(max(close - 2, 0), min(close + 2, last)):
        ax, ay, az = course[k, 0], course[k, 1], course[k, 2]
        ex, ey, ez = course[k + 1, 0] - ax, course[k + 1, 1] - ay, course[k + 1, 2] - az
        square = ex * ex + ey * ey + ez * ez
        u = ((x - ax) * ex + (y - ay) * ey + (z - az) * ez) / square
        if k > 0:
            u = max(u, 0.0)
        if k < last - 1:
            u = min(u, 1.0)
        dx, dy, dz = x - ax - u * ex, y - ay - u * ey, z - az - u * ez
        d = dx * dx + dy * dy + dz * dz
        if d < least:
            least, s = d, lengths[k] + u * np.sqrt(square)
            side = dx * (ey * nz - ez * ny) + dy * (ez * nx - ex * nz) + dz * (ex * ny - ey * nx)
            w = np.sqrt(d) if side >= 0.0 else -np.sqrt(d)
    beyond = max(-s, s - lengths[last], 0.0)
    return s, w, np.sqrt(least + beyond * beyond)


@njit(cache=True)
def _settle(v, points, normals, courses, lengths, starts, balls, guess, place, apart):
    """Where vertex v is on all courses (rows of `courses` from `starts`), and how far from the nearest."""
    apart[v] = np.inf
    for c in range(len(starts) - 1):
        i, j = starts[c], starts[c + 1]
        s, w, d = _along(
            points[v, 0], points[v, 1], points[v, 2], normals[v, 0], normals[v, 1], normals[v, 2],
            courses[i:j], lengths[i:j], balls[c], guess[c],
        )  # fmt: skip
        place[c, 0, v], place[c, 1, v] = s, w
        apart[v] = min(apart[v], d)


@njit(cache=True)
def _slot(v, w, table):
    """Where the side between v and w is in the table, or belongs."""
    low, high = min(v, w), max(v, w)
    at = ((low * 0x9E3779B1 + high) * 0x85EBCA77 >> 15) & (len(table) - 1)
    while table[at, 0] >= 0 and (table[at, 0] != low or table[at, 1] != high):
        at = (at + 1) & (len(table) - 1)
    return at


SLACK = 0.71
"""No point of a triangle is farther from the middle of one of its sides than half its length, nor from an end of one
than this share of it."""


@njit(cache=True)
def subdivide(
    mesh, triangles, points, normals, corners, weights, place, apart, halves, used, first, courses, lengths, starts,
    detail, reach, out, hosts,
):  # fmt: skip
    """Halve sides longer than `detail` within `reach` of the courses; the number of triangles then.

    `triangles` are those of `mesh` in numbers of the vertices that are kept, of which there are used[0], those from
    `first` on new; used[1] sides are in the table `halves`. Triangles that are out of reach are left out. -1 if there
    is too little room for vertices, sides or triangles.
    """
    guess, far, n = np.zeros(len(starts) - 1), reach + SLACK * detail, used[0]
    balls = [_balls(courses[starts[c] : starts[c + 1]]) for c in range(len(starts) - 1)]
    stack = np.empty((256, 3), np.int64)
    for v in range(first, n):
        _settle(v, points, normals, courses, lengths, starts, balls, guess, place, apart)
        guess[:] = place[:, 0, v]
    m, corner, middle = 0, np.empty(3, np.int64), np.empty(3, np.int64)
    for t in range(len(triangles)):
        top = _put(stack, 0, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        while top > 0:
            if n + 3 > len(points) or m + 1 > len(out) or 2 * used[1] > len(halves):
                return -1
            top -= 1
            corner[:] = stack[top]
            for k in range(3):
                middle[k] = -1
                v, w = corner[k], corner[(k + 1) % 3]
                length = _length(points, v, w)
                if length <= detail or max(apart[v], apart[w]) > far + length:
                    continue
                at = _slot(v, w, halves)
                if halves[at, 0] >= 0:
                    middle[k] = halves[at, 2]
                    continue
                for i in range(3):
                    points[n, i], normals[n, i] = (
                        0.5 * (points[v, i] + points[w, i]),
                        0.5 * (normals[v, i] + normals[w, i]),
                    )
                    total = 0.0
                    for j in range(3):
                        total += weights[v, j] * (corners[v, j] == mesh[t, i])
                        total += weights[w, j] * (corners[w, j] == mesh[t, i])
                    weights[n, i] = 0.5 * total
                    corners[n, i] = mesh[t, i] if total > 0.0 else corners[v, 0]  # the mesh may lose the third
                for c in range(len(guess)):
                    guess[c] = 0.5 * (place[c, 0, v] + place[c, 0, w])
                _settle(n, points, normals, courses, lengths, starts, balls, guess, place, apart)
                halves[at, 0], halves[at, 1] = min(v, w), max(v, w)
                used[1] += 1
                if apart[n] < far + 0.5 * length:
                    halves[at, 2] = middle[k] = n
                    n += 1
            a, b, c, p, q, r = corner[0], corner[1], corner[2], middle[0], middle[1], middle[2]
            while (p < 0 and q >= 0) or (q < 0 and r >= 0):  # turned until p; p and q; or all are halved
                a, b, c, p, q, r = b, c, a, q, r, p
            if p < 0:
                if min(apart[a], apart[b], apart[c]) < reach:
                    hosts[m] = t
                    m = _put(out, m, a, b, c)
            elif q < 0:
                top = _put(stack, _put(stack, top, a, p, c), p, b, c)
            elif r < 0:
                top = _put(stack, top, p, b, q)
                if _length(points, p, c) < _length(points, a, q):
                    top = _put(stack, _put(stack, top, a, p, c), p, q, c)
                else:
                    top = _put(stack, _put(stack, top, a, p, q), a, q, c)
            else:
                top = _put(stack, _put(stack, top, a, p, r), p, b, q)
                top = _put(stack, _put(stack, top, r, q, c), p, q, r)
    used[0] = n
    return m


@njit(cache=True)
def look_up(s, w, wobble, noise, out_wobble, out_noise):
    """Values at places (n,) of a row, and at places (n,) of a grid whose second axis is 0 in the middle; linear."""
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
def _length(points, v, w):
    return _apart(points[v, 0], points[v, 1], points[v, 2], points, w)


@njit(cache=True)
def _put(out, m, a, b, c):
    out[m, 0], out[m, 1], out[m, 2] = a, b, c
    return m + 1


@njit(cache=True)
def rings(edges, offsets, neighbours):
    """Neighbours of every vertex; `offsets` (n + 1,) are 0 before."""
    for e in range(len(edges)):
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


@njit(cache=True)
def carry(values, corners, weights, first, second, share, out):
    """Values (n, 3) of vertices, at a share of the way from one place to another between three of them each."""
    for i in range(len(first)):
        v, w = first[i], second[i]
        for k in range(3):
            a, b = 0.0, 0.0
            for j in range(3):
                a += weights[v, j] * values[corners[v, j], k]
            if v != w:
                for j in range(3):
                    b += weights[w, j] * values[corners[w, j], k]
            out[i, k] = a + share[i] * (b - a)


@njit(cache=True)
def thicken(s, w, front, sizes, tapering, drained, wobble, rough, level, height):
    """Level and height of a tear at places: see :func:`facewrinkle.tears.shape.thickness`."""
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
        film = thin * (1.0 + rough[i])
        height[i] = (film + (tall - film) * head * np.sqrt(head)) * max(level[i], 0.0)


@njit(cache=True)
def make_disk(level, triangles, edges, offsets, rings, border, tiny):
    """Change `level` so that the vertices above 0 are connected and enclose none that are not; how many there are."""
    label, queue = np.full(len(level), -1, np.int32), np.empty(len(level), np.int32)
    largest, kept = 0, -1
    for seed in range(len(level)):
        if level[seed] > 0.0 and label[seed] < 0:
            size, _ = _flood(seed, level, offsets, rings, border, label, queue)
            if size > largest:
                largest, kept = size, seed
    euler = largest
    for v in range(len(level)):
        if level[v] > 0.0 and label[v] != kept:
            level[v] = -tiny
    for e in range(len(edges)):
        euler -= (level[edges[e, 0]] > 0.0) & (level[edges[e, 1]] > 0.0)
    for t in range(len(triangles)):
        euler += (level[triangles[t, 0]] > 0.0) & (level[triangles[t, 1]] > 0.0) & (level[triangles[t, 2]] > 0.0)
    if euler == 1:
        return largest
    label[:] = -1
    for seed in range(len(level)):
        if level[seed] <= 0.0 and label[seed] < 0:
            size, outside = _flood(seed, level, offsets, rings, border, label, queue)
            if not outside:
                for i in range(size):
                    level[queue[i]] = tiny
                largest += size
    return largest


@njit(cache=True)
def _flood(seed, level, offsets, rings, border, label, queue):
    """Label what is connected to a vertex and on the same side of 0; its size, and whether it is at the border."""
    wet, size, at, outside = level[seed] > 0.0, 1, 0, False
    queue[0], label[seed] = seed, seed
    while at < size:
        v = queue[at]
        at += 1
        outside = outside or border[v]
        for i in range(offsets[v], offsets[v + 1]):
            j = rings[i]
            if label[j] < 0 and (level[j] > 0.0) == wet:
                label[j] = seed
                queue[size] = j
                size += 1
    return size, outside


@njit(cache=True)
def clip(triangles, sides, edges, single, level, out, rim, first, second, share, inside):
    """The part of a mesh where the linear function `level` is above 0.

    Vertices of the part lie between `first` and `second` at `share`, in triangle `inside`. Writes its triangles into
    `out` and the sides of its outline, of which some are `single` edges of the mesh, into `rim`; returns the numbers of
    the three.
    """
    n, m, r = len(level), 0, 0
    vertex, between, count = np.full(n, -1, np.int32), np.full(len(edges), -1, np.int32), 0
    ring, side = np.empty(4, np.int64), np.empty(4, np.bool_)
    for t in range(len(triangles)):
        size = 0
        for k in range(3):
            v, w, e = triangles[t, k], triangles[t, (k + 1) % 3], sides[t, k]
            if level[v] > 0.0:
                if vertex[v] < 0:
                    vertex[v] = count
                    first[count], second[count], share[count], inside[count] = v, v, 0.0, t
                    count += 1
                ring[size], side[size] = vertex[v], single[e]
                size += 1
            if (level[v] > 0.0) != (level[w] > 0.0):
                if between[e] < 0:
                    between[e] = count
                    i, j = edges[e, 0], edges[e, 1]
                    first[count], second[count], inside[count] = i, j, t
                    share[count] = min(max(level[i] / (level[i] - level[j]), 0.03), 0.97)
                    count += 1
                ring[size], side[size] = between[e], level[v] > 0.0 or single[e]
                size += 1
        for k in range(1, size - 1):
            m = _put(out, m, ring[0], ring[k], ring[k + 1])
        for k in range(size):
            if side[k]:
                rim[r, 0], rim[r, 1] = ring[k], ring[(k + 1) % size]
                r += 1
    return m, r, count


@njit(cache=True)
def close(triangles, rim, n, out):
    """Triangles (2 m + 2 b, 3) of a solid: of its top, of its base numbered from `n` on, and of the walls."""
    m = len(triangles)
    for t in range(m):
        for k in range(3):
            out[t, k] = triangles[t, k]
            out[m + t, k] = triangles[t, 2 - k] + n
    at = 2 * m
    for i in range(len(rim)):
        a, b = rim[i, 0], rim[i, 1]
        at = _put(out, _put(out, at, a + n, b + n, b), a + n, b, a)


@njit(cache=True)
def _overlapping(points, triangles, low, high):
    """The triangles whose boxes overlap the one from `low` to `high`."""
    out, count = np.empty(len(triangles), np.int32), 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        away = False
        for k in range(3):
            x, y, z = points[a, k], points[b, k], points[c, k]
            away = away or max(x, y, z) < low[k] or min(x, y, z) > high[k]
        if not away:
            out[count] = t
            count += 1
    return out[:count]


@njit(cache=True)
def limit_heights(base, rest, normals, height, under, skin, skin_rest, triangles, cell):
    """Lower heights so that no vertex goes half the way to the skin that it would meet, nor to other skin near it.

    Other skin, such as the other lid of an eye that closes, is far from the vertex at rest. `under` is the triangle of
    the skin that a vertex stands on; those around it are looked up in a grid of this cell size, once for all vertices
    in a row that stand on it.
    """
    low, high, tallest = base[0].copy(), base[0].copy(), np.zeros(len(triangles))
    for i in range(len(base)):
        tallest[under[i]] = max(tallest[under[i]], height[i])
    for t in range(len(triangles)):
        if tallest[t] > 0.0:
            for s in range(3):
                for k in range(3):
                    x = skin[triangles[t, s], k]
                    low[k], high[k] = min(low[k], x - 2.5 * tallest[t]), max(high[k], x + 2.5 * tallest[t])
    near = _overlapping(skin, triangles, low, high)
    bounds, home = np.empty((len(near), 6)), np.zeros((len(near), 4))
    boxes, shape = np.empty((len(near), 6), np.int32), np.empty(3, np.int64)
    for k in range(3):
        shape[k] = int((high[k] - low[k]) / cell) + 1
    for i in range(len(near)):
        a, b, c = triangles[near[i], 0], triangles[near[i], 1], triangles[near[i], 2]
        for k in range(3):
            x, y, z = skin[a, k], skin[b, k], skin[c, k]
            bounds[i, k], bounds[i, 3 + k] = min(x, y, z), max(x, y, z)
            boxes[i, 2 * k] = int(max(bounds[i, k] - low[k], 0.0) / cell)
            boxes[i, 2 * k + 1] = int((min(bounds[i, 3 + k], high[k]) - low[k]) / cell)
            home[i, k] = (skin_rest[a, k] + skin_rest[b, k] + skin_rest[c, k]) / 3.0
        for v in (a, b, c):
            home[i, 3] = max(home[i, 3], _apart(home[i, 0], home[i, 1], home[i, 2], skin_rest, v))
    start, content = _sorted_in(boxes, shape)
    least = 6e-08 * cell  # nearer is the triangle that the ray starts from
    found, seen, around = np.empty(3), np.full(len(near), -1, np.int32), np.empty(len(near), np.int32)
    rising, box, here, count = np.empty(len(near), np.bool_), np.empty(6), -1, 0
    for i in range(len(base)):
        if under[i] != here:
            here = under[i]
            a, b, c = triangles[here, 0], triangles[here, 1], triangles[here, 2]
            for k in range(3):
                x, y, z = skin[a, k], skin[b, k], skin[c, k]
                box[k], box[3 + k] = min(x, y, z) - 2.5 * tallest[here], max(x, y, z) + 2.5 * tallest[here]
            nx, ny, nz = _normal(skin, a, b, c)
            count = 0
            for x in range(int((box[0] - low[0]) / cell), int((box[3] - low[0]) / cell) + 1):
                for y in range(int((box[1] - low[1]) / cell), int((box[4] - low[1]) / cell) + 1):
                    for z in range(int((box[2] - low[2]) / cell), int((box[5] - low[2]) / cell) + 1):
                        g = (x * shape[1] + y) * shape[2] + z
                        for at in range(start[g], start[g + 1]):
                            j = content[at]
                            if seen[j] == here:
                                continue
                            seen[j] = here
                            if near[j] == here or not _overlap(bounds[j], box):
                                continue
                            above, joined = False, False
                            for s in range(3):
                                v = triangles[near[j], s]
                                up = (skin[v, 0] - skin[a, 0]) * nx + (skin[v, 1] - skin[a, 1]) * ny
                                above = above or up + (skin[v, 2] - skin[a, 2]) * nz > least
                                joined = joined or v in (a, b, c)
                            if above or not joined:
                                around[count], rising[count] = j, above
                                count += 1
        px, py, pz, dx, dy, dz = base[i, 0], base[i, 1], base[i, 2], normals[i, 0], normals[i, 1], normals[i, 2]
        leaning = dx * nx + dy * ny + dz * nz <= 0.0
        nearest = 3.0 * height[i]
        for at in range(count):
            j = around[at]
            t = near[j]
            x = max(bounds[j, 0] - px, px - bounds[j, 3], 0.0)
            y = max(bounds[j, 1] - py, py - bounds[j, 4], 0.0)
            z = max(bounds[j, 2] - pz, pz - bounds[j, 5], 0.0)
            if x * x + y * y + z * z > nearest * nearest:
                continue
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            if rising[at] or leaning:  # what lies below the plane of its own triangle is never met
                nearest = _met(px, py, pz, dx, dy, dz, skin, a, b, c, least, nearest)
            if _apart(home[j, 0], home[j, 1], home[j, 2], rest, i) > home[j, 3] + 4.0 * height[i]:
                _nearest_in(base[i], skin[a], skin[b], skin[c], found)
                nearest = min(nearest, np.sqrt((px - found[0]) ** 2 + (py - found[1]) ** 2 + (pz - found[2]) ** 2))
        height[i] = min(height[i], 0.45 * nearest)


@njit(cache=True)
def _overlap(first, second):
    out = True
    for k in range(3):
        out = out and first[k] <= second[3 + k] and first[3 + k] >= second[k]
    return out


@njit(cache=True)
def _sorted_in(boxes, shape):
    """What is in each cell of a grid: where it starts, and the numbers of the boxes (n, 6)."""
    start = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int32)
    where, content = start, np.empty(0, np.int32)
    for fill in range(2):
        if fill:
            for i in range(1, len(start)):
                start[i] += start[i - 1]
            where, content = start.copy(), np.empty(start[-1], np.int32)
        for i in range(len(boxes)):
            for x in range(boxes[i, 0], boxes[i, 1] + 1):
                for y in range(boxes[i, 2], boxes[i, 3] + 1):
                    for z in range(boxes[i, 4], boxes[i, 5] + 1):
                        g = (x * shape[1] + y) * shape[2] + z
                        if fill:
                            content[where[g]] = i
                            where[g] += 1
                        else:
                            start[g + 1] += 1
    return start, content


@njit(cache=True)
def _normal(points, i, j, k):
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    ex, ey, ez = points[j, 0] - ax, points[j, 1] - ay, points[j, 2] - az
    fx, fy, fz = points[k, 0] - ax, points[k, 1] - ay, points[k, 2] - az
    x, y, z = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    size = np.sqrt(x * x + y * y + z * z) + 1e-300
    return x / size, y / size, z / size


@njit(cache=True)
def _met(px, py, pz, dx, dy, dz, skin, i, j, k, least, most):
    """Distance along the ray p + x d at which it meets the triangle of vertices i, j, k; `most` where it does not."""
    ax, ay, az = skin[i, 0], skin[i, 1], skin[i, 2]
    ex, ey, ez = skin[j, 0] - ax, skin[j, 1] - ay, skin[j, 2] - az
    fx, fy, fz = skin[k, 0] - ax, skin[k, 1] - ay, skin[k, 2] - az
    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    det = -(dx * nx + dy * ny + dz * nz)
    if det == 0.0:
        return most
    qx, qy, qz = px - ax, py - ay, pz - az
    x = (qx * nx + qy * ny + qz * nz) / det
    if x < least or x > most:
        return most
    gx, gy, gz = qy * dz - qz * dy, qz * dx - qx * dz, qx * dy - qy * dx
    u, v = (fx * gx + fy * gy + fz * gz) / det, -(ex * gx + ey * gy + ez * gz) / det
    if u < -1e-9 or v < -1e-9 or u + v > 1.0 + 1e-9:
        return most
    return x
