"""Charts: flat coordinates laid on a curved surface about a point, in the lengths of the surface."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from heapq import heapify, heappop, heappush

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, diags_array

from ..array_types import Array, IntArray
from .compilation import compiled
from .interpolation import ClosestPoint
from .laplacian import symmetric_factors
from .normals import double_areas
from .topology import incident_triangles, unique_edges


def geodesic_chart(points: Array, triangles: IntArray, centre: ClosestPoint, up: npt.ArrayLike, reach: float) -> Array:
    """Positions of the vertices as seen from `centre`: the logarithmic map of the surface.

    The length and direction of the straightest line from the centre spread outwards over the triangles: two known
    corners give the third. Exact on surfaces that can be unrolled.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int32, shape (m, 3)
    centre : ClosestPoint
    up : array_like, shape (3,)
        Its part in the tangent plane at the centre is the direction of the second axis.
    reach : float
        Vertices farther away than this are left out, except some just beyond it.

    Returns
    -------
    ndarray, shape (n, 2)
        Right and up, in the unit of `points`; NaN for vertices out of reach.

    Notes
    -----
    After Melvaer and Reimers, "Geodesic polar coordinates on polygonal meshes" (2012).

    Examples
    --------
    >>> p = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    >>> t = np.array([[0, 1, 2], [1, 3, 2]], np.int32)
    >>> from facewrinkle.geometry.interpolation import closest_point
    >>> geodesic_chart(p, t, closest_point(p, t, [0.25, 0.25, 0.0]), [0, 1, 0], 9.0)[3].round(12)
    array([0.75, 0.75])
    """
    corners = triangles[centre.triangle]
    # From a corner or on an edge, angles are undefined: start a little inside, and shift the result.
    start = (1.0 - 1e-3) * centre.point + 1e-3 * points[corners].mean(axis=0)
    flat = np.cross(*np.diff(points[corners], axis=0))
    # Directions are those on the smooth surface: on an edge, either of its triangles would turn them another way.
    right, upward = tilted(np.array(tangents(centre.normal, up)), centre.normal, flat / np.linalg.norm(flat))
    rays, shift = points[corners] - start, start - centre.point
    distance, angle = np.full(len(points), np.inf), np.zeros(len(points))
    distance[corners] = np.linalg.norm(rays, axis=1)
    angle[corners] = np.arctan2(rays @ upward, rays @ right)
    _polar(points, triangles, *incident_triangles(triangles), centre.triangle, reach, distance, angle)
    distance[np.isinf(distance)] = np.nan
    return np.stack([distance * np.cos(angle) + shift @ right, distance * np.sin(angle) + shift @ upward], axis=1)


def tangents(normal: Array, up: npt.ArrayLike) -> tuple[Array, Array]:
    """Unit tangents to the right and upwards, as seen from the tip of `normal`; zero if `up` is parallel to it.

    Examples
    --------
    >>> [t.tolist() for t in tangents(np.array([0.0, 0.0, 2.0]), [0.0, 3.0, 1.0])]
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    normal = normal / np.linalg.norm(normal)
    up = np.asarray(up, dtype=np.float64)
    upward = up - (up @ normal) * normal
    length = np.linalg.norm(upward)
    upward = upward / length if length > 1e-9 * np.linalg.norm(up) else np.zeros(3)
    return np.cross(upward, normal), upward


def tilted(vectors: Array, normal: Array, other: Array) -> Array:
    """Vectors (k, 3), turned as the least rotation that takes one unit normal to another does.

    Examples
    --------
    >>> tilted(np.array([[1.0, 0, 0], [0, 1, 0]]), np.array([0.0, 0, 1]), np.array([1.0, 0, 0])).tolist()
    [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    """
    axis = np.cross(normal, other)
    turned = vectors + np.cross(axis, vectors) + np.cross(axis, np.cross(axis, vectors)) / (1.0 + normal @ other)
    return np.asarray(turned)


