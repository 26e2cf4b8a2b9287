"""Tears that are shed: a bead of water that runs down a surface, with a wet trail behind it (Section 4.2).

The paper's five steps: the surface under the tear, subdivided linearly (:meth:`SheddingTear._base_of`); a copy just
above it, joined to it along the outline (:func:`solid`); the head (:func:`thickness`); noise on the top, raised by
moving least squares (:func:`rough_film`); and the part that is covered at a time, ``h = s + c t``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import gaussian_filter1d, map_coordinates
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..errors import MeshError, ParameterError, check_range, check_whole
from ..geometry.least_squares import moving_least_squares
from ..geometry.normals import detail_normals, vertex_normals
from ..geometry.refinement import RedGreenForest
from ..geometry.topology import as_triangles, boundary_loops, euler_characteristic, unique_edges, vertex_rings
from ..geometry.transfer import carried
from ..mesh import to_polydata
from . import _kernels as kernels
from . import path as paths
from .ground import Ground, ground_of

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

FILM = 0.002
"""Thickness at the very edge, mm: the paper's two surfaces that 'are seen as almost one'."""

TINY = 1e-6


@dataclass(frozen=True)
class Shape:
    """Sizes of a tear, in the unit of the surface.

    Attributes
    ----------
    half : float
        Half the width of the head.
    height : float
        Of the head.
    trail, film : float
        Half the width, and the thickness, of the trail.
    """

    half: float
    height: float
    trail: float
    film: float

    def scaled(self, factor: float) -> Shape:
        """All of it larger or smaller."""
        return Shape(self.half * factor, self.height * factor, self.trail * factor, self.film * factor)


def thickness(
    s: Array, w: Array, front: float, shape: Shape, wobble: Array | float = 0.0, rough: Array | float = 0.0
) -> tuple[Array, Array]:
    """Where the tear is, and how thick.

    The head is round in front and tapers into the trail; across, its profile is a parabola.

    Parameters
    ----------
    s, w : ndarray, shape (n,)
        Position along the path and distance from it.
    front : float
        Length that is covered.
    shape : Shape
    wobble, rough : ndarray, shape (n,)
        Change of the trail's width, and what is added to its thickness, as shares.

    Returns
    -------
    level : ndarray, shape (n,)
        Above 0 inside the outline, 1 on the path.
    height : ndarray, shape (n,)
        0 outside of the outline.

    Examples
    --------
    >>> level, height = thickness(np.array([9.0, 3.0, 11.0]), np.zeros(3), 10.0, Shape(1.0, 0.8, 0.5, 0.05))
    >>> height.round(3).tolist()
    [0.8, 0.05, 0.0]
    """
    behind = (front - s) / shape.half
    taper = 0.5 + 0.5 * np.cos(np.pi * np.clip((behind - 1.0) / TAPER, 0.0, 1.0))
    trail = shape.trail * (1.0 + wobble) * (DRAINED + (1.0 - DRAINED) * np.exp(-np.maximum(behind, 0.0) / 15.0))
    half = trail + (shape.half - trail) * taper
    cap = np.maximum(1.0 - behind, 0.0)
    start = np.maximum(1.0 - s / shape.trail, 0.0)
    level = 1.0 - (w / half) ** 2 - cap**2 - start**2
    film = shape.film * (1.0 + rough)
    height = (film + (shape.height - film) * taper**1.5) * np.maximum(level, 0.0)
    return level, height


DRAINED = 0.72
"""Share of its width that the trail keeps long after the head has passed."""

TAPER = 2.6
"""Length over which the head narrows into the trail, in halves of its width."""


