"""Paths of tears: down the steepest descent, or through given points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

from ..array_types import Array, IntArray
from ..checks import vectors
from ..errors import ParameterError
from ..geometry import closest, incident_triangles, unit
from .shape import rough_film, waves
from .support_surface import SupportSurface

WOBBLE = 0.4
"""Share of its width by which the trail narrows and widens, at most."""


def descent(support: SupportSurface, start: Array, step: float, length: float) -> Array:
    """Return the path of water from a point of the surface down the steepest descent.

    The slope is that of the interpolated normals, as of a smooth surface; water keeps some of its direction.

    Parameters
    ----------
    support : SupportSurface
    start : ndarray, shape (3,)
    step, length : float
        Length of a step, and the most of the whole path.

    Returns
    -------
    ndarray, shape (k, 3)
        It ends where the surface is level, in a pit, or at the border; k = 1 if the water does not run at all.

    Examples
    --------
    Straight down an upright sheet to its border:

    >>> import pyvista as pv
    >>> from facewrinkle.tears.support_surface import support_surface
    >>> sheet = support_surface(pv.Plane(i_size=20, j_size=20))
    >>> path = descent(sheet, np.array([3.0, 8, 0]), step=0.5, length=100.0)
    >>> path[0].round(3) + 0.0, path[-1].round(3) + 0.0
    (array([3., 8., 0.]), array([  3., -10.,   0.]))
    """
    fans, down = incident_triangles(support.triangles), support.down
    cells, found = support.nearest(start[None])
    cell, path, heading = int(cells[0]), [found[0]], down
    while len(path) <= int(length / step):
        corners, here = support.triangles[cell], path[-1]
        sides = support.points[corners] - here
        areas = np.linalg.norm(np.cross(np.roll(sides, -1, axis=0), np.roll(sides, -2, axis=0)), axis=1) + 1e-300
        normal = unit(areas @ support.normals[corners])
        steepest = down - (down @ normal) * normal
        slope = float(np.linalg.norm(steepest))
        if slope < 0.06:  # where it is nearly level, water stays
            break
        kept = 0.6  # of the direction of the last step
        heading = (1.0 - kept) * steepest / slope + kept * heading
        heading = unit(heading - (heading @ normal) * normal)
        ahead = here + step * heading
        cell, next_ = _walked(support, fans, cell, ahead)
        if np.linalg.norm(next_ - ahead) > 0.5 * step or (next_ - here) @ down < 0.02 * step:
            break
        path.append(next_)
    return np.array(path)


def _walked(support: SupportSurface, fans: tuple[IntArray, IntArray], cell: int, point: Array) -> tuple[int, Array]:
    """Walk from a triangle to the one nearest to a point; return it, and its point nearest to that point.

    `fans` are the triangles around each vertex: offsets and triangles. A walk does not leave one fold for another.
    """
    (offsets, around), best, place = fans, np.inf, point
    while True:
        near = np.concatenate([[cell], *(around[offsets[v] : offsets[v + 1]] for v in support.triangles[cell])])
        found, shares, distance = closest(support.points, support.triangles[near], point)
        if not distance < best * (1.0 - 1e-9):
            return cell, place
        cell, best = int(near[found]), distance
        place = shares @ support.points[support.triangles[cell]]


def through(support: SupportSurface, given: npt.ArrayLike, width: float) -> Array:
    """Return a path over the surface through points given on it.

    Raises
    ------
    ParameterError
        If a point is off the surface or behind the face, if the path between two of them leaves the surface, or if it
        crosses itself.

    Examples
    --------
    The path between two points runs on the surface, and is longer than the straight line between them:

    >>> import pyvista as pv
    >>> from facewrinkle.tears.support_surface import support_surface
    >>> ball = support_surface(pv.Sphere(radius=20.0, theta_resolution=60, phi_resolution=60))
    >>> path = through(ball, [(0, 14, 14), (0, -14, 14)], width=2.0)
    >>> round(float(lengths(path)[-1])), round(float(np.linalg.norm(path[-1] - path[0])))
    (31, 28)
    >>> through(ball, [(0, 14, 14), (0, 0, 30)], width=2.0)
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: the path must lie on the surface; its point 1, [ 0.  0. 30.], is 10 away ...
    """
    points = vectors("path", given)
    if len(points) < 2:
        raise ParameterError(f"a path needs at least two points, received {len(points)}.")
    _, found = support.nearest(points)
    gap = np.linalg.norm(found - points, axis=1)
    allowed = max(width, 0.02 * support.size)
    if gap.max() > allowed:
        worst = int(np.argmax(gap))
        raise ParameterError(
            f"the path must lie on the surface; its point {worst}, {points[worst]}, is {gap[worst]:.3g} away from it "
            f"(at most {allowed:.3g} is allowed). Are path and surface in the same unit and coordinates?"
        )
    _check_side(support, found)
    pieces = []
    for a, b in pairwise(found):
        share = np.linspace(0.0, 1.0, max(int(np.ceil(np.linalg.norm(b - a) / (0.5 * width))), 1) + 1)[:-1, None]
        pieces.append(support.nearest((1.0 - share) * a + share * b)[1])
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


def smoothed(support: SupportSurface, path: Array, spacing: float) -> Array:
    """Return the path on the surface, its corners rounded, with points at equal distances."""
    path = resampled(path, spacing)
    for _ in range(12):
        path[1:-1] = 0.25 * path[:-2] + 0.5 * path[1:-1] + 0.25 * path[2:]
    path = support.nearest(path)[1]
    moved = np.linalg.norm(np.diff(path, axis=0), axis=1) > 1e-6 * spacing  # at a border, neighbors may become one
    return path[np.concatenate([[True], moved])]


def resampled(path: Array, spacing: float) -> Array:
    """Return points (k, 3) at equal distances, about `spacing`, on a polyline; k is at least 3."""
    length = lengths(path)
    keep = np.concatenate([[True], np.diff(length) > 0.0])
    path, length = path[keep], length[keep]
    places = np.linspace(0.0, length[-1], max(int(np.ceil(length[-1] / spacing)), 2) + 1)
    return np.stack([np.interp(places, length, x) for x in path.T], axis=1)


def lengths(path: Array) -> Array:
    """Length of a polyline up to each of its points."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])


