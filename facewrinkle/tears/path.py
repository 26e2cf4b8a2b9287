"""Where a tear runs: down the steepest descent, through given points, or along what was painted."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..errors import ParameterError
from ..geometry.topology import unique_edges
from . import _kernels as kernels
from .support_surface import SupportSurface, vectors

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

LEVEL = 0.06
"""Where the slope of the surface (sine) is less, water stays."""

INERTIA = 0.6
"""How much of its direction water keeps from one step to the next."""


def descent(ground: SupportSurface, start: Array, step: float, length: float, heading: Array | None = None) -> Array:
    """The way of water from a point of the surface down the steepest descent.

    Where facets meet, interpolated normals stand for the smooth surface; water keeps some of its direction.

    Parameters
    ----------
    ground : SupportSurface
    start : ndarray, shape (3,)
    step, length : float
        Of a step, and at most of the whole way.
    heading : ndarray, shape (3,), optional
        Direction in which it arrives.

    Returns
    -------
    ndarray, shape (k, 3)
        It ends at a level place, in a pit, or at the border; k = 1 if it does not run at all.

    Examples
    --------
    Straight down an upright sheet to its border:

    >>> import pyvista as pv
    >>> from facewrinkle.tears.support_surface import support_surface
    >>> sheet = support_surface(pv.Plane(i_size=20, j_size=20))
    >>> way = descent(sheet, np.array([3.0, 8, 0]), step=0.5, length=100.0)
    >>> way[0].round(3) + 0.0, way[-1].round(3) + 0.0
    (array([3., 8., 0.]), array([  3., -10.,   0.]))
    """
    order = np.argsort(ground.triangles, axis=None, kind="stable")
    offsets = np.concatenate([[0], np.cumsum(np.bincount(ground.triangles.ravel(), minlength=len(ground.points)))])
    cells, found = ground.nearest(start[None])
    path = np.empty((int(length / step) + 1, 3))
    count = kernels.descend(
        ground.points, ground.triangles, ground.normals, offsets, order // 3, found[0], int(cells[0]),
        ground.down if heading is None else heading, ground.down, step, INERTIA, LEVEL, path,
    )  # fmt: skip
    return path[:count]


def through(ground: SupportSurface, given: npt.ArrayLike, width: float) -> Array:
    """A path over the surface through points given on it.

    Raises
    ------
    ParameterError
        If a point is off the surface or under it, if the way between two of them leaves the surface, or if the path
        crosses itself.

    Examples
    --------
    The way between two points runs on the surface, and is longer than the chord:

    >>> import pyvista as pv
    >>> from facewrinkle.tears.support_surface import support_surface
    >>> ball = support_surface(pv.Sphere(radius=20.0, theta_resolution=60, phi_resolution=60))
    >>> way = through(ball, [(0, 14, 14), (0, -14, 14)], width=2.0)
    >>> round(float(lengths(way)[-1])), round(float(np.linalg.norm(way[-1] - way[0])))
    (31, 28)
    >>> through(ball, [(0, 14, 14), (0, 0, 30)], width=2.0)
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: the path must lie on the surface; its point 1, [ 0.  0. 30.], is 10 away ...
    """
    points = vectors("path", given)
    if len(points) < 2:
        raise ParameterError(f"a path needs two points at least, received {len(points)}.")
    _, found = ground.nearest(points)
    gap = np.linalg.norm(found - points, axis=1)
    allowed = max(width, 0.02 * ground.size)
    if gap.max() > allowed:
        worst = int(np.argmax(gap))
        raise ParameterError(
            f"the path must lie on the surface; its point {worst}, {points[worst]}, is {gap[worst]:.3g} away from it "
            f"(at most {allowed:.3g} is allowed). Are path and surface in the same unit and coordinates?"
        )
    _check_side(ground, found)
    pieces = []
    for a, b in pairwise(found):
        share = np.linspace(0.0, 1.0, max(int(np.ceil(np.linalg.norm(b - a) / (0.5 * width))), 1) + 1)[:-1, None]
        pieces.append(ground.nearest((1.0 - share) * a + share * b)[1])
    path = np.concatenate([*pieces, found[-1:]])
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    if steps.max() > 2.5 * width:
        worst = int(np.argmax(steps))
        raise ParameterError(
            f"the path leaves the surface: between {path[worst].round(2)} and {path[worst + 1].round(2)} there is a "
            "hole or a fold. Lead it around with more points."
        )
    _check_crossing(path, width)
    return path


def painted(ground: SupportSurface, weight: npt.ArrayLike, width: float) -> Array:
    """A path along painted vertices: the shortest way from the highest to the lowest of them that keeps to the paint.

    Parameters
    ----------
    ground : SupportSurface
    weight : array_like, shape (n,)
        Above 0 where the tear may run; it prefers large ones.
    width : float

    Raises
    ------
    ParameterError
        For weights of another shape or that are not finite, or if no connected vertices are painted.

    Examples
    --------
    A column of vertices of an upright sheet:

    >>> import pyvista as pv
    >>> from facewrinkle.tears.support_surface import support_surface
    >>> sheet = support_surface(pv.Plane(i_size=20, j_size=20))
    >>> way = painted(sheet, abs(sheet.points[:, 0] - 4.0) < 0.5, width=2.0)
    >>> way[0].round(3) + 0.0, way[-1].round(3) + 0.0
    (array([ 4., 10.,  0.]), array([  4., -10.,   0.]))
    """
    paint = np.asarray(weight, dtype=np.float64)
    if paint.shape != (len(ground.points),) or not np.isfinite(paint).all():
        raise ParameterError(
            f"painted weights must be {len(ground.points)} finite numbers, one for each vertex, received {paint.shape}"
            f"{'' if np.isfinite(paint).all() else ', some of them not finite'}."
        )
    edges, _ = unique_edges(ground.triangles)
    edges = edges[(paint[edges] > 0.0).all(axis=1)]
    if not len(edges):
        raise ParameterError("nothing is painted: two neighbouring vertices at least need weights above 0.")
    length = np.linalg.norm(ground.points[edges[:, 0]] - ground.points[edges[:, 1]], axis=1)
    cost = length * paint.max() / paint[edges].mean(axis=1)
    graph = coo_array((cost, edges.T), shape=(len(paint), len(paint))).tocsr()
    used = np.unique(edges)
    depth = ground.points[used] @ ground.down
    top = int(used[np.argmin(depth)])
    reached, before = dijkstra(graph, directed=False, indices=top, return_predecessors=True)
    lowest = used[np.isfinite(reached[used])]
    at = int(lowest[np.argmax(ground.points[lowest] @ ground.down)])
    way = [at]
    while at != top:
        at = int(before[at])
        way.append(at)
    if len(way) < 2:
        raise ParameterError("the painted vertices have one height; a path leads downwards.")
    return through(ground, ground.points[way[::-1]], width)


def smoothed(ground: SupportSurface, path: Array, spacing: float, rounds: int = 12) -> Array:
    """The path on the surface, without its corners, with points at equal distances."""
    path = resampled(path, spacing)
    for _ in range(rounds):
        path[1:-1] = 0.25 * path[:-2] + 0.5 * path[1:-1] + 0.25 * path[2:]
    path = ground.nearest(path)[1]
    moved = np.linalg.norm(np.diff(path, axis=0), axis=1) > 1e-6 * spacing  # at a border, neighbours may become one
    return path[np.concatenate([[True], moved])]


def resampled(path: Array, spacing: float) -> Array:
    """Points (k, 3) at equal distances, about `spacing`, on a polyline; k is at least 3."""
    length = lengths(path)
    keep = np.concatenate([[True], np.diff(length) > 0.0])
    path, length = path[keep], length[keep]
    places = np.linspace(0.0, length[-1], max(int(np.ceil(length[-1] / spacing)), 2) + 1)
    return np.stack([np.interp(places, length, x) for x in path.T], axis=1)


def lengths(path: Array) -> Array:
    """Length of a polyline up to each of its points."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])


