"""Triangles that turn over: heights over a surface are limited so that none does; in a moved mesh they turn back."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import Array, BoolArray, IntArray
from .compilation import compiled
from .least_squares import closest_rotations
from .normals import area_vector, area_vectors

LEFT = 0.05
"""The smallest share of a triangle's area that a displacement may leave, seen along its normal."""

LEAST = 0.1
"""Triangles get at least this share of their area at rest, along their normals at rest, turned with the surface."""


class Untangling:
    """Turns back triangles of a moved mesh that are turned over.

    A triangle is turned over if its area along a direction is negative: its normal at rest, turned as the surface
    around it has turned. That is the rotation which fits two rings of vertices around its corners best (Kabsch 1976),
    with weights of one over their squared distances at rest. Where the surface is crumpled so much that this says
    nothing, some may remain.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        At rest.
    triangles : ndarray of int, shape (m, 3)
    offsets, ring : ndarray of int
        Neighbors of each vertex; see :func:`facewrinkle.geometry.topology.vertex_rings`.

    Examples
    --------
    One vertex of a flat grid is moved beyond its neighbors:

    >>> import pyvista as pv
    >>> from facewrinkle.geometry.topology import vertex_rings
    >>> grid = pv.Plane(i_resolution=6, j_resolution=6, i_size=6.0, j_size=6.0).triangulate()
    >>> points, triangles = grid.points.astype(float), grid.regular_faces
    >>> untangling = Untangling(points, triangles, *vertex_rings(triangles))
    >>> moved = points.copy()
    >>> moved[24, :2] += 1.3
    >>> mended = untangling.untangled(moved)
    >>> areas = [np.cross(*(p[triangles[:, k]] - p[triangles[:, 0]] for k in (1, 2)))[:, 2] for p in (moved, mended)]
    >>> bool(areas[0].min() < -0.2), bool(areas[1].min() > 0.09)
    (True, True)
    >>> len(untangling.turned_over(moved)), len(untangling.turned_over(mended))
    (3, 0)
    """

    def __init__(self, points: Array, triangles: IntArray, offsets: IntArray, ring: IntArray) -> None:
        self._points = np.ascontiguousarray(points, dtype=np.float64)
        self._triangles, self._rings = np.ascontiguousarray(triangles, np.int32), (offsets, ring)
        self._cross = area_vectors(self._points, self._triangles)

    def untangled(self, points: Array) -> Array:
        """Return moved points (n, 3) with no triangle turned over; the given ones themselves if none is.

        Corners of triangles that are turned over, or nearly so, make room for them. Where they cannot, there and around
        points go half the way to where the mean motion of their neighbors takes them, and make room again, up to 20
        times.
        """
        low = self._low(points, LEAST)
        if not len(low):
            return points
        out, changed = self._swept(points, low)
        for _ in range(20):
            left = self._lacking(out, changed, 0.5 * LEAST)
            if not len(left):
                break
            points = self._smoothed(points, left)
            out, changed = self._swept(points, self._low(points, LEAST))
        return out

    def turned_over(self, points: Array) -> IntArray:
        """Return the triangles (k,) that are turned over at points (n, 3)."""
        return self._low(points, 0.0)

    def _low(self, points: Array, least: float) -> IntArray:
        """Return the triangles (k,) with less than a share of their area at rest, along where they should face."""
        triangles, marked = self._triangles, np.zeros(len(points), np.bool_)
        if not _turned(points, triangles, self._cross, least, marked):
            return np.empty(0, np.int64)
        return self._lacking(points, _touching(triangles, marked), least)

    def _lacking(self, points: Array, chosen: IntArray, least: float) -> IntArray:
        """Return those (k,) of chosen triangles with less than a share of their area at rest, likewise."""
        facing, double = self._facing(points, chosen)
        shares = (area_vectors(points, self._triangles[chosen]) * facing).sum(axis=1) / double
        return np.asarray(chosen[(shares < least) & facing.any(axis=1)])

    def _swept(self, points: Array, low: IntArray) -> tuple[Array, IntArray]:
        """Return points (n, 3) at which the corners of low triangles have made room for them, and the triangles (k,)
        that these corners belong to.
        """
        out, free = points.copy(), np.zeros(len(points), np.bool_)
        free[self._triangles[low]] = True
        around = _touching(self._triangles, free)
        # In at most 100 sweeps: what one triangle gets, the next one may lack.
        _turn_back(out, self._triangles, around, *self._facing(points, around), free, LEAST, 100)
        return out, around

    def _smoothed(self, points: Array, low: IntArray) -> Array:
        """Return points (n, 3), of which those around low triangles have gone half the way to the mean motion."""
        marked, out, moved = np.zeros(len(points), np.bool_), points.copy(), points - self._points
        marked[self._triangles[low]] = True
        offsets, ring = self._rings
        for vertex in np.unique(self._triangles[_touching(self._triangles, marked)]):
            mean = moved[ring[offsets[vertex] : offsets[vertex + 1]]].mean(axis=0)
            out[vertex] += 0.5 * (mean - moved[vertex])
        return out

    def _facing(self, points: Array, chosen: IntArray) -> tuple[Array, Array]:
        """Normals (k, 3) of chosen triangles at rest, turned with the surface around them, and twice the areas (k,)."""
        used, corners = np.unique(self._triangles[chosen], return_inverse=True)
        of_corner, cross = np.empty((len(used), 3, 3)), self._cross[chosen]
        _correlations(points, self._points, used, *self._rings, of_corner)
        double = np.maximum(np.linalg.norm(cross, axis=1), 1e-300)
        facing = np.einsum("ti,tij->tj", cross, closest_rotations(of_corner[corners.reshape(-1, 3)].sum(axis=1)))
        return facing / double[:, None], double


