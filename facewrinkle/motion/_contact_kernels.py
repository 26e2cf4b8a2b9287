"""Inner loops of contacts: distances from solids, energies, and the forces that keep them apart.

Positions x (n, 3) are in mm. A sample is a point of the skin with fixed barycentric coordinates `shares` in `corners`.
A row is a contact that the model of a step knows: gap(x + d) ~ gap + sum of slopes . d[vertices].
"""

from __future__ import annotations

import numpy as np

from ..anatomy.teeth import END_RADIUS
from ..geometry import area_vector, compiled
from ..geometry.least_squares import cholesky_solve
from ._skin_kernels import slopes_of_area


@compiled
def at_sample(x, corners, shares, s, out):
    """Write the position of sample s to out (3,)."""
    for k in range(3):
        out[k] = 0.0
        for c in range(3):
            out[k] += shares[s, c] * x[corners[s, c], k]


@compiled
def solid_gap(p, origins, axes, halves, s, normal):
    """Return the distance of p (3,) from solid s, a ball or half of an elliptic cylinder; write its gradient (3,).

    The half cylinder ends at its origin, towards its third axis: there its flank rounds off as a parabola, so slowly
    that nothing has two places of rest at its end. Its distance is that from the flank, scaled by the depth of the
    ellipse, plus what the flank has receded. A negative first half axis stands for a ball, the second one is then its
    radius. Both distances are convex.
    """
    if halves[s, 0] < 0.0:
        square = 0.0
        for k in range(3):
            normal[k] = p[k] - origins[s, k]
            square += normal[k] * normal[k]
        d = np.sqrt(square)
        for k in range(3):
            normal[k] = normal[k] / d if d > 0.0 else 0.0
        return d - halves[s, 1]
    a, b, beyond = 0.0, 0.0, 0.0
    for k in range(3):
        offset = p[k] - origins[s, k]
        a += axes[s, 0, k] * offset
        b += axes[s, 1, k] * offset
        beyond += axes[s, 2, k] * offset
    a /= halves[s, 0]
    b /= halves[s, 1]
    r = np.sqrt(a * a + b * b)
    beyond = max(beyond, 0.0)
    for k in range(3):
        aside = a / halves[s, 0] * axes[s, 0, k] + b / halves[s, 1] * axes[s, 1, k]
        normal[k] = halves[s, 1] * aside / r if r > 0.0 else 0.0
        normal[k] += beyond / END_RADIUS * axes[s, 2, k]
    return halves[s, 1] * (r - 1.0) + 0.5 * beyond * beyond / END_RADIUS


@compiled
def gaps_of(x, samples, solids):
    """Return the distances (k,) of all samples from what they meet."""
    (corners, shares, partners, allowed, _), (origins, axes, halves, _) = samples, solids
    p, normal, out = np.empty(3), np.empty(3), np.empty_like(allowed)
    for s in range(len(out)):
        at_sample(x, corners, shares, s, p)
        if partners[s, 0] < 0:
            out[s] = solid_gap(p, origins, axes, halves, -1 - partners[s, 0], normal)
        else:
            out[s] = plane_gap(p, x, partners, s, normal)
    return out


@compiled
def sample_rows(x, ahead, still, near, samples, solids, full, rows):
    """Write rows of the `near` samples that are too deep now, or would be after the displacement `ahead` (n, 3).

    It is `still` if it is 0 everywhere. Depths are those below the planes of triangles times the `firmness` of these,
    whose `full` areas are given (k,), or those in solids. `rows` are vertices (m, 6), slopes (m, 6, 3), depths (m,)
    after `ahead` and stiffness (m,). Returns the number of rows that are filled.
    """
    (corners, shares, partners, allowed, stiffness), (origins, axes, halves, _) = samples, solids
    vertices, slopes, depths, stiff = rows
    p, normal, bary, turn = np.empty(3), np.empty(3), np.zeros(3), np.zeros((3, 3))
    count = 0
    for s in near:
        at_sample(x, corners, shares, s, p)
        of_skin, firm = partners[s, 0] >= 0, 1.0
        if of_skin:
            gap = plane_gap(p, x, partners, s, normal)
        else:
            gap = solid_gap(p, origins, axes, halves, -1 - partners[s, 0], normal)
        after = depth = allowed[s] - gap
        if depth == -np.inf or (still and depth <= 0.0):
            continue
        if of_skin:
            foot(p, x, partners, s, bary)
        for c in range(3):
            for k in range(3):
                after -= normal[k] * shares[s, c] * ahead[corners[s, c], k]
                if of_skin and partners[s, c] < ahead.shape[0]:
                    after += normal[k] * bary[c] * ahead[partners[s, c], k]
        if depth <= 0.0 and after <= 0.0:
            continue
        if of_skin:
            firm = firmness(x, partners, s, full[s], turn)
        after *= firm
        for c in range(3):
            moves = of_skin and partners[s, c] < ahead.shape[0]
            vertices[count, c], vertices[count, c + 3] = corners[s, c], partners[s, c] if moves else corners[s, c]
            for k in range(3):
                slopes[count, c, k] = firm * shares[s, c] * normal[k]
                slopes[count, c + 3, k] = -firm * bary[c] * normal[k] - depth * turn[c, k] if moves else 0.0
                after += depth * turn[c, k] * ahead[partners[s, c], k] if moves else 0.0
        depths[count], stiff[count] = after, stiffness[s]
        count += 1
    return count


