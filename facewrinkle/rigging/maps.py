"""Maps: the wrinkles of an expression as pictures, for meshes that are too coarse to hold them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import distance_transform_edt, gaussian_filter

from ..anatomy import Face, Mixture
from ..appearance.flush import flush
from ..array_types import Array, IntArray
from ..errors import ParameterError, check_range, check_whole, warn
from ..export import write_mesh
from ..export.model import Model, png_of, skin_model
from ..files import write_whole
from ..geometry import barycentric, rasterize, smoothstep, unit, vertex_areas
from ..layers.base import Layer
from ..mesh.arrays import corner_texture, in_bytes, rest_of
from ..simulation import Refinement, Simulation

FOLDED = 0.03
"""Wrinkles of a shape that are nowhere deeper than this, mm, are left out; below half of it, normals are flat."""

CHART_CENTRE = np.array([0.0, -0.5, -1.0])
"""Middle of the head, [left, up, forward] from between the eyes, around which the chart of the face is laid, in
distances between the pupils.
"""


@dataclass(frozen=True, eq=False)
class Maps:
    """Maps of an expression, on the texture coordinates of a face; the first row is the uppermost.

    Attributes
    ----------
    normal : ndarray of uint8, shape (h, w, 3)
        Normals of the wrinkles in the tangent space of the smooth skin in this expression, green upwards (+Y, as in
        OpenGL, glTF, Blender and Unity).
    height : ndarray of uint16, shape (h, w)
        Heights of the wrinkles from -`most` to `most` mm; 32768 is none.
    flush : ndarray of uint8, shape (h, w, 3)
        Factors of the skin's color, 255 for 1: gathered skin reddens; see :func:`facewrinkle.appearance.flush.flush`.
    most : float
        Of the heights, mm.
    smooth : PolyData
        The skin in this expression without wrinkles, with the texture coordinates of the maps.
    rest : PolyData
        The same at rest.
    covered : ndarray of bool, shape (h, w)
        Texels that lie on the skin.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> maps = bake_maps(fw.default_face(), "surprise", size=64)
    >>> maps.height.shape, maps.height.dtype.name, bool(0.2 < maps.covered.mean() < 1.0)
    ((64, 64), 'uint16', True)
    """

    normal: npt.NDArray[np.uint8]
    height: npt.NDArray[np.uint16]
    flush: npt.NDArray[np.uint8]
    most: float
    smooth: pv.PolyData
    rest: pv.PolyData
    covered: npt.NDArray[np.bool_]


def bake_maps(
    face: Face,
    expression: Mixture,
    *,
    intensity: float = 1.0,
    size: int = 1024,
    layers: Sequence[Layer] | None = None,
) -> Maps:
    """Bake the wrinkles of an expression into maps for the face's own triangles.

    Each texel's place on the refined skin is known, as its triangles lie in those of the face: nothing is searched for
    along rays, which go astray at lips and lids.

    Parameters
    ----------
    face : Face
        With texture coordinates in [0, 1]. Without any, those of a chart around the head are made: the whole face lies
        on it once; what is behind lips and in nostrils is not drawn.
    expression : str or mapping
        As for :meth:`facewrinkle.Simulation.express`.
    intensity : float
    size : int
        Width and height, texels.
    layers : sequence of Layer, optional
        Default: the folds of a :class:`facewrinkle.Simulation`.

    Returns
    -------
    Maps

    Raises
    ------
    ParameterError
        For texture coordinates outside [0, 1], and sizes that are no power of two from 64 to 8192.

    Warns
    -----
    FaceWrinkleWarning
        If triangles overlap on the texture.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> maps = bake_maps(fw.default_face(), "surprise", size=256)
    >>> maps.normal.shape, maps.most > 0.1
    ((256, 256, 3), True)
    """
    size = check_map_size(size)
    check_range("intensity", intensity, 0.0, 1.0)
    check_texture(face)
    wrinkled = Simulation(face, layers=layers)
    bare = Simulation(face, Refinement(max_level=0), layers=[], motion=wrinkled.motion)
    wrinkled.express(expression, intensity)
    fine, rest = wrinkled.settle(), face.mesh.copy()
    bare.contract(dict(zip(wrinkled.muscles, wrinkled.motion.rates.tolist(), strict=True)))
    smooth = bare.settle()
    folds = FoldMaps(face, fine, smooth, size)
    height, normal, _ = folds.of(fine, smooth)
    state = face.state_of(smooth)
    blood = folds.on_skin(flush(face, state.to_rest(state.points)))
    smooth = charted(smooth, face)
    if corner_texture(face.mesh) is None:
        rest.active_texture_coordinates = around_head(face, face.points)
    most = max(float(np.abs(height).max()), 1e-6)
    return Maps(
        folds.filled(in_bytes(0.5 + 0.5 * normal)),
        folds.filled(heights_as_integers(height, most)),
        folds.filled(in_bytes(blood)),
        most,
        smooth,
        rest,
        folds.covered,
    )


def check_texture(face: Face) -> None:
    """Raise a ParameterError for texture coordinates outside [0, 1], where no map can be."""
    own = corner_texture(face.mesh)
    if own is not None and (own.min() < -1e-6 or own.max() > 1.0 + 1e-6):
        raise ParameterError(
            f"maps need texture coordinates in [0, 1], received some from {own.min():.3g} to {own.max():.3g}. "
            "Move the islands of all tiles into one, or cut the mesh by tiles."
        )


def check_map_size(size: int, largest: int = 8192, remedy: str = "Maps are squares.") -> int:
    """Return the width of a map, a power of two from 64 to the largest; raise a ParameterError for another."""
    size = check_whole("the size of a map", size, 64, largest, remedy)
    if size & (size - 1):
        raise ParameterError(f"the size of a map must be a power of two from 64 to {largest}, received {size}.")
    return size


def around_head(face: Face, points: Array) -> Array:
    """Return places (n, 2) on a chart: directions from the middle of the head, in Lambert's azimuthal projection."""
    local = unit(face.frame.local(points) - CHART_CENTRE)
    half = 0.5 / np.sqrt(2.0 * np.maximum(1.0 + local[:, 2:], 1e-6))
    return np.asarray(0.5 + np.clip(0.999 * half * local[:, :2], -0.5, 0.5))


