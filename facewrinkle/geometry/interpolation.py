"""Points on triangles: values interpolated there, heights above them, the closest ones, and samples of a surface."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..array_types import Array, IntArray
from .compilation import compiled
from .normals import double_areas, tangent_axes, vertex_normals
from .refinement import RedGreenForest, frozen


def interpolated(values: Array, corners: npt.NDArray[np.int32], barycentric: Array) -> Array:
    """Linear interpolation of (n0, d) values at n points with barycentric coordinates in three base vertices each.

    Examples
    --------
    >>> interpolated(np.array([[0.0], [1.0], [4.0]]), np.array([[0, 1, 2]], np.int32), np.array([[0.5, 0.25, 0.25]]))
    array([[1.25]])
    """
    out = np.empty((len(corners), values.shape[1]))
    # Read-only, as those of vertices are: machine code for both is the same.
    _interpolate(values, frozen(corners), frozen(barycentric), out)
    return out


def refined_values(values: Array, base: IntArray, forest: RedGreenForest) -> Array:
    """Values (m, 3, d) at the corners of a refined mesh, by linear interpolation in the base triangles.

    Parameters
    ----------
    values : ndarray, shape (m0, 3, d)
        At the corners of the base triangles.
    base : ndarray of int, shape (m0, 3)
        The triangles that the forest was made of.
    forest : RedGreenForest

    Examples
    --------
    >>> forest = RedGreenForest([[0, 1, 2]])
    >>> forest.split([0])
    Change(kept=slice(None, None, None), n_created=3)
    >>> refined_values(np.array([[[0.0], [4.0], [8.0]]]), np.array([[0, 1, 2]]), forest)[0].ravel().tolist()
    [0.0, 2.0, 4.0]
    """
    out = np.empty((*forest.triangles.shape, values.shape[2]))
    base = np.ascontiguousarray(base, dtype=np.int32)
    _interpolate_corners(values, base, forest.triangles, forest.root, forest.corners, forest.barycentric, out)
    return out


def barycentric(points: Array, corners: Array) -> Array:
    """Barycentric coordinates (n, 3) of points (n, 3) that lie in triangles (n, 3, 3) or close to them.

    Examples
    --------
    >>> corners = np.array([[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]])
    >>> barycentric(np.array([[1.0, 2.0, 0.0]]), corners).tolist()
    [[0.25, 0.25, 0.5]]
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = points - corners[:, 0]
    aa, ab, bb = (np.einsum("ni,ni->n", x, y) for x, y in ((a, a), (a, b), (b, b)))
    pa, pb = np.einsum("ni,ni->n", p, a), np.einsum("ni,ni->n", p, b)
    det = np.maximum(aa * bb - ab * ab, 1e-300)
    v, w = (bb * pa - ab * pb) / det, (aa * pb - ab * pa) / det
    weights = np.clip(np.stack([1.0 - v - w, v, w], axis=1), 0.0, 1.0)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def nearest_values(values: np.ndarray, corners: npt.NDArray[np.int32], barycentric: Array) -> np.ndarray:
    """Values of the base vertex with the largest weight: for labels and other values that cannot be averaged.

    Examples
    --------
    >>> labels = np.array(["lip", "lip", "cheek"])
    >>> nearest_values(labels, np.array([[0, 1, 2]], np.int32), np.array([[0.3, 0.3, 0.4]]))
    array(['cheek'], dtype='<U5')
    """
    return np.asarray(values[corners[np.arange(len(corners)), np.argmax(barycentric, axis=1)]])


def displaced(points: Array, heights: Array, directions: Array) -> Array:
    """Points (n, 3) moved by heights (n,) along directions (n, 3).

    Examples
    --------
    >>> displaced(np.zeros((1, 3)), np.array([2.0]), np.array([[0.0, 0.0, 1.0]]))
    array([[0., 0., 2.]])
    """
    return np.asarray(points + heights[:, None] * directions)


