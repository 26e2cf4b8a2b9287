"""Inner loops of the contact between lips or lids: points of the skin and the planes of the triangles that they face.

Positions x are in mm: n vertices, and points that stay. A sample is a point of the skin with fixed barycentric
coordinates `shares` in `corners`; `triangles` (k, 3) holds the corners of the triangle that each sample faces.
"""

from __future__ import annotations

import numpy as np

from ..geometry._mesh_kernels import area_vector
from ..geometry.compilation import njit


@njit(cache=True)
def plane_gap(x, corners, shares, triangle, bary, normal):
    """Return the height of a sample above the plane of its triangle, inf if this has no area.

    Writes the normal (3,), and the barycentric coordinates (3,) of the point of the plane below the sample.
    """
    i, j, l = triangle[0], triangle[1], triangle[2]
    normal[0], normal[1], normal[2] = area_vector(x, i, j, l)
    square = normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2
    if square == 0.0:
        return np.inf
    gap = 0.0
    for k in range(3):
        p = shares[0] * x[corners[0], k] + shares[1] * x[corners[1], k] + shares[2] * x[corners[2], k]
        gap += normal[k] * (p - x[i, k])
    b = c = 0.0
    for k in range(3):  # areas of the triangles that the point below the sample makes with the sides
        e, f = (k + 1) % 3, (k + 2) % 3
        pe = shares[0] * x[corners[0], e] + shares[1] * x[corners[1], e] + shares[2] * x[corners[2], e] - x[i, e]
        pf = shares[0] * x[corners[0], f] + shares[1] * x[corners[1], f] + shares[2] * x[corners[2], f] - x[i, f]
        b += normal[k] * (pe * (x[l, f] - x[i, f]) - pf * (x[l, e] - x[i, e]))
        c += normal[k] * ((x[j, e] - x[i, e]) * pf - (x[j, f] - x[i, f]) * pe)
    bary[1], bary[2] = b / square, c / square
    bary[0] = 1.0 - bary[1] - bary[2]
    length = np.sqrt(square)
    for k in range(3):
        normal[k] /= length
    return gap / length


@njit(cache=True)
def firmness(x, triangle, full, slopes):
    """Return the share to which a triangle holds what it faces; write its slopes (3, 3) by the corners' places.

    It is 1 from a `full` area on, and q (2 - q) at a share q of it; areas are doubled, as cross products are long. The
    plane of a triangle that collapses turns with the least motion of its corners: without this, forces on them have no
    bound.
    """
    normal = area_vector(x, triangle[0], triangle[1], triangle[2])
    slopes[:] = 0.0
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    if length >= full or length == 0.0:
        return 1.0
    share = length / full
    steep = (2.0 - 2.0 * share) / (full * length)
    for c in range(3):
        p, q = triangle[(c + 1) % 3], triangle[(c + 2) % 3]
        for k in range(3):
            e, f = (k + 1) % 3, (k + 2) % 3
            slopes[c, k] = steep * ((x[p, e] - x[q, e]) * normal[f] - (x[p, f] - x[q, f]) * normal[e])
    return share * (2.0 - share)


@njit(cache=True)
def plane_energy(x, corners, shares, triangles, full, allowed, stiffness, gaps, grad):
    """Add up half stiffness times depth squared of samples that are too near. Adds to grad; writes the gaps (k,).

    Depths are those below the planes times the `firmness` of the triangles, whose `full` areas are given (k,).
    """
    bary, normal, slopes = np.empty(3), np.empty(3), np.empty((3, 3))
    energy = 0.0
    for s in range(corners.shape[0]):
        gaps[s] = plane_gap(x, corners[s], shares[s], triangles[s], bary, normal)
        depth = allowed[s] - gaps[s]
        if depth <= 0.0:
            continue
        firm = firmness(x, triangles[s], full[s], slopes)
        force = stiffness[s] * firm * depth
        energy += 0.5 * force * firm * depth
        for c in range(3):
            for k in range(3):
                grad[corners[s, c], k] -= force * firm * shares[s, c] * normal[k]
                if triangles[s, c] < grad.shape[0]:
                    grad[triangles[s, c], k] += force * (firm * bary[c] * normal[k] + depth * slopes[c, k])
    return energy


@njit(cache=True)
def plane_rows(x, ahead, corners, shares, triangles, full, allowed, stiffness, gaps, rows, first):
    """Write rows of samples that are too near now or after `ahead`; see `solid_rows`. `gaps` is what `plane_energy`
    has written at x.
    """
    vertices, slopes, depths, stiff = rows
    bary, normal, turn = np.empty(3), np.empty(3), np.empty((3, 3))
    for s in range(corners.shape[0]):
        if plane_gap(x, corners[s], shares[s], triangles[s], bary, normal) == np.inf:
            continue
        depth = allowed[s] - gaps[s]
        after = depth
        for c in range(3):
            for k in range(3):
                after -= normal[k] * shares[s, c] * ahead[corners[s, c], k]
                if triangles[s, c] < ahead.shape[0]:
                    after += normal[k] * bary[c] * ahead[triangles[s, c], k]
        if depth <= 0.0 and after <= 0.0:
            continue
        firm = firmness(x, triangles[s], full[s], turn)
        after *= firm
        for c in range(3):
            stays = triangles[s, c] >= ahead.shape[0]
            vertices[first, c], vertices[first, c + 3] = corners[s, c], corners[s, c] if stays else triangles[s, c]
            for k in range(3):
                slopes[first, c, k] = firm * shares[s, c] * normal[k]
                slopes[first, c + 3, k] = 0.0 if stays else -firm * bary[c] * normal[k] - depth * turn[c, k]
                after += 0.0 if stays else depth * turn[c, k] * ahead[triangles[s, c], k]
        depths[first], stiff[first] = after, stiffness[s]
        first += 1
    return first
