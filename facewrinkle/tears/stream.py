"""Tears that are shed: a bead of water that runs down a surface, with a wet trail behind it (Section 4.2).

The paper's five steps: the surface under the tear, subdivided linearly (:mod:`.base`); a copy just above it, joined to
it along the outline (:func:`.shape.solid`); the head (:func:`.shape.thickness`); noise on the top, raised by moving
least squares (:func:`.shape.rough_film`); and the part that is covered at a time, ``h = s + c t``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..errors import MeshError, ParameterError, check_range, check_whole
from ..geometry.normals import detail_normals, vertex_normals
from ..geometry.topology import boundary_loops, euler_characteristic
from ..mesh import array_of, of_own_arrays
from . import _height_kernels as kernels
from . import path as paths
from .footprint import Footprint, StreamPath, footprint_under
from .shape import Shape, rough_film, solid, thickness, waves
from .subdivision import LocalSubdivision
from .support_surface import SupportSurface, support_surface

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

FILM = 0.002
"""Thickness at the very edge, mm: the paper's two surfaces that 'are seen as almost one'."""

WOBBLE = 0.3
"""Share of its width by which the trail narrows and widens."""

MEANDER = 2.7
"""How far rough skin turns it aside, in halves of its width."""

SHALLOW = 0.25
"""How deep, at most, a hollow is that a tear fills and leaves again, in its widths."""

ROUGH = 3.0
"""How much thicker than the film of the trail its highest bumps are."""


