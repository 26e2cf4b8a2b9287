"""Machine code for the checks of the skin."""

from __future__ import annotations

import numpy as np
from numba import njit

from facewrinkle.geometry.interpolation import closest_in_triangle

UPRIGHT = np.cos(np.deg2rad(45.0))
"""Triangles whose normals turn less than this, amid hardly changed edges, are not turned over."""

HARDLY = 0.3
"""Edges that change by no more than this share of their length, turns included, have hardly changed."""


@njit(cache=True)
def crossed(points, triangles, out):
    """Write the cross products (m, 3) of the sides of triangles, twice their areas long."""
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
        out[t, 0], out[t, 1], out[t, 2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@njit(cache=True)
def changes(points, rest, start, ring, weight, out):
    """Write the largest change (n,) of the offsets of the neighbors of each vertex, relative to their length, squared.

    `weight` are the inverse squares of their lengths at rest.
    """
    for v in range(points.shape[0]):
        out[v] = 0.0
        for e in range(start[v], start[v + 1]):
            square = 0.0
            for k in range(3):
                square += (points[ring[e], k] - points[v, k] - rest[ring[e], k] + rest[v, k]) ** 2
            out[v] = max(out[v], square * weight[e])


@njit(cache=True)
def doubtful(cross, rest, change, triangles, out):
    """Write the triangles that may be turned over, by their normals now and at rest (m, 3) and the changes (n,) around
    their corners; return their number.
    """
    count = 0
    for t in range(triangles.shape[0]):
        dot = own = before = 0.0
        for k in range(3):
            dot += cross[t, k] * rest[t, k]
            own += cross[t, k] ** 2
            before += rest[t, k] ** 2
        around = max(change[triangles[t, 0]], change[triangles[t, 1]], change[triangles[t, 2]])
        if dot <= UPRIGHT * np.sqrt(own * before) or around > HARDLY * HARDLY:
            out[count] = t
            count += 1
    return count


@njit(cache=True)
def spread(points, rest, start, ring, weight, v, out):
    """Write the weighted products of the offsets of the neighbors of a vertex, now and at rest, to `out` (3, 3)."""
    out[:] = 0.0
    for e in range(start[v], start[v + 1]):
        w = ring[e]
        x, y, z = rest[w, 0] - rest[v, 0], rest[w, 1] - rest[v, 1], rest[w, 2] - rest[v, 2]
        for k in range(3):
            now = weight[e] * (points[w, k] - points[v, k])
            out[k, 0] += now * x
            out[k, 1] += now * y
            out[k, 2] += now * z


@njit(cache=True)
def largest_eigenvector(a, vectors, out):
    """Write the eigenvector (4,) of the largest eigenvalue of a symmetric matrix (4, 4), by Jacobi's turns."""
    vectors[:] = 0.0
    for i in range(4):
        vectors[i, i] = 1.0
    for _ in range(12):
        off = a[0, 1] ** 2 + a[0, 2] ** 2 + a[0, 3] ** 2 + a[1, 2] ** 2 + a[1, 3] ** 2 + a[2, 3] ** 2
        if off <= 1e-28 * (a[0, 0] ** 2 + a[1, 1] ** 2 + a[2, 2] ** 2 + a[3, 3] ** 2):
            break
        for p in range(3):
            for q in range(p + 1, 4):
                if a[p, q] == 0.0:
                    continue
                ratio = (a[q, q] - a[p, p]) / (2.0 * a[p, q])
                t = (1.0 if ratio >= 0.0 else -1.0) / (abs(ratio) + np.sqrt(ratio * ratio + 1.0))
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(4):
                    x, y = a[k, p], a[k, q]
                    a[k, p], a[k, q] = c * x - s * y, s * x + c * y
                for k in range(4):
                    x, y = a[p, k], a[q, k]
                    a[p, k], a[q, k] = c * x - s * y, s * x + c * y
                    x, y = vectors[k, p], vectors[k, q]
                    vectors[k, p], vectors[k, q] = c * x - s * y, s * x + c * y
    best = 0
    for i in range(1, 4):
        if a[i, i] > a[best, best]:
            best = i
    for k in range(4):
        out[k] = vectors[k, best]


@njit(cache=True)
def by_eigenvector(m, n, vectors, q, vector, out):
    """Write a vector (3,), turned by the rotation nearest to a matrix m (3, 3), to `out`.

    Horn, "Closed-form solution of absolute orientation using unit quaternions", 1987.
    """
    n[0, 0] = m[0, 0] + m[1, 1] + m[2, 2]
    n[1, 1], n[2, 2] = m[0, 0] - m[1, 1] - m[2, 2], m[1, 1] - m[0, 0] - m[2, 2]
    n[3, 3] = m[2, 2] - m[0, 0] - m[1, 1]
    n[0, 1] = n[1, 0] = m[2, 1] - m[1, 2]
    n[0, 2] = n[2, 0] = m[0, 2] - m[2, 0]
    n[0, 3] = n[3, 0] = m[1, 0] - m[0, 1]
    n[1, 2] = n[2, 1] = m[1, 0] + m[0, 1]
    n[1, 3] = n[3, 1] = m[0, 2] + m[2, 0]
    n[2, 3] = n[3, 2] = m[2, 1] + m[1, 2]
    largest_eigenvector(n, vectors, q)
    w, x, y, z = q[0], q[1], q[2], q[3]
    a, b, c = vector[0], vector[1], vector[2]
    u = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    out[0] = a + w * u[0] + y * u[2] - z * u[1]
    out[1] = b + w * u[1] + z * u[0] - x * u[2]
    out[2] = c + w * u[2] + x * u[1] - y * u[0]


@njit(cache=True)
def by_largest_root(m, vector, out):
    """Write a vector (3,), turned by the rotation nearest to a matrix m (3, 3), to `out`, and return True.

    That takes a tenth of the time of an eigenvector (Markley, "Attitude determination using vector observations: a fast
    optimal matrix algorithm", 1993), but returns False where the rotation is nearly undetermined.
    """
    square = 0.0
    for i in range(3):
        for k in range(3):
            square += m[i, k] * m[i, k]
    cofactors = np.empty((3, 3))
    own = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for l in range(3):
            p, q = (l + 1) % 3, (l + 2) % 3
            cofactors[i, l] = m[j, p] * m[k, q] - m[j, q] * m[k, p]
            own += cofactors[i, l] ** 2
    det = m[0, 0] * cofactors[0, 0] + m[0, 1] * cofactors[0, 1] + m[0, 2] * cofactors[0, 2]
    root = np.sqrt(3.0 * square)  # the sum of the singular values is not larger
    for _ in range(40):  # Newton's method comes down to the largest root
        inner = root * root - square
        slope = 4.0 * root * inner - 8.0 * det
        step = (inner * inner - 8.0 * root * det - 4.0 * own) / slope if slope > 0.0 else 0.0
        root -= step
        if abs(step) <= 1e-15 * root:
            break
    half = 0.5 * (root * root - square)
    scale = half * root - det
    if not scale > 1e-3 * root**3:
        return False
    across, along = np.empty(3), np.empty(3)
    for i in range(3):
        across[i] = m[i, 0] * vector[0] + m[i, 1] * vector[1] + m[i, 2] * vector[2]
    for i in range(3):
        along[i] = m[0, i] * across[0] + m[1, i] * across[1] + m[2, i] * across[2]
    for i in range(3):
        turned = (half + square) * across[i]
        for k in range(3):
            turned += root * cofactors[i, k] * vector[k] - m[i, k] * along[k]
        out[i] = turned / scale
    return True


@njit(cache=True)
def area_shares(points, rest, start, ring, weight, triangles, chosen, cross, rest_cross, out):
    """Write the areas of chosen triangles along their rest normals, turned with the skin around, relative to rest.

    `start` and `ring` are the neighbors of each vertex that tell the turn.
    """
    m, n, vectors, q = np.empty((3, 3)), np.empty((4, 4)), np.empty((4, 4)), np.empty(4)
    spreads, known, turned = np.empty((points.shape[0], 3, 3)), np.zeros(points.shape[0], np.bool_), np.empty(3)
    for i in range(chosen.shape[0]):
        t = chosen[i]
        m[:] = 0.0
        for s in range(3):
            v = triangles[t, s]
            if not known[v]:
                spread(points, rest, start, ring, weight, v, spreads[v])
                known[v] = True
            m += spreads[v]
        if not by_largest_root(m, rest_cross[t], turned):
            by_eigenvector(m, n, vectors, q, rest_cross[t], turned)
        share = square = 0.0
        for k in range(3):
            share += cross[t, k] * turned[k]
            square += rest_cross[t, k] ** 2
        out[i] = share / square


@njit(cache=True)
def off_node(query, low, high):
    """Return the squared distance of a point from a box."""
    square = 0.0
    for k in range(3):
        off = max(low[k] - query[k], query[k] - high[k], 0.0)
        square += off * off
    return square


@njit(cache=True)
def off_box(query, points, triangle):
    """Return the squared distance of a point from the box around a triangle."""
    square = 0.0
    for k in range(3):
        p, q, r = points[triangle[0], k], points[triangle[1], k], points[triangle[2], k]
        off = max(min(p, q, r) - query[k], query[k] - max(p, q, r), 0.0)
        square += off * off
    return square


@njit(cache=True)
def squared_distances(query, points, triangles, most, out):
    """Write the squared distance (m,) of triangles from a point; infinity for some that are farther than `most`."""
    weights = np.empty(3)
    for t in range(triangles.shape[0]):
        out[t] = np.inf
        if off_box(query, points, triangles[t]) < most * most:
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            out[t] = closest_in_triangle(query, points[a], points[b], points[c], weights)


@njit(cache=True)
def signed_distance(query, points, triangles, kept, normals, border, tree, out):
    """Write distance, side, 1.0 if the closest point of a sheet lies on its border, and its triangle, to `out` (4,).

    A point is behind the sheet (-1.0) if it is behind all triangles that meet at the closest point: where a sheet is
    crumpled, what is behind one of its triangles and before another is not behind the sheet.

    The search begins at the triangle that `out` holds. `kept` are the triangles of the sheet, `normals` (m, 3) theirs;
    `border` (m, 3) is True for sides of triangles opposite each corner that have no neighbor. The `tree` of boxes
    around them is their order, how many are in a leaf, and the low and high ends of the boxes, as in a heap.
    """
    weights, stack = np.empty(3), np.empty(64, np.int64)
    order, leaf, low, high = tree
    nearest, first = int(out[3]), low.shape[0] // 2
    a, b, c = triangles[nearest, 0], triangles[nearest, 1], triangles[nearest, 2]
    best = closest_in_triangle(query, points[a], points[b], points[c], weights)
    on_border, side = ends_at(weights, border[nearest]), side_of(query, points, triangles[nearest], normals[nearest])
    stack[0], top = 0, 1
    while top > 0:
        top -= 1
        node = stack[top]
        if off_node(query, low[node], high[node]) > best * (1.0 + 1e-9):
            continue
        if node < first:
            one, other = 2 * node + 1, 2 * node + 2
            if off_node(query, low[one], high[one]) < off_node(query, low[other], high[other]):
                one, other = other, one
            stack[top], stack[top + 1] = one, other
            top += 2
            continue
        begin = (node - first) * leaf
        for i in order[begin : min(begin + leaf, order.shape[0])]:
            t = kept[i]
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            if off_box(query, points, triangles[t]) > best * (1.0 + 1e-9):
                continue
            d = closest_in_triangle(query, points[a], points[b], points[c], weights)
            if d > best * (1.0 + 1e-9):
                continue
            own, ends = side_of(query, points, triangles[t], normals[t]), ends_at(weights, border[t])
            if d < best * (1.0 - 1e-9):
                side, on_border = own, ends
            else:
                side, on_border = max(side, own), max(on_border, ends)
            if d < best:
                best, nearest = d, t
    out[0], out[1], out[2], out[3] = np.sqrt(best), side, on_border, nearest


@njit(cache=True)
def side_of(query, points, triangle, normal):
    """Return -1.0 for a point behind the plane of a triangle, otherwise 1.0."""
    height = 0.0
    for k in range(3):
        height += (query[k] - points[triangle[0], k]) * normal[k]
    return -1.0 if height < 0.0 else 1.0


@njit(cache=True)
def ends_at(weights, border):
    """Return 1.0 if a point of a triangle, by its barycentric coordinates, lies on a side that is border."""
    for s in range(3):
        if border[s] and weights[s] < 1e-9:
            return 1.0
    return 0.0


@njit(cache=True)
def penetrating(points, triangles, kept, normals, border, tree, start, ring, seeds, depth):
    """Write the depth (n,) behind a sheet of the vertices that can be reached from `seeds` without leaving its back.

    Vertices before the sheet, or nearest to its border, stay at 0. `start` and `ring` are the edges that may be walked.
    """
    found, seen = np.empty(4), np.zeros(points.shape[0], np.bool_)
    found[3] = kept[0]
    stack, top = np.empty(points.shape[0], np.int64), 0
    for v in seeds:
        if not seen[v]:
            seen[v] = True
            stack[top] = v
            top += 1
    while top > 0:
        top -= 1
        v = stack[top]
        signed_distance(points[v], points, triangles, kept, normals, border, tree, found)
        if found[1] > 0.0 or found[2] > 0.0:
            continue
        depth[v] = found[0]
        for e in range(start[v], start[v + 1]):
            if ring[e] >= 0 and not seen[ring[e]]:
                seen[ring[e]] = True
                stack[top] = ring[e]
                top += 1


@njit(cache=True)
def penetrating_edges(points, triangles, kept, normals, border, tree, edges, depth):
    """Write the depth (e,) behind a sheet of the deepest of three points on each edge; 0 before it."""
    found, at = np.empty(4), np.empty(3)
    found[3] = kept[0]
    for e in range(edges.shape[0]):
        for quarter in range(1, 4):
            for k in range(3):
                first, last = points[edges[e, 0], k], points[edges[e, 1], k]
                at[k] = first + 0.25 * quarter * (last - first)
            signed_distance(at, points, triangles, kept, normals, border, tree, found)
            if found[1] < 0.0 and found[2] == 0.0:
                depth[e] = max(depth[e], found[0])


@njit(cache=True)
def sampled(points, triangles, firsts, shares, low, high, middle, axes, half, places, chosen):
    """Write the samples that lie in a box and an upright elliptic cylinder, and their places; return their number.

    Samples from `firsts[t]` on lie at `shares` (s, 3) of triangle t; the cylinder stands around `middle` on two `axes`
    (2, 3) with the half axes `half` (2,).
    """
    count, x = 0, np.empty(3)
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        outside = False
        for k in range(3):
            p, q, r = points[a, k], points[b, k], points[c, k]
            outside = outside or max(p, q, r) < low[k] or min(p, q, r) > high[k]
        if outside:
            continue
        for i in range(firsts[t], firsts[t + 1]):
            across = along = 0.0
            for k in range(3):
                x[k] = shares[i, 0] * points[a, k] + shares[i, 1] * points[b, k] + shares[i, 2] * points[c, k]
                across += axes[0, k] * (x[k] - middle[k])
                along += axes[1, k] * (x[k] - middle[k])
            if (across / half[0]) ** 2 + (along / half[1]) ** 2 < 1.0:
                places[count] = x
                chosen[count] = i
                count += 1
    return count


@njit(cache=True)
def edges_in_box(points, edges, low, high, out):
    """Write the edges whose own boxes meet a box; return how many there are."""
    count = 0
    for e in range(edges.shape[0]):
        meets = True
        for k in range(3):
            p, q = points[edges[e, 0], k], points[edges[e, 1], k]
            meets = meets and max(p, q) >= low[k] and min(p, q) <= high[k]
        if meets:
            out[count] = e
            count += 1
    return count


@njit(cache=True)
def in_solids(places, points, triangles, firsts, middles, axes, low, high, depth):
    """Write the depth (s,) of places in any of several closed solids, in order the triangles from `firsts` (b + 1,) on.

    Solid b lies between `low` and `high` (b, 3) along `axes` (b, 3, 3) from `middles` (b, 3).
    """
    for i in range(places.shape[0]):
        depth[i] = 0.0
        for b in range(low.shape[0]):
            inside = True
            for k in range(3):
                along = 0.0
                for j in range(3):
                    along += axes[b, k, j] * (places[i, j] - middles[b, j])
                if along < low[b, k] or along > high[b, k]:
                    inside = False
                    break
            if inside:
                depth[i] = max(depth[i], depth_in_solid(places[i], points, triangles, firsts[b], firsts[b + 1]))


@njit(cache=True)
def depth_in_solid(query, points, triangles, first, last):
    """Return the depth of a point in the closed solid of the triangles from `first` to `last`; 0 outside."""
    winding, a, b, c = 0.0, np.empty(3), np.empty(3), np.empty(3)
    for t in range(first, last):  # solid angles (Van Oosterom and Strackee)
        aa = bb = cc = ab = bc = ca = 0.0
        for k in range(3):
            a[k] = points[triangles[t, 0], k] - query[k]
            b[k] = points[triangles[t, 1], k] - query[k]
            c[k] = points[triangles[t, 2], k] - query[k]
            aa += a[k] * a[k]
            bb += b[k] * b[k]
            cc += c[k] * c[k]
            ab += a[k] * b[k]
            bc += b[k] * c[k]
            ca += c[k] * a[k]
        volume = (
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        )
        aa, bb, cc = np.sqrt(aa), np.sqrt(bb), np.sqrt(cc)
        winding += 2.0 * np.arctan2(volume, aa * bb * cc + ab * cc + bc * aa + ca * bb)
    if abs(winding) < 2.0 * np.pi:
        return 0.0
    best = np.inf
    for t in range(first, last):
        near = closest_in_triangle(query, points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]], a)
        best = min(best, near)
    return np.sqrt(best)


@njit(cache=True)
def beyond_way(place, start, end, coasting, beyond):
    """Lower `beyond` (n,) to how far vertices at `place` (n, 3) are off the way from `start` to `end`, where that is
    less.

    The way of a vertex is the ball between both, widened by a fifth of the larger of both, by `coasting` (n,), and by
    half a millimeter.
    """
    for v in range(start.shape[0]):
        way = first = last = off = 0.0
        for k in range(3):
            way += (end[v, k] - start[v, k]) ** 2
            first += start[v, k] ** 2
            last += end[v, k] ** 2
            off += (place[v, k] - 0.5 * (start[v, k] + end[v, k])) ** 2
        allowed = 0.5 * np.sqrt(way) + 0.2 * np.sqrt(max(first, last)) + coasting[v] + 0.5
        beyond[v] = min(beyond[v], np.sqrt(off) - allowed)
