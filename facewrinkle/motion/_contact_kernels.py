"""Inner loops of contacts: distances from solids and between lips, energies, and the forces that keep them apart.

Positions x (n, 3) are in mm. A sample is a point of the skin with fixed barycentric coordinates `shares` in `corners`.
A row is a contact that the model of a step knows: gap(x + d) ~ gap + sum of slopes . d[vertices].
"""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import njit

DEEPEST = 1.0
"""No sample that is deeper in the other lip than this, mm, has come there through its surface."""


@njit(cache=True)
def at_sample(x, corners, shares, s, out):
    """Write the position of sample s to out (3,)."""
    for k in range(3):
        out[k] = 0.0
        for c in range(3):
            out[k] += shares[s, c] * x[corners[s, c], k]


@njit(cache=True)
def solid_gap(p, origin, axes, half, normal):
    """Return the distance of p (3,) from a ball, or from half of an elliptic cylinder; write its gradient (3,).

    The half cylinder ends at its origin, towards its third axis; its distance is that from the flank, scaled by the
    depth of the ellipse, or that from the end if this is larger. A negative first half axis stands for a ball, the
    second one is then its radius. Both distances are convex.
    """
    if half[0] < 0.0:
        square = 0.0
        for k in range(3):
            normal[k] = p[k] - origin[k]
            square += normal[k] * normal[k]
        d = np.sqrt(square)
        for k in range(3):
            normal[k] = normal[k] / d if d > 0.0 else 0.0
        return d - half[1]
    a, b, beyond = 0.0, 0.0, 0.0
    for k in range(3):
        offset = p[k] - origin[k]
        a += axes[0, k] * offset
        b += axes[1, k] * offset
        beyond += axes[2, k] * offset
    a /= half[0]
    b /= half[1]
    r = np.sqrt(a * a + b * b)
    gap = half[1] * (r - 1.0)
    if beyond > gap:
        normal[:] = axes[2]
        return beyond
    for k in range(3):
        normal[k] = half[1] * (a / half[0] * axes[0, k] + b / half[1] * axes[1, k]) / r if r > 0.0 else 0.0
    return gap


@njit(cache=True)
def near_solids(x, corners, shares, origins, axes, halves, allowed, reach):
    """Return the samples that are nearer to their solids than `allowed` (k,) and `reach` together."""
    p, normal = np.empty(3), np.empty(3)
    found = np.empty(corners.shape[0], np.int64)
    count = 0
    for s in range(corners.shape[0]):
        at_sample(x, corners, shares, s, p)
        if solid_gap(p, origins[s], axes[s], halves[s], normal) < allowed[s] + reach:
            found[count] = s
            count += 1
    return found[:count]


@njit(cache=True)
def solid_energy(x, near, corners, shares, origins, axes, halves, allowed, stiffness, grad):
    """Add up half stiffness times depth squared of the `near` samples deeper than allowed. Adds to grad."""
    p, normal = np.empty(3), np.empty(3)
    energy = 0.0
    for s in near:
        at_sample(x, corners, shares, s, p)
        depth = allowed[s] - solid_gap(p, origins[s], axes[s], halves[s], normal)
        if depth <= 0.0:
            continue
        force = stiffness[s] * depth
        energy += 0.5 * force * depth
        for c in range(3):
            for k in range(3):
                grad[corners[s, c], k] -= force * shares[s, c] * normal[k]
    return energy


