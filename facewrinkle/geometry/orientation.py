"""Heights over a surface, limited so that no triangle turns over."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ._mesh_kernels import area_vector
from .compilation import compiled

LEAST = 0.05
"""The smallest share of a triangle's area that a displacement may leave, seen along its normal."""

ROUNDS = 16
"""Rounds in which heights become lower; what is still turned over then is not displaced at all."""


def unfolded_shares(points: Array, heights: Array, directions: Array, triangles: npt.NDArray[np.int32]) -> Array | None:
    """Shares (n,) of the heights that leave every triangle on the side it faces; None if all of them do.

    Heights along one direction never turn a triangle over. Where directions converge (over hollows, and where a
    triangle is small and leans) they do, as soon as the heights exceed what its size and the convergence allow.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        The bare surface.
    heights : ndarray, shape (n,)
    directions : ndarray, shape (n, 3)
        Unit normals along which heights displace it.
    triangles : ndarray of int32, shape (m, 3)

    Returns
    -------
    ndarray, shape (n,), or None
        1 except at corners of triangles that would keep less than `LEAST` of their area, seen along their normals.

    Examples
    --------
    In a trough with a radius of 1, normals meet at the height 1:

    >>> trough = np.array([[-0.6, 0.2, 0.0], [0.6, 0.2, 0.0], [0.0, 0.0, 2.0]])
    >>> inwards = np.array([[0.6, 0.8, 0.0], [-0.6, 0.8, 0.0], [0.0, 1.0, 0.0]])
    >>> triangle = np.array([[1, 0, 2]], np.int32)
    >>> unfolded_shares(trough, np.full(3, 0.8), inwards, triangle) is None
    True
    >>> unfolded_shares(trough, np.full(3, 1.9), inwards, triangle).round(3)
    array([0.5, 0.5, 0.5])
    """
    ways = np.asarray(heights, np.float64)[:, None] * directions
    shares, factors = np.ones(len(ways)), np.ones(len(ways))
    for k in range(ROUNDS):
        # What lowers one triangle tilts the next: each round aims at the full share, and demands less of it.
        demanded = LEAST * (1.0 - k / ROUNDS)
        if not _limit(points, ways, triangles, demanded, factors):
            return shares if k else None
        shares *= factors
        ways *= factors[:, None]
        factors[:] = 1.0
    while _limit(points, ways, triangles, 0.0, factors):
        ways[factors < 1.0], shares[factors < 1.0] = 0.0, 0.0
        factors[:] = 1.0
    return shares


@compiled
def _limit(points, ways, triangles, demanded, factors):
    """Lower `factors` of the ways (n, 3) at the corners of triangles of which less than the share `demanded` would be
    left of the bare area, seen along the bare normal.

    The area vector of a triangle is a quadratic function of a factor of all its ways; `factors` get the one for which
    its component along the bare normal is the share `LEAST`, at least `demanded`. Returns the number of triangles that
    are lowered.
    """
    found, moves = 0, np.zeros(len(ways), np.bool_)
    for n in range(len(ways)):
        moves[n] = ways[n, 0] != 0.0 or ways[n, 1] != 0.0 or ways[n, 2] != 0.0
    for f in range(len(triangles)):
        i, j, k = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        if not (moves[i] or moves[j] or moves[k]):
            continue
        nx, ny, nz = area_vector(points, i, j, k)
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
        ux, uy, uz = ways[j, 0] - ways[i, 0], ways[j, 1] - ways[i, 1], ways[j, 2] - ways[i, 2]
        vx, vy, vz = ways[k, 0] - ways[i, 0], ways[k, 1] - ways[i, 1], ways[k, 2] - ways[i, 2]
        area = nx * nx + ny * ny + nz * nz
        linear = nx * (ay * vz - az * vy + uy * bz - uz * by) + ny * (az * vx - ax * vz + uz * bx - ux * bz)
        linear += nz * (ax * vy - ay * vx + ux * by - uy * bx)
        square = nx * (uy * vz - uz * vy) + ny * (uz * vx - ux * vz) + nz * (ux * vy - uy * vx)
        if area + linear + square >= demanded * area:
            continue
        factor, spare = 0.0, (1.0 - LEAST) * area
        if spare > 0.0:  # from positive to negative the parabola has one root, unless only rounding makes it negative
            divisor = np.sqrt(linear * linear - 4.0 * square * spare) - linear
            factor = min(2.0 * spare / divisor, 1.0) if divisor > 0.0 else 1.0
        found += factor < 1.0
        for v in (i, j, k):
            factors[v] = min(factors[v], factor)
    return found