def merged(path: Array, other: Array, distance: float) -> Array:
    """Return the path up to where it comes within `distance` of another one, and from there the other."""
    gap, where = cKDTree(other).query(path)
    close = np.flatnonzero(gap < distance)
    return np.concatenate([path[: close[0]], other[where[close[0]] :]]) if len(close) else path


def _check_side(support: SupportSurface, path: Array) -> None:
    """Raise a ParameterError for a path over the back of a head."""
    if support.face is None:
        return
    behind = support.face.frame.local(path)[:, 2]
    if behind.min() < -1.7:  # in distances between the pupils
        worst = int(np.argmin(behind))
        raise ParameterError(
            f"the path must run over the front of the face; its point {worst}, {path[worst].round(2)}, is on the wrong "
            "side, behind the ears. Was it found with a mirrored or turned mesh?"
        )


def _check_crossing(path: Array, width: float) -> None:
    """Raise a ParameterError for a path that crosses or nearly touches itself."""
    points = resampled(path, 0.5 * width)
    pairs = cKDTree(points).query_pairs(width, output_type="ndarray")
    crossing = pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > 8]  # four widths along the path
    if len(crossing):
        i, j = sorted(crossing[0].tolist())
        raise ParameterError(
            f"the path must not cross itself or come within its width of itself; it does so at {points[i].round(2)}, "
            f"{0.5 * width * i:.3g} and {0.5 * width * j:.3g} along it. Take out the loop, or make two tears of it."
        )


# --- streams ----------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class StreamPath:
    """The path of a stream, with the irregularities of the water on it.

    Attributes
    ----------
    points : ndarray, shape (k, 3)
        At rest.
    noise, spacing : ndarray and float
        Bumps over a grid of (s, w), see :func:`facewrinkle.tears.shape.rough_film`.
    wobble : ndarray
        Change of the trail's width along the grid, as a share.

    Examples
    --------
    Down a line 16 mm long, with a tenth more width everywhere and no bumps; s and w are known every 0.25 mm:

    >>> line = np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> path = StreamPath(line, np.zeros((65, 9)), 0.25, np.full(65, 0.1))
    >>> wobble, noise = path.fields(np.array([4.0]), np.array([0.5]))
    >>> path.lengths, wobble, noise
    (array([ 0., 16.]), array([0.1]), array([0.]))
    """

    points: Array
    noise: Array
    spacing: float
    wobble: Array

    @cached_property
    def lengths(self) -> Array:
        """Length (k,) up to each point."""
        return lengths(self.points)

    def fields(self, s: Array, w: Array) -> Array:
        """Return wobble and noise (2, n) at positions (n,) along the path and distances (n,) to its side."""
        row, column = s / self.spacing, w / self.spacing + self.noise.shape[1] // 2
        wobble = np.interp(row, np.arange(len(self.wobble)), self.wobble)
        return np.stack([wobble, map_coordinates(self.noise, [row, column], order=1, mode="nearest")])