FINEST = 20_000.0
"""How many times as long as the edges of its mesh a tear may be."""


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
        Length of the path that is covered at first, mm (default, and at least, the head's), and speed, mm/s:
        ``h = s + c t``.
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
    courses : tuple of StreamPath
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
        trail: float = 0.77,
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
        detail: float = 0.28,
        down: npt.ArrayLike | None = None,
        unit: float = 1.0,
    ) -> None:
        self._ground = support_surface(surface, down, unit)
        unit = self._ground.unit
        half = 0.5 * check_range("width", width, 1e-6, 1e6) / unit
        height = check_range("height", height, 1e-6, 1e6) / unit
        if max(2.0 * half, height) > 0.15 * self._ground.size:
            raise ParameterError(
                f"a tear must be smaller than 0.15 of the surface, {0.15 * self._ground.size * unit:.3g} mm, received "
                f"width={width:g} and height={height * unit:g}. Is the unit of the surface right?"
            )
        share = check_range("trail", trail, 0.2, 1.0)
        self.shape = Shape(half, height, half * share, max(0.07 * height, 2.0 * FILM / unit))
        self.begin = check_range("begin", begin, 0.0, 1e9)
        self.c = check_range("c", c, 1e-6, 1e9) / unit
        self._detail = check_range("detail", detail, 0.03, 1.0) * 2.0 * half
        self._random = np.random.default_rng(check_whole("seed", seed, 0, 2**63))
        self.roughness = check_range("roughness", roughness, 0.0, 1.0)
        self._degree = check_whole("degree", degree, 0, 3)
        most = min(check_range("length", length, 1e-6, 1e9) / unit, 20.0 * self._ground.size)
        if most > FINEST * self._detail:
            raise ParameterError(
                f"a tear {2.0 * half * unit:g} mm wide and up to {most * unit:.4g} mm long needs too fine a mesh. Make "
                f"it wider, give a larger detail, or a length of {FINEST * self._detail * unit:.3g} mm at most."
            )
        way = self._way(path, start, weight, most, on, into)
        self.courses = self._courses(way, check_whole("branches", branches, 0, 16), on)
        self.s = min(2.2 * half, self.length) if s is None else check_range("s", s, 0.0, 1e9) / unit
        self.s = max(self.s, 1.2 * (half + self.shape.trail))
        arrived = max(self.length - self.s, 0.0) / self.c
        self.end = self.begin + arrived + check_range("hold", hold, 0.0, 1e9)
        reach = max(half, (1.0 + WOBBLE) * self.shape.trail)
        self._below = LocalSubdivision([course.points for course in self.courses], reach, self._detail)
        self._kept: Footprint | None = None
        self._check_disk()

    # --- the way -------------------------------------------------------------------------------

    def _way(self, path: Any, start: Any, weight: Any, most: float, on: Any, into: SheddingTear | None) -> Array:
        """The path of the source at rest."""
        if sum(choice is not None for choice in (path, start, weight)) != 1:
            raise ParameterError("give one of path, start and weight: it says where the tear runs.")
        if into is not None and not isinstance(into, SheddingTear):
            raise ParameterError(f"into must be a SheddingTear, the stream to follow, received {type(into).__name__}.")
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
        if len(way) < 3 or not paths.lengths(way)[-1] > 0.0:
            raise ParameterError(
                "the path has no length: its points are one place of the surface, or length is too small."
            )
        if start is not None and into is None:
            way = self._meandered(way)
        return paths.smoothed(ground, way, 0.2 * width) if len(way) > 2 else way

    def _found(self, start: Any, most: float, on: Any) -> Array:
        """The way down from a point; where it is level there, or slopes inwards as some lids do, from just below it."""
        ground, width, (moved, rest) = self._ground, 2.0 * self.shape.half, self._moved(on)
        first = ground.start(start, max(2.0 * width, 0.02 * ground.size))
        lowered = 0.35 * width * np.arange(6.0)[:, None] * ground.down
        for begin in ground.nearest(first + lowered)[1]:
            at = ground.bound(np.array([first, begin])).at(moved.points)
            way = paths.descent(moved, at[1], 0.5 * self._detail, most)
            if paths.lengths(way)[-1] > 1.5 * width:
                way = self._overflowed(moved, way, lowered[1:], most)
                return moved.bound(np.concatenate([at[:1], way])).at(rest)
        raise ParameterError(
            f"no water runs from {first.round(2)}: the surface is level there, or ends. Start elsewhere, or give a "
            "path."
        )

    def _overflowed(self, moved: SupportSurface, way: Array, lowered: Array, most: float) -> Array:
        """A way that goes on below hollows as small as the tear, which fills them, such as creases of the lids."""
        step, width = 0.5 * self._detail, 2.0 * self.shape.half
        for begin in moved.nearest(way[-1] + lowered)[1]:
            across = np.linspace(way[-1], begin, 9)
            if np.linalg.norm(moved.nearest(across)[1] - across, axis=1).max() > SHALLOW * width:
                continue
            more = paths.descent(moved, begin, step, max(most - paths.lengths(way)[-1], step))
            if paths.lengths(more)[-1] > 1.5 * width and (begin - way[-1]) @ moved.down > 0.0:
                return self._overflowed(moved, np.concatenate([way, more]), lowered, most)
        return way

    def _meandered(self, way: Array) -> Array:
        """The way with the small turns that rough skin makes; its start stays."""
        half, along = self.shape.half, np.gradient(way, axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        aside = np.cross(along, self._ground.bound(way).at(self._ground.normals))
        grown = np.minimum(paths.lengths(way) / (4.0 * half), 1.0)
        turns = MEANDER * waves(self._random, len(way), 6.0 * half / self._detail)
        return way + (self.roughness * half * grown * turns)[:, None] * aside

    def _weights(self, weight: Any) -> Any:
        if not isinstance(weight, str):
            return weight
        face = self._ground.face
        if face is None or weight not in face.mesh.point_data:
            raise ParameterError(f"there are no painted weights {weight!r} on the face. Pass the array itself.")
        return face.mesh.point_data[weight]

    def _moved(self, on: pv.PolyData | None) -> tuple[SupportSurface, Array]:
        """The ground as it is in a frame, and the frame's points at rest."""
        ground = self._ground
        points, triangles, _, rest = self._frame(on)
        moved = SupportSurface(points, triangles, ground.down, ground.forward, ground.unit, ground.face)
        return (ground if on is None else moved), rest

    def _courses(self, way: Array, branches: int, on: pv.PolyData | None) -> tuple[StreamPath, ...]:
        """The source's course, and those that leave it at folds."""
        courses = [self._course(way, 0.0, 1.0)]
        if not branches:
            return tuple(courses)
        moved, rest = self._moved(on)
        main = (
            way
            if on is None
            else SupportSurface(rest, moved.triangles, moved.down, moved.forward, 1.0).bound(way).at(moved.points)
        )
        for _ in range(branches):
            found = paths.branch(moved, main, 0.5 * self._detail, 2.0 * self.shape.half)
            if found is None:
                break
            spilled = moved.bound(found).at(rest)
            for _ in range(4):  # little by little: it must stay on top of the fold
                spilled = paths.smoothed(self._ground, spilled, 0.4 * self.shape.half, 3)
            k = int(np.argmin(np.linalg.norm(way - spilled[0], axis=1)))
            courses.append(self._course(spilled, float(paths.lengths(way)[k]), 0.7))
            main = main[: max(k - 4, 0)]
        return tuple(courses)

    def _course(self, way: Array, begin: float, flow: float) -> StreamPath:
        half, random = self.shape.half, self._random
        noise, spacing = rough_film(float(paths.lengths(way)[-1]), half, self.roughness, self._degree, random)
        short, wide = (waves(random, len(noise), scale * half / spacing) for scale in (1.5, 6.0))
        return StreamPath(way, begin, flow, noise, spacing, 0.5 * WOBBLE * (short + wide))

    @property
    def length(self) -> float:
        """Of the longest way, in the unit of the surface."""
        return max(course.begin + float(course.lengths[-1]) for course in self.courses)

    def _check_disk(self) -> None:
        base = self._base(self._ground.points, self._ground.triangles)
        level, _ = self._thickness(base, self.length)
        part = base.part(level)
        if (
            part is None
            or np.count_nonzero(part.share == 0.0) < 0.9 * np.count_nonzero(level > 0.0)
            or euler_characteristic(part.triangles) != 1
            or len(boundary_loops(part.triangles)) != 1
        ):
            raise ParameterError(
                "the tear would not be one piece without holes: its path runs around a hole of the surface, or over a "
                "gap. Lead it elsewhere, or make it narrower."
            )

    def meets(self, other: SheddingTear) -> bool:
        """Whether its path comes within the width of another one's, beyond their starts."""
        own, width = self.courses[0].points, 2.0 * self.shape.half
        gap, where = cKDTree(other.courses[0].points).query(own[len(own) // 20 :])
        return bool(((gap < 0.6 * width) & (where > 2)).any())

    # --- the tear --------------------------------------------------------------------------------

    def covered(self, t: float) -> float:
        """How much of the path the tear covers at time t: the paper's ``h = s + c t``.

        It is a length along the path, in the unit of the surface, and not a height; it never becomes less.

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
            Closed, of genus 0, oriented outwards, nowhere in the skin; with "Normals", "thickness", and the normal of
            the skin "under" it.

        Raises
        ------
        ParameterError
            For t outside [begin, end].
        MeshError
            For a frame of another surface.
        """
        front, unit = self.covered(t), self._ground.unit
        points, triangles, normals, rest = self._frame(on)
        base = self._base(rest, triangles)
        level, thick = self._thickness(base, front)
        part = base.part(level)
        if part is None:
            raise MeshError("nothing of the surface is under the tear. Is it a frame of another surface?")
        bottom, up, home = part.at(points, normals)
        height = np.maximum(thick[part.first] * (part.share == 0.0), FILM / unit)
        kernels.limit_heights(bottom, home, up, height, part.under, points, rest, triangles, 2.0 * self.shape.half)
        top = bottom + height[:, None] * up
        shaded = detail_normals(bottom, top, part.triangles, up)
        data = {"Normals": (shaded, -up), "thickness": (height, height), "under": (up, up)}
        mesh = of_own_arrays(
            *solid(bottom, top, part.triangles, part.rim),
            {name: np.concatenate(of_top_and_bottom) for name, of_top_and_bottom in data.items()},
        )
        mesh.GetPointData().SetActiveNormals("Normals")
        return mesh

    def _frame(self, on: pv.PolyData | None) -> tuple[Array, IntArray, Array, Array]:
        """Points, triangles, normals and rest points of a frame."""
        ground = self._ground
        if on is None:
            return ground.points, ground.triangles, ground.normals, ground.points
        points, triangles, rest = ground.frame(on)
        normals = array_of(on, "Normals") if on.GetPointData().HasArray("split_gamma") else None
        if normals is None:
            normals = vertex_normals(points, triangles)
        return points, triangles, np.ascontiguousarray(normals, dtype=np.float64), rest

    def _base(self, rest: Array, triangles: IntArray) -> Footprint:
        self._kept = footprint_under(self._below, self.courses, rest, triangles, self._kept)
        return self._kept

    def _thickness(self, base: Footprint, front: float) -> tuple[Array, Array]:
        """Level and height at the base's vertices: of all courses, those of the thickest."""
        level, height = np.empty(0), np.empty(0)
        for k, course in enumerate(self.courses):
            here = min(front - course.begin, float(course.lengths[-1]))
            shape = self.shape.scaled(course.flow)
            if k and here < shape.half + shape.trail:
                continue
            grown = min(max((here - self.s) / (4.0 * shape.half), 0.0), 1.0)  # it fills as it begins to run
            head = Shape(shape.half * (0.7 + 0.3 * grown), shape.height * (0.6 + 0.4 * grown), shape.trail, shape.film)
            one, thick = thickness(base.s[k], base.w[k], here, head, base.wobble[k], ROUGH * base.noise[k])
            level, height = (np.maximum(level, one), np.maximum(height, thick)) if k else (one, thick)
        return level, height