def joined(path: Array, others: Sequence[Array], distance: float) -> Array:
    """The path up to where it comes within a distance of another one, which it follows from there."""
    for other in others:
        gap, where = cKDTree(other).query(path)
        close = np.flatnonzero(gap < distance)
        if len(close):
            return np.concatenate([path[: close[0]], other[where[close[0]] :]])
    return path


def branch(ground: SupportSurface, path: Array, step: float, width: float) -> Array | None:
    """The way of what spills over where a fold first turns the stream aside; None where no fold does.

    Parameters
    ----------
    ground : SupportSurface
    path : ndarray, shape (k, 3)
    step, width : float
        The surface without its folds is that of normals averaged over four widths.
    """
    if len(path) < 8:
        return None
    around = cKDTree(ground.points).query_ball_point(path, 4.0 * width)
    normal = np.array([ground.normals[near].sum(axis=0) if near else -ground.down for near in around])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    straight = ground.down - (normal @ ground.down)[:, None] * normal
    straight /= np.maximum(np.linalg.norm(straight, axis=1, keepdims=True), 1e-9)
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    turned = np.einsum("ki,ki->k", along, straight)
    turned[[0, 1, 2, -1, -2, -3]] = 1.0
    diverted = np.flatnonzero(turned < np.cos(SPILL))
    if not len(diverted):
        return None
    k = int(diverted[0])
    crossing = path[k] + np.linspace(0.0, 2.5 * width, 26)[1:, None] * straight[k]
    over = _from_above(ground, crossing, 2.0 * width * normal[k])
    if over is None:
        return None
    way = descent(ground, over[-1], step, float(lengths(path)[-1]), straight[k])
    free = cKDTree(path).query(way)[0] > 1.2 * width
    way = way[: int(np.argmin(free)) if not free.all() else len(way)]
    if len(way) * step < 3.0 * width:
        return None
    return np.concatenate([path[k : k + 1], over[:-1], way])


