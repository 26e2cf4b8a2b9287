"""Inner loops of what is subdivided under a tear, and where it lies along the courses."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def near_course(points, triangles, course, spacing, reach):
    """The triangles that may hold points within `reach` of a polyline with points `spacing` apart."""
    low, high = course[0].copy(), course[0].copy()
    for k in range(len(course)):
        for i in range(3):
            low[i], high[i] = min(low[i], course[k, i]), max(high[i], course[k, i])
    reach += 0.5 * spacing
    near, count = overlapping(points, triangles, low - reach, high + reach), 0
    gap, hint, centre = _widest_gap(course), 0, np.empty(3)
    for t in near:
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        side = max(length_of(points, a, b), length_of(points, b, c), length_of(points, c, a))
        far = reach + 0.6 * side  # from the centroid no corner is farther than 0.58 sides
        for i in range(3):
            centre[i] = (points[a, i] + points[b, i] + points[c, i]) / 3.0
        x, y, z = centre
        k = hint if distance(x, y, z, course, hint) < far else 0
        while k < len(course):
            apart = distance(x, y, z, course, k)
            if apart < far:
                near[count], hint = t, k  # the next triangle is often beside this one
                count += 1
                break
            k += max(1, int(0.999 * (apart - far) / gap))  # no point before that one is close enough
    return near[:count]


@njit(cache=True)
def overlapping(points, triangles, low, high):
    """The triangles whose boxes overlap the one from `low` to `high`."""
    x0, y0, z0, x1, y1, z1 = low[0], low[1], low[2], high[0], high[1], high[2]
    beyond = np.empty(len(points), np.uint8)  # which of the six sides of the box
    for v in range(len(points)):
        x, y, z = points[v, 0], points[v, 1], points[v, 2]
        beyond[v] = (x < x0) | (x > x1) << 1 | (y < y0) << 2 | (y > y1) << 3 | (z < z0) << 4 | (z > z1) << 5
    out, count = np.empty(len(triangles), np.int32), 0
    for t in range(len(triangles)):
        if not beyond[triangles[t, 0]] & beyond[triangles[t, 1]] & beyond[triangles[t, 2]]:
            out[count] = t
            count += 1
    return out[:count]


@njit(cache=True)
def distance(x, y, z, points, k):
    """How far x, y, z is from point k."""
    x, y, z = x - points[k, 0], y - points[k, 1], z - points[k, 2]
    return np.sqrt(x * x + y * y + z * z)


@njit(cache=True)
def _widest_gap(course):
    gap = 1e-300
    for k in range(1, len(course)):
        gap = max(gap, length_of(course, k, k - 1))
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
            out[b, 3] = max(out[b, 3], distance(out[b, 0], out[b, 1], out[b, 2], row, k))
    return out


BLOCK = 8


@njit(cache=True)
def _nearest_sample(x, y, z, course, balls, close):
    """The point of a polyline nearest to x, y, z; the nearer the point `close` is, the sooner it is found."""
    best = distance(x, y, z, course, close)
    for b in range(len(balls)):
        dx, dy, dz, far = x - balls[b, 0], y - balls[b, 1], z - balls[b, 2], balls[b, 3] + best
        if dx * dx + dy * dy + dz * dz < far * far:
            for k in range(b * BLOCK, min((b + 1) * BLOCK, len(course))):
                d = distance(x, y, z, course, k)
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
    """Where the row that begins with v and w is in the table, or belongs."""
    at = ((v * 0x9E3779B1 + w) * 0x85EBCA77 >> 15) & (len(table) - 1)
    while table[at, 0] >= 0 and (table[at, 0] != v or table[at, 1] != w):
        at = (at + 1) & (len(table) - 1)
    return at


SLACK = 0.71
"""No point of a triangle is farther from the middle of one of its sides than half its length, nor from an end of one
than this share of it."""


@njit(cache=True)
def subdivide(
    mesh, triangles, points, normals, corners, weights, place, apart, halves, done, fine, used, first, courses, lengths,
    starts, detail, reach, runs,
):  # fmt: skip
    """Halve sides longer than `detail` within `reach` of the courses; whether there was room for all.

    `triangles` are those of `mesh` in numbers of the vertices that are kept, of which there are used[0], those from
    `first` on new. used[1] sides are in the table `halves`, used[2] triangles in the table `done`, and used[3] are in
    `fine`, where `runs` (m, 2) says which each triangle becomes: none of those that are out of reach.
    """
    guess, far, n = np.zeros(len(starts) - 1), reach + SLACK * detail, used[0]
    balls = [_balls(courses[starts[c] : starts[c + 1]]) for c in range(len(starts) - 1)]
    stack = np.empty((256, 3), np.int64)
    for v in range(first, n):
        _settle(v, points, normals, courses, lengths, starts, balls, guess, place, apart)
        guess[:] = place[:, 0, v]
    m, corner, middle = used[3], np.empty(3, np.int64), np.empty(3, np.int64)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        row = _slot(a, b, done)
        if done[row, 2] == c:
            runs[t, 0], runs[t, 1] = done[row, 3], done[row, 4]
            continue
        used[2] += done[row, 0] < 0
        done[row, 0], done[row, 1], done[row, 2], runs[t, 0] = a, b, c, m
        top = put(stack, 0, a, b, c)
        while top > 0:
            if n + 3 > len(points) or m + 1 > len(fine) or 2 * max(used[1], used[2]) > len(halves):
                return False
            top -= 1
            corner[:] = stack[top]
            for k in range(3):
                middle[k] = -1
                v, w = corner[k], corner[(k + 1) % 3]
                length = length_of(points, v, w)
                if length <= detail or max(apart[v], apart[w]) > far + length:
                    continue
                at = _slot(min(v, w), max(v, w), halves)
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
                    m = put(fine, m, a, b, c)
            elif q < 0:
                top = put(stack, put(stack, top, a, p, c), p, b, c)
            elif r < 0:
                top = put(stack, top, p, b, q)
                if length_of(points, p, c) < length_of(points, a, q):
                    top = put(stack, put(stack, top, a, p, c), p, q, c)
                else:
                    top = put(stack, put(stack, top, a, p, q), a, q, c)
            else:
                top = put(stack, put(stack, top, a, p, r), p, b, q)
                top = put(stack, put(stack, top, r, q, c), p, q, r)
        runs[t, 1] = done[row, 4] = m
        done[row, 3] = runs[t, 0]
    used[0], used[3] = n, m
    return True


@njit(cache=True)
def joined(fine, runs, n):
    """Runs of triangles of n vertices as one mesh: the vertices in use, triangles of these, and which run has each."""
    m, number = 0, np.full(n, -1, np.int32)
    for t in range(len(runs)):
        m += runs[t, 1] - runs[t, 0]
        for i in range(runs[t, 0], runs[t, 1]):
            number[fine[i, 0]] = number[fine[i, 1]] = number[fine[i, 2]] = 0
    vertices, count = np.empty(n, np.int32), 0
    for v in range(n):
        if number[v] == 0:
            vertices[count], number[v] = v, count
            count += 1
    triangles, hosts, m = np.empty((m, 3), np.int32), np.empty(m, np.int32), 0
    for t in range(len(runs)):
        for i in range(runs[t, 0], runs[t, 1]):
            hosts[m] = t
            m = put(triangles, m, number[fine[i, 0]], number[fine[i, 1]], number[fine[i, 2]])
    return vertices[:count].copy(), triangles, hosts


@njit(cache=True)
def first_change(points, others):
    """The first row in which two arrays of points differ."""
    n = min(len(points), len(others))
    for v in range(n):
        if points[v, 0] != others[v, 0] or points[v, 1] != others[v, 1] or points[v, 2] != others[v, 2]:
            return v
    return n


@njit(cache=True)
def length_of(points, v, w):
    return distance(points[v, 0], points[v, 1], points[v, 2], points, w)


@njit(cache=True)
def put(out, m, a, b, c):
    out[m, 0], out[m, 1], out[m, 2] = a, b, c
    return m + 1