def height_above(points: Array, up: Array, mesh: tuple[Array, npt.NDArray[np.integer]], deep: float) -> Array:
    """Heights (n,) of a mesh above points (n, 3), along unit directions (n, 3) that differ by less than a right angle.

    Triangles count that contain a point as seen along the mean of the directions, face it and its own direction, and
    whose plane is within `deep` of it. The highest gives the height; -inf where there is none.

    Examples
    --------
    >>> sheet = np.array([[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 3.0]]), np.array([[0, 1, 2]], np.int32)
    >>> up, below = np.tile([0.0, 0.0, 1.0], (2, 1)), np.array([[1.0, 2.0, 0.0], [3.0, 3.0, 0.0]])
    >>> height_above(below, up, sheet, deep=10.0).tolist()
    [2.0, -inf]
    """
    out = np.full(len(points), -np.inf)
    if not len(points):
        return out
    ahead = up.mean(axis=0, keepdims=True)
    ahead /= max(float(np.linalg.norm(ahead)), 1e-300)
    axes = np.concatenate([*tangent_axes(ahead), ahead]).T
    place, local, reach = points @ axes, np.asarray(mesh[0]) @ axes, np.array([0.0, 0.0, deep])
    near = overlapping(local, mesh[1], place.min(axis=0) - reach, place.max(axis=0) + reach)
    order = np.argsort(place[:, 0])
    found = np.full(len(points), -np.inf)
    # Points that lie outside a triangle by less than 0.02, in barycentric coordinates, count as inside.
    heights_above(place[order], (up @ axes)[order], local[mesh[1][near]], deep, 0.02, found)
    out[order] = found
    return out


def overlapping(points: Array, triangles: npt.NDArray[np.integer], low: Array, high: Array) -> IntArray:
    """Return the triangles (k,) whose bounding boxes overlap the box from `low` to `high`.

    Examples
    --------
    >>> points = 4.0 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 2, 2]])
    >>> overlapping(points, np.array([[0, 1, 2], [1, 2, 3]]), np.ones(3), 2.0 * np.ones(3)).tolist()
    [1]
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    return np.flatnonzero(((most >= low) & (least <= high)).all(axis=1))


def surface_samples(points: Array, triangles: npt.NDArray[np.integer], count: int) -> Array:
    """Return `count` points (count, 3) spread over the triangles evenly by area, the same ones every time.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> surface_samples(square, np.array([[0, 1, 2], [0, 2, 3]]), 1000).mean(axis=0).round(2)
    array([0.5, 0.5, 0. ])
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.cumsum(double_areas(points, triangles))
    which = np.searchsorted(area, (np.arange(count) + 0.5) / count * area[-1])
    # 1 / p and 1 / p^2 of the plastic number p: their multiples fill the square evenly (Roberts 2018).
    steps = np.array([0.7548776662466927, 0.5698402909980532])
    u, v = ((0.5 + np.arange(count)[:, None] * steps) % 1.0).T[..., None]
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    return np.asarray(a[which] + u * (b - a)[which] + v * (c - a)[which])