def visible_first(mesh: pv.PolyData, face: Face) -> pv.PolyData:
    """Return a mesh on the chart whose outer triangles come last, so that these are drawn over the ones behind.

    First come those that are turned over on the chart, undersides, and the few at the back of the head around the place
    that the rim of the chart is: their corners lie all around it, and they far from the middle of these.
    """
    triangles, chart = np.asarray(mesh.regular_faces), np.asarray(mesh.active_texture_coordinates)
    rest = np.asarray(mesh.point_data["rest"])
    away = np.linalg.norm(face.frame.local(rest) - CHART_CENTRE, axis=1)
    first, second = (chart[triangles[:, k]] - chart[triangles[:, 0]] for k in (1, 2))
    turned = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] <= 0.0
    middle = around_head(face, rest[triangles].mean(axis=1))
    torn = np.linalg.norm(middle - chart[triangles].mean(axis=1), axis=1) > 0.02  # at the tear of the chart
    out = mesh.copy()
    out.regular_faces = triangles[np.lexsort([away[triangles].mean(axis=1), ~(turned | torn)])]
    return out


class Texels:
    """The texels that the triangles of a mesh cover.

    Parameters
    ----------
    corners : ndarray, shape (m, 3, 2)
        Texture coordinates, v upwards.
    size : int

    Examples
    --------
    >>> texels = Texels(np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]), 2)
    >>> texels.of(np.array([[0, 1, 2]]), np.array([0.0, 1.0, 2.0])).round(2)
    array([[1.75, 0.  ],
           [0.75, 1.25]])
    """

    def __init__(self, corners: Array, size: int) -> None:
        # The first row of a picture is the uppermost. Where several triangles lie, the last one is seen.
        places = corners.reshape(-1, 2) * [size, -size] + [-0.5, size - 0.5]
        (x, y), rows = np.ascontiguousarray(places.T), np.arange(len(places), dtype=np.int32).reshape(-1, 3)
        self.triangle, first = np.full((2, size, size), -1, np.int32)
        for order, numbers in ((rows // 3, self.triangle), (-(rows // 3), first)):
            depth = np.full((size, size), -np.inf)
            rasterize(x, y, order.ravel().astype(np.float64), rows, -np.inf, np.inf, 0, numbers, depth)
        self.covered = self.triangle >= 0
        self.several = self.covered & (self.triangle != first)
        row, column = np.nonzero(self.covered)
        corners_here = places.reshape(-1, 3, 2)[self.triangle[self.covered]]
        self.shares = np.zeros((size, size, 3))
        self.shares[self.covered] = barycentric(
            np.stack([column, row, np.zeros_like(row)], axis=1), np.pad(corners_here, ((0, 0), (0, 0), (0, 1)))
        )

    @property
    def shared(self) -> float:
        """Share of the covered texels on which several triangles lie."""
        return float(self.several[self.covered].mean()) if self.covered.any() else 0.0

    def of(self, triangles: IntArray, values: Array) -> Array:
        """Return values (n, ...) of vertices, interpolated at the texels, 0 where there is no triangle."""
        out = np.zeros((*self.triangle.shape, *values.shape[1:]))
        out[self.covered] = self.at(self.covered, triangles, values)
        return out

    def at(self, where: npt.NDArray[np.bool_], triangles: IntArray, values: Array) -> Array:
        """Return values (n, ...) of vertices, interpolated at some of the covered texels, a row for each."""
        chosen = values[triangles[self.triangle[where]]]
        return np.asarray(np.einsum("tc,tc...->t...", self.shares[where], chosen))


class FoldMaps:
    """The wrinkles of a face on the texels of its texture, or of a chart, in frames of always the same triangles.

    Parameters
    ----------
    face : Face
    fine, smooth : PolyData
        Frames with wrinkles, and without any on the face's own triangles.
    size : int
        Width and height, texels.

    Attributes
    ----------
    covered : ndarray of bool, shape (h, w)
        Texels that lie on the skin.

    Warns
    -----
    FaceWrinkleWarning
        If triangles overlap on the texture.
    """

    def __init__(self, face: Face, fine: pv.PolyData, smooth: pv.PolyData, size: int) -> None:
        self.face = face
        fine, smooth = charted(fine, face), charted(smooth, face)
        self._texels, self._below = (Texels(_corners(mesh), size) for mesh in (fine, smooth))
        if self._below.shared > 0.02 and corner_texture(face.mesh) is not None:
            warn(
                f"on {100.0 * self._below.shared:.0f} % of the texture several triangles lie on each other, such as "
                "halves that share a place: the maps hold one of them. Lay the islands side by side for both."
            )
        self._triangles, self._base = (np.asarray(mesh.regular_faces, np.int64) for mesh in (fine, smooth))
        self.covered = self._texels.covered & self._below.covered
        distance, nearest = distance_transform_edt(~self.covered, return_indices=True)
        self._nearest = tuple(np.where(distance > 16.0, np.indices(self.covered.shape), nearest))
        area = vertex_areas(np.asarray(face.points, np.float64), self._base).sum() * face.unit**2
        self._per_texel = float(np.sqrt(area / max(self._below.covered.sum(), 1)))

    def of(self, fine: pv.PolyData, smooth: pv.PolyData) -> tuple[Array, Array, Array]:
        """Return the wrinkles of a frame: heights (h, w), mm, normals (h, w, 3) in tangent space, and depths (h, w).

        The depth is the root mean square of the heights around, mm. Where it is next to nothing, normals differ by
        refinement alone, as on the rolled edge of lips, and are left flat.
        """
        fine, smooth = charted(fine, self.face), charted(smooth, self.face)
        height = np.where(self.covered, self._texels.of(self._triangles, np.asarray(fine["W"], np.float64)), 0.0)
        turning, folding = np.zeros(fine.n_points, bool), np.asarray(fine["W"], bool)
        turning[self._triangles[folding[self._triangles].any(axis=1)]] = True  # elsewhere both have the same normals
        folded = self.covered & np.asarray(turning[self._triangles].any(axis=1))[self._texels.triangle]
        normal = np.tile([0.0, 0.0, 1.0], (*height.shape, 1))
        turned = self._texels.at(folded, self._triangles, np.asarray(fine.point_data["Normals"], np.float64))
        normal[folded] = in_tangent_space(turned, folded, self._below, skin_model(smooth, None))
        depth = np.sqrt(np.maximum(2.0 * self.blurred(height**2), 0.0))
        flat = np.array([0.0, 0.0, 1.0])
        normal = flat + smoothstep(depth / FOLDED - 0.5)[..., None] * (normal - flat)
        return height, unit(normal), depth

    def on_skin(self, values: Array) -> Array:
        """Return values (n,) of the vertices of the face at the texels (h, w), 0 where there is no skin."""
        return self._below.of(self._base, values)

    def blurred(self, values: Array) -> Array:
        """Return values (h, w) averaged over the skin around each place, with a standard deviation of 1.2 mm."""
        return np.asarray(gaussian_filter(values, 1.2 / self._per_texel))

    def filled(self, pixels: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return pixels (h, w, ...) with 16 texels around each island that have the nearest value.

        Filters and small versions of a map need them.
        """
        return pixels[self._nearest]


def charted(frame: pv.PolyData, face: Face) -> pv.PolyData:
    """Return a frame with the texture coordinates of the maps: those of the face, or of a chart around the head."""
    if corner_texture(face.mesh) is not None:
        return frame
    frame = frame.copy(deep=False)
    rest = rest_of(frame)
    frame.active_texture_coordinates = around_head(face, rest)
    return visible_first(frame, face)


def _corners(mesh: pv.PolyData) -> Array:
    corners = corner_texture(mesh)
    assert corners is not None
    return corners


def in_tangent_space(normals: Array, where: npt.NDArray[np.bool_], texels: Texels, model: Model) -> Array:
    """Return normals (t, 3) of texels relative to the frames of a smooth mesh that programs make from its texture."""
    assert model.uv is not None
    tangent, sign = tangents_of(model)
    shading, along = texels.at(where, model.triangles, model.normals), texels.at(where, model.triangles, tangent)
    across = np.cross(shading, along) * np.sign(texels.at(where, model.triangles, sign))[:, None]
    return unit(np.stack([(axis * normals).sum(axis=1) for axis in (along, across, shading)], axis=1))


def tangents_of(model: Model) -> tuple[Array, Array]:
    """Return unit tangents (n, 3) along u, and the sign (n,) of ``normal × tangent`` along v, of the vertices.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> up, one = np.tile([0.0, 0, 1], (3, 1)), np.array([[0, 1, 2]])
    >>> tangent, sign = tangents_of(Model(points, up, one, np.arange(3), points[:, :2], None, None))
    >>> tangent[0].tolist(), float(sign[0])
    ([1.0, 0.0, 0.0], 1.0)
    """
    assert model.uv is not None
    p, uv = model.points[model.triangles], model.uv[model.triangles]
    e1, e2, d1, d2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    turned = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    side = np.sign(turned)[:, None]
    ways = side * (d2[:, 1:] * e1 - d1[:, 1:] * e2), side * (d1[:, :1] * e2 - d2[:, :1] * e1)
    sums = np.zeros((2, *model.points.shape))
    for total, way in zip(sums, ways, strict=True):
        np.add.at(total, model.triangles.T.ravel(), np.tile(unit(way), (3, 1)))
    tangent = unit(sums[0] - (sums[0] * model.normals).sum(axis=1, keepdims=True) * model.normals)
    sign = np.where((np.cross(model.normals, tangent) * sums[1]).sum(axis=1) < 0.0, -1.0, 1.0)
    return tangent, sign


def heights_as_integers(height: Array, most: float) -> npt.NDArray[np.uint16]:
    """Return heights from -`most` to `most` as 16 bits; 32768 is none."""
    return np.rint(32768.0 + 32767.0 * np.clip(height / most, -1.0, 1.0)).astype(np.uint16)


def write_maps(maps: Maps, path: str | Path) -> list[Path]:
    """Write maps as PNG files, the smooth mesh that they belong to, at rest, as OBJ, and what the numbers mean as JSON.

    Parameters
    ----------
    maps : Maps
    path : path
        Beginning of the names: ``brows`` makes ``brows_normal.png``, ``brows_height.png`` and so on.

    Returns
    -------
    list of pathlib.Path

    Raises
    ------
    OutputError
        If a file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import facewrinkle as fw
    >>> maps = bake_maps(fw.default_face(), "surprise", size=64)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [file.name for file in write_maps(maps, Path(folder) / "brows")][:3]
    ['brows_normal.png', 'brows_height.png', 'brows_flush.png']
    """
    path = Path(path)
    pictures = [
        write_whole(path.with_name(f"{path.name}_{name}.png"), png_of(getattr(maps, name)))
        for name in ("normal", "height", "flush")
    ]
    mesh = write_mesh(maps.rest, path.with_name(f"{path.name}_maps.obj"))
    facts = json.dumps(conventions(maps.most) | {"flush": {"factor_at_255": 1}}, indent=2) + "\n"
    return [*pictures, mesh, write_whole(path.with_name(f"{path.name}_maps.json"), facts)]


def conventions(most: float) -> dict[str, dict[str, Any]]:
    """Return what the numbers of normals and heights mean; heights reach up to the `most`, mm."""
    return {
        "normal": {"space": "tangent", "green": "up"},
        "height": {"mm_at_65535": most, "mm_at_0": -most, "zero": 32768},
    }