@compiled
def flat_rows(x, ahead, shares, after, least, triangles, normals, double_area, heights, stiffness, rows, first):
    """Write rows of triangles below the share `least` of their area now or after `ahead`, from row `first` on; see
    `sample_rows`.
    """
    vertices, slopes, depths, stiff = rows
    slope = np.empty((3, 3))
    for f in range(triangles.shape[0]):
        if shares[f] >= least and after[f] >= least:
            continue
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


@compiled
def energy_of(rows, count, grad):
    """Add up half stiffness times depth squared of the first `count` rows; none may be negative. Adds to grad."""
    vertices, slopes, depths, stiff = rows
    energy = 0.0
    for r in range(count):
        force = stiff[r] * depths[r]
        energy += 0.5 * force * depths[r]
        for c in range(6):
            for k in range(3):
                grad[vertices[r, c], k] -= force * slopes[r, c, k]
    return energy


@compiled(inline="always")
def own_compliance(rows, columns):
    """Return the change (m,) of the gap of each row by a unit force at itself."""
    slopes, size, involved, place, slots = rows
    out = np.zeros(len(slopes))
    for r in range(len(slopes)):
        for a in range(size[r]):
            column = columns[slots[place[r, a]]]
            for b in range(size[r]):
                for k in range(3):
                    out[r] += slopes[r, a, k] * slopes[r, b, k] * column[involved[place[r, b]], k]
    return out


@compiled
def compliance(r, rows, columns, known, out):
    """Write the changes (m,) of the gaps of all rows by a unit force at row r to out[r], which is then known.

    `columns[slot]` (n, 3) is the response of all vertices to unit forces along the coordinates at a vertex, and `out`
    (m, m) symmetric.
    """
    slopes, size, involved, place, slots = rows
    moved = np.zeros((len(involved), 3))
    for a in range(size[r]):
        column = columns[slots[place[r, a]]]
        x, y, z = slopes[r, a, 0], slopes[r, a, 1], slopes[r, a, 2]
        for j in range(len(involved)):
            i = involved[j]
            moved[j, 0] += x * column[i, 0]
            moved[j, 1] += y * column[i, 1]
            moved[j, 2] += z * column[i, 2]
    for q in range(len(slopes)):
        if known[q]:
            out[r, q] = out[q, r]
            continue
        x, y, z = 0.0, 0.0, 0.0
        for b in range(size[q]):
            j = place[q, b]
            x += slopes[q, b, 0] * moved[j, 0]
            y += slopes[q, b, 1] * moved[j, 1]
            z += slopes[q, b, 2] * moved[j, 2]
        out[r, q] = x + y + z
    known[r] = True


