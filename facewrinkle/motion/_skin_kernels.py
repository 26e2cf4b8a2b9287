"""Inner loops of the skin: energies, gradients, contacts. Positions are displacements u (n, 3) from rest, in mm."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
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


@njit(cache=True)
def inversion_barrier(u, triangles, points, normals, double_area, smallest, stiffness, grad):
    """Repulsion of triangles that fall below `smallest` of their area, seen along their rest normal. Adds to grad."""
    energy = 0.0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax = points[j, 0] - points[i, 0] + u[j, 0] - u[i, 0]
        ay = points[j, 1] - points[i, 1] + u[j, 1] - u[i, 1]
        az = points[j, 2] - points[i, 2] + u[j, 2] - u[i, 2]
        bx = points[k, 0] - points[i, 0] + u[k, 0] - u[i, 0]
        by = points[k, 1] - points[i, 1] + u[k, 1] - u[i, 1]
        bz = points[k, 2] - points[i, 2] + u[k, 2] - u[i, 2]
        nx, ny, nz = normals[f, 0], normals[f, 1], normals[f, 2]
        signed = (ay * bz - az * by) * nx + (az * bx - ax * bz) * ny + (ax * by - ay * bx) * nz
        missing = smallest - signed / double_area[f]
        if missing <= 0.0:
            continue
        energy += 0.25 * stiffness * double_area[f] * missing * missing
        c = -0.5 * stiffness * missing
        # d signed / d x_j = b x n, d signed / d x_k = n x a
        jx, jy, jz = c * (by * nz - bz * ny), c * (bz * nx - bx * nz), c * (bx * ny - by * nx)
        kx, ky, kz = c * (ny * az - nz * ay), c * (nz * ax - nx * az), c * (nx * ay - ny * ax)
        grad[j, 0] += jx
        grad[j, 1] += jy
        grad[j, 2] += jz
        grad[k, 0] += kx
        grad[k, 1] += ky
        grad[k, 2] += kz
        grad[i, 0] -= jx + kx
        grad[i, 1] -= jy + ky
        grad[i, 2] -= jz + kz
    return energy


@njit(cache=True)
def tethers(u, shift, normals, along, across, indptr, indices, bending, grad):
    """Bending, and tethers to anchors that moved by `shift`: `across` along the normal, `along` the surface."""
    energy = 0.0
    for i in range(u.shape[0]):
        bx, by, bz = 0.0, 0.0, 0.0
        for p in range(indptr[i], indptr[i + 1]):
            j, b = indices[p], bending[p]
            bx += b * u[j, 0]
            by += b * u[j, 1]
            bz += b * u[j, 2]
        wx, wy, wz = u[i, 0] - shift[i, 0], u[i, 1] - shift[i, 1], u[i, 2] - shift[i, 2]
        out = wx * normals[i, 0] + wy * normals[i, 1] + wz * normals[i, 2]
        extra = (across[i] - along[i]) * out
        gx = bx + along[i] * wx + extra * normals[i, 0]
        gy = by + along[i] * wy + extra * normals[i, 1]
        gz = bz + along[i] * wz + extra * normals[i, 2]
        energy += 0.5 * (u[i, 0] * bx + u[i, 1] * by + u[i, 2] * bz)
        energy += 0.5 * (along[i] * (wx * wx + wy * wy + wz * wz) + extra * out)
        grad[i, 0] += gx
        grad[i, 1] += gy
        grad[i, 2] += gz
    return energy


SOFT, DEEP = 0.1, 0.3
"""Contacts stiffen up to the first depth, as a kink in the force would cost iterations. Beyond the second depth their
force is constant, so that skin which a muscle or the jaw has pushed far in within one step is not thrown out. mm.
"""


@njit(cache=True)
def contact(depth):
    """Return the force and the energy of a contact of stiffness 1 at a depth > 0."""
    if depth < SOFT:
        return 0.5 * depth * depth / SOFT, depth**3 / (6.0 * SOFT)
    near = min(depth, DEEP)
    force = near - 0.5 * SOFT
    return force, 0.5 * near * (near - SOFT) + SOFT * SOFT / 6.0 + force * (depth - near)


@njit(cache=True)
def eyeball(u, points, vertices, centre, radii, weight, grad):
    """Repulsion from a ball, of vertices that are nearer to its centre than their `radii`. Adds to grad."""
    energy = 0.0
    for p in range(vertices.shape[0]):
        i = vertices[p]
        x = points[i, 0] + u[i, 0] - centre[0]
        y = points[i, 1] + u[i, 1] - centre[1]
        z = points[i, 2] + u[i, 2] - centre[2]
        square = x * x + y * y + z * z
        if square >= radii[p] * radii[p] or square == 0.0:
            continue
        d = np.sqrt(square)
        missing = radii[p] - d
        force, stored = contact(missing)
        energy += weight[p] * stored
        c = -weight[p] * force / d
        grad[i, 0] += c * x
        grad[i, 1] += c * y
        grad[i, 2] += c * z
    return energy


@njit(cache=True)
def bone(u, points, vertices, anchors, normals, nearest, off, weight, grad):
    """Repulsion within `off` of the tangent planes at the `nearest` anchors on the skull. Adds to grad."""
    energy = 0.0
    for p in range(vertices.shape[0]):
        i = vertices[p]
        b = nearest[i]
        missing = off
        for k in range(3):
            missing -= (points[i, k] + u[i, k] - anchors[b, k]) * normals[b, k]
        if missing <= 0.0:
            continue
        force, stored = contact(missing)
        energy += weight[p] * stored
        for k in range(3):
            grad[i, k] -= weight[p] * force * normals[b, k]
    return energy


@njit(cache=True)
def lip_pairs(u, vertices, corners, shares, away, gap, allowed, weight, grad):
    """Repulsion of vertices from the triangles they face, `gap` apart at rest along `away`. Adds to grad."""
    energy = 0.0
    for p in range(vertices.shape[0]):
        i, a, b, c = vertices[p], corners[p, 0], corners[p, 1], corners[p, 2]
        now = gap[p]
        for k in range(3):
            other = shares[p, 0] * u[a, k] + shares[p, 1] * u[b, k] + shares[p, 2] * u[c, k]
            now += away[p, k] * (u[i, k] - other)
        missing = allowed[p] - now
        if missing <= 0.0:
            continue
        force, stored = contact(missing)
        energy += weight[p] * stored
        for k in range(3):
            push = weight[p] * force * away[p, k]
            grad[i, k] -= push
            grad[a, k] += shares[p, 0] * push
            grad[b, k] += shares[p, 1] * push
            grad[c, k] += shares[p, 2] * push
    return energy


@njit(cache=True)
def dental_wall(u, shift, vertices, local, axes, half, allowed, weight, grad):
    """Repulsion from an upright elliptic cylinder of half axes `half` (2,) that moves with `shift`. Adds to grad.

    `local` holds the rest positions (k, 2) along `axes` (2, 3) from the cylinder's middle, `allowed` the relative radii
    below which vertices are pushed.
    """
    energy = 0.0
    for p in range(vertices.shape[0]):
        i = vertices[p]
        x, z = local[p, 0], local[p, 1]
        for k in range(3):
            moved = u[i, k] - shift[i, k]
            x += axes[0, k] * moved
            z += axes[1, k] * moved
        x /= half[0]
        z /= half[1]
        square = x * x + z * z
        if square >= allowed[p] * allowed[p] or square == 0.0:
            continue
        r = np.sqrt(square)
        missing = half[1] * (allowed[p] - r)
        force, stored = contact(missing)
        energy += weight[p] * stored
        c = -weight[p] * force * half[1] / r
        for k in range(3):
            grad[i, k] += c * (x / half[0] * axes[0, k] + z / half[1] * axes[1, k])
    return energy


@njit(cache=True)
def inertia(u, target, old, mass, drag, h, force, grad):
    """Inertia and drag of a step of length h from `old` towards `target`, less the work of a force. Adds to grad."""
    energy = 0.0
    for i in range(u.shape[0]):
        m = mass[i] / h**2
        for k in range(3):
            ahead, since = u[i, k] - target[i, k], u[i, k] - old[i, k]
            energy += 0.5 * m * (ahead * ahead + drag * since * since) - force[i, k] * u[i, k]
            grad[i, k] += m * (ahead + drag * since) - force[i, k]
    return energy


@njit(cache=True)
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


@njit(cache=True)
def keep_off_bone(u, points, vertices, anchors, normals, below, nearest, indptr, ring):
    """Move those of the given vertices that entered the skull back onto it.

    `nearest` holds the nearest anchor of each vertex, `below` that at rest. The search walks from neighbour to
    neighbour, starting at the nearer of the two, and updates `nearest`.
    """
    for i in vertices:
        x, y, z = points[i, 0] + u[i, 0], points[i, 1] + u[i, 1], points[i, 2] + u[i, 2]
        best, own = nearest[i], below[i]
        d = (x - anchors[best, 0]) ** 2 + (y - anchors[best, 1]) ** 2 + (z - anchors[best, 2]) ** 2
        home = (x - anchors[own, 0]) ** 2 + (y - anchors[own, 1]) ** 2 + (z - anchors[own, 2]) ** 2
        if home < d:
            d, best = home, own
        moved = True
        while moved:
            moved = False
            at = best
            for p in range(indptr[at], indptr[at + 1]):
                j = ring[p]
                dj = (x - anchors[j, 0]) ** 2 + (y - anchors[j, 1]) ** 2 + (z - anchors[j, 2]) ** 2
                if dj < d:
                    d, best, moved = dj, j, True
        nearest[i] = best
        n = normals[best]
        depth = (x - anchors[best, 0]) * n[0] + (y - anchors[best, 1]) * n[1] + (z - anchors[best, 2]) * n[2]
        if depth < 0.0:
            u[i, 0] -= depth * n[0]
            u[i, 1] -= depth * n[1]
            u[i, 2] -= depth * n[2]


@njit(cache=True)
def keep_off_eye(u, points, vertices, centre, radii):
    """Move vertices that entered an eyeball back onto it; `radii` is the closest that each vertex may come."""
    for p in range(vertices.shape[0]):
        i = vertices[p]
        x, y, z = (
            points[i, 0] + u[i, 0] - centre[0],
            points[i, 1] + u[i, 1] - centre[1],
            points[i, 2] + u[i, 2] - centre[2],
        )
        d = np.sqrt(x * x + y * y + z * z)
        if 0.0 < d < radii[p]:
            push = radii[p] / d - 1.0
            u[i, 0] += push * x
            u[i, 1] += push * y
            u[i, 2] += push * z


@njit(cache=True)
def solve(indptr, indices, lower, inverse, row_order, column_order, right, scratch, out):
    """Solve three systems of one pattern at once: factors L (unit lower, (nnz, 3)) and 1 / D (n, 3), side by side."""
    n = inverse.shape[0]
    for i in range(n):
        for k in range(3):
            scratch[row_order[i], k] = right[i, k]
    for j in range(n):
        x, y, z = scratch[j, 0], scratch[j, 1], scratch[j, 2]
        for p in range(indptr[j] + 1, indptr[j + 1]):
            i = indices[p]
            scratch[i, 0] -= lower[p, 0] * x
            scratch[i, 1] -= lower[p, 1] * y
            scratch[i, 2] -= lower[p, 2] * z
    for j in range(n - 1, -1, -1):
        x, y, z = scratch[j, 0] * inverse[j, 0], scratch[j, 1] * inverse[j, 1], scratch[j, 2] * inverse[j, 2]
        for p in range(indptr[j] + 1, indptr[j + 1]):
            i = indices[p]
            x -= lower[p, 0] * scratch[i, 0]
            y -= lower[p, 1] * scratch[i, 1]
            z -= lower[p, 2] * scratch[i, 2]
        scratch[j, 0], scratch[j, 1], scratch[j, 2] = x, y, z
    for i in range(n):
        for k in range(3):
            out[i, k] = scratch[column_order[i], k]