def gradients(points: Array, triangles: IntArray, values: Array) -> Array:
    """Surface gradients (n, 3, d) of values (n, d) at the vertices: means over triangles, weighted by area.

    Triangles with a NaN are left out; vertices that have no other triangles get zero.

    Examples
    --------
    >>> p = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> gradients(p, np.array([[0, 1, 2]], np.int32), 3.0 * p[:, :1])[1].ravel()
    array([3., 0., 0.])
    """
    known = triangles[np.isfinite(values[triangles]).all(axis=(1, 2))]
    a, b = points[known[:, 1]] - points[known[:, 0]], points[known[:, 2]] - points[known[:, 0]]
    normal = np.cross(a, b)
    double = np.linalg.norm(normal, axis=1, keepdims=True)
    dual_a, dual_b = np.cross(b, normal) / double**2, np.cross(normal, a) / double**2
    da, db = values[known[:, 1]] - values[known[:, 0]], values[known[:, 2]] - values[known[:, 0]]
    slope = dual_a[:, :, None] * da[:, None] + dual_b[:, :, None] * db[:, None]
    out, total = np.zeros((len(points), 3, values.shape[1])), np.full(len(points), 1e-300)
    for corner in range(3):
        np.add.at(out, known[:, corner], slope * double[:, :, None])
        np.add.at(total, known[:, corner], double[:, 0])
    return np.asarray(out / total[:, None, None])


def smoothly_interpolated(
    points: Array, values: Array, slopes: Array, places: Array, corners: IntArray, barycentric: Array
) -> Array:
    """Values (k, d) at places on triangles, without the kinks of linear interpolation at the edges.

    ``sum w_i (v_i + (x - x_i) . g_i / 2)`` with the gradients g (n, 3, d) at the vertices: half linear interpolation,
    half the mean of the tangents. One overshoots by what the other undershoots, so quadratic functions are exact.

    Examples
    --------
    The squares of 0, 1 and 2, and their slopes, give the square of 1.5; linear interpolation gives 2.5:

    >>> p = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    >>> slopes = np.array([[[0.0], [0], [0]], [[2], [0], [0]], [[4], [0], [0]]])
    >>> at = np.array([[0.0, 0.5, 0.5]])
    >>> smoothly_interpolated(p, p[:, :1] ** 2, slopes, at @ p, np.array([[0, 1, 2]]), at)
    array([[2.25]])
    """
    along = places[:, None] - points[corners]
    bent = values[corners] + 0.5 * np.einsum("kcx,kcxd->kcd", along, slopes[corners])
    return np.einsum("kc,kcd->kd", barycentric, bent)


