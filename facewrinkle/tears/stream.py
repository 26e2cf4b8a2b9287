"""Tears that are shed: a bead of water that runs down a surface, with a wet trail behind it (Section 4.2).

The paper's five steps: the surface under the tear, a strip along its path (:mod:`.strip`); a copy just above it, joined
to it along the outline (:func:`.shape.solid`); the head (:func:`.shape.thickness`, or :func:`.shape.extruded` and
smoothed); noise on the top, raised by moving least squares (:func:`.shape.raised`); and the part that is covered at a
time, ``h = s + c t``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import maximum_filter
from scipy.spatial import cKDTree

from ..anatomy import Face
from ..array_types import Array
from ..errors import ParameterError, check_name, check_range, check_ranges, check_whole
from ..geometry import detail_normals, ring_triangles, unit
from ..mesh import MeshLike, is_frame, to_polydata
from . import path as paths
from .drop import Sampled
from .path import WOBBLE, PathFinder, StreamPath, irregular_path
from .shape import Shape, extruded, outline, raised, smoothed_head, solid, thickness
from .strip import Binding, bind, bulge, kept_off, strip_along
from .support_surface import support_surface

EDGE = 0.002
"""Thickness at the very edge, mm: the paper's two surfaces that 'are seen as almost one'."""


@dataclass(frozen=True)
class Film:
    """The wet trail behind the head of a tear that is shed.

    Attributes
    ----------
    trail : float
        Width of the trail, as a share of the head's.
    roughness : float
        Roughness of the skin, 0 to 1: the share of the trail that is raised by water held back. It also turns the
        stream aside.
    degree : int
        Degree of the moving least squares that smooth this noise.

    Examples
    --------
    A narrow trail on smooth skin:

    >>> import facewrinkle as fw
    >>> tear = fw.SheddingTear(fw.default_face(), start="l", film=Film(trail=0.5, roughness=0.0))
    >>> tear.shape.trail / tear.shape.half
    0.5
    """

    trail: float = 0.7
    roughness: float = 0.3
    degree: int = 1

    def __post_init__(self) -> None:
        check_ranges(self, trail=(0.2, 1.0), roughness=(0.0, 1.0))
        check_whole("degree", self.degree, 0, 3)


@dataclass(frozen=True)
class Flow:
    """The progress of a tear that is shed: it covers a length ``h = s + c t`` of its path.

    Attributes
    ----------
    s : float, optional
        Length that is covered at first, mm; by default, and at least, about that of the head.
    c : float
        Speed, mm/s.
    hold : float
        Seconds for which the tear stays when it has arrived.
    by : {"length", "height"}
        What h is: a length along the path, so that the tear runs evenly, or, as in the paper, the height that is
        covered: on a slope that is less steep the tear runs faster.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> tear = fw.SheddingTear(fw.default_face(), start="l", flow=Flow(s=5.0, c=20.0))
    >>> tear.covered(0.0), tear.covered(1.5)
    (5.0, 35.0)
    """

    s: float | None = None
    c: float = 30.0
    hold: float = 1.0
    by: Literal["length", "height"] = "length"

    def __post_init__(self) -> None:
        if self.s is not None:
            check_range("s", self.s, 0.0, 1e9)
        check_ranges(self, c=(1e-6, 1e9), hold=(0.0, 1e9))
        check_name("measure of the flow", self.by, ("length", "height"))


@dataclass(frozen=True, eq=False)
class Route:
    """The route of a tear that is shed: its length, and the folds that divert it.

    Attributes
    ----------
    length : float
        The most that the tear runs, mm.
    into : SheddingTear, optional
        Another stream, which the tear follows from where they meet.
    on : PolyData, optional
        A frame of the face: folds that are not there at rest divert the tear too.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> tear = fw.SheddingTear(fw.default_face(), start="l", route=Route(length=25.0))
    >>> round(tear.length)
    25
    """

    length: float = 120.0
    into: SheddingTear | None = None
    on: pv.PolyData | None = None

    def __post_init__(self) -> None:
        check_range("length", self.length, 1e-6, 1e9)
        if self.into is not None and not isinstance(self.into, SheddingTear):
            raise ParameterError(
                f"into must be a SheddingTear, the stream to follow, received {type(self.into).__name__}."
            )