def _touching(triangles: IntArray, marked: BoolArray) -> IntArray:
    """Numbers of triangles with a marked corner."""
    return np.unique(np.flatnonzero(marked.take(triangles.ravel())) // 3)  # any(axis=1) takes five times as long


@compiled
def _turned(points, triangles, rest, least, marked):
    """Mark (n,) the corners of triangles that have turned far from their area vectors (m, 3) at rest, or shrunk to
    about a share of their area; return their number.
    """
    count = 0
    for t in range(triangles.shape[0]):
        x, y, z = area_vector(points, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        dot, one = x * rest[t, 0] + y * rest[t, 1] + z * rest[t, 2], x * x + y * y + z * z
        two = rest[t, 0] * rest[t, 0] + rest[t, 1] * rest[t, 1] + rest[t, 2] * rest[t, 2]
        # Leaning by less than 45 degrees, as may the surface around it, and larger than this, a triangle has more than
        # the share left, seen along where it faced.
        if (dot <= 0.0 or dot * dot <= 0.5 * one * two or 0.5 * one < least * least * two) and two > 0.0:
            marked[triangles[t, 0]] = marked[triangles[t, 1]] = marked[triangles[t, 2]] = True
            count += 1
    return count


@compiled
def _correlations(points, at_rest, chosen, offsets, ring, out):
    """Write the products (k, 3, 3) of offsets at rest and now, summed up over two rings around chosen vertices (k,).

    Each offset, from a chosen vertex to another, counts once, and weighs as the inverse square of its length at rest.
    """
    out[:] = 0.0
    counted = np.full(len(points), -1)  # around which vertex each was counted last
    for i in range(len(chosen)):
        v = chosen[i]
        counted[v] = v
        for e in range(offsets[v], offsets[v + 1]):
            _add_offset(points, at_rest, v, ring[e], counted, out[i])
            for f in range(offsets[ring[e]], offsets[ring[e] + 1]):
                _add_offset(points, at_rest, v, ring[f], counted, out[i])


@compiled
def _add_offset(points, at_rest, v, w, counted, out):
    """Add the product of the offsets from v to w at rest and now, over its square at rest, unless it was counted."""
    if counted[w] == v:
        return
    counted[w] = v
    square = 0.0
    for k in range(3):
        square += (at_rest[w, k] - at_rest[v, k]) ** 2
    if square > 0.0:
        for k in range(3):
            for j in range(3):
                out[k, j] += (at_rest[w, k] - at_rest[v, k]) * (points[w, j] - points[v, j]) / square


@compiled
def _turn_back(points, triangles, chosen, facing, double_area, free, least, sweeps):
    """Move free vertices (n,) until no chosen triangle has less than a share of its area along its direction (k, 3).

    Each triangle in turn gets what it lacks by the shortest move of its corners. Returns the number of sweeps.
    """
    slopes = np.empty((3, 3))
    for sweep in range(sweeps):
        moved = False
        for i in range(len(chosen)):
            triangle, n = triangles[chosen[i]], facing[i]
            x, y, z = area_vector(points, triangle[0], triangle[1], triangle[2])
            lacking = least * double_area[i] - (x * n[0] + y * n[1] + z * n[2])
            if lacking <= 0.0:
                continue
            square = 0.0
            for c in range(3):
                a, b = triangle[(c + 1) % 3], triangle[(c + 2) % 3]
                for k in range(3):
                    p, q = (k + 1) % 3, (k + 2) % 3
                    slopes[c, k] = n[p] * (points[b, q] - points[a, q]) - n[q] * (points[b, p] - points[a, p])
                    if free[triangle[c]]:
                        square += slopes[c, k] ** 2
            if square == 0.0:
                continue
            moved = True
            for c in range(3):
                if free[triangle[c]]:
                    for k in range(3):
                        points[triangle[c], k] += lacking / square * slopes[c, k]
        if not moved:
            return sweep
    return sweeps


# --- heights over a surface -------------------------------------------------------------------------


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
        1 except at corners of triangles that would keep less than `LEFT` of their area, seen along their normals.

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
    rounds = 16
    for k in range(rounds):
        # What lowers one triangle tilts the next: each round aims at the full share, and demands less of it.
        demanded = LEFT * (1.0 - k / rounds)
        if not _limit(points, ways, triangles, demanded, factors):
            return shares if k else None
        shares *= factors
        ways *= factors[:, None]
        factors[:] = 1.0
    while _limit(points, ways, triangles, 0.0, factors):  # what is still turned over is not displaced at all
        ways[factors < 1.0], shares[factors < 1.0] = 0.0, 0.0
        factors[:] = 1.0
    return shares


@compiled
def _limit(points, ways, triangles, demanded, factors):
    """Lower `factors` of the ways (n, 3) at the corners of triangles of which less than the share `demanded` would be
    left of the bare area, seen along the bare normal.

    The area vector of a triangle is a quadratic function of a factor of all its ways; `factors` get the one for which
    its component along the bare normal is the share `LEFT`, at least `demanded`. Returns the number of triangles that
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
        factor, spare = 0.0, (1.0 - LEFT) * area
        if spare > 0.0:  # from positive to negative the parabola has one root, unless only rounding makes it negative
            divisor = np.sqrt(linear * linear - 4.0 * square * spare) - linear
            factor = min(2.0 * spare / divisor, 1.0) if divisor > 0.0 else 1.0
        found += factor < 1.0
        for v in (i, j, k):
            factors[v] = min(factors[v], factor)
    return found