def smoothed(points: Array, triangles: IntArray, values: Array, length: float) -> Array:
    """Values (n, d) at the vertices without features shorter than about `length`; linear functions stay as they are.

    Minimizes the area integral of ``(c - values)^2 + length^4 |second derivatives of c|^2``, where a second derivative
    is the jump of the slope across an edge. Vertices with NaN, and triangles that have one, are left out.

    Examples
    --------
    >>> p = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    >>> t = np.array([[0, 1, 2], [1, 3, 2]], np.int32)
    >>> smoothed(p, t, np.array([[0.0], [1.0], [2.0], [3.0]]), 9.0).ravel().round(9).tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    known = triangles[np.isfinite(values[triangles]).all(axis=(1, 2))]
    if len(known) < 2:
        return values
    used, local = np.unique(known, return_inverse=True)
    local, p = local.reshape(-1, 3).astype(np.int32), points[used]
    edges, sides = unique_edges(local)
    area = 0.5 * double_areas(p, local)
    area = np.maximum(area, 1e-12 * area.max())
    rows, columns, weights = [], [], []
    for s in range(3):  # |edge| times the slope out of the triangle, from the cotangents at both ends
        a, b, o = local[:, s], local[:, (s + 1) % 3], local[:, (s + 2) % 3]
        side = p[b] - p[a]
        at_a = ((p[o] - p[a]) * side).sum(axis=1) / (2.0 * area)
        at_b = ((p[o] - p[b]) * -side).sum(axis=1) / (2.0 * area)
        rows.append(np.tile(sides[:, s], 3))
        columns.append(np.concatenate([a, b, o]))
        weights.append(np.concatenate([at_b, at_a, -at_a - at_b]))
    shape = len(edges), len(used)
    jump = coo_array((np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))), shape=shape).tocsr()
    around = np.bincount(sides.ravel(), np.repeat(area, 3), minlength=len(edges))
    inner = np.bincount(sides.ravel(), minlength=len(edges)) == 2
    stiff = diags_array(np.where(inner, 3.0 * length**4 / around, 0.0))
    mass = diags_array(np.bincount(local.ravel(), np.repeat(area / 3.0, 3), minlength=len(used)))
    matrix = (mass + jump.T @ stiff @ jump).tocsc()
    factors = symmetric_factors(matrix)
    out = values.copy()
    out[used] = factors.solve(mass @ values[used])
    return out


@compiled
def _through(points, i, j, k, distance, angle):
    """Distance and angle at i of the straight line through the edge j k, and the angle by which it misses the edge.

    The triangle of the source and the edge and the triangle j k i of the mesh are unfolded into one plane. As j k i is
    oriented, a source beyond the edge sees k to the right of j. Distance and miss are infinite where no line leads
    through the edge: for a source on the near side, for lines that lead back, and for lines longer than by way of j.
    """
    e, r = points[k] - points[j], points[i] - points[j]
    length = np.sqrt((e * e).sum())
    ix = (r * e).sum() / length
    iy = np.sqrt(max((r * r).sum() - ix * ix, 0.0))
    uj, uk = distance[j], distance[k]
    turn = angle[k] - angle[j]
    sx = (uj * uj - uk * uk + length * length) / (2.0 * length)
    sy = -np.sqrt(max(uj * uj - sx * sx, 0.0))
    to_j, to_k, to_i = np.arctan2(-sy, -sx), np.arctan2(-sy, length - sx), np.arctan2(iy - sy, ix - sx)
    from_j, from_k = to_i - to_j, to_i - to_k
    turn -= 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
    from_j -= 2.0 * np.pi * np.round(from_j / (2.0 * np.pi))
    from_k -= 2.0 * np.pi * np.round(from_k / (2.0 * np.pi))
    u = np.hypot(ix - sx, iy - sy)
    longest = uj + np.sqrt((r * r).sum())
    if turn > 0.0 or u < min(uj, uk) or u > longest * (1.0 + 1e-9):
        return np.inf, 0.0, np.inf
    if from_j > 0.0:  # past an end of the edge the plane is continued
        return u, angle[j] + from_j, from_j
    if from_k < 0.0:
        return u, angle[k] + from_k, -from_k
    wide = from_k - from_j
    share = -from_j / wide if wide > 1e-12 else 0.5
    return u, angle[j] + share * turn, 0.0


@compiled
def _polar(points, triangles, offsets, around, first, reach, distance, angle):
    """Fill in distances and angles, from those at the triangle `first` outwards to `reach`, nearest vertices first.

    `around[offsets[v]:offsets[v + 1]]` are the triangles at v. A vertex takes its values through the edge that the
    straight line to it crosses or, if no such edge is known yet, through the one that the line misses by least.
    """
    n = points.shape[0]
    quality, done = np.full(n, np.inf), np.zeros(n, np.bool_)
    heap = [(distance[v], v) for v in triangles[first]]
    heapify(heap)
    quality[triangles[first]] = -1.0
    while heap:
        key, v = heappop(heap)
        if done[v] or key > distance[v] or key > reach:
            continue
        done[v] = True
        for q in range(offsets[v], offsets[v + 1]):
            f = around[q]
            for c in range(3):
                i, j, k = triangles[f, c], triangles[f, (c + 1) % 3], triangles[f, (c + 2) % 3]
                if i == v or done[i] or not (done[j] and done[k]):
                    continue
                u, a, miss = _through(points, i, j, k, distance, angle)
                if miss < quality[i] or (miss == quality[i] and u < distance[i]):
                    quality[i], distance[i], angle[i] = miss, u, a
                    heappush(heap, (u, i))
    for v in range(n):
        if not done[v]:
            distance[v] = np.inf
    # Now that all neighbors are known, each vertex takes the edge that its line really crosses; twice over.
    order = np.argsort(distance)
    for _ in range(2):
        for v in order:
            if not done[v]:
                break
            for q in range(offsets[v], offsets[v + 1]):
                f = around[q]
                c = 0 if triangles[f, 0] == v else 1 if triangles[f, 1] == v else 2
                j, k = triangles[f, (c + 1) % 3], triangles[f, (c + 2) % 3]
                if done[j] and done[k]:
                    u, a, miss = _through(points, v, j, k, distance, angle)
                    if miss < quality[v]:
                        quality[v], distance[v], angle[v] = miss, u, a
