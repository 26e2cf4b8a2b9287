"""Inner loops of the contact between lips or lids: points of the skin and the planes of the triangles that they face.

Positions x are in mm: n vertices, and points that stay. A sample is a point of the skin with fixed barycentric
coordinates `shares` in `corners`; `triangles` (k, 3) holds the corners of the triangle that each sample faces.
"""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import njit


@njit(cache=True)
def plane_gap(x, corners, shares, triangle, bary, normal):
    """Return the height of a sample above the plane of its triangle, inf if this has no area.

    Writes the normal (3,), and the barycentric coordinates (3,) of the point of the plane below the sample.
    """
    i, j, l = triangle[0], triangle[1], triangle[2]
    square = 0.0
    for k in range(3):
        e, f = (k + 1) % 3, (k + 2) % 3
        normal[k] = (x[j, e] - x[i, e]) * (x[l, f] - x[i, f]) - (x[j, f] - x[i, f]) * (x[l, e] - x[i, e])
        square += normal[k] ** 2
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
def plane_energy(x, corners, shares, triangles, allowed, stiffness, gaps, grad):
    """Add up half stiffness times depth squared of samples that are too near. Adds to grad; writes the gaps (k,)."""
    bary, normal = np.empty(3), np.empty(3)
    energy = 0.0
    for s in range(corners.shape[0]):
        gaps[s] = plane_gap(x, corners[s], shares[s], triangles[s], bary, normal)
        depth = allowed[s] - gaps[s]
        if depth <= 0.0:
            continue
        force = stiffness[s] * depth
        energy += 0.5 * force * depth
        for c in range(3):
            for k in range(3):
                grad[corners[s, c], k] -= force * shares[s, c] * normal[k]
                if triangles[s, c] < grad.shape[0]:
                    grad[triangles[s, c], k] += force * bary[c] * normal[k]
    return energy


@njit(cache=True)
def plane_rows(x, ahead, corners, shares, triangles, allowed, stiffness, gaps, rows, first):
    """Write rows of samples that are too near now or after `ahead`; see `solid_rows`. `gaps` is what `plane_energy`
    has written at x.
    """
    vertices, slopes, depths, stiff = rows
    bary, normal = np.empty(3), np.empty(3)
    for s in range(corners.shape[0]):
        if plane_gap(x, corners[s], shares[s], triangles[s], bary, normal) == np.inf:
            continue
        after = allowed[s] - gaps[s]
        for c in range(3):
            for k in range(3):
                after -= normal[k] * shares[s, c] * ahead[corners[s, c], k]
                if triangles[s, c] < ahead.shape[0]:
                    after += normal[k] * bary[c] * ahead[triangles[s, c], k]
        if gaps[s] >= allowed[s] and after <= 0.0:
            continue
        for c in range(3):
            stays = triangles[s, c] >= ahead.shape[0]
            vertices[first, c], vertices[first, c + 3] = corners[s, c], corners[s, c] if stays else triangles[s, c]
            for k in range(3):
                slopes[first, c, k] = shares[s, c] * normal[k]
                slopes[first, c + 3, k] = 0.0 if stays else -bary[c] * normal[k]
        depths[first], stiff[first] = after, stiffness[s]
        first += 1
    return first