@compiled
def contact_forces(rows, columns, depths, stiffness, start, rounds, tolerance):
    """Return the forces f >= 0 (m,) with f = stiffness * max(depths - response (f - start), 0).

    Sweeps of projected Gauss-Seidel find which contacts press, and a direct solution how much these do (Dostal, Optimal
    Quadratic Programming Algorithms, 2009, section 5.8). Most never press: responses are worked out for those that do.
    """
    # Loops compile faster than expressions of arrays, and than rows that are taken apart.
    m = depths.shape[0]
    own, response, known = own_compliance(rows, columns), np.empty((m, m)), np.zeros(m, np.bool_)
    forces, pushed, free, pressing = start.copy(), np.zeros(m), np.empty(m), np.empty(m, np.int64)
    for r in range(m):
        if start[r] != 0.0:
            compliance(r, rows, columns, known, response)
            add(start[r], response[r], pushed)
    for r in range(m):
        free[r] = depths[r] + pushed[r]
    for _ in range(rounds):
        for _ in range(8):  # sweeps before a direct solution
            largest = 0.0
            for r in range(m):
                give = 1.0 / stiffness[r]
                change = (free[r] - pushed[r] - give * forces[r]) / (own[r] + give)
                change = max(forces[r] + change, 0.0) - forces[r]
                if change == 0.0:
                    continue
                if not known[r]:
                    compliance(r, rows, columns, known, response)
                forces[r] += change
                add(change, response[r], pushed)
                largest = max(largest, abs(change) * own[r])
            if largest < tolerance:
                return forces
        count = 0
        for r in range(m):
            if forces[r] > 0.0:
                pressing[count] = r
                count += 1
        to_solve, wanted = np.empty((count, count)), np.empty(count)
        for i in range(count):
            for j in range(i + 1):
                to_solve[i, j] = response[pressing[i], pressing[j]]
            to_solve[i, i] += 1.0 / stiffness[pressing[i]]
            wanted[i] = free[pressing[i]]
        cholesky_solve(to_solve, wanted)
        share = 1.0
        for i in range(count):
            now = forces[pressing[i]]
            if wanted[i] < 0.0:
                share = min(share, now / (now - wanted[i]))
        for i in range(count):
            r = pressing[i]
            change = max(forces[r] + share * (wanted[i] - forces[r]), 0.0) - forces[r]
            forces[r] += change
            add(change, response[r], pushed)
    return forces


@compiled
def add(factor, vector, out):
    """Add a multiple of a vector (m,) to another."""
    for i in range(len(out)):
        out[i] += factor * vector[i]


@compiled
def added_up(forces, pushed, slots, columns):
    """Return the responses (n, 3) to the forces at the vertices `pushed`; see `compliance`."""
    out = np.zeros(forces.shape)
    for v in pushed:
        x, y, z = forces[v, 0], forces[v, 1], forces[v, 2]
        column = columns[slots[v]]
        for i in range(out.shape[0]):
            out[i, 0] += x * column[i, 0]
            out[i, 1] += y * column[i, 1]
            out[i, 2] += z * column[i, 2]
    return out


@compiled
def plane_gap(p, x, triangles, s, normal):
    """Return the height of p (3,) above the plane of triangle s, inf if this has no area; write its normal (3,)."""
    normal[0], normal[1], normal[2] = area_vector(x, triangles[s, 0], triangles[s, 1], triangles[s, 2])
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    if length == 0.0:
        return np.inf
    gap = 0.0
    for k in range(3):
        gap += normal[k] * (p[k] - x[triangles[s, 0], k])
        normal[k] /= length
    return gap / length


@compiled
def foot(p, x, triangles, s, bary):
    """Write the barycentric coordinates (3,) of the point of the plane of triangle s below p (3,)."""
    i, j, l = triangles[s, 0], triangles[s, 1], triangles[s, 2]
    normal = area_vector(x, i, j, l)
    square = normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2
    b = c = 0.0
    for k in range(3):  # areas of the triangles that the point below p makes with the sides
        e, f = (k + 1) % 3, (k + 2) % 3
        b += normal[k] * ((p[e] - x[i, e]) * (x[l, f] - x[i, f]) - (p[f] - x[i, f]) * (x[l, e] - x[i, e]))
        c += normal[k] * ((x[j, e] - x[i, e]) * (p[f] - x[i, f]) - (x[j, f] - x[i, f]) * (p[e] - x[i, e]))
    bary[1], bary[2] = b / square, c / square
    bary[0] = 1.0 - bary[1] - bary[2]


@compiled
def firmness(x, triangles, s, full, slopes):
    """Return the share to which triangle s holds what it faces; write its slopes (3, 3) by the corners' places.

    It is 1 from a `full` area on, and q (2 - q) at a share q of it; areas are doubled, as cross products are long. The
    plane of a triangle that collapses turns with the least motion of its corners: without this, forces on them have no
    bound.
    """
    normal = area_vector(x, triangles[s, 0], triangles[s, 1], triangles[s, 2])
    slopes[:] = 0.0
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    if length >= full or length == 0.0:
        return 1.0
    share = length / full
    steep = (2.0 - 2.0 * share) / (full * length)
    slopes_of_area(x, triangles[s, 0], triangles[s, 1], triangles[s, 2], normal, steep, slopes)
    return share * (2.0 - share)