@njit(cache=True)
def solid_rows(x, ahead, near, corners, shares, origins, axes, halves, allowed, stiffness, rows, first):
    """Write rows of the `near` samples that are too deep now, or would be after the displacement `ahead` (n, 3).

    `rows` are vertices (m, 6), slopes (m, 6, 3), depths (m,) after `ahead` and stiffness (m,); they are filled from row
    `first` on. Returns the number of rows that are then filled.
    """
    vertices, slopes, depths, stiff = rows
    p, normal = np.empty(3), np.empty(3)
    for s in near:
        at_sample(x, corners, shares, s, p)
        depth = allowed[s] - solid_gap(p, origins[s], axes[s], halves[s], normal)
        after = depth
        for c in range(3):
            for k in range(3):
                after -= shares[s, c] * normal[k] * ahead[corners[s, c], k]
        if depth <= 0.0 and after <= 0.0:
            continue
        for c in range(3):
            vertices[first, c] = vertices[first, c + 3] = corners[s, c]
            for k in range(3):
                slopes[first, c, k] = shares[s, c] * normal[k]
                slopes[first, c + 3, k] = 0.0
        depths[first], stiff[first] = after, stiffness[s]
        first += 1
    return first


@njit(cache=True)
def closest_on_triangle(p, x, i, j, l, bary):
    """Return the squared distance of p from the triangle of points i, j, l of x; write barycentric coordinates (3,).

    Regions of Voronoi as in Ericson, Real-Time Collision Detection (2005), section 5.1.5.
    """
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for k in range(3):
        a, b, c = x[i, k], x[j, k], x[l, k]
        ab, ac = b - a, c - a
        d1 += ab * (p[k] - a)
        d2 += ac * (p[k] - a)
        d3 += ab * (p[k] - b)
        d4 += ac * (p[k] - b)
        d5 += ab * (p[k] - c)
        d6 += ac * (p[k] - c)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w = d1 / (d1 - d3), 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    bary[0], bary[1], bary[2] = 1.0 - v - w, v, w
    square = 0.0
    for k in range(3):
        square += (p[k] - bary[0] * x[i, k] - v * x[j, k] - w * x[l, k]) ** 2
    return square


@njit(cache=True)
def lip_gap(x, p, triangles, open_edges, facing, candidates, bary, normal):
    """Return the signed distance of p from a surface of `triangles`, and the closest triangle.

    Writes the barycentric coordinates (3,) of the closest point, and the gradient (3,) of the distance. A point whose
    closest one lies on an open edge of the surface is beside it, and outside, as is one whose skin does not face the
    closest triangle at rest (`facing`, (m,)), or that is deeper than `DEEPEST`. `open_edges` (m,) holds a bit
    for each side of a triangle: 1 for that from corner 0 to 1, 2 for 1 to 2, 4 for 2 to 0.
    """
    best, which, steepest = np.inf, -1, 0.0
    own, face = np.empty(3), np.empty(3)
    for t in candidates:
        i, j, l = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        square = closest_on_triangle(p, x, i, j, l, own)
        if square > best * (1.0 + 1e-9) + 1e-12:
            continue
        a, b, c = x[i], x[j], x[l]
        face[0] = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
        face[1] = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
        face[2] = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        length = np.sqrt(face[0] ** 2 + face[1] ** 2 + face[2] ** 2)
        if length == 0.0:
            continue
        # Of triangles that share the closest point, the one that looks most towards p tells its side.
        up = 0.0
        for k in range(3):
            up += face[k] / length * (p[k] - own[0] * a[k] - own[1] * b[k] - own[2] * c[k])
        if square >= best * (1.0 - 1e-9) - 1e-12 and abs(up) <= abs(steepest):
            continue
        best, which, steepest = square, t, up
        for k in range(3):
            bary[k], normal[k] = own[k], face[k] / length
    if which < 0:
        return np.inf, -1
    sides = open_edges[which]
    on = (sides & 1 and bary[2] < 1e-9) or (sides & 2 and bary[0] < 1e-9) or (sides & 4 and bary[1] < 1e-9)
    d = np.sqrt(best)
    sign = 1.0 if steepest >= 0.0 or on or d > DEEPEST or not facing[which] else -1.0
    if d > 1e-9:
        for k in range(3):
            q = 0.0
            for c in range(3):
                q += bary[c] * x[triangles[which, c], k]
            normal[k] = sign * (p[k] - q) / d
    return sign * d, which


