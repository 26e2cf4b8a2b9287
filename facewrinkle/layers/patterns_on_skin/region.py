"""Regions that patterns lie on: areas of a surface with local coordinates, windows that fade the patterns out, and the
compression of the skin in them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ...anatomy import Face
from ...array_types import Array, BoolArray, IntArray
from ...checks import finite, vector
from ...errors import MeshError, ParameterError, check_name, check_range, check_ranges, check_whole
from ...geometry import (
    ClosestPoint,
    attenuation,
    band,
    closest_point,
    interpolated,
    side_lengths,
    smoothstep,
    vertex_areas,
    vertex_rings,
)
from ...geometry.chart import geodesic_chart, gradients, smoothed, smoothly_interpolated, tangents
from ...geometry.topology import morton_order
from ..base import SurfacePoints
from ..compression import StrainField, compression_along, principal_compression


def valid_vertices(chart: Array, inside: BoolArray, share: float, seed: int) -> Array:
    """Return 1 for ``round(share N)`` of the N vertices inside, chosen at random but evenly over the area, else 0.

    The vertices are put in the order of Morton's curve, which fills the plane, and cut into as many runs as vertices
    are to be chosen; each run gives one. A refined mesh interpolates these values, so that
    nothing is drawn again.

    Parameters
    ----------
    chart : ndarray, shape (n, 2)
    inside : ndarray of bool, shape (n,)
    share : float
    seed : int

    Examples
    --------
    >>> grid = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0)), axis=-1).reshape(-1, 2)
    >>> chosen = valid_vertices(grid, np.ones(64, bool), 0.25, seed=1)
    >>> int(chosen.sum()), int(chosen[(grid < 4).all(axis=1)].sum())
    (16, 4)
    """
    candidates = np.flatnonzero(inside)
    count = round(share * len(candidates))
    if share == 1.0 or count == 0:
        return np.full(len(chart), float(share == 1.0))
    uv = np.nan_to_num(chart[candidates])
    low, span = uv.min(axis=0), np.maximum(np.ptp(uv, axis=0), 1e-300)
    order = morton_order(((uv - low) / span * 65535.0).astype(np.int64), bits=16)
    edges = np.arange(count + 1) * len(candidates) // count
    drawn = edges[:-1] + (np.random.default_rng(seed).random(count) * np.diff(edges)).astype(int)
    out = np.zeros(len(chart))
    out[candidates[order[drawn]]] = 1.0
    return out


def selection_weights(select: npt.ArrayLike | str, face: Face, border: float) -> Array:
    """Return the weights (n,) of a selection: as painted, or rising from 0 to 1 over the share `border` of its depth.

    Parameters
    ----------
    select : array_like or str
        See :class:`facewrinkle.Region`.
    face : Face
    border : float

    Raises
    ------
    UnknownNameError
        If the mesh has no such point data.
    MeshError
        If the selection does not fit the mesh.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> weights = selection_weights(face.points[:, 1] > 40.0, face, border=0.5)
    >>> float(weights.min()), float(weights.max())
    (0.0, 1.0)
    """
    if isinstance(select, str):
        check_name("point data", select, face.mesh.point_data)
        select = face.mesh.point_data[select]
    values = np.asarray(select)
    if values.shape != (len(face.points),) or values.dtype.kind not in "biuf":
        raise MeshError(
            f"a selection must have a bool or a weight for each of the {len(face.points)} points of the mesh, received "
            f"{values.dtype} of {values.shape}. Or store it as point data of the mesh, and give the name."
        )
    if not ((values >= 0) & (values <= 1)).all():
        raise MeshError("a selection must be bools, or weights in [0, 1]; others, or NaN, were received.")
    if not (values > 0).any():
        raise MeshError("the selection holds no vertex.")
    if values.dtype.kind == "f":
        return values.astype(np.float64)
    chosen = values.astype(bool)
    if chosen.all():
        return np.ones(len(chosen))
    inward = cKDTree(face.points[~chosen]).query(face.points)[0]
    offsets, ring = vertex_rings(face.triangles, len(chosen))
    step = np.linalg.norm(face.points[ring] - np.repeat(face.points, np.diff(offsets), axis=0), axis=1)
    return np.clip(inward / max(border * inward.max(), float(np.median(step))), 0.0, 1.0)


Outline = Literal["ellipse", "box"]

OUTLINES: dict[str, float] = {"ellipse": 2.0, "box": 6.0}
"""Exponents p of the p-norm of (u, v), which is 1 at the border."""


@dataclass(frozen=True, eq=False)
class Region:
    """An area of a surface.

    Attributes
    ----------
    center : array_like, shape (3,), or str, optional
        Its middle, in the coordinates of the mesh, or the name of a landmark of the face; the closest point of the
        surface is taken. Default: the middle of `select`.
    up : array_like, shape (3,)
        Direction whose part in the surface is the region's own up.
    size : float or tuple of float, optional
        Width and height on the surface, in the unit of the mesh. Default: those of `select`, or a tenth of the
        mesh from corner to corner.
    select : array_like, shape (n0,), or str, optional
        Bools or painted weights in [0, 1] at the vertices of the mesh, or the name of point data that holds them.
        Without it the region is the ellipse or box of `size`.
    outline : {"ellipse", "box"}
        The box has round corners.
    border : float
        Share of the distance from the border to the middle over which the pattern fades, in (0, 1].
    bow : float
        Height of the ends of the region's middle line above its middle, in half heights of the region: a crescent.
    mirrored : bool
        If True, the first axis points to the left, seen from outside, instead of the right.
    valid_share : float
        Share of the vertices of the mesh that carry the pattern (the paper's valid vertices), in (0, 1].
    seed : int
        Seed for the choice of these vertices.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> brow = fw.Region("forehead_mid", size=(80, 30), outline="box")
    >>> sim = fw.Simulation(face, layers=[fw.PatternLayer("forehead", region=brow, depth=1.0)], motion=fw.Still(face))
    >>> bool(abs(sim.step()["W"]).max() > 0.1)
    True
    """

    center: npt.ArrayLike | str | None = None
    up: npt.ArrayLike = (0.0, 1.0, 0.0)
    size: float | tuple[float, float] | None = None
    select: npt.ArrayLike | str | None = None
    outline: Outline = "ellipse"
    border: float = 0.6
    bow: float = 0.0
    mirrored: bool = False
    valid_share: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        check_name("outline", self.outline, OUTLINES)
        share_of = "It is a share of the vertices."
        check_ranges(self, border=(1e-6, 1.0), bow=(-10.0, 10.0), valid_share=(1e-9, 1.0, share_of))
        check_whole("seed", self.seed, 0, 2**63)
        if self.center is not None and not isinstance(self.center, str):
            vector("center", self.center)
        if not np.any(vector("up", self.up)):
            raise ParameterError("up must be a direction, received three zeros.")
        if self.select is None and self.center is None:
            raise ParameterError("a region needs a center, or a selection of vertices (select).")
        if self.size is not None:
            check_size(self.size)

    def laid(self, face: Face) -> LaidRegion:
        """Lay the region on a surface.

        Raises
        ------
        ParameterError
            If the region lies off the surface or is larger than it, or `up` points straight out of the surface.
        MeshError
            If the selection does not fit the mesh.
        UnknownNameError
            If `center` is no landmark of the face.
        """
        points, triangles = face.points, face.triangles
        weight = None if self.select is None else selection_weights(self.select, face, self.border)
        middle = np.average(points, axis=0, weights=weight) if self.center is None else self._middle(face)
        center = closest_point(points, triangles, middle)
        size: float | tuple[float, float] | None = self.size
        if size is None and weight is None:
            size = 0.1 * float(np.linalg.norm(np.ptp(points, axis=0)))
        half = None if size is None else 0.5 * np.broadcast_to(np.asarray(size, dtype=np.float64), 2)
        self._check_place(center, half)
        chart = self._chart(points, triangles, center, half)
        if half is None:
            inside = np.isfinite(chart).all(axis=1) & self._inside(chart, weight)
            half = np.abs(chart[inside]).max(axis=0)
        elif not (np.abs(chart[np.isfinite(chart).all(axis=1)]) > half).any():
            reach = 2.0 * np.nanmax(np.abs(chart), axis=0)
            raise ParameterError(
                f"the region is larger than the mesh: {2.0 * half[0]:.3g} wide and {2.0 * half[1]:.3g} high, and the "
                f"surface about its center is {reach[0]:.3g} wide and {reach[1]:.3g} high. Is the size in the unit of "
                "the mesh? Use a smaller one."
            )
        chart = chart / half * [-1.0 if self.mirrored else 1.0, 1.0]
        chart[:, 1] -= self.bow * chart[:, 0] ** 2
        known: BoolArray = np.asarray(np.isfinite(chart).all(axis=1))
        slopes = gradients(points, triangles, chart)
        valid = valid_vertices(chart, self._inside(chart, weight), self.valid_share, self.seed)
        chart = np.where(known[:, None], chart, 0.0)
        corners = triangles[center.triangle]
        return LaidRegion(self, center, corners, half, points, chart, slopes, known, weight, valid)

    def _middle(self, face: Face) -> npt.ArrayLike:
        """Return the point that `center` names."""
        if isinstance(self.center, str) and face.landmarks:
            check_name("landmark", self.center, face.landmarks)
            return face.landmarks[self.center]
        return vector("center", self.center)

    def _check_place(self, center: ClosestPoint, half: Array | None) -> None:
        if not np.any(tangents(center.normal, vector("up", self.up))[1]):
            raise ParameterError(
                f"up must not point straight out of the surface; it is {np.asarray(self.up).tolist()}, and the normal "
                f"in the center is {center.normal.round(3).tolist()}. Choose another up."
            )
        if half is not None and center.distance > half.max():
            raise ParameterError(
                f"the region lies off the mesh: its center {np.asarray(self.center).tolist()} is {center.distance:.3g} "
                f"away from the surface, and it is {2.0 * half.max():.3g} in size. The closest point of the surface is "
                f"{center.point.round(3).tolist()}."
            )

    def _chart(self, points: Array, triangles: IntArray, center: ClosestPoint, half: Array | None) -> Array:
        """Coordinates (n0, 2) about the center, in the unit of the mesh; NaN beyond the region."""
        size = np.inf if half is None else float(np.hypot(*half))
        near = np.linalg.norm(points[triangles].mean(axis=1) - center.point, axis=1) <= 1.2 * size
        near[center.triangle] = True
        edges = side_lengths(points[triangles[near]])
        laid = geodesic_chart(points, triangles, center, self.up, size + float(edges.max()))
        # Coordinates are smoothed over a share of the size of the region, to even out uneven triangles.
        length = 0.15 * (float(np.sqrt(half.prod())) if half is not None else float(np.median(edges)))
        # No path along a surface is shorter than the straight line: coordinates far below it lie beyond a fold.
        straight = 0.8 * np.linalg.norm(points - center.point, axis=1)
        laid[np.hypot(*laid.T) < straight] = np.nan
        laid = smoothed(points, triangles, laid, length)
        laid[np.hypot(*laid.T) < straight] = np.nan
        return laid

    def _inside(self, chart: Array, weight: Array | None) -> BoolArray:
        """True for base vertices in the region."""
        if weight is not None:
            return weight > 0.0
        return np.isfinite(chart).all(axis=1) & (outline_norm(np.nan_to_num(chart, nan=9.0), self.outline) < 1.0)


@dataclass(frozen=True, eq=False)
class LaidRegion:
    """A region laid on a surface.

    Attributes
    ----------
    region : Region
    center : ClosestPoint
    corners : ndarray of int32, shape (3,)
        Vertices of the base triangle that the center lies in.
    half : ndarray, shape (2,)
        Half its width and height, in the unit of the mesh.
    points : ndarray, shape (n0, 3)
        Base vertices.
    chart : ndarray, shape (n0, 2)
        Their local coordinates (u, v): 0 in the center, +-1 where the border crosses the axes.
    slopes : ndarray, shape (n0, 3, 2)
        Gradients of u and v.
    known : ndarray of bool, shape (n0,)
        True for base vertices that have coordinates.
    weight : ndarray, shape (n0,), optional
        Weights of a selection.
    valid : ndarray, shape (n0,)
        1 for base vertices that carry the pattern, 0 for others.

    Examples
    --------
    A sheet with a vertex every 10 mm; the one at (20, 10) is half way to the border, to the right as well as up:

    >>> import pyvista as pv
    >>> import facewrinkle as fw
    >>> sheet = fw.surface(pv.Plane(i_size=100, j_size=100))
    >>> laid = Region((0, 0, 0), size=(80, 40)).laid(sheet)
    >>> vertex = np.flatnonzero((laid.points.round() == [20, 10, 0]).all(axis=1))
    >>> laid.aspect, laid.chart[vertex].round(3)
    (0.5, array([[0.5, 0.5]]))
    """

    region: Region
    center: ClosestPoint
    corners: IntArray
    half: Array
    points: Array
    chart: Array
    slopes: Array
    known: BoolArray
    weight: Array | None
    valid: Array

    @property
    def aspect(self) -> float:
        """Height over width."""
        return float(self.half[1] / self.half[0])

    @property
    def base_window(self) -> Array:
        """Window (n0,) at the base vertices."""
        return np.where(self.known, self.window(self.chart, self.weight), 0.0)

    def window(self, uv: Array, weight: Array | None = None) -> Array:
        """Return the window (k,) at local coordinates (k, 2): 1 inside, 0 from the border on, with a continuous slope.

        With a selection, `weight` (k,) takes the place of the coordinates.
        """
        if weight is not None:
            return 1.0 - attenuation(weight, "smoothstep")
        return attenuation(band(outline_norm(uv, self.region.outline), 1.0 - self.region.border, 1.0), "smoothstep")

    def at(self, vertices: SurfacePoints) -> tuple[npt.NDArray[np.int64], Array, Array, Array]:
        """Return the vertices in the region: their numbers (k,), (u, v), its gradients (k, 3, 2), and weights (k,).

        The weight is the window times the share of valid vertices around.
        """
        near = np.flatnonzero(self.known[vertices.corners].all(axis=1))
        corners, barycentric = vertices.corners[near], vertices.barycentric[near]
        uv = smoothly_interpolated(self.points, self.chart, self.slopes, vertices.points[near], corners, barycentric)
        weight = None if self.weight is None else interpolated(self.weight[:, None], corners, barycentric)[:, 0]
        window = self.window(uv, weight)
        inside = window > 0.0
        near, corners, barycentric = near[inside], corners[inside], barycentric[inside]
        share = interpolated(self.valid[:, None], corners, barycentric)[:, 0]
        slopes = np.einsum("kc,kcxd->kxd", barycentric, self.slopes[corners])
        return near, uv[inside], slopes, window[inside] * share


def outline_norm(uv: Array, outline: Outline) -> Array:
    """Return the norm (k,) of local coordinates (k, 2) that is 1 on the border.

    Examples
    --------
    >>> outline_norm(np.array([[0.6, 0.8], [1.0, 0.0]]), "ellipse")
    array([1., 1.])
    """
    power = OUTLINES[outline]
    return np.asarray((np.abs(uv) ** power).sum(axis=1) ** (1.0 / power))


def check_size(size: npt.ArrayLike) -> Array:
    """Return width and height (2,) of one length or two, or raise an error."""
    lengths = finite("size", size)
    if lengths.shape not in ((), (2,)) or not (lengths > 0.0).all():
        raise ParameterError(f"size must be a length, or width and height, greater than 0, received {size!r}.")
    return np.broadcast_to(lengths, 2)


@dataclass(frozen=True)
class Compression:
    """A strength set by the skin under the pattern: 0 up to a compression of `low`, 1 from `full` on.

    Attributes
    ----------
    low, full : float
        Share by which the skin is shortened, on average over the region.
    along : tuple of float, optional
        Direction in which it is measured; default: that of the largest compression at each point.

    Examples
    --------
    >>> Compression(low=0.0, full=0.25)(0.125)
    0.5
    """

    low: float = 0.03
    full: float = 0.2
    along: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        check_range("low", self.low, -10.0, 1.0)
        check_range("full", self.full, self.low + 1e-9, 1.0, "It has to be above low.")
        if self.along is not None and not np.any(vector("along", self.along)):
            raise ParameterError("along must be a direction, received three zeros.")

    def __call__(self, epsilon: float) -> float:
        """Return the strength at a compression."""
        return float(smoothstep((epsilon - self.low) / (self.full - self.low)))


class RegionCompression:
    """Mean compression of the skin under a region, whatever its triangles.

    Parameters
    ----------
    face : Face
    laid : LaidRegion
        The region on it.
    along : tuple of float, optional
        See :class:`Compression`.
    """

    def __init__(self, face: Face, laid: LaidRegion, along: tuple[float, float, float] | None) -> None:
        inside = laid.base_window
        if not inside.any():
            inside[laid.corners] = 1.0
        points = face.points_mm
        self._at = np.flatnonzero(inside)
        share = inside * vertex_areas(points, face.triangles)
        self._share, self._metric = share[self._at] / share.sum(), StrainField.of(face).metric[self._at]
        self._normals = face.normals[self._at]
        self._along = None if along is None else np.asarray(along, dtype=np.float64)

    def at(self, strain: Array) -> float:
        """Return the compression at a strain (n0, 6) of the base mesh."""
        if self._along is None:
            epsilon, _ = principal_compression(strain[self._at], self._metric, self._normals)
        else:
            epsilon = compression_along(strain[self._at], self._metric, self._normals, self._along)
        return float(self._share @ epsilon)
