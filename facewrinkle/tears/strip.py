"""The strip of a tear: a grid of points on the surface along its path, each bound to the surface once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from ..array_types import Array, BoolArray, IntArray
from ..errors import MeshError, ParameterError
from ..geometry.interpolation import balls_around, barycentric, interpolated, overlapping
from ..geometry.topology import pairs_of
from .path import StreamPath, resampled
from .support_surface import BoundPoints, SupportSurface

GAP = 0.5
"""Distance, in halves of the width, that the middle of a strip may be from the surface."""


@dataclass(frozen=True, eq=False)
class Strip:
    """A grid of points on a surface at rest: rows along a path, columns across it.

    Attributes
    ----------
    path : StreamPath
    s, w : ndarray, shapes (r,) and (c,)
        Position of each row along the path, and distance of each column from it, evenly spaced.
    rest : ndarray, shape (r, c, 3)
        The points.
    ends : ndarray of bool, shape (r, c)
        True where the surface has ended between the path and the point, which lies on its border then.
    wobble, noise : ndarray, shapes (r,) and (r, c)
        Of the path, at the rows and at the points.

    Examples
    --------
    A strip 4 mm wide down an upright sheet:

    >>> import pyvista as pv
    >>> from facewrinkle.tears.support_surface import support_surface
    >>> path = StreamPath(np.array([[0.0, 8, 0], [0, -8, 0]]), np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> strip = strip_along(support_surface(pv.Plane(i_size=20, j_size=20)), path, reach=2.0, spacing=0.5)
    >>> strip.rest.shape, strip.rest[0, 1].round(9).tolist(), strip.rest[-1, -2].round(9).tolist()
    ((33, 11, 3), [2.0, 8.0, 0.0], [-2.0, -8.0, 0.0])
    """

    path: StreamPath
    s: Array
    w: Array
    rest: Array
    ends: BoolArray
    wobble: Array
    noise: Array

    def within(self, values: Array, front: float, half: Array) -> tuple[Array, Array, Array, BoolArray]:
        """Return s (r, 1) and w (r, c) of the grid when it is drawn in to an outline, its values there, and what moved.

        Points outside move to the outline along their rows. Rows beyond the front shrink to points of the path, the
        first of them to the front itself.

        Parameters
        ----------
        values : ndarray, shape (r, c, k)
            At the grid.
        front : float
        half : ndarray, shape (r,)
            Half the width of the outline at each row; 0 beyond the front.
        """
        s, first = self.s.copy(), int(np.searchsorted(self.s, front))
        if 0 < first < len(s):
            share = (front - s[first - 1]) / (s[first] - s[first - 1])
            s[first], values = front, values.copy()
            values[first] = (1.0 - share) * values[first - 1] + share * values[first]
        w = np.clip(self.w, -half[:, None], half[:, None])
        column = np.clip((w - self.w[0]) / (self.w[1] - self.w[0]), 0.0, len(self.w) - 1.0)
        left = np.minimum(column.astype(int), len(self.w) - 2)
        share, rows = (column - left)[:, :, None], np.arange(len(s))[:, None]
        moved = ((w != self.w) & (rows < first)) | (rows == first)
        between = (1.0 - share) * values[rows, left] + share * values[rows, left + 1]
        return s[:, None], w, np.where((w != self.w)[:, :, None], between, values), moved


def strip_along(support: SupportSurface, path: StreamPath, reach: float, spacing: float) -> Strip:
    """Return the strip along a path: the paper's base surface.

    Parameters
    ----------
    support : SupportSurface
        At rest.
    path : StreamPath
    reach, spacing : float
        Half the width, and the distance of rows and of columns, at most.

    Raises
    ------
    ParameterError
        If the path leaves the surface.

    Examples
    --------
    On an upright sheet; one column lies outside on either side:

    >>> import pyvista as pv
    >>> from facewrinkle.tears.support_surface import support_surface
    >>> path = StreamPath(np.array([[0.0, 8, 0], [0, -8, 0]]), np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> strip_along(support_surface(pv.Plane(i_size=20, j_size=20)), path, reach=1.0, spacing=0.5).w.round(2).tolist()
    [-1.33, -1.0, -0.67, -0.33, 0.0, 0.33, 0.67, 1.0, 1.33]
    """
    count = int(np.ceil(path.lengths[-1] / spacing))
    line = resampled(path.points, path.lengths[-1] / max(count, 2))
    s, side = np.linspace(0.0, path.lengths[-1], len(line)), max(int(np.ceil(reach / spacing)), 3)
    w = reach * np.arange(-side - 1, side + 2) / side  # one column lies outside, for what rises before it
    cells, middle = support.nearest(line)
    off = np.linalg.norm(middle - line, axis=1)
    if off.max() > GAP * reach:
        raise ParameterError(
            f"the tear would run over a gap of the surface, at {line[off.argmax()].round(2)}. Lead it elsewhere."
        )
    along = np.gradient(line, axis=0)
    right = gaussian_filter1d(np.cross(along, _normals(support, cells, middle)), reach / s[1], axis=0, mode="nearest")
    rest, ends = np.repeat(middle[:, None], len(w), axis=1), np.zeros((len(s), len(w)), bool)
    for way in (1, -1):
        here, on, heading = middle, cells, way * right
        for k in range(1, side + 2):
            normal = _normals(support, on, here)
            heading = heading - (heading * normal).sum(axis=1, keepdims=True) * normal
            heading /= np.linalg.norm(heading, axis=1, keepdims=True) + 1e-300
            on, there = support.nearest(here + reach / side * heading)
            stalled = np.linalg.norm(there - here, axis=1) < 0.5 * reach / side  # at the border of the surface
            column = side + 1 + way * k
            ends[:, column], rest[:, column], here = ends[:, column - way] | stalled, there, there
    wobble, noise = path.fields(*np.broadcast_arrays(s[:, None], w))
    return Strip(path, s, w, rest, ends, wobble[:, 0], noise)


def _normals(support: SupportSurface, cells: IntArray, points: Array) -> Array:
    """Return the interpolated normals (n, 3) at points of the surface, in triangles `cells`."""
    corners = support.triangles[cells]
    return interpolated(support.normals, corners, barycentric(points, support.points[corners]))


@dataclass(frozen=True, eq=False)
class Binding:
    """Points on a surface at rest, bound to the triangles of a mesh of it.

    Attributes
    ----------
    corners : ndarray, shape (k, 3, 3)
        The triangles of the mesh that are near, at rest.
    hosts : ndarray of int, shape (n,)
        The one of these in which each point lies.
    bound : BoundPoints

    Examples
    --------
    >>> rest, triangles = np.eye(3), np.array([[0, 1, 2]], np.int32)
    >>> bind(np.full((1, 3), 1.0 / 3.0), rest, triangles).bound.at(2.0 * rest).round(3)
    array([[0.667, 0.667, 0.667]])
    """

    corners: Array
    hosts: IntArray
    bound: BoundPoints


def bind(points: Array, rest: Array, triangles: IntArray, last: Binding | None = None) -> Binding:
    """Bind points (n, 3) on a surface at rest to a mesh of it, which may be refined.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    rest : ndarray, shape (n0, 3)
    triangles : ndarray of int32, shape (m, 3)
    last : Binding, optional
        Of the same points to the mesh of the last frame: used again if that has not changed.

    Raises
    ------
    MeshError
        If a point is near no triangle.

    Examples
    --------
    >>> rest, triangles = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]), np.array([[0, 1, 2]], np.int32)
    >>> bind(np.array([[0.5, 0.5, 0.0]]), rest, triangles).bound.weights.round(9).tolist()
    [[0.5, 0.25, 0.25]]
    """
    margin = 1e-6 * float(np.linalg.norm(np.ptp(points, axis=0)))
    near = triangles[overlapping(rest, triangles, points.min(axis=0) - margin, points.max(axis=0) + margin)]
    corners = rest[near]
    if last is not None and np.array_equal(last.corners, corners):
        return Binding(corners, last.hosts, BoundPoints(near[last.hosts], last.bound.weights))
    balls = balls_around(corners)
    cell, point = pairs_of(cKDTree(points).query_ball_point(balls[:, :3], balls[:, 3] + margin))
    weights = barycentric(points[point], corners[cell])
    away = np.linalg.norm(np.einsum("nk,nki->ni", weights, corners[cell]) - points[point], axis=1)
    order = np.lexsort((away, point))
    number, first = np.unique(point[order], return_index=True)
    if len(number) < len(points):
        raise MeshError("nothing of the surface is under the tear. Is it a frame of another surface?")
    hosts = cell[order[first]]
    return Binding(corners, hosts, BoundPoints(near[hosts], weights[order[first]]))


def bulge(points: Array, up: Array) -> Array:
    """Return how far (r, c) the surface between points of a grid (r, c, 3) may rise above the facets between them.

    Where one crease crosses between neighbors, it rises no further than facets do that are raised by this much.

    Examples
    --------
    A ridge 1 high along the middle row:

    >>> points = np.zeros((3, 3, 3))
    >>> points[1, :, 2] = 1.0
    >>> bulge(points, np.tile([0.0, 0, 1], (3, 3, 1)))[1].tolist()
    [1.0, 1.0, 1.0]
    """
    out = np.zeros(points.shape[:2])
    for axis in (0, 1):
        p = np.moveaxis(points, axis, 0)
        bend = p[1:-1] - 0.5 * (p[:-2] + p[2:])
        rise = (bend * np.moveaxis(up, axis, 0)[1:-1]).sum(axis=2)
        np.moveaxis(out, axis, 0)[1:-1] += np.maximum(rise, 0.0)
    return out
