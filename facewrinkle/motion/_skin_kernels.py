"""Inner loops of the skin: energies and their gradients. Positions are displacements u (n, 3) from rest, in mm."""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import compiled


@compiled
def springs(u, edges, rest, length, stiffness, threshold, stiffening, grad):
    """Biphasic edge springs: linear in the strain, stiffer by `stiffening` beyond `threshold`. Adds to grad."""
    energy = 0.0
    for e in range(edges.shape[0]):
        i, j = edges[e, 0], edges[e, 1]
        dx = rest[e, 0] + u[j, 0] - u[i, 0]
        dy = rest[e, 1] + u[j, 1] - u[i, 1]
        dz = rest[e, 2] + u[j, 2] - u[i, 2]
        now = np.sqrt(dx * dx + dy * dy + dz * dz)
        if now == 0.0:
            continue
        stretch = now - length[e]
        force = stiffness[e] * stretch
        energy += 0.5 * force * stretch
        over = stretch - threshold * length[e]
        if over > 0.0:
            extra = stiffness[e] * stiffening * over
            force += extra
            energy += 0.5 * extra * over
        force /= now
        grad[i, 0] -= force * dx
        grad[i, 1] -= force * dy
        grad[i, 2] -= force * dz
        grad[j, 0] += force * dx
        grad[j, 1] += force * dy
        grad[j, 2] += force * dz
    return energy


@compiled
def shares_of_area(x, triangles, normals, double_area, out):
    """Write the areas (m,) of triangles as seen along `normals` (m, 3), relative to rest; negative if turned over."""
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, az = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        bx, by, bz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        signed = (ay * bz - az * by) * normals[f, 0] + (az * bx - ax * bz) * normals[f, 1]
        out[f] = (signed + (ax * by - ay * bx) * normals[f, 2]) / double_area[f]


@compiled
def slopes_of_area(x, i, j, k, normal, scale, out):
    """Write the slopes (3, 3) of the area of a triangle seen along a normal, times `scale`, by its corners' places."""
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        ad, bd = x[j, d] - x[i, d], x[k, d] - x[i, d]
        ae, be = x[j, e] - x[i, e], x[k, e] - x[i, e]
        out[1, c] = scale * (bd * normal[e] - be * normal[d])
        out[2, c] = scale * (normal[d] * ae - normal[e] * ad)
        out[0, c] = -out[1, c] - out[2, c]


@compiled
def volume(u, x, triangles, facing, double_area, shares, at_rest, smallest, barrier, tissue, excess, grad):
    """Columns of tissue that keep their volume, and a barrier against triangles that turn over. Adds to grad.

    Positions are x (n, 3). Triangles have the `shares` (m,) of their areas, and `at_rest` (m,) when they rest. A vertex
    pays by a stiffness (n,) for the `excess` (n,) of its column: its way along the normal from the anchor, which moved
    by `shift`, and `heights` (n,) times the area that the triangles at it have gained. A triangle pays by `barrier`
    for what lacks of the share `smallest`.
    """
    shift, normals, stiffness, heights = tissue
    energy, slopes = 0.0, np.empty((3, 3))
    for i in range(u.shape[0]):
        excess[i] = 0.0
        for k in range(3):
            excess[i] += normals[i, k] * (u[i, k] - shift[i, k])
    for f in range(triangles.shape[0]):
        gained = 0.5 * double_area[f] * (shares[f] - at_rest[f])
        for c in range(3):
            excess[triangles[f, c]] += heights[triangles[f, c]] * gained
    for i in range(u.shape[0]):
        force = stiffness[i] * excess[i]
        energy += 0.5 * force * excess[i]
        for k in range(3):
            grad[i, k] += force * normals[i, k]
        excess[i] = force * heights[i]
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        missing = max(smallest - shares[f], 0.0)
        energy += 0.25 * barrier * double_area[f] * missing * missing
        c = 0.5 * (excess[i] + excess[j] + excess[k] - barrier * missing)
        slopes_of_area(x, i, j, k, facing[f], c, slopes)
        for v in range(3):
            for d in range(3):
                grad[triangles[f, v], d] += slopes[v, d]
    return energy


