"""Inner loops that subdivide the surface under a tear and find the stream coordinates of its vertices."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..geometry.compilation import njit

BALL = 8
"""Consecutive points of a polyline that share a bounding ball."""

COVERING = 0.71
"""No point of a triangle is farther from the middle of one of its sides than half the side's length, nor from an end
of a side than this share of its length."""

STACK = 256
"""Room for the parts of one triangle that are still to be subdivided."""


class Polylines(NamedTuple):
    """Polylines one after another: points (k, 3), arc lengths (k,), and the first row of each, with k at the end."""

    points: Any
    lengths: Any
    starts: Any


class Vertices(NamedTuple):
    """The vertices that are kept: their barycentric coordinates in the mesh, and their coordinates along the polylines.

    `points`, `normals`, `corners` and `weights` are (n, 3), `coordinates` (c, 2, n) and `distance`, from the nearest
    polyline, (n,).
    """

    points: Any
    normals: Any
    corners: Any
    weights: Any
    coordinates: Any
    distance: Any


class Tables(NamedTuple):
    """The parts found so far: hash tables, and how many rows of everything are in use.

    A row of `middles` has the ends of a side and the vertex in its middle, -1 where it is not halved. A row of `done`
    has the corners of a triangle, and the first and the last of its parts in `parts` (m, 3). `used` counts vertices,
    rows of `middles`, rows of `done`, and rows of `parts`.
    """

    middles: Any
    done: Any
    parts: Any
    used: Any


@njit(cache=True)
def near_path(points, triangles, line, spacing, reach):
    """Return the triangles that may have points within `reach` of a polyline whose points are `spacing` apart."""
    low, high = line[0].copy(), line[0].copy()
    for k in range(len(line)):
        for i in range(3):
            low[i], high[i] = min(low[i], line[k, i]), max(high[i], line[k, i])
    reach += 0.5 * spacing
    near, count = overlapping(points, triangles, low - reach, high + reach), 0
    gap, hint, centre = _widest_gap(line), 0, np.empty(3)
    for t in near:
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        side = max(length_of(points, a, b), length_of(points, b, c), length_of(points, c, a))
        far = reach + 0.6 * side  # from the centroid no corner is farther than 0.58 sides
        for i in range(3):
            centre[i] = (points[a, i] + points[b, i] + points[c, i]) / 3.0
        x, y, z = centre
        k = hint if distance(x, y, z, line, hint) < far else 0
        while k < len(line):
            apart = distance(x, y, z, line, k)
            if apart < far:
                near[count], hint = t, k  # the next triangle is often beside this one
                count += 1
                break
            k += max(1, int(0.999 * (apart - far) / gap))  # no point before that one is close enough
    return near[:count]


@njit(cache=True)
def overlapping(points, triangles, low, high):
    """Return the triangles whose bounding boxes overlap the box from `low` to `high`."""
    x0, y0, z0, x1, y1, z1 = low[0], low[1], low[2], high[0], high[1], high[2]
    beyond = np.empty(len(points), np.uint8)  # one bit for each side of the box
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
    """Distance of x, y, z from point k."""
    x, y, z = x - points[k, 0], y - points[k, 1], z - points[k, 2]
    return np.sqrt(x * x + y * y + z * z)


@njit(cache=True)
def _widest_gap(line):
    """The greatest distance between neighbouring points of a polyline."""
    gap = 1e-300
    for k in range(1, len(line)):
        gap = max(gap, length_of(line, k, k - 1))
    return gap


@njit(cache=True)
def _balls(line):
    """Centres and radii of balls around BALL consecutive points each."""
    out = np.zeros(((len(line) + BALL - 1) // BALL, 4))
    for b in range(len(out)):
        row = line[b * BALL : (b + 1) * BALL]
        for k in range(len(row)):
            for i in range(3):
                out[b, i] += row[k, i] / len(row)
        for k in range(len(row)):
            out[b, 3] = max(out[b, 3], distance(out[b, 0], out[b, 1], out[b, 2], row, k))
    return out


@njit(cache=True)
def _nearest_sample(x, y, z, line, balls, close):
    """Return the point of a polyline nearest to x, y, z; the nearer the first guess `close` is, the faster."""
    best = distance(x, y, z, line, close)
    for b in range(len(balls)):
        dx, dy, dz, far = x - balls[b, 0], y - balls[b, 1], z - balls[b, 2], balls[b, 3] + best
        if dx * dx + dy * dy + dz * dz < far * far:
            for k in range(b * BALL, min((b + 1) * BALL, len(line))):
                d = distance(x, y, z, line, k)
                if d < best:
                    best, close = d, k
    return close


@njit(cache=True)
def _along(x, y, z, nx, ny, nz, line, lengths, balls, guess):
    """Coordinates s and w of a point x, y, z with normal nx, ny, nz along a polyline, and its distance from it.

    s is the arc length at the nearest point of the polyline, w the distance from there, positive on the right. Beyond
    its ends the polyline goes on straight, so that heads and starts are round. `guess` is an arc length nearby.
    """
    last = len(line) - 1
    close = _nearest_sample(x, y, z, line, balls, min(max(int(guess / lengths[last] * last), 0), last))
    least, s, w = np.inf, 0.0, 0.0
    for k in range(max(close - 2, 0), min(close + 2, last)):
        ax, ay, az = line[k, 0], line[k, 1], line[k, 2]
        ex, ey, ez = line[k + 1, 0] - ax, line[k + 1, 1] - ay, line[k + 1, 2] - az
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
def _locate(v, vertices, lines, balls, guess):
    """Find the coordinates of vertex v along all polylines, and its distance from the nearest one."""
    points, normals = vertices.points, vertices.normals
    vertices.distance[v] = np.inf
    for c in range(len(lines.starts) - 1):
        i, j = lines.starts[c], lines.starts[c + 1]
        s, w, d = _along(
            points[v, 0], points[v, 1], points[v, 2], normals[v, 0], normals[v, 1], normals[v, 2],
            lines.points[i:j], lines.lengths[i:j], balls[c], guess[c],
        )  # fmt: skip
        vertices.coordinates[c, 0, v], vertices.coordinates[c, 1, v] = s, w
        vertices.distance[v] = min(vertices.distance[v], d)


@njit(cache=True)
def _slot(v, w, table):
    """Return the row of a hash table that begins with v and w, or the free row for it."""
    at = ((v * 0x9E3779B1 + w) * 0x85EBCA77 >> 15) & (len(table) - 1)
    while table[at, 0] >= 0 and (table[at, 0] != v or table[at, 1] != w):
        at = (at + 1) & (len(table) - 1)
    return at


@njit(cache=True)
def subdivide(mesh, triangles, vertices, tables, first, lines, detail, reach, runs):
    """Halve sides longer than `detail` within `reach` of the polylines; return True if there was room for all.

    `triangles` are those of `mesh` in numbers of the vertices that are kept, of which those from `first` on are new.
    Row i of `runs` (m, 2) gets the rows of `parts` that triangle i becomes: none where it is out of reach.
    """
    points, distances = vertices.points, vertices.distance
    done, parts, used = tables.done, tables.parts, tables.used
    guess, far = np.zeros(len(lines.starts) - 1), reach + COVERING * detail
    balls = [_balls(lines.points[lines.starts[c] : lines.starts[c + 1]]) for c in range(len(guess))]
    for v in range(first, used[0]):
        _locate(v, vertices, lines, balls, guess)
        guess[:] = vertices.coordinates[:, 0, v]
    stack, corner, middle = np.empty((STACK, 3), np.int64), np.empty(3, np.int64), np.empty(3, np.int64)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        row = _slot(a, b, done)
        if done[row, 2] == c:
            runs[t, 0], runs[t, 1] = done[row, 3], done[row, 4]
            continue
        used[2] += done[row, 0] < 0
        done[row, 0], done[row, 1], done[row, 2], runs[t, 0] = a, b, c, used[3]
        top = put(stack, 0, a, b, c)
        while top > 0:
            if used[0] + 3 > len(points) or used[3] + 1 > len(parts) or 2 * max(used[1], used[2]) > len(done):
                return False
            top -= 1
            corner[:] = stack[top]
            for k in range(3):
                middle[k] = -1
                v, w = corner[k], corner[(k + 1) % 3]
                length = length_of(points, v, w)
                if length > detail and max(distances[v], distances[w]) <= far + length:
                    middle[k] = _middle(v, w, mesh[t], vertices, tables, lines, balls, guess, far + 0.5 * length)
            top, used[3] = _divide(corner, middle, points, distances, reach, stack, top, parts, used[3])
        runs[t, 1] = done[row, 4] = used[3]
        done[row, 3] = runs[t, 0]
    return True


@njit(cache=True)
def _middle(v, w, host, vertices, tables, lines, balls, guess, far):
    """Return the vertex in the middle of a side of triangle `host` of the mesh, -1 if it is too far; it may be new."""
    middles, n = tables.middles, tables.used[0]
    at = _slot(min(v, w), max(v, w), middles)
    if middles[at, 0] >= 0:
        return middles[at, 2]
    _average(v, w, n, host, vertices)
    for c in range(len(guess)):
        guess[c] = 0.5 * (vertices.coordinates[c, 0, v] + vertices.coordinates[c, 0, w])
    _locate(n, vertices, lines, balls, guess)
    middles[at, 0], middles[at, 1] = min(v, w), max(v, w)
    tables.used[1] += 1
    if vertices.distance[n] < far:
        middles[at, 2] = n
        tables.used[0] += 1
    return middles[at, 2]


@njit(cache=True)
def _average(v, w, n, host, vertices):
    """Make vertex n the mean of v and w, all three in triangle `host` of the mesh."""
    points, normals, corners, weights = vertices.points, vertices.normals, vertices.corners, vertices.weights
    for i in range(3):
        points[n, i] = 0.5 * (points[v, i] + points[w, i])
        normals[n, i] = 0.5 * (normals[v, i] + normals[w, i])
        total = 0.0
        for j in range(3):
            total += weights[v, j] * (corners[v, j] == host[i])
            total += weights[w, j] * (corners[w, j] == host[i])
        weights[n, i] = 0.5 * total
        corners[n, i] = host[i] if total > 0.0 else corners[v, 0]  # the mesh may lose the third


@njit(cache=True)
def _divide(corner, middle, points, distances, reach, stack, top, parts, m):
    """Put the parts of a triangle on the stack, or the triangle itself, if it stays and is within reach, in `parts`."""
    a, b, c, p, q, r = corner[0], corner[1], corner[2], middle[0], middle[1], middle[2]
    while (p < 0 and q >= 0) or (q < 0 and r >= 0):  # rotated until the halved sides are p, or p and q, or all
        a, b, c, p, q, r = b, c, a, q, r, p
    if p < 0:
        if min(distances[a], distances[b], distances[c]) < reach:
            m = put(parts, m, a, b, c)
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
    return top, m


@njit(cache=True)
def collect(parts, runs, n):
    """Join runs of triangles of n vertices into one mesh.

    Return the vertices in use, triangles of these, and for each the run that it comes from.
    """
    m, number = 0, np.full(n, -1, np.int32)
    for t in range(len(runs)):
        m += runs[t, 1] - runs[t, 0]
        for i in range(runs[t, 0], runs[t, 1]):
            number[parts[i, 0]] = number[parts[i, 1]] = number[parts[i, 2]] = 0
    vertices, count = np.empty(n, np.int32), 0
    for v in range(n):
        if number[v] == 0:
            vertices[count], number[v] = v, count
            count += 1
    triangles, hosts, m = np.empty((m, 3), np.int32), np.empty(m, np.int32), 0
    for t in range(len(runs)):
        for i in range(runs[t, 0], runs[t, 1]):
            hosts[m] = t
            m = put(triangles, m, number[parts[i, 0]], number[parts[i, 1]], number[parts[i, 2]])
    return vertices[:count].copy(), triangles, hosts


@njit(cache=True)
def first_change(points, others):
    """Return the first row in which two arrays of points differ."""
    n = min(len(points), len(others))
    for v in range(n):
        if points[v, 0] != others[v, 0] or points[v, 1] != others[v, 1] or points[v, 2] != others[v, 2]:
            return v
    return n


@njit(cache=True)
def length_of(points, v, w):
    """Distance between two points of an array."""
    return distance(points[v, 0], points[v, 1], points[v, 2], points, w)


@njit(cache=True)
def put(out, m, a, b, c):
    """Write a, b, c into row m; return the next row."""
    out[m, 0], out[m, 1], out[m, 2] = a, b, c
    return m + 1
