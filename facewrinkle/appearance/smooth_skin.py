"""The skin as it is drawn: the smooth surface through the vertices of the face, in triangles too small to be seen."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pyvista as pv

from ..anatomy import Face, per_face
from ..array_types import Array, IntArray
from ..geometry import barycentric, interpolated, normalize, openness, vertex_normals
from ..geometry.smooth_split import SmoothSplit, lifted, smooth_split
from ..mesh.arrays import CORNERS, closest_places, is_frame, rest_of, to_polydata, use_texture

LONGEST, BEND, SAGITTA = 8.0, np.radians(5.0), 0.06
"""Longer edges are split, mm on a face of average size, as are those that turn by more, radians, if the arc over them
rises by more than the last, mm: less than a pixel of a portrait."""


class SmoothSkin:
    """The smooth surface of a frame.

    New vertices of a frame lie on the flat triangles of the face: they are lifted onto the smooth surface, and edges
    that would be seen are split. What is split depends on the face at rest alone, so that it stays as the skin moves.

    Parameters
    ----------
    face : Face
    skin : PolyData
        A frame with normals, or the mesh of the face. Not changed.
    pose : ndarray, shape (4, 4), optional
        Motion of the head as a whole.

    Attributes
    ----------
    split : SmoothSplit
    points, normals : ndarray, shape (n, 3)
        Of its vertices; those of the frame come first.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> from facewrinkle.mesh import with_normals
    >>> face = fw.default_face()
    >>> smooth = SmoothSkin(face, with_normals(face.mesh))
    >>> smooth.split.triangles.shape[0] > 3 * face.triangles.shape[0]
    True
    """

    def __init__(self, face: Face, skin: pv.PolyData, pose: Array | None = None) -> None:
        self._face, self._skin, self._pose = face, skin, np.eye(4) if pose is None else pose
        self._on_base = corners, shares = on_base(face, skin)
        key = skin.n_points, skin.regular_faces.tobytes(), corners.tobytes()
        self.split = per_face(face, "smooth skin", key, lambda: _split(face, skin, corners, shares))
        self.points, self.normals = self.split.places(
            lifted_points(face, skin, corners, shares), np.asarray(skin.point_data["Normals"], np.float64)
        )

    @cached_property
    def mesh(self) -> pv.PolyData:
        """The surface with normals, texture coordinates, and heights and places at rest if it is that of a frame."""
        skin, split = self._skin, self.split
        texture = skin.point_data.active_texture_coordinates_name
        names = [name for name in ("rest", "level", "W", texture) if name is not None and name in skin.point_data]
        data = {name: split.values(np.asarray(skin.point_data[name])) for name in names}
        mesh = to_polydata(self.points, split.triangles, {**data, "Normals": self.normals}, copy=False)
        mesh.SetFieldData(skin.GetFieldData())
        if texture is not None:
            use_texture(mesh, texture)
        mesh.point_data.active_normals_name = "Normals"
        if CORNERS in skin.cell_data:
            corners = np.asarray(skin.cell_data[CORNERS]).reshape(-1, 3, 2)[split.parent]
            mesh.cell_data[CORNERS] = np.einsum("mck,mkd->mcd", split.shares, corners).reshape(-1, 6)
        return mesh

    @property
    def on_head(self) -> tuple[Array, Array]:
        """Points and normals of the vertices on the head at rest."""
        turn, shift = self._pose[:3, :3], self._pose[:3, 3]
        return (self.points - shift) @ turn, self.normals @ turn

    @cached_property
    def occluder(self) -> tuple[Array, IntArray]:
        """Points and triangles, on the head at rest, of what casts shadows: the face's own mesh now, and hair."""
        base, triangles, hair = self._base, self._face.triangles, _hair_of(self._face)
        if hair is None:
            return base, triangles
        return np.concatenate([base, hair[0]]), np.concatenate([triangles, hair[1] + len(base)])

    @cached_property
    def _base(self) -> Array:
        """The vertices (n0, 3) of the face on the head at rest."""
        base = np.asarray(self._skin.points, np.float64)[: len(self._face.points)]
        return (base - self._pose[:3, 3]) @ self._pose[:3, :3]

    @cached_property
    def openness(self) -> Array:
        """Share (n,) of the light from all sides that reaches the vertices."""
        base = self._base  # many pictures are of one frame
        return self.from_base(per_face(self._face, "openness", base.tobytes(), lambda: open_to(self._face, base)))

    def from_base(self, values: Array) -> Array:
        """Values (n, ...) at all vertices by those (n0, ...) at the vertices of the face."""
        corners, shares = self._on_base
        return self.split.values(np.concatenate([values, np.einsum("kc...,kc->k...", values[corners], shares)]))


def open_to(face: Face, points: Array) -> Array:
    """Share (n0,) of the light from all sides that reaches the vertices of a face when they are at `points` (n0, 3)."""
    step, upright = 2.0 * face.frame.scale, vertex_normals(points, face.triangles)  # rays are 2 mm wide
    out, hair = openness(points, upright, (points, face.triangles), step=step), _hair_of(face)
    if hair is None:
        return out
    # Hair hangs from the skull: what it hides stays the same.
    return out * per_face(face, "below hair", None, lambda: openness(face.points, face.normals, hair, step=step))


def _hair_of(face: Face) -> tuple[Array, IntArray] | None:
    """Points and triangles of the hair that hangs from a head."""
    if "hair" not in face.parts:
        return None
    mesh = face.parts["hair"].mesh
    return np.asarray(mesh.points, np.float64), np.asarray(mesh.regular_faces)


def on_base(face: Face, skin: pv.PolyData) -> tuple[IntArray, Array]:
    """Corners and shares (n - n0, 3) of the new vertices of a frame in the triangles of a face on which they lie."""
    places = rest_of(skin)[len(face.points) :]
    known = "host" in skin.point_data and is_frame(skin)
    host = np.asarray(skin.point_data["host"] if known else np.empty(0, np.int32))[len(face.points) :]
    if len(places) and (not known or host.max() >= len(face.triangles)):  # not a frame, or one of another mesh
        host = closest_places(face.mesh, places)[0]
    corners = face.triangles[host]
    return corners, barycentric(places, face.points[corners])


def lifted_points(face: Face, skin: pv.PolyData, corners: IntArray, shares: Array) -> Array:
    """Return the points (n, 3) of a frame, those :func:`on_base` lifted by the bare smooth surface."""
    points = np.asarray(skin.points, np.float64)
    if not len(corners):
        return points
    base, triangles = points[: len(face.points)], face.triangles
    heights = np.asarray(skin.point_data.get("W", np.zeros(len(base))))[: len(base), None] / face.unit
    bare = base - heights * vertex_normals(base, triangles)
    upright = vertex_normals(bare, triangles)
    return np.concatenate([base, lifted(points[len(base) :], bare[corners], upright[corners], shares)])


def _split(face: Face, skin: pv.PolyData, corners: IntArray, shares: Array) -> SmoothSplit:
    """What is split of a frame, by the face at rest; see :func:`on_base`."""
    upright, scale = face.normals, face.frame.scale
    places = lifted(rest_of(skin)[len(face.points) :], face.points[corners], upright[corners], shares)
    normals = np.concatenate([upright, interpolated(upright, corners, shares)])
    normalize(normals)
    return smooth_split(
        np.concatenate([face.points, places]),
        normals,
        np.asarray(skin.regular_faces),
        longest=LONGEST * scale,
        bend=BEND,
        sagitta=SAGITTA * scale,
    )