class SheddingTear:
    """A tear that is shed: it runs down the skin, joined to it, and leaves a wet trail. Or water on any surface.

    Parameters
    ----------
    surface : Face, or any mesh that `read_surface` takes
        At rest.
    path : array_like, shape (k, 3), optional
        Points on the surface through which the tear runs.
    start : array_like, shape (3,), or {"l", "r"}, optional
        A point from which it finds its own path, down the steepest descent. A letter is the eye of a Face, from whose
        lower lid it runs. Either path or start is needed.
    width, height : float
        Width and height of the head of the tear, mm.
    begin : float
        Seconds at which it appears.
    seed : int
        Seed of everything random.
    film : Film, optional
        The wet trail: its width, the roughness of the skin.
    flow : Flow, optional
        The speed of the tear, and the time for which it stays.
    route : Route, optional
        The length of the path, another stream that it joins.
    head : {"round", "extruded"}
        A head by a formula, round in front and narrowing into the trail; or, as in the paper (Fig. 9 d and e), the end
        of the tear is extruded to its height and then smoothed.
    detail : float
        Length of the edges of the mesh on the skin, at most, as a share of the width; those of a narrow trail are
        shorter.
    down : array_like, shape (3,), optional
        Default: down the face; -y on other surfaces.
    units : {"um", "mm", "cm", "dm", "m", "in"} or float
        Unit of a surface that is no Face, or millimeters per unit.

    Attributes
    ----------
    path : StreamPath
    strip : Strip
        The strip of the surface along the path, at rest.
    shape : Shape
        In the unit of the surface.
    begin, end : float
        Seconds between which there is a tear.
    s, c : float
        Of ``h = s + c t``, in the unit of the surface.

    Raises
    ------
    ParameterError
        For a path that leaves the surface, runs over the back of the head or crosses itself, a start off the surface or
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
        surface: Face | MeshLike,
        path: npt.ArrayLike | None = None,
        *,
        start: npt.ArrayLike | str | None = None,
        width: float = 3.0,
        height: float = 0.9,
        begin: float = 0.0,
        seed: int = 0,
        film: Film | None = None,
        flow: Flow | None = None,
        route: Route | None = None,
        head: Literal["round", "extruded"] = "round",
        detail: float = 0.28,
        down: npt.ArrayLike | None = None,
        units: str | float = "mm",
    ) -> None:
        film, flow, route = film or Film(), flow or Flow(), route or Route()
        if (path is None) == (start is None):
            raise ParameterError("give either path or start: it says where the tear runs.")
        check_name("head", head, ("round", "extruded"))
        self._extruded = head == "extruded"
        self._support = support_surface(surface, down, units)
        self.shape = self._checked_shape(width, height, film.trail)
        half, unit = self.shape.half, self._support.unit
        self.begin = check_range("begin", begin, 0.0, 1e9)
        # The trail is a parabola across: points so far apart, in halves of its width, show that.
        self._spacing = min(check_range("detail", detail, 0.03, 1.0) * half, 0.4 * self.shape.trail)
        random = np.random.default_rng(check_whole("seed", seed, 0, 2**63))
        finder = self._path_finder(route)
        found = finder.path(path, start)
        if route.into is not None:
            found = paths.merged(found, route.into.path.points, 1.2 * half)
        found = finder.cut(found)
        if start is not None and route.into is None:
            found = finder.meandered(found, film.roughness, random)
        found = paths.smoothed(self._support, found, 0.4 * half)
        self.path: StreamPath = irregular_path(found, half, film.roughness, int(film.degree), random)
        self.c = flow.c / unit
        self.s = min(2.2 * half, self.length) if flow.s is None else flow.s / unit
        self.s = max(self.s, 1.2 * (half + self.shape.trail))
        self._heights = self._lengths = np.array([0.0, self.length])
        if flow.by == "height":
            drop = (self.path.points - self.path.points[0]) @ self._support.down
            self._heights, self._lengths = np.maximum.accumulate(drop), self.path.lengths
        self.end = self.begin + max(float(self._heights[-1]) - self.s, 0.0) / self.c + flow.hold
        reach = max(half, (1.0 + WOBBLE) * self.shape.trail)
        self.strip = strip_along(self._support, self.path, reach, self._spacing)
        self._rest = self.strip.rest.reshape(-1, 3)
        rows, columns = self.strip.noise.shape
        self._sheet = ring_triangles(columns, rows, closed=False)
        self._closed = solid(self._rest, self._rest, self._sheet)[1]
        self._binding: Binding | None = None

    def _checked_shape(self, width: float, height: float, trail: float) -> Shape:
        """Return the shape of the tear in the unit of the surface, after checking that the surface is large enough."""
        unit = self._support.unit
        half = 0.5 * check_range("width", width, 1e-6, 1e6) / unit
        height = check_range("height", height, 1e-6, 1e6) / unit
        self._support.check_size(max(2.0 * half, height))
        return Shape(half, height, half * trail, max(0.08 * height, 2.0 * EDGE / unit))

    def _path_finder(self, route: Route) -> PathFinder:
        """Return a finder of paths, after checking that the longest does not need too fine a mesh."""
        support, width = self._support, 2.0 * self.shape.half
        longest, most = min(route.length / support.unit, 20.0 * support.size), 20_000.0 * self._spacing
        if longest > most:
            raise ParameterError(
                f"a tear {width * support.unit:g} mm wide and up to {longest * support.unit:.4g} mm long needs too "
                "fine a mesh. Make it wider, give a larger detail, or a length of "
                f"{most * support.unit:.3g} mm at most."
            )
        return PathFinder(support, *support.in_frame(route.on), width, self._spacing, longest)

    @property
    def length(self) -> float:
        """Length of the path, in the unit of the surface."""
        return float(self.path.lengths[-1])

    def meets(self, other: SheddingTear) -> bool:
        """Return True if its path comes within its width of another one's, beyond the starts of both."""
        own, width = self.path.points, 2.0 * self.shape.half
        gap, where = cKDTree(other.path.points).query(own[len(own) // 20 :])
        return bool(((gap < 0.6 * width) & (where > 2)).any())

    # --- the tear --------------------------------------------------------------------------------

    def covered(self, t: float) -> float:
        """Return the length of the path that is covered at time t: the paper's ``h = s + c t``.

        It is in the unit of the surface, and never decreases. Unless the flow goes by height, h is this length itself.

        Raises
        ------
        ParameterError
            For t outside [begin, end].
        """
        t = check_range("t", t, self.begin, self.end, "There is no tear at other times.")
        h = self.s + self.c * (t - self.begin)
        last = min(int(np.searchsorted(self._heights, h, side="right")), len(self._heights) - 1)
        between = slice(last - 1, last + 1)  # where the path is level, its end
        return max(float(np.interp(h, self._heights[between], self._lengths[between])), self.s)

    def surface(self, t: float, on: pv.PolyData | None = None) -> pv.PolyData:
        """Return the tear at time t.

        Parameters
        ----------
        t : float
            Seconds, from `begin` to `end`.
        on : PolyData, optional
            The surface at this time: a frame of a :class:`facewrinkle.Simulation`, or any mesh with the points of the
            surface at rest. Default: at rest.

        Returns
        -------
        PolyData
            Closed, of genus 0, oriented outwards, always of the same triangles, which have no area where the tear has
            not come; with "Normals", "thickness", and the normal of the skin "under" it. The second half of the points
            lies on the skin.

        Raises
        ------
        ParameterError
            For t outside [begin, end].
        MeshError
            For a frame of another surface.
        """
        front = self.covered(t)
        # Step two, the base and a copy of it, joined.
        frame, rest = self._support.in_frame(on)
        self._binding = binding = bind(self._rest, rest, frame.triangles, self._binding)
        normals = frame.normals
        if on is not None and is_frame(on) and "Normals" in on.point_data:  # those of its wrinkles
            normals = np.ascontiguousarray(on.point_data["Normals"], np.float64)
        grid = np.concatenate([binding.bound.at(frame.points), binding.bound.at(normals), self._rest], axis=1)
        bottom, up, at_rest, thick = self._raised(front, grid.reshape(*self.strip.noise.shape, 9))
        height, wet = np.zeros(len(thick)), thick > 0.0
        skin = frame.points, rest, frame.triangles
        height[wet] = kept_off(bottom[wet], at_rest[wet], up[wet], thick[wet], skin, 2.0 * self.shape.half)
        top = bottom + height[:, None] * up
        shaded = detail_normals(bottom, top, self._sheet, up)
        data = {"Normals": (shaded, -up), "thickness": (height, height), "under": (up, up)}
        mesh = to_polydata(
            np.concatenate([top, bottom]),
            self._closed,
            {name: np.concatenate(of_top_and_bottom) for name, of_top_and_bottom in data.items()},
        )
        mesh.GetPointData().SetActiveNormals("Normals")
        return mesh

    def sampled(self, times: Sequence[float] | Array, frames: Sequence[pv.PolyData]) -> Sampled | None:
        """Return the tear at times; see :meth:`DrippingTear.sampled`."""
        return Sampled.of(self, times, frames)

    def _raised(self, front: float, grid: Array) -> tuple[Array, Array, Array, Array]:
        """Return the points (n, 3) of the strip, their normals, where they are at rest, and the thickness (n,) there.

        Parameters
        ----------
        front : float
        grid : ndarray, shape (r, c, 9)
            The same of the whole strip, without the thickness.
        """
        strip, shape = self.strip, self.shape
        risen = bulge(grid[:, :, :3], grid[:, :, 3:6])[:, :, None]
        run = min(front, self.length)
        grown = min(max((run - self.s) / (4.0 * shape.half), 0.0), 1.0)  # it fills as it begins to run
        shape = replace(shape, half=shape.half * (0.7 + 0.3 * grown), height=shape.height * (0.6 + 0.4 * grown))
        half = outline(strip.s, run, shape, strip.wobble)
        s, w, grid, moved = strip.within(np.concatenate([grid, risen], axis=2), run, half)
        points, up, at_rest, (risen,) = grid[..., :3], grid[..., 3:6], grid[..., 6:9], np.moveaxis(grid[..., 9:], 2, 0)
        up = unit(up)
        points = points + (risen * moved)[:, :, None] * up
        height = np.maximum(
            self._heights_of(s, w, run, shape), np.maximum(EDGE / self._support.unit, maximum_filter(risen, 3))
        )
        height *= (half > 0.0)[:, None] & ~strip.ends
        return points.reshape(-1, 3), up.reshape(-1, 3), at_rest.reshape(-1, 3), height.ravel()

    def _heights_of(self, s: Array, w: Array, run: float, shape: Shape) -> Array:
        """Return the thickness (r, c) of a tear that has run so far: steps three and four, the head and the noise."""
        wobble = self.strip.wobble[:, None]
        bumps = raised(s, w, run, shape, wobble, self.strip.noise)
        if not self._extruded:
            return thickness(s, w, run, shape, wobble) + bumps
        film = thickness(s, w, run, replace(shape, height=shape.film), wobble)
        s = np.broadcast_to(s, w.shape)
        return smoothed_head(s, w, extruded(s, film, run, shape), run, shape) + bumps
