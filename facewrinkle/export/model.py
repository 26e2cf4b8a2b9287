"""Meshes as other programs take them: one normal and one place in the texture for each vertex; and blend shapes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import BytesIO
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from ..array_types import Array, Image, IntArray, Single
from ..errors import MeshError, ParameterError, check_type
from ..geometry.normals import vertex_normals
from ..mesh import COLORS, has_colors, in_bytes, split_at_seams, with_normals

WATER_INDEX, WATER_OPACITY = 1.33, 0.3
"""Refractive index of tears, and their opacity in programs that do not refract."""


@dataclass(frozen=True)
class Model:
    """A mesh whose vertices have one normal and one place in the texture each.

    Attributes
    ----------
    points, normals : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    origin : ndarray of int, shape (n,)
        Vertex of the frame that each vertex comes from; the frame's own come first, then their twins at texture seams.
    uv : ndarray, shape (n, 2), optional
        Texture coordinates, v upwards.
    colors : ndarray of uint8, shape (n, 3), optional
    png : bytes, optional
        The texture; in glTF it may also be a JPEG.
    cutout : bool
        Draw nothing where the texture is transparent.
    water : bool
        Draw the mesh as water.
    """

    points: Array
    normals: Array
    triangles: IntArray
    origin: IntArray
    uv: Array | None
    colors: Image | None
    png: bytes | None
    cutout: bool = False
    water: bool = False


@dataclass(frozen=True, eq=False)
class Morphs:
    """Blend shapes of one mesh.

    Attributes
    ----------
    names : sequence of str
        Names of the k shapes.
    deltas, normals : ndarray of float32, shape (k, n, 3)
        What is added to points and normals at weight 1.
    drivers : mapping of str to sequence of str
        Shapes whose weight is the product of the weights of others; written beside the names, for programs that ask.

    Examples
    --------
    One shape that moves one of three points:

    >>> deltas = np.zeros((1, 3, 3), np.float32)
    >>> deltas[0, 2] = [0.0, 1.0, 0.0]
    >>> morphs = Morphs(["up"], deltas, np.zeros_like(deltas))
    """

    names: Sequence[str]
    deltas: Single
    normals: Single
    drivers: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class WeightTrack:
    """Weights of shapes over time.

    Attributes
    ----------
    times : ndarray, shape (f,)
        Seconds, rising.
    weights : ndarray, shape (f, k)
    """

    times: Array
    weights: Array


def is_hair(name: str) -> bool:
    """Return True for the name of brows or lashes, painted or the face's own: folds toss their many hairs about.

    Examples
    --------
    >>> is_hair("lashes_l"), is_hair("upper_teeth")
    (True, False)
    """
    return name.split("_")[0] in ("brows", "lashes")


def skin_model(frame: pv.PolyData, face: Face | None) -> Model:
    """Return the skin of a frame, with the texture of its face."""
    check_type("face", face, Face, optional=True)
    shaded, numbers = with_normals(frame), " origin"  # of the vertices, which seams split
    shaded.point_data[numbers] = np.arange(frame.n_points)
    mesh = split_at_seams(shaded)
    uv, texture = mesh.active_texture_coordinates, None if face is None else face.texture
    if texture is not None and uv is None:
        raise MeshError(
            "the face has a texture, and the frame has no texture coordinates by which it would lie on it. Is it a "
            "frame of this face?"
        )
    return Model(
        points=np.asarray(mesh.points, dtype=np.float64),
        normals=np.asarray(mesh.point_data["Normals"], dtype=np.float64),
        triangles=np.asarray(mesh.regular_faces, dtype=np.int64),
        origin=np.asarray(mesh.point_data[numbers]),
        uv=None if uv is None else np.asarray(uv, dtype=np.float64),
        colors=_colors(mesh, COLORS) if has_colors(mesh.point_data) else None,
        png=None if texture is None else png_of(texture),
    )


def part_model(part: pv.PolyData, texture: Image | None = None) -> Model:
    """Return a mesh that is seen beside the skin, colored by its texture, or else by its array `paint`."""
    points, triangles = np.asarray(part.points, np.float64), np.asarray(part.triangulate().regular_faces, np.int64)
    normals = part.point_data.get("Normals")  # an eye has those of its cornea
    return Model(
        points=points,
        normals=vertex_normals(points, triangles) if normals is None else np.asarray(normals),
        triangles=triangles,
        origin=np.arange(len(points)),
        uv=None if texture is None else np.asarray(part.active_texture_coordinates, dtype=np.float64),
        colors=_colors(part, "paint"),
        png=None if texture is None else png_of(texture),
        cutout=texture is not None and texture.shape[2] == 4,
    )


def tears_model(tears: Iterable[pv.PolyData]) -> Model | None:
    """Return all tears as one mesh; None if there are none."""
    surfaces = []
    for tear in tears:
        if not isinstance(tear, pv.PolyData):
            raise ParameterError(f"tears must be surfaces (pyvista.PolyData), received {tear!r} among them.")
        surfaces += [tear] if tear.n_cells else []
    if not surfaces:
        return None
    merged = pv.merge(surfaces, merge_points=False) if len(surfaces) > 1 else surfaces[0]
    return replace(part_model(merged), colors=None, water=True)


def png_of(pixels: npt.NDArray[Any]) -> bytes:
    """Return pixels as the content of a PNG file, those of 16 bits too."""
    from PIL import Image as Pillow

    stream = BytesIO()
    Pillow.fromarray(pixels).save(stream, format="PNG")
    return stream.getvalue()


def _colors(mesh: pv.PolyData, name: str) -> Image | None:
    """Colors (n, 3) of the points, if there are any."""
    colors = mesh.point_data.get(name)
    if colors is None or colors.ndim != 2 or colors.shape[1] < 3:
        return None
    return in_bytes(np.asarray(colors)[:, :3])