def irregular_path(
    points: Array, half: float, roughness: float, degree: int, random: np.random.Generator
) -> StreamPath:
    """Return a path with random irregularities, for a stream of half width `half`.

    The roughness, and the degree of the least squares, are as of :func:`facewrinkle.tears.shape.rough_film`.
    """
    noise, spacing = rough_film(float(lengths(points)[-1]), half, roughness, degree, random)
    short, long = (waves(random, len(noise), waviness * half / spacing) for waviness in (1.5, 4.0))
    return StreamPath(points, noise, spacing, WOBBLE * np.sin(short + 2.0 * long))


@dataclass(frozen=True, eq=False)
class PathFinder:
    """Finds the path of a stream.

    Attributes
    ----------
    support, moved : SupportSurface
        The surface at rest, on which paths are given and returned, and in the frame down whose folds the water runs.
    rest : ndarray, shape (n, 3)
        Vertices of `moved` at rest.
    width, step, longest : float
        Of the stream; of a step of the descent; and the most that the stream runs.
    """

    support: SupportSurface
    moved: SupportSurface
    rest: Array
    width: float
    step: float
    longest: float

    def path(self, points: Any, start: Any) -> Array:
        """Return a path through points, or down from a start, whichever is given."""
        return self._descent(start) if points is None else through(self.support, points, self.width)

    def _descent(self, start: Any) -> Array:
        """Return the path down from a start, or from just below it where it is level or slopes inwards, as some lids.

        The start itself is always the first point.
        """
        support, moved = self.support, self.moved
        first = support.start(start, max(2.0 * self.width, 0.02 * support.size))
        lowered = 0.35 * self.width * np.arange(6.0)[:, None] * support.down
        for below in support.nearest(first + lowered)[1]:
            at = support.bound(np.array([first, below])).at(moved.points)
            path = descent(moved, at[1], self.step, self.longest)
            if lengths(path)[-1] > 1.5 * self.width:
                path = self._overflowed(path, lowered[1:])
                return moved.bound(np.concatenate([at[:1], path])).at(self.rest)
        raise ParameterError(
            f"no water runs from {first.round(2)}: the surface is level there, or ends. Start elsewhere, or give a "
            "path."
        )

    def _overflowed(self, path: Array, lowered: Array) -> Array:
        """Return the path, continued below hollows that the stream fills, such as creases of the lids."""
        moved = self.moved
        for below in moved.nearest(path[-1] + lowered)[1]:
            across = np.linspace(path[-1], below, 9)
            if np.linalg.norm(moved.nearest(across)[1] - across, axis=1).max() > 0.25 * self.width:
                continue  # it is too deep
            more = descent(moved, below, self.step, max(self.longest - lengths(path)[-1], self.step))
            if lengths(more)[-1] > 1.5 * self.width and (below - path[-1]) @ moved.down > 0.0:
                return self._overflowed(np.concatenate([path, more]), lowered)
        return path

    def cut(self, path: Array) -> Array:
        """Return a path in equal steps, cut off at the most that the stream runs."""
        path = resampled(path, self.step)
        path = path[lengths(path) <= self.longest]
        if len(path) < 3 or not lengths(path)[-1] > 0.0:
            raise ParameterError("the path has no length: its points coincide, or length is too small.")
        return path

    def meandered(self, path: Array, roughness: float, random: np.random.Generator) -> Array:
        """Return a path with the small turns that rough skin makes; its start stays."""
        half, along = 0.5 * self.width, unit(np.gradient(path, axis=0))
        aside = np.cross(along, self.support.bound(path).at(self.support.normals))
        # Water sticks, and slips aside to where skin lets it: straight from place to place, not in waves.
        s, near, far = lengths(path), 3.0 * half, 9.0 * half  # from one such place to the next
        places = np.cumsum(random.uniform(near, far, int(s[-1] / near) + 2))
        turns = np.interp(s, np.append(0.0, places), np.append(0.0, random.uniform(-1.0, 1.0, len(places))))
        most = 5.0 * roughness * half
        return path + (most * turns)[:, None] * aside