def rough_film(
    length: float, half: float, roughness: float, degree: int, random: np.random.Generator
) -> tuple[Array, float]:
    """Noise on the top surface over a grid of (s, w): bumps of height 0 to 1 at some places, 0 at the others.

    Parameters
    ----------
    length, half : float
        The grid spans [0, length] and [-half, half].
    roughness : float
        Share of the places that are raised, 0 to 1: rough skin holds more water back.
    degree : int
        Of the moving least squares. Above 0 they dip, and are cut off at 0: the tear must not enter the skin.

    Returns
    -------
    noise : ndarray, shape (i, j)
        At least 0.
    spacing : float
        Of the grid.
    """
    spacing = half / 4.0
    grid_s, grid_w = np.arange(0.0, length + spacing, spacing), spacing * np.arange(-4, 5)
    apart = 2.5 * spacing
    s, w = np.meshgrid(np.arange(0.0, length + apart, apart), apart * np.arange(-2, 3), indexing="ij")
    places = np.stack([s.ravel(), w.ravel()], axis=1) + random.uniform(-0.35, 0.35, (s.size, 2)) * apart
    raised = random.random(s.size) < roughness
    values = np.where(raised, random.uniform(0.3, 1.0, s.size), 0.0)
    noise = np.empty((len(grid_s), len(grid_w)))
    rows = 32
    for first in range(0, len(grid_s), rows):  # far away points hardly count
        part = grid_s[first : first + rows]
        near = (places[:, 0] > part[0] - 6.0 * apart) & (places[:, 0] < part[-1] + 6.0 * apart)
        x = np.stack(np.meshgrid(part, grid_w, indexing="ij"), axis=-1).reshape(-1, 2)
        fitted = moving_least_squares(x, places[near], values[near], degree, 0.4 * apart)
        noise[first : first + rows] = fitted.reshape(len(part), -1)
    return np.maximum(noise, 0.0), spacing


def solid(base: Array, top: Array, triangles: IntArray) -> tuple[Array, IntArray]:
    """The closed surface between a base and a top with the same triangles, joined by walls along the outline.

    Parameters
    ----------
    base, top : ndarray, shape (n, 3)
    triangles : ndarray of int32, shape (m, 3)
        Of a disk, each used vertex once.

    Returns
    -------
    points : ndarray, shape (2 n, 3)
        Those of the top, then those of the base.
    triangles : ndarray of int32, shape (2 m + 2 b, 3)
        Oriented outwards where those of the base face towards the top.

    Examples
    --------
    >>> flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> points, triangles = solid(flat, flat + [0.0, 0.0, 1.0], np.array([[0, 1, 2]], np.int32))
    >>> points.shape, triangles.shape
    ((6, 3), (8, 3))
    """
    n = len(base)
    _, sides = unique_edges(triangles)
    outline = np.bincount(sides.ravel())[sides] == 1
    a, b = triangles[outline], np.roll(triangles, -1, axis=1)[outline]
    walls = np.concatenate([np.stack([a + n, b + n, b], axis=1), np.stack([a + n, b, a], axis=1)])
    all_triangles = np.concatenate([triangles, triangles[:, ::-1] + n, walls])
    return np.concatenate([top, base]), all_triangles.astype(np.int32)


@dataclass(frozen=True, eq=False)
class Course:
    """One run of a stream: its points at rest, where it leaves the source's path, and its share of the water."""

    points: Array
    begin: float
    flow: float

    @property
    def lengths(self) -> Array:
        """Length up to each point."""
        return paths.lengths(self.points)


@dataclass(frozen=True, eq=False)
class Base:
    """The surface under a tear, subdivided: everything that changes only when the mesh below it does.

    Attributes
    ----------
    of, below : tuple
        The rest points and triangles of the mesh it was made of, and of the part of it below the tear.
    used : ndarray of int
        The vertices of that part, in the mesh.
    corners, barycentric : ndarray, shape (n, 3)
        Of the base's vertices, in that part.
    triangles : ndarray of int32, shape (m, 3)
    centres, radii : ndarray, shapes (k, 3) and (k,)
        Of the mesh's triangles, at rest.
    s, w, wobble, rough : ndarray, shape (c, n)
        Position along each course and distance from it, and the noise there.
    """

    of: tuple[Array, IntArray]
    below: tuple[Array, IntArray]
    used: IntArray
    corners: IntArray
    barycentric: Array
    triangles: IntArray
    edges: IntArray
    sides: IntArray
    rings: tuple[IntArray, IntArray]
    border: npt.NDArray[np.bool_]
    centres: Array
    radii: Array
    s: Array
    w: Array
    wobble: Array
    rough: Array