@njit(cache=True)
def near_triangles(x, corners, shares, triangles, open_edges, facing, order, starts, reach):
    """Return the triangles within `reach` of each sample, as offsets (k + 1,) and indices, and the gaps (k,).

    `order` holds the triangles sorted by their least first coordinate, and `starts` these coordinates. The gap is that
    of `lip_gap`.
    """
    n = corners.shape[0]
    gaps = np.full(n, np.inf)
    widest = 0.0
    for t in range(triangles.shape[0]):
        low, high = x[triangles[t, 0], 0], x[triangles[t, 0], 0]
        for c in range(1, 3):
            low, high = min(low, x[triangles[t, c], 0]), max(high, x[triangles[t, c], 0])
        widest = max(widest, high - low)
    offsets, found = np.zeros(n + 1, np.int64), np.empty(8 * n + 8, np.int64)
    p, own, normal = np.empty(3), np.empty(3), np.empty(3)
    count = 0
    for s in range(n):
        at_sample(x, corners, shares, s, p)
        i = np.searchsorted(starts, p[0] - reach - widest)
        while i < starts.shape[0] and starts[i] <= p[0] + reach:
            t = order[i]
            i += 1
            near = True
            for k in range(3):
                a, b, c = x[triangles[t, 0], k], x[triangles[t, 1], k], x[triangles[t, 2], k]
                if min(a, min(b, c)) > p[k] + reach or max(a, max(b, c)) < p[k] - reach:
                    near = False
                    break
            if not near or closest_on_triangle(p, x, triangles[t, 0], triangles[t, 1], triangles[t, 2], own) > reach**2:
                continue
            if count == found.shape[0]:
                longer = np.empty(2 * count, np.int64)
                longer[:count] = found
                found = longer
            found[count] = t
            count += 1
        if count > offsets[s]:
            near_this = found[offsets[s] : count]
            gaps[s] = lip_gap(x, p, triangles, open_edges, facing[s], near_this, own, normal)[0]
        offsets[s + 1] = count
    return offsets, found[:count], gaps


@njit(cache=True)
def lip_gaps(x, corners, shares, triangles, open_edges, facing, near):
    """Return the signed distances (k,) of samples from a surface; inf where there is nothing near."""
    p, bary, normal = np.empty(3), np.empty(3), np.empty(3)
    offsets, candidates = near
    gaps = np.empty(corners.shape[0])
    for s in range(corners.shape[0]):
        at_sample(x, corners, shares, s, p)
        gaps[s] = lip_gap(
            x, p, triangles, open_edges, facing[s], candidates[offsets[s] : offsets[s + 1]], bary, normal
        )[0]
    return gaps


@njit(cache=True)
def away_from(x, p, i, j, l, bary, normal):
    """Return the distance of p from the triangle of points i, j, l; write its closest point and gradient (3,).

    The distance is infinite if p is on the inner side: skin that was flung through the other lip may come back.
    """
    d = np.sqrt(closest_on_triangle(p, x, i, j, l, bary))
    if d == 0.0:
        return np.inf
    for k in range(3):
        normal[k] = (p[k] - bary[0] * x[i, k] - bary[1] * x[j, k] - bary[2] * x[l, k]) / d
    side = 0.0
    for k in range(3):
        e, f = (k + 1) % 3, (k + 2) % 3
        ae, af, be, bf = x[j, e] - x[i, e], x[j, f] - x[i, f], x[l, e] - x[i, e], x[l, f] - x[i, f]
        side += normal[k] * (ae * bf - af * be)
    return d if side > 0.0 else np.inf


@njit(cache=True)
def pushed_apart(force, corners, shares, triangle, bary, normal, grad):
    """Add the gradient of a sample and a triangle that a force pushes apart."""
    for c in range(3):
        for k in range(3):
            grad[corners[c], k] -= force * shares[c] * normal[k]
            grad[triangle[c], k] += force * bary[c] * normal[k]