@compiled
def tethers(u, shift, stiffness, indptr, indices, bending, grad):
    """Bending, and tethers to anchors that moved by `shift`. Adds to grad."""
    energy = 0.0
    for i in range(u.shape[0]):
        bx, by, bz = 0.0, 0.0, 0.0
        for p in range(np.uint32(indptr[i]), np.uint32(indptr[i + 1])):
            j, b = indices[p], bending[p]
            bx += b * u[j, 0]
            by += b * u[j, 1]
            bz += b * u[j, 2]
        wx, wy, wz = u[i, 0] - shift[i, 0], u[i, 1] - shift[i, 1], u[i, 2] - shift[i, 2]
        energy += 0.5 * (u[i, 0] * bx + u[i, 1] * by + u[i, 2] * bz)
        energy += 0.5 * stiffness[i] * (wx * wx + wy * wy + wz * wz)
        grad[i, 0] += bx + stiffness[i] * wx
        grad[i, 1] += by + stiffness[i] * wy
        grad[i, 2] += bz + stiffness[i] * wz
    return energy


@compiled
def inertia(u, target, old, mass, drag, h, grad):
    """Inertia and drag of a step of length h from `old` towards `target`. Adds to grad."""
    energy = 0.0
    for i in range(u.shape[0]):
        m = mass[i] / h**2
        for k in range(3):
            ahead, since = u[i, k] - target[i, k], u[i, k] - old[i, k]
            energy += 0.5 * m * (ahead * ahead + drag * since * since)
            grad[i, k] += m * (ahead + drag * since)
    return energy


@compiled
def two_loop_update(q, step, other, curvature, less):
    """Subtract a multiple of `step` from q, (q . other) / curvature - less; return this factor."""
    x, y, z = 0.0, 0.0, 0.0
    for i in range(q.shape[0]):
        x += q[i, 0] * other[i, 0]
        y += q[i, 1] * other[i, 1]
        z += q[i, 2] * other[i, 2]
    share = (x + y + z) / curvature - less
    for i in range(q.shape[0]):
        for k in range(3):
            q[i, k] -= share * step[i, k]
    return share


@compiled
def solve(indptr, indices, lower, inverse, row_order, column_order, right, scratch, out):
    """Solve three systems of one pattern at once: factors L (unit lower, (nnz, 3)) and 1 / D (n, 3), side by side."""
    n = inverse.shape[0]
    for i in range(n):
        for k in range(3):
            scratch[np.uint32(row_order[i]), k] = right[i, k]
    for j in range(n):
        x, y, z = scratch[j, 0], scratch[j, 1], scratch[j, 2]
        if x == 0.0 and y == 0.0 and z == 0.0:  # mostly, where forces act at a single vertex
            continue
        for p in range(np.uint32(indptr[j] + 1), np.uint32(indptr[j + 1])):
            i = indices[p]
            scratch[i, 0] -= lower[p, 0] * x
            scratch[i, 1] -= lower[p, 1] * y
            scratch[i, 2] -= lower[p, 2] * z
    for j in range(n - 1, -1, -1):
        x, y, z = scratch[j, 0] * inverse[j, 0], scratch[j, 1] * inverse[j, 1], scratch[j, 2] * inverse[j, 2]
        for p in range(np.uint32(indptr[j] + 1), np.uint32(indptr[j + 1])):
            i = indices[p]
            x -= lower[p, 0] * scratch[i, 0]
            y -= lower[p, 1] * scratch[i, 1]
            z -= lower[p, 2] * scratch[i, 2]
        scratch[j, 0], scratch[j, 1], scratch[j, 2] = x, y, z
    for i in range(n):
        for k in range(3):
            out[i, k] = scratch[np.uint32(column_order[i]), k]


@compiled
def add_turns(points, which, centre, axis, angles, sign, out):
    """Add to `out` (n, 3) `sign` times the ways of `which` (k,) of the points, turned by angles (k,) about an axis.

    By the formula of Rodrigues; `out` may be the points themselves.
    """
    for p in range(which.shape[0]):
        if angles[p] == 0.0:
            continue
        i, less, sin = which[p], sign * (np.cos(angles[p]) - 1.0), sign * np.sin(angles[p])
        x, y, z = points[i, 0] - centre[0], points[i, 1] - centre[1], points[i, 2] - centre[2]
        axial = x * axis[0] + y * axis[1] + z * axis[2]
        out[i, 0] += less * (x - axial * axis[0]) + sin * (axis[1] * z - axis[2] * y)
        out[i, 1] += less * (y - axial * axis[1]) + sin * (axis[2] * x - axis[0] * z)
        out[i, 2] += less * (z - axial * axis[2]) + sin * (axis[0] * y - axis[1] * x)