def _from_above(ground: SupportSurface, points: Array, up: Array) -> Array | None:
    """Where the surface is first met from above points: on top of a fold, not inside it. None where it ends."""
    met = [ground.mesh.ray_trace(point + up, point - up, first_point=True)[0] for point in points]
    return np.array(met, dtype=np.float64) if all(len(point) for point in met) else None


SPILL = np.deg2rad(25.0)
"""A fold that turns a stream by more than this from its way down lets some of it over."""


def _check_side(ground: SupportSurface, path: Array) -> None:
    if ground.face is None:
        return
    frame = ground.face.frame
    behind = (path - frame.origin) @ frame.axes[2] / frame.pupil_distance
    if behind.min() < -BACK:
        worst = int(np.argmin(behind))
        raise ParameterError(
            f"the path must run over the front of the face; its point {worst}, {path[worst].round(2)}, is on the wrong "
            "side, behind the ears. Was it found with a mirrored or turned mesh?"
        )


BACK = 1.7
"""What lies farther behind the eyes, in distances between the pupils, is no face."""


def _check_crossing(path: Array, width: float) -> None:
    """Raise a ParameterError for a path that comes back to itself."""
    points = resampled(path, 0.5 * width)
    apart = 8  # samples: four widths along the path
    pairs = cKDTree(points).query_pairs(width, output_type="ndarray")
    crossing = pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > apart]
    if len(crossing):
        i, j = sorted(crossing[0].tolist())
        raise ParameterError(
            f"the path must not cross itself or come within its width of itself; it does at {points[i].round(2)}, "
            f"{0.5 * width * i:.3g} and {0.5 * width * j:.3g} along it. Take out the loop, or make two tears of it."
        )