@njit(cache=True)
def lip_energy(x, corners, shares, triangles, open_edges, facing, near, moved, allowed, stiffness, gaps, grad):
    """Add up half stiffness times depth squared of samples of one lip near or in the other. Adds to grad.

    A sample outside is pushed off every triangle that is too near, one inside towards the nearest. Both lips have moved
    by `moved` at most since `near` was found. Writes the gaps (k,), or lower bounds of large ones.
    """
    p, bary, normal = np.empty(3), np.empty(3), np.empty(3)
    offsets, candidates, at_first = near
    energy = 0.0
    for s in range(corners.shape[0]):
        gaps[s] = at_first[s] - 2.0 * moved
        if gaps[s] > allowed[s]:
            continue
        at_sample(x, corners, shares, s, p)
        these = candidates[offsets[s] : offsets[s + 1]]
        gaps[s], t = lip_gap(x, p, triangles, open_edges, facing[s], these, bary, normal)
        depth = allowed[s] - gaps[s]
        if depth <= 0.0:
            continue
        if gaps[s] <= 0.0:
            energy += 0.5 * stiffness[s] * depth * depth
            pushed_apart(stiffness[s] * depth, corners[s], shares[s], triangles[t], bary, normal, grad)
            continue
        for t in these:
            depth = allowed[s] - away_from(x, p, triangles[t, 0], triangles[t, 1], triangles[t, 2], bary, normal)
            if depth > 0.0:
                energy += 0.5 * stiffness[s] * depth * depth
                pushed_apart(stiffness[s] * depth, corners[s], shares[s], triangles[t], bary, normal, grad)
    return energy


@njit(cache=True)
def lip_rows(
    x, ahead, far, corners, shares, triangles, open_edges, facing, near, allowed, stiffness, gaps, rows, first
):
    """Write rows of samples and triangles that are too near each other now or after `ahead`, which nowhere exceeds
    `far`; see `solid_rows`. `gaps` is what `lip_energy` has written at x.
    """
    p, bary, normal = np.empty(3), np.empty(3), np.empty(3)
    offsets, candidates, _ = near
    for s in range(corners.shape[0]):
        if gaps[s] - 2.0 * far > allowed[s]:
            continue
        at_sample(x, corners, shares, s, p)
        these = candidates[offsets[s] : offsets[s + 1]]
        gap, t = lip_gap(x, p, triangles, open_edges, facing[s], these, bary, normal)
        if t < 0:
            continue
        if gap <= 0.0:
            after = allowed[s] - gap - approach(ahead, corners[s], shares[s], triangles[t], bary, normal)
            first = lip_row(after, s, t, corners, shares, triangles, bary, normal, stiffness, rows, first)
            continue
        # Of the triangles that it does not touch yet, the one that it would enter deepest.
        deepest, which = 0.0, -1
        for t in these:
            d = away_from(x, p, triangles[t, 0], triangles[t, 1], triangles[t, 2], bary, normal)
            after = allowed[s] - d - approach(ahead, corners[s], shares[s], triangles[t], bary, normal)
            if d < allowed[s]:
                first = lip_row(after, s, t, corners, shares, triangles, bary, normal, stiffness, rows, first)
            elif after > deepest:
                deepest, which = after, t
        if which >= 0:
            away_from(x, p, triangles[which, 0], triangles[which, 1], triangles[which, 2], bary, normal)
            first = lip_row(deepest, s, which, corners, shares, triangles, bary, normal, stiffness, rows, first)
    return first


@njit(cache=True)
def approach(ahead, corners, shares, triangle, bary, normal):
    """Return the change of the distance between a sample and a point of a triangle by displacements `ahead`."""
    change = 0.0
    for c in range(3):
        for k in range(3):
            change += normal[k] * (shares[c] * ahead[corners[c], k] - bary[c] * ahead[triangle[c], k])
    return change