def smoothstep(t: npt.ArrayLike) -> Array:
    """Rise ``3 t^2 - 2 t^3`` from 0 at t <= 0 to 1 at t >= 1, level at both ends.

    Examples
    --------
    >>> smoothstep([-1.0, 0.0, 0.5, 2.0])
    array([0. , 0. , 0.5, 1. ])
    """
    t = np.clip(np.asarray(t, dtype=np.float64), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


@compiled
def _interpolate(values, corners, barycentric, out):
    """Linear interpolation of values (n0, d) at points with three corners and weights each."""
    for i in range(corners.shape[0]):
        a, b, c = np.uint32(corners[i, 0]), np.uint32(corners[i, 1]), np.uint32(corners[i, 2])
        wa, wb, wc = barycentric[i, 0], barycentric[i, 1], barycentric[i, 2]
        for k in range(values.shape[1]):
            out[i, k] = wa * values[a, k] + wb * values[b, k] + wc * values[c, k]


@compiled
def _interpolate_corners(values, base, triangles, roots, hosts, weights, out):
    """Interpolate values (m0, 3, d) at corners of base triangles for the corners (m, 3, d) of the triangles in them.

    Vertex v lies in the base triangle with the vertices hosts[v], at weights[v]; that triangle may be a neighbor of
    the root of a triangle at v. Sums run over the corners of the root: on an edge one of the three terms is 0, so
    that both sides of the edge are rounded alike.
    """
    for t in range(len(triangles)):
        root = roots[t]
        for k in range(3):
            v = triangles[t, k]
            for c in range(values.shape[2]):
                out[t, k, c] = 0.0
            for j in range(3):
                share = 0.0
                for i in range(3):
                    if hosts[v, i] == base[root, j]:
                        share += weights[v, i]
                for c in range(values.shape[2]):
                    out[t, k, c] += share * values[root, j, c]


@compiled
def heights_above(places, up, corners, deep, tolerance, out):
    """Raise `out` (n,) to the heights of triangles, with `corners` (m, 3, 3), above places (n, 3) that are sorted by x.

    Those triangles count that face z and contain the place as seen along it; their planes give the heights.
    """
    x = places[:, 0].copy()
    for f in range(len(corners)):
        ax, ay, az = corners[f, 0, 0], corners[f, 0, 1], corners[f, 0, 2]
        ex, ey, ez = corners[f, 1, 0] - ax, corners[f, 1, 1] - ay, corners[f, 1, 2] - az
        gx, gy, gz = corners[f, 2, 0] - ax, corners[f, 2, 1] - ay, corners[f, 2, 2] - az
        nx, ny, nz = ey * gz - ez * gy, ez * gx - ex * gz, ex * gy - ey * gx
        if nz <= 0.0:
            continue
        margin = tolerance * (abs(ex) + abs(gx))
        first, last = min(ax, ax + ex, ax + gx) - margin, max(ax, ax + ex, ax + gx) + margin
        for i in range(np.searchsorted(x, first), np.searchsorted(x, last)):
            ox, oy = x[i] - ax, places[i, 1] - ay
            v, w = (ox * gy - oy * gx) / nz, (oy * ex - ox * ey) / nz
            if v < -tolerance or w < -tolerance or v + w > 1.0 + tolerance:
                continue
            facing = nx * up[i, 0] + ny * up[i, 1] + nz * up[i, 2]
            if facing > 0.0:
                rise = -(nx * ox + ny * oy + nz * (places[i, 2] - az)) / facing
                if abs(rise) < deep:
                    out[i] = max(out[i], rise)


# --- the point of a mesh that is closest to a given point ----------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ClosestPoint:
    """The point of a mesh that is closest to a given point.

    Attributes
    ----------
    triangle : int
    barycentric : ndarray, shape (3,)
    point, normal : ndarray, shape (3,)
        Its position, and the unit normal interpolated there; zero on triangles without area.
    distance : float

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
    >>> near = closest_point(corners, np.array([[0, 1, 2]], np.int32), [1.0, 2.0, 3.0])
    >>> near.distance, near.barycentric, near.normal
    (3.0, array([0.25, 0.25, 0.5 ]), array([0., 0., 1.]))
    """

    triangle: int
    barycentric: Array
    point: Array
    normal: Array
    distance: float


def closest_point(points: Array, triangles: IntArray, query: npt.ArrayLike) -> ClosestPoint:
    """Return the point of a mesh that is closest to `query` (3,).

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
    >>> closest_point(corners, np.array([[0, 1, 2]], np.int32), [1.0, 2.0, 3.0]).point
    array([1., 2., 0.])
    """
    triangle, weights, distance = closest(points, triangles, np.asarray(query, dtype=np.float64))
    own = triangles[triangle]
    corners, around = points[own], triangles[np.isin(triangles, own).any(axis=1)]
    normal = weights @ vertex_normals(points, around)[own]
    length = max(float(np.linalg.norm(normal)), 1e-300)
    return ClosestPoint(int(triangle), weights, weights @ corners, normal / length, float(distance))


@compiled
def closest(points, triangles, query):
    """Triangle, barycentric coordinates and distance of the point of a mesh that is closest to `query`."""
    best, found = np.inf, 0
    weights, w = np.empty(3), np.empty(3)
    for f in range(triangles.shape[0]):
        a, b, c = points[triangles[f, 0]], points[triangles[f, 1]], points[triangles[f, 2]]
        distance = closest_in_triangle(query, a, b, c, w)
        if distance < best:
            best, found = distance, f
            for k in range(3):  # as a whole, numba would compile the text of an error for it: three seconds
                weights[k] = w[k]
    return found, weights, np.sqrt(best)


class BoxTree:
    """A hierarchy of boxes around the triangles of a mesh, in which the points closest to others are found.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)

    Examples
    --------
    >>> tree = BoxTree(np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]), np.array([[0, 1, 2]]))
    >>> triangle, weights, distance = tree.closest(np.array([[1.0, 2, 3], [8, 0, 0]]))
    >>> triangle.tolist(), weights.tolist(), distance.tolist()
    ([0, 0], [[0.25, 0.25, 0.5], [0.0, 1.0, 0.0]], [3.0, 4.0])
    """

    def __init__(self, points: Array, triangles: IntArray) -> None:
        self._corners = corners = np.asarray(points, np.float64)[triangles]
        a, b, c = (corners[:, k] for k in range(3))
        self._middles = cKDTree((a + b + c) / 3.0, balanced_tree=False, compact_nodes=False)
        order = self._middles.indices  # triangles beside each other are close to each other
        # Boxes of single triangles, then of 8 in a row, of 64, and so on.
        branches = 8
        boxes = [np.hstack([np.minimum(np.minimum(a, b), c), -np.maximum(np.maximum(a, b), c)])[order]]
        while len(boxes[-1]) > 1:
            boxes.append(np.minimum.reduceat(boxes[-1], np.arange(0, len(boxes[-1]), branches)))
        starts = np.concatenate([branches**k * np.arange(len(each)) for k, each in enumerate(boxes)])
        sizes = np.repeat(branches ** np.arange(len(boxes)), [len(each) for each in boxes])
        rows = np.lexsort((-sizes, starts))  # each box comes before those in it
        held = np.append(order, np.full(len(rows) - len(order), -1))[rows]
        self._boxes = np.concatenate(boxes)[rows], np.searchsorted(starts[rows], (starts + sizes)[rows]), held

    def closest(self, places: Array) -> tuple[npt.NDArray[np.int64], Array, Array]:
        """Return triangles (n,), barycentric coordinates (n, 3) and distances (n,) of the points that are the closest
        to places (n, 3); distances are infinite if there are no triangles.
        """
        n, (_, found) = len(places), self._middles.query(places)
        weights, distance = np.empty((n, 3)), np.full(n, np.inf)
        _look_in_boxes(places, self._corners, *self._boxes, found, weights, distance)
        return found, weights, distance


@compiled
def _look_in_boxes(places, corners, boxes, following, held, found, weights, distance):
    """Replace the triangles that were `found` nearby by the closest ones; write barycentric coordinates and distances.

    Rows of `boxes` have the lowest coordinates, and the highest with their signs changed. Each holds the triangle
    `held`, or the boxes in the next rows up to `following`.
    """
    w = np.empty(3)
    for i in range(len(places) if len(corners) else 0):
        place, row, t = places[i], 0, found[i]
        best = closest_in_triangle(place, corners[t, 0], corners[t, 1], corners[t, 2], weights[i])
        while row < len(boxes):
            from_box, t = 0.0, held[row]
            for k in range(3):
                from_box += max(boxes[row, k] - place[k], place[k] + boxes[row, k + 3], 0.0) ** 2
            row = row + 1 if from_box < best else following[row]
            if t >= 0 and from_box < best:
                square = closest_in_triangle(place, corners[t, 0], corners[t, 1], corners[t, 2], w)
                if square < best:
                    best, found[i] = square, t
                    for k in range(3):
                        weights[i, k] = w[k]
        distance[i] = np.sqrt(best)


@compiled
def closest_in_triangle(p, a, b, c, weights):
    """Squared distance of p from the triangle abc; the barycentric coordinates of the closest point go to `weights`.

    The triangle may be degenerate.
    """
    d00 = d01 = d11 = d20 = d21 = 0.0
    for k in range(3):  # numbers, not small arrays, which would be allocated
        ab, ac, ap = b[k] - a[k], c[k] - a[k], p[k] - a[k]
        d00 += ab * ab
        d01 += ab * ac
        d11 += ac * ac
        d20 += ap * ab
        d21 += ap * ac
    determinant = d00 * d11 - d01 * d01
    if determinant > 0.0:
        v, w = (d11 * d20 - d01 * d21) / determinant, (d00 * d21 - d01 * d20) / determinant
        u = 1.0 - v - w
        if u >= 0.0 and v >= 0.0 and w >= 0.0:
            weights[0], weights[1], weights[2] = u, v, w
            distance = 0.0
            for k in range(3):
                distance += (p[k] - a[k] - v * (b[k] - a[k]) - w * (c[k] - a[k])) ** 2
            return distance
    best, corners = np.inf, (a, b, c)
    for e in range(3):
        start, end = corners[e], corners[(e + 1) % 3]
        along = square = distance = 0.0
        for k in range(3):
            along += (p[k] - start[k]) * (end[k] - start[k])
            square += (end[k] - start[k]) ** 2
        t = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        for k in range(3):
            distance += (p[k] - start[k] - t * (end[k] - start[k])) ** 2
        if distance < best:
            best = distance
            weights[e], weights[(e + 1) % 3], weights[(e + 2) % 3] = 1.0 - t, t, 0.0
    return best