class SheddingTear:
    """A tear that is shed: it runs down the skin, joined to it, and leaves a wet trail. Or water on any surface.

    Parameters
    ----------
    surface : Face or PolyData
        At rest.
    path : array_like, shape (k, 3), optional
        Points on the surface through which the tear runs.
    start : array_like, shape (3,), or {"l", "r"}, optional
        Where it starts if there is no path: it finds its own way, down the steepest descent. A letter is the eye of a
        Face, from whose lower lid it runs.
    weight : array_like, shape (n,), or str, optional
        Painted weights of the vertices, or the name of such an array: the path follows them from the highest to the
        lowest place.
    width, height : float
        Of the head of the tear, mm.
    trail : float
        Width of the trail, as a share.
    begin : float
        Seconds at which it appears.
    s, c : float
        Length of the path that is covered at first (mm; default: the head), and speed (mm/s): ``h = s + c t``.
    hold : float
        Seconds for which it stays when it has arrived.
    length : float
        The most it runs, mm.
    roughness : float
        Of the skin, 0 to 1: how much of the trail is raised by what the skin holds back.
    degree : int
        Of the moving least squares that smooth this noise.
    branches : int
        How often, at most, it divides where a fold diverts it.
    into : SheddingTear, optional
        Another stream; where this one meets it, it follows it.
    on : PolyData, optional
        A frame of the face: folds that are not there at rest divert the tear too.
    seed : int
        Of everything random.
    detail : float
        Edges of the mesh, as a share of the width.
    down : array_like, shape (3,), optional
    unit : float
        Millimetres per unit of a surface that is no Face.

    Attributes
    ----------
    courses : tuple of Course
    begin, end : float
        When there is a tear, seconds.

    Raises
    ------
    ParameterError
        For a path that leaves the surface, is on its wrong side or crosses itself, a start off the surface, a place
        from which no water runs, sizes too large for the surface, and numbers out of range.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> tear = SheddingTear(fw.default_face(), start="l")
    >>> mesh = tear.surface(1.0)
    >>> mesh.n_open_edges, bool(mesh.volume > 0.0)
    (0, True)
    """

    def __init__(
        self,
        surface: Face | pv.PolyData,
        path: npt.ArrayLike | None = None,
        start: npt.ArrayLike | str | None = None,
        *,
        weight: npt.ArrayLike | str | None = None,
        width: float = 3.0,
        height: float = 0.9,
        trail: float = 0.62,
        begin: float = 0.0,
        s: float | None = None,
        c: float = 30.0,
        hold: float = 1.0,
        length: float = 120.0,
        roughness: float = 0.3,
        degree: int = 1,
        branches: int = 0,
        into: SheddingTear | None = None,
        on: pv.PolyData | None = None,
        seed: int = 0,
        detail: float = 0.2,
        down: npt.ArrayLike | None = None,
        unit: float = 1.0,
    ) -> None:
        self._ground = ground_of(surface, down, unit)
        unit = self._ground.unit
        half = 0.5 * check_range("width", width, 1e-6, 1e6) / unit
        height = check_range("height", height, 1e-6, 1e6) / unit
        if max(2.0 * half, height) > 0.15 * self._ground.size:
            raise ParameterError(
                f"a tear must be smaller than 0.15 of the surface, {0.15 * self._ground.size * unit:.3g} mm, received "
                f"width={width:g} and height={height * unit:g}. Is the unit of the surface right?"
            )
        share = check_range("trail", trail, 0.2, 1.0)
        self.shape = Shape(half, height, half * share, max(0.06 * height, 2.0 * FILM / unit))
        self.begin = check_range("begin", begin, 0.0, 1e9)
        self.c = check_range("c", c, 1e-6, 1e9) / unit
        self._detail = check_range("detail", detail, 0.03, 1.0) * 2.0 * half
        self._random = np.random.default_rng(check_whole("seed", seed, 0, 2**63))
        self.roughness = check_range("roughness", roughness, 0.0, 1.0)
        self._degree = check_whole("degree", degree, 0, 3)
        most = check_range("length", length, 1e-6, 1e9) / unit
        way = self._way(path, start, weight, most, on, into)
        self.courses = self._courses(way, check_whole("branches", branches, 0, 16), on)
        self.s = min(2.2 * half, self.length) if s is None else check_range("s", s, 0.0, 1e9) / unit
        self.s = max(self.s, 1.2 * (half + self.shape.trail))
        arrived = max(self.length - self.s, 0.0) / self.c
        self.end = self.begin + arrived + check_range("hold", hold, 0.0, 1e9)
        self._noise = [self._noise_of(course) for course in self.courses]
        self._kept: Base | None = None
        self._check_disk()

    # --- the way -------------------------------------------------------------------------------

    def _way(self, path: Any, start: Any, weight: Any, most: float, on: Any, into: SheddingTear | None) -> Array:
        """The path of the source at rest."""
        if sum(choice is not None for choice in (path, start, weight)) != 1:
            raise ParameterError("give one of path, start and weight: it says where the tear runs.")
        ground, width = self._ground, 2.0 * self.shape.half
        if path is not None:
            way = paths.through(ground, path, width)
        elif weight is not None:
            way = paths.painted(ground, self._weights(weight), width)
        else:
            way = self._found(start, most, on)
        if into is not None:
            way = paths.joined(way, [course.points for course in into.courses], 0.6 * width)
        way = paths.resampled(way, 0.5 * self._detail)
        way = way[paths.lengths(way) <= most]
        if start is not None and into is None:
            way = self._meandered(way)
        return paths.smoothed(ground, way, 0.2 * width) if len(way) > 2 else way

    def _found(self, start: Any, most: float, on: Any) -> Array:
        """The way down from a point; where it is level there, or slopes inwards as some lids do, from just below it."""
        ground, width, moved = self._ground, 2.0 * self.shape.half, self._moved(on)
        first = ground.start(start, max(2.0 * width, 0.02 * ground.size))
        lowered = 0.35 * width * np.arange(6.0)[:, None] * ground.down
        for begin in ground.nearest(first + lowered)[1]:
            at = ground.bound(np.array([first, begin])).on(moved.points)
            way = paths.descent(moved, at[1], 0.5 * self._detail, most)
            if paths.lengths(way)[-1] > 1.5 * width:
                return self._at_rest(np.concatenate([at[:1], way]), moved)
        raise ParameterError(
            f"no water runs from {first.round(2)}: the surface is level there, or ends. Start elsewhere, or give a "
            "path."
        )

    def _meandered(self, way: Array) -> Array:
        """The way with the small turns that rough skin makes; its start stays."""
        along = np.gradient(way, axis=0)
        aside = np.cross(
            along / np.linalg.norm(along, axis=1, keepdims=True), self._ground.bound(way).on(self._ground.normals)
        )
        grown = np.minimum(paths.lengths(way) / (4.0 * self.shape.half), 1.0)
        swing = (
            self.roughness
            * self.shape.half
            * grown
            * _waves(self._random, len(way), 6.0 * self.shape.half / self._detail)
        )
        return way + swing[:, None] * aside

    def _weights(self, weight: Any) -> Any:
        if not isinstance(weight, str):
            return weight
        face = self._ground.face
        if face is None or weight not in face.mesh.point_data:
            raise ParameterError(f"there are no painted weights {weight!r} on the face. Pass the array itself.")
        return face.mesh.point_data[weight]

    def _moved(self, on: pv.PolyData | None) -> Ground:
        """The ground as it is in a frame."""
        if on is None:
            return self._ground
        points, triangles, _ = self._frame(on)
        return Ground(points, triangles, self._ground.down, self._ground.forward, self._ground.unit, self._ground.face)

    def _at_rest(self, way: Array, moved: Ground) -> Array:
        """Points of a moved ground, at rest."""
        if moved is self._ground:
            return way
        rest = self._rest_of(moved.points, moved.triangles)
        return moved.bound(way).on(rest)

    def _courses(self, way: Array, branches: int, on: pv.PolyData | None) -> tuple[Course, ...]:
        """The source's course, and those that leave it at folds."""
        courses = [Course(way, 0.0, 1.0)]
        if not branches:
            return tuple(courses)
        moved = self._moved(on)
        main = self._ground.bound(way).on(moved.points) if moved is self._ground else moved.nearest(way)[1]
        for _ in range(branches):
            found = paths.branch(moved, main, 0.5 * self._detail, 2.0 * self.shape.half)
            if found is None:
                break
            spilled = paths.smoothed(self._ground, self._at_rest(found, moved), 0.4 * self.shape.half)
            k = int(np.argmin(np.linalg.norm(way - spilled[0], axis=1)))
            courses.append(Course(spilled, float(paths.lengths(way)[k]), 0.7))
            main = main[: max(k - 4, 0)]
        return tuple(courses)

    @property
    def length(self) -> float:
        """Of the longest way, in the unit of the surface."""
        return max(course.begin + float(course.lengths[-1]) for course in self.courses)

    def _noise_of(self, course: Course) -> tuple[Array, float, Array]:
        """The raised noise over (s, w), the spacing of its grid, and the wobble of the trail's width along it."""
        noise, spacing = rough_film(
            float(course.lengths[-1]), self.shape.half, self.roughness, self._degree, self._random
        )
        wobble = gaussian_filter1d(
            self._random.normal(size=len(noise)), 1.5 * self.shape.half / spacing, mode="nearest"
        )
        return noise, spacing, 0.28 * wobble / max(float(np.abs(wobble).max()), 1e-9)

    def _check_disk(self) -> None:
        base = self._base(self._ground.points, self._ground.triangles)
        part = self._part(base, self.length)
        if part is None or euler_characteristic(part[0]) != 1 or len(boundary_loops(part[0])) != 1:
            raise ParameterError(
                "the tear would not be one piece without holes: its path runs around a hole of the surface, or over a "
                "gap. Lead it elsewhere, or make it narrower."
            )

    def meets(self, other: SheddingTear) -> bool:
        """Whether its path comes within the width of another one's, beyond their starts."""
        own, width = self.courses[0].points, 2.0 * self.shape.half
        gap, where = cKDTree(other.courses[0].points).query(own[len(own) // 20 :])
        return bool(((gap < 0.6 * width) & (where > 2)).any())

    # --- the surface below -----------------------------------------------------------------------

    def _rest_of(self, points: Array, triangles: IntArray) -> Array:
        return self._ground.points if len(points) == len(self._ground.points) else self._kept_rest

    def _frame(self, on: pv.PolyData) -> tuple[Array, IntArray, Array]:
        """Points, triangles and normals of a frame; its rest points are remembered."""
        points, triangles = np.asarray(on.points, dtype=np.float64), np.asarray(on.regular_faces, dtype=np.int32)
        rest = on.point_data.get("rest")
        if rest is None and len(points) != len(self._ground.points):
            raise MeshError(
                f"the frame must have the {len(self._ground.points)} points of the surface at rest, or an array "
                f"'rest', received {len(points)} points. Is it one of another surface?"
            )
        self._kept_rest = self._ground.points if rest is None else np.asarray(rest, dtype=np.float64)
        known = "split_gamma" in on.point_data and "Normals" in on.point_data
        normals = on.point_data["Normals"] if known else vertex_normals(points, triangles)
        return points, triangles, np.ascontiguousarray(normals, dtype=np.float64)

    def _base(self, rest: Array, triangles: IntArray) -> Base:
        """The base surface in a mesh; a new one only if this is another mesh than last time."""
        kept = self._kept
        if kept is None or not (np.array_equal(kept.of[1], triangles) and np.array_equal(kept.of[0], rest)):
            self._kept = kept = self._base_of(rest, triangles)
        return kept

    def _base_of(self, rest: Array, triangles: IntArray) -> Base:
        """Step one: the triangles that the tear will pass over, subdivided linearly until they are small enough."""
        spacing, reach = 0.5 * self.shape.half, self.shape.half + 0.5 * self._detail
        way = np.concatenate([paths.resampled(course.points, spacing) for course in self.courses])

        def near(points: Array, triangles: IntArray) -> tuple[npt.NDArray[np.bool_], Array]:
            chosen, longest = np.empty(len(triangles), bool), np.empty(len(triangles))
            kernels.near_course(points, triangles, way, spacing, reach, chosen, longest)
            return chosen, longest

        chosen, _ = near(rest, triangles)
        used, local = np.unique(triangles[chosen], return_inverse=True)
        centres = rest[triangles].mean(axis=1)
        around = centres, np.linalg.norm(rest[triangles] - centres[:, None], axis=2).max(axis=1)
        below = rest[used], local.reshape(-1, 3)
        kept = self._kept
        if kept is not None and np.array_equal(kept.below[1], below[1]) and np.array_equal(kept.below[0], below[0]):
            # The mesh has changed elsewhere.
            return replace(kept, of=(rest.copy(), triangles.copy()), used=used, centres=around[0], radii=around[1])
        return self._subdivided((rest.copy(), triangles.copy()), used, below, around, near)

    def _subdivided(self, of: Any, used: Any, below: Any, around: Any, near: Any) -> Base:
        """The triangles below the tear, until they are small enough."""
        rest, forest = below[0], RedGreenForest(below[1], 8)
        inside, longest = near(rest, forest.triangles)
        while (marked := inside & (longest > self._detail)).any() and forest.split(marked):
            inside, longest = near(carried(rest, forest.corners, forest.barycentric), forest.triangles)
        kept, fine = np.unique(forest.triangles[inside], return_inverse=True)
        triangles = as_triangles(fine.reshape(-1, 3))
        corners, weights = forest.corners[kept], forest.barycentric[kept]
        edges, sides = unique_edges(triangles)
        border = np.zeros(len(kept), bool)
        border[edges[np.bincount(sides.ravel(), minlength=len(edges)) == 1]] = True
        s, w, wobble, rough = self._fields(
            carried(rest, corners, weights), vertex_normals(rest, below[1])[corners].sum(axis=1)
        )
        return Base(
            of, below, used, corners, weights, triangles, edges, sides, vertex_rings(triangles), border,
            centres=around[0], radii=around[1], s=s, w=w, wobble=wobble, rough=rough,
        )  # fmt: skip

    def _fields(self, points: Array, normals: Array) -> tuple[Array, Array, Array, Array]:
        """s, w, wobble and roughness at points, for each course."""
        s, w, wobble, rough = (np.empty((len(self.courses), len(points))) for _ in range(4))
        for k, (course, (noise, spacing, along)) in enumerate(zip(self.courses, self._noise, strict=True)):
            kernels.along_course(points, course.points, course.lengths, normals, s[k], w[k])
            place = s[k] / spacing
            wobble[k] = np.interp(place, np.arange(len(along)), along)
            rough[k] = map_coordinates(noise, [place, w[k] / spacing + noise.shape[1] // 2], order=1, mode="nearest")
        return s, w, wobble, rough

    # --- the tear --------------------------------------------------------------------------------

    def covered(self, t: float) -> float:
        """Length of the path that the tear covers at time t: ``h = s + c t`` (in the unit of the surface).

        Raises
        ------
        ParameterError
            For t outside [begin, end].
        """
        t = check_range("t", t, self.begin, self.end, "There is no tear at other times.")
        return min(self.s + self.c * (t - self.begin), max(self.length, self.s))

    def surface(self, t: float, on: pv.PolyData | None = None) -> pv.PolyData:
        """The tear at time t.

        Parameters
        ----------
        t : float
            Seconds, from `begin` to `end`.
        on : PolyData, optional
            The surface of this moment: a frame of a :class:`facewrinkle.Simulation`, or any mesh with the points of the
            surface at rest. Default: at rest.

        Returns
        -------
        PolyData
            Closed, of genus 0, oriented outwards, nowhere in the skin; with "Normals" and "thickness" (mm).

        Raises
        ------
        ParameterError
            For t outside [begin, end].
        MeshError
            For a frame of another surface.
        """
        front, ground = self.covered(t), self._ground
        points, triangles, normals = (
            (ground.points, ground.triangles, ground.normals) if on is None else self._frame(on)
        )
        rest = ground.points if on is None else self._kept_rest
        base = self._base(rest, triangles)
        part = self._part(base, front)
        if part is None:
            raise MeshError("nothing of the surface is under the tear. Is it a frame of another surface?")
        faces, first, second, share, height = part

        def laid(values: Array) -> Array:
            fine = carried(values[base.used], base.corners, base.barycentric)
            return np.asarray(fine[first] + share[:, None] * (fine[second] - fine[first]))

        bottom, up = laid(points), laid(normals)
        up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-12)
        height = np.maximum(height, FILM / ground.unit)
        kernels.limit_heights(
            bottom, laid(rest), up, height, points, triangles, base.centres, base.radii, 0.6 * self.shape.half
        )
        top = bottom + height[:, None] * up
        shaded = detail_normals(bottom, top, faces, up)
        mesh_points, mesh_triangles = solid(bottom, top, faces)
        data = {"Normals": np.concatenate([shaded, -up]), "thickness": np.tile(height, 2), "under": np.tile(up, (2, 1))}
        mesh = to_polydata(mesh_points, mesh_triangles, data)
        mesh.point_data.active_normals_name = "Normals"
        return mesh

    def _part(self, base: Base, front: float) -> tuple[IntArray, IntArray, IntArray, Array, Array] | None:
        """What is covered of the base: its triangles; of its vertices the two they lie between, the share; heights."""
        level, height = np.full(base.s.shape[1], -np.inf), np.zeros(base.s.shape[1])
        for k, course in enumerate(self.courses):
            here = min(front - course.begin, float(course.lengths[-1]))
            shape = self.shape.scaled(course.flow)
            if k and here < shape.half + shape.trail:
                continue
            grown = np.clip((here - self.s) / (4.0 * shape.half), 0.0, 1.0)
            head = Shape(shape.half * (0.7 + 0.3 * grown), shape.height * (0.6 + 0.4 * grown), shape.trail, shape.film)
            one, thick = thickness(base.s[k], base.w[k], here, head, base.wobble[k], ROUGH * base.rough[k])
            level, height = np.maximum(level, one), np.maximum(height, thick)
        level = np.where(np.abs(level) < TINY, TINY, level)
        if kernels.make_disk(level, *base.rings, base.border, TINY) == 0:
            return None
        m, n = len(base.triangles), len(level)
        faces = np.empty((2 * m, 3), np.int32)
        first, second, share = np.empty(n + len(base.edges), np.int32), np.empty(n + len(base.edges), np.int32), None
        share = np.empty(len(first))
        m, n = kernels.clip(base.triangles, base.sides, base.edges, level, faces, first, second, share)
        first, second, share = first[:n], second[:n], share[:n]
        return faces[:m], first, second, share, np.where(share == 0.0, height[first], 0.0)


def _waves(random: np.random.Generator, n: int, scale: float) -> Array:
    """Smooth random numbers (n,) between -1 and 1 that change over `scale` of them."""
    waves = np.asarray(gaussian_filter1d(random.normal(size=n), scale, mode="nearest"))
    return waves / max(float(np.abs(waves).max()), 1e-9)


WOBBLE = 0.4
"""Share of its width by which the trail narrows and widens."""

ROUGH = 3.0
"""How much thicker than the film of the trail its highest bumps are."""
