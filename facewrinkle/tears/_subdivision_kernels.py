"""Inner loops of what is subdivided under a tear, and where it lies along the courses."""

from __future__ import annotations

import numpy as np
from numba import njit


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
        if distance(centre[0], centre[1], centre[2], course, hint) < far:
            near[t] = True
            continue
        k = 0
        while k < len(course):
            apart = distance(centre[0], centre[1], centre[2], course, k)
            if apart < far:
                near[t], hint = True, k  # the next triangle is often beside this one
                break
            k += max(1, int(0.999 * (apart - far) / gap))  # no point before that one is close enough


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
        top = put(stack, 0, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        while top > 0:
            if n + 3 > len(points) or m + 1 > len(out) or 2 * used[1] > len(halves):
                return -1
            top -= 1
            corner[:] = stack[top]
            for k in range(3):
                middle[k] = -1
                v, w = corner[k], corner[(k + 1) % 3]
                length = length_of(points, v, w)
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
                    m = put(out, m, a, b, c)
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
    used[0] = n
    return m


@njit(cache=True)
def length_of(points, v, w):
    return distance(points[v, 0], points[v, 1], points[v, 2], points, w)


@njit(cache=True)
def put(out, m, a, b, c):
    out[m, 0], out[m, 1], out[m, 2] = a, b, c
    return m + 1
