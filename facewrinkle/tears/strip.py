"""The strip of a tear: a grid of points on the surface along its path, each bound to the surface once."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..array_types import Array, BoolArray, IntArray
from ..errors import MeshError, ParameterError
from ..geometry import (
    BoxTree,
    barycentric,
    closest_in_triangle,
    compiled,
    interpolated,
    overlapping,
    side_lengths,
    unit,
)
from .path import StreamPath, resampled
from .support_surface import BoundPoints, SupportSurface


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
    if off.max() > 0.5 * reach:
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
            heading = unit(heading - (heading * normal).sum(axis=1, keepdims=True) * normal)
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
    hosts, weights, distance = BoxTree(rest, near).closest(points)
    if not len(near) or distance.max() > side_lengths(corners).max():
        raise MeshError("nothing of the surface is under the tear. Is it a frame of another surface?")
    return Binding(corners, hosts, BoundPoints(near[hosts], weights))


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


# --- the room between a tear and other skin: the other lid, or the other side of a fold ----------------------------


SHARE = 0.45
"""Share of the way to other skin that a tear is high at most."""


def kept_off(
    bottom: Array, rest: Array, normals: Array, height: Array, skin: tuple[Array, Array, IntArray], width: float
) -> Array:
    """Return heights so low that every vertex stays less than half way to skin ahead of it, and to other skin near it.

    Parameters
    ----------
    bottom, rest, normals : ndarray, shape (n, 3)
        Vertices on the skin, the same at rest, and unit normals.
    height : ndarray, shape (n,)
    skin : tuple of ndarray
        Its points, its points at rest, and its triangles. Other skin is far from a vertex at rest.
    width : float
        Width of the tear.

    Examples
    --------
    A vertex 2 mm high, with skin of the other side of a fold 1 mm above it that is far at rest:

    >>> flat = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    >>> points, at_rest = np.vstack([flat, flat + [0, 0, 1]]), np.vstack([flat, flat + [0, 50, 0]])
    >>> skin = points, at_rest, np.array([[0, 1, 2], [4, 3, 5]])
    >>> origin, up = np.zeros((1, 3)), np.array([[0.0, 0, 1]])
    >>> kept_off(origin, origin, up, np.array([2.0]), skin, width=3.0)
    array([0.45])
    """
    points, at_rest, triangles = skin
    if not len(height):
        return height.copy()
    lowered, reach = np.empty_like(height), height.max() / SHARE
    beside = triangles[overlapping(points, triangles, bottom.min(axis=0) - reach, bottom.max(axis=0) + reach)]
    axis = int(np.ptp(bottom, axis=0).argmax())
    order = np.argsort(bottom[:, axis])
    least = 6e-8 * width  # nearer along its ray, a vertex only meets the triangle that it lies on
    limits = height[order]
    _limit_heights(bottom[order], rest[order], normals[order], axis, points[beside], at_rest[beside], least, limits)
    lowered[order] = limits
    return lowered


@compiled
def _limit_heights(bottom, rest, normals, axis, corners, corners_at_rest, least, height):
    """Lower heights so that every vertex stays less than half way to the skin ahead of it, and to other skin near it.

    Vertices are sorted along an axis, in which they spread most; triangles have these corners (k, 3, 3).
    """
    weights, ball, ball_at_rest = np.empty(3), np.empty(4), np.empty(4)
    asked, along, most = height.copy(), bottom[:, axis].copy(), height.max() / SHARE
    for j in range(len(corners)):
        ball_around(corners[j], ball)
        ball_around(corners_at_rest[j], ball_at_rest)
        reach = ball[3] + most
        first, last = np.searchsorted(along, ball[axis] - reach), np.searchsorted(along, ball[axis] + reach)
        for i in range(first, last):
            nearest = height[i] / SHARE
            away, apart = 0.0, 0.0
            for k in range(3):
                away += (bottom[i, k] - ball[k]) ** 2
                apart += (rest[i, k] - ball_at_rest[k]) ** 2
            if away > (nearest + ball[3]) ** 2:
                continue
            nearest = _met(bottom[i], normals[i], corners[j], least, nearest)
            if np.sqrt(apart) > ball_at_rest[3] + 4.0 * asked[i]:
                square = closest_in_triangle(bottom[i], corners[j, 0], corners[j, 1], corners[j, 2], weights)
                nearest = min(nearest, np.sqrt(square))
            height[i] = min(height[i], SHARE * nearest)


@compiled
def ball_around(corners, out):
    """Write the centre and the radius (4,) of a ball around the corners (3, 3) of a triangle."""
    largest = 0.0
    for k in range(3):
        out[k] = (corners[0, k] + corners[1, k] + corners[2, k]) / 3.0
    for c in range(3):
        square = 0.0
        for k in range(3):
            square += (corners[c, k] - out[k]) ** 2
        largest = max(largest, square)
    out[3] = np.sqrt(largest)


@compiled
def _met(p, d, corners, least, most):
    """Return the x at which the ray p + x d meets a triangle (3, 3); `most` if it does not."""
    px, py, pz, dx, dy, dz = p[0], p[1], p[2], d[0], d[1], d[2]
    ax, ay, az = corners[0]
    ex, ey, ez = corners[1, 0] - ax, corners[1, 1] - ay, corners[1, 2] - az
    fx, fy, fz = corners[2, 0] - ax, corners[2, 1] - ay, corners[2, 2] - az
    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    det = -(dx * nx + dy * ny + dz * nz)
    if det == 0.0:
        return most
    qx, qy, qz = px - ax, py - ay, pz - az
    x = (qx * nx + qy * ny + qz * nz) / det
    if x < least or x > most:
        return most
    gx, gy, gz = qy * dz - qz * dy, qz * dx - qx * dz, qx * dy - qy * dx
    u, v = (fx * gx + fy * gy + fz * gz) / det, -(ex * gx + ey * gy + ez * gz) / det
    if u < -1e-9 or v < -1e-9 or u + v > 1.0 + 1e-9:
        return most
    return x