@njit(cache=True)
def lip_row(after, s, t, corners, shares, triangles, bary, normal, stiffness, rows, first):
    """Write the row of a sample and a triangle; see `solid_rows`."""
    vertices, slopes, depths, stiff = rows
    if first == depths.shape[0]:
        return first
    place = 0
    slopes[first] = 0.0
    for c in range(6):
        own, share = (corners[s, c], shares[s, c]) if c < 3 else (triangles[t, c - 3], -bary[c - 3])
        if share != 0.0:
            vertices[first, place] = own
            for k in range(3):
                slopes[first, place, k] = share * normal[k]
            place += 1
    vertices[first, place:] = vertices[first, 0]
    depths[first], stiff[first] = after, stiffness[s]
    return first + 1


@njit(cache=True)
def shares_of_area(x, triangles, normals, double_area, out):
    """Write the areas (m,) of triangles as seen along `normals` (m, 3), relative to rest; negative if turned over."""
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, az = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        bx, by, bz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        signed = (ay * bz - az * by) * normals[f, 0] + (az * bx - ax * bz) * normals[f, 1]
        out[f] = (signed + (ax * by - ay * bx) * normals[f, 2]) / double_area[f]


@njit(cache=True)
def slopes_of_area(x, i, j, k, normal, scale, out):
    """Write the slopes (3, 3) of the area of a triangle seen along a normal, times `scale`, by its corners' places."""
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        ad, bd = x[j, d] - x[i, d], x[k, d] - x[i, d]
        ae, be = x[j, e] - x[i, e], x[k, e] - x[i, e]
        out[1, c] = scale * (bd * normal[e] - be * normal[d])
        out[2, c] = scale * (normal[d] * ae - normal[e] * ad)
        out[0, c] = -out[1, c] - out[2, c]


@njit(cache=True)
def flat_energy(x, shares, least, triangles, normals, double_area, heights, stiffness, grad):
    """Add up half stiffness times the missing height squared of triangles below the share `least`. Adds to grad."""
    slope = np.empty((3, 3))
    energy = 0.0
    for f in range(triangles.shape[0]):
        if shares[f] >= least:
            continue
        missing = heights[f] * (least - shares[f])
        force = stiffness[f] * missing
        energy += 0.5 * force * missing
        slopes_of_area(
            x, triangles[f, 0], triangles[f, 1], triangles[f, 2], normals[f], force * heights[f] / double_area[f], slope
        )
        for c in range(3):
            for k in range(3):
                grad[triangles[f, c], k] -= slope[c, k]
    return energy


@njit(cache=True)
def flat_rows(x, ahead, shares, after, least, triangles, normals, double_area, heights, stiffness, rows, first):
    """Write rows of triangles below the share `least` of their area now or after `ahead`; see `solid_rows`."""
    vertices, slopes, depths, stiff = rows
    slope = np.empty((3, 3))
    for f in range(triangles.shape[0]):
        if shares[f] >= least and after[f] >= least:
            continue
        if first == depths.shape[0]:
            break
        i, j, l = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        slopes_of_area(x, i, j, l, normals[f], heights[f] / double_area[f], slope)
        depth = heights[f] * (least - shares[f])
        for c in range(3):
            vertices[first, c] = vertices[first, c + 3] = triangles[f, c]
            for k in range(3):
                slopes[first, c, k] = slope[c, k]
                slopes[first, c + 3, k] = 0.0
                depth -= slope[c, k] * ahead[triangles[f, c], k]
        depths[first], stiff[first] = depth, stiffness[f]
        first += 1
    return first


@njit(cache=True)
def compliance(vertices, slopes, involved, slots, columns):
    """Return the change (m, m) of the gaps of rows by unit forces at rows.

    `columns[slots[v]]` (n, 3) is the response of all vertices to unit forces along the coordinates at vertex v, and
    `involved` are the vertices of the rows in ascending order.
    """
    m, n = vertices.shape[0], involved.shape[0]
    out, moved = np.empty((m, m)), np.empty((n, 3))
    near = np.empty((n, n, 3), np.float32)
    for i in range(n):
        for j in range(n):
            near[i, j] = columns[slots[involved[i]], involved[j]]
    size, place = np.empty(m, np.int64), np.empty((m, 6), np.int64)
    for r in range(m):
        size[r] = 6
        while size[r] > 1 and not slopes[r, size[r] - 1].any():
            size[r] -= 1
        for a in range(size[r]):
            place[r, a] = np.searchsorted(involved, vertices[r, a])
    for r in range(m):
        moved[:] = 0.0
        for a in range(size[r]):
            i = place[r, a]
            for j in range(n):
                for k in range(3):
                    moved[j, k] += slopes[r, a, k] * near[i, j, k]
        for q in range(r + 1):
            total = 0.0
            for b in range(size[q]):
                for k in range(3):
                    total += slopes[q, b, k] * moved[place[q, b], k]
            out[r, q] = out[q, r] = total
    return out


@njit(cache=True)
def contact_forces(response, depths, stiffness, sweeps, tolerance):
    """Return the forces f >= 0 (m,) with f = stiffness * max(depths - response f, 0) (projected Gauss-Seidel)."""
    m = depths.shape[0]
    forces, pushed = np.zeros(m), np.zeros(m)
    for _ in range(sweeps):
        largest = 0.0
        for r in range(m):
            give = 1.0 / stiffness[r]
            change = (depths[r] - pushed[r] - give * forces[r]) / (response[r, r] + give)
            change = max(forces[r] + change, 0.0) - forces[r]
            if change == 0.0:
                continue
            forces[r] += change
            for q in range(m):
                pushed[q] += response[r, q] * change
            largest = max(largest, abs(change) * response[r, r])
        if largest < tolerance:
            break
    return forces


@njit(cache=True)
def add_forces(vertices, slopes, forces, out):
    """Add the forces of rows to those of vertices (n, 3)."""
    for r in range(forces.shape[0]):
        for c in range(6):
            for k in range(3):
                out[vertices[r, c], k] += forces[r] * slopes[r, c, k]


@njit(cache=True)
def added_up(forces, pushed, slots, columns):
    """Return the responses (n, 3) to the forces at the vertices `pushed`; see `compliance`."""
    out = np.zeros(forces.shape)
    for v in pushed:
        x, y, z = forces[v]
        column = columns[slots[v]]
        for i in range(out.shape[0]):
            out[i, 0] += x * column[i, 0]
            out[i, 1] += y * column[i, 1]
            out[i, 2] += z * column[i, 2]
    return out


@njit(cache=True)
def farthest_moved(x, y, vertices):
    """Return the largest distance between points of x (n, 3) and y, of those with the given indices."""
    largest = 0.0
    for i in vertices:
        square = 0.0
        for k in range(3):
            square += (x[i, k] - y[i, k]) ** 2
        largest = max(largest, square)
    return np.sqrt(largest)


@njit(cache=True)
def turn(vectors, centre, axis, angles):
    """Turn vectors (k, 3) by angles (k,) about an axis (Rodrigues), in place."""
    for i in range(vectors.shape[0]):
        if angles[i] == 0.0:
            continue
        cos, sin = np.cos(angles[i]), np.sin(angles[i])
        x, y, z = vectors[i, 0] - centre[0], vectors[i, 1] - centre[1], vectors[i, 2] - centre[2]
        axial = (1.0 - cos) * (x * axis[0] + y * axis[1] + z * axis[2])
        vectors[i, 0] = centre[0] + cos * x + axial * axis[0] + sin * (axis[1] * z - axis[2] * y)
        vectors[i, 1] = centre[1] + cos * y + axial * axis[1] + sin * (axis[2] * x - axis[0] * z)
        vectors[i, 2] = centre[2] + cos * z + axial * axis[2] + sin * (axis[0] * y - axis[1] * x)
