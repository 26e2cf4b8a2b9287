"""Surfaces as arrays, with what their files tell of them, between the door of the package and its meshes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pyvista as pv
from scipy.sparse import csr_array

from ..array_types import Array, BoolArray, IntArray
from ..geometry import connected
from .arrays import (
    ARRAYS,
    COLORS,
    CORNERS,
    FIELDS,
    GAZE,
    OF_PART,
    PART,
    PARTS,
    TEXTURE,
    blended,
    is_frame,
    joined,
    joined_texture,
    set_texture,
    to_polydata,
)

PIECES = "facewrinkle: pieces"
"""The cell data of a PolyData that number its pieces, and the field data that list them."""

MOVED = "facewrinkle: moved"
"""The point data of a PolyData with the shapes of its surface, blended."""


class Piece(NamedTuple):
    """What a file tells of the triangles of one mesh with one material.

    Attributes
    ----------
    mesh : int
        Number of the mesh: the materials of a mesh of a glTF file, and the materials of a group of an OBJ file, are
        several pieces.
    name : str
        What the file calls them: several names with "/" between them, the most telling first. Group, object and
        material of an OBJ file; node, mesh and material of a glTF file; a USD prim and those above it.
    image : str
        The image on them: a file, `a.glb#3` for one in a glTF file, `a.usdz[b.png]` for one in a USD package; "" for
        none. See :func:`facewrinkle.mesh.formats.polygons.tinted` for images that are multiplied by a color.

    Examples
    --------
    >>> Piece(2, "lips", "lips.png")
    Piece(mesh=2, name='lips', image='lips.png')
    """

    mesh: int = 0
    name: str = ""
    image: str = ""


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles, the user's own data on them, and what their file tells of them.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    texture : ndarray, shape (m, 3, 2), optional
        At the corners of the triangles, with v upwards.
    point_data : mapping of str to ndarray, shape (n,) or (n, k)
        Arrays of the user's own, by any name, and colors, see :func:`facewrinkle.mesh.has_colors`.
    field_data : mapping of str to array_like
        The user's own, too.
    active : tuple of str
        Names of the arrays of texture coordinates of the mesh, and of what PyVista colors it by.
    pieces : tuple of Piece
    piece : ndarray of int, shape (m,)
        Which of the pieces each triangle belongs to. Default: the first.
    shapes : ndarray, shape (k, n, 3), optional
        Displacements of the points of an animated mesh. They distinguish seams from borders that touch at rest and part
        as the mesh moves, such as closed lips.
    weights : csr_array, shape (n, b), optional
        Weights of the bones of its skin at each point; they add up to 1.
    source_points : ndarray of int, shape (n,), optional
        Index of each point in the mesh that this one is a part of.
    sheet : ndarray of int, shape (m,)
        Which of several connected sheets each triangle belongs to. Default: the first.
    report : tuple of str
        One sentence for each repair.
    others : Surface, optional
        What came with it and was set apart, by its sheets.

    Examples
    --------
    >>> sheet = Surface.of(pv.Plane(i_resolution=3, j_resolution=1).triangulate())
    >>> sheet = replace(sheet, pieces=(Piece(0, "nose"), Piece(1, "lips", "größe.png")), piece=np.arange(6) // 2 % 2)
    >>> again = Surface.of(sheet.to_polydata())
    >>> again.pieces == sheet.pieces, again.images
    (True, (['größe.png'], array([-1, -1,  0,  0, -1, -1])))
    >>> [again.pieces[number].name for number in again.only([0, 2]).piece]
    ['nose', 'lips']
    """

    points: Array
    triangles: IntArray
    texture: Array | None = None
    point_data: Mapping[str, np.ndarray] = field(default_factory=dict)
    field_data: Mapping[str, Any] = field(default_factory=dict)
    active: tuple[str, str | None] = (TEXTURE, COLORS)
    pieces: tuple[Piece, ...] = (Piece(),)
    piece: IntArray = field(default_factory=lambda: np.zeros(1, np.int64))
    shapes: Array | None = None
    weights: csr_array | None = None
    source_points: IntArray | None = None
    sheet: IntArray = field(default_factory=lambda: np.zeros(1, np.int64))
    report: tuple[str, ...] = ()
    others: Surface | None = None

    def __post_init__(self) -> None:
        for name in ("piece", "sheet"):
            object.__setattr__(self, name, np.broadcast_to(getattr(self, name), len(self.triangles)))

    @classmethod
    def of(cls, mesh: pv.PolyData, triangles: IntArray | None = None) -> Surface:
        """Return a mesh as arrays, without normals, which may be stale, and without what a simulation has written.

        `triangles` (m, 3) are those of its faces where these are not triangles.
        """
        cells = dict(mesh.cell_data) if triangles is None else {}
        triangles = np.array(mesh.regular_faces, dtype=np.int64) if triangles is None else triangles
        data, fields, frame = mesh.point_data, dict(mesh.field_data), is_frame(mesh)
        told = json.loads(str(np.ravel(fields.pop(PIECES, "[]"))[0]))
        pieces = tuple(Piece(int(number), str(name), str(image)) for number, name, image in told)
        piece = np.asarray(cells.get(PIECES))
        if frame and PART in data and PARTS in fields:
            pieces, piece = tuple(map(Piece, range(len(fields[PARTS])))), np.asarray(data[PART])[triangles[:, 0]]
        if piece.shape != (len(triangles),) or not np.isin(piece, range(len(pieces))).all():
            pieces, piece = (Piece(),), np.zeros(1)
        uv = data.active_texture_coordinates_name
        texture = None if uv is None else np.asarray(data[uv], np.float64)[triangles][..., :2]
        if CORNERS in cells and cells[CORNERS].shape == (len(triangles), 6):
            texture = np.array(cells[CORNERS], np.float64).reshape(-1, 3, 2)
        stale = {data.active_normals_name, "Normals", uv, MOVED}
        if frame:
            stale |= {*ARRAYS, PART}
            fields = {
                name: a for name, a in fields.items() if name not in FIELDS and not name.startswith((GAZE, OF_PART))
            }
        return cls(
            np.array(mesh.points, np.float64),
            triangles,
            texture,
            {name: np.array(values) for name, values in data.items() if name not in stale},
            fields,
            (uv or TEXTURE, data.active_scalars_name),
            pieces,
            piece.astype(np.int64),
            np.array(data[MOVED])[None] if MOVED in data else None,
        )

    @cached_property
    def mesh(self) -> pv.PolyData:
        """The mesh, with the data of the user."""
        mesh, (texture, scalars) = to_polydata(self.points, self.triangles, self.point_data), self.active
        if self.texture is not None:
            set_texture(mesh, self.texture, texture)
        if scalars in self.point_data:
            mesh.point_data.active_scalars_name = scalars
        mesh.field_data.update(dict(self.field_data))
        return mesh

    def to_polydata(self) -> pv.PolyData:
        """Return the mesh with arrays of what its file tells, which :meth:`of` takes off."""
        mesh = self.mesh.copy(deep=False)
        if self.pieces != (Piece(),):
            mesh.cell_data[PIECES], mesh.field_data[PIECES] = self.piece, [json.dumps(self.pieces)]
        if self.shapes is not None:
            mesh.point_data[MOVED] = blended(self.shapes)
        return mesh

    def mapped(self, triangles: IntArray, kept: IntArray, rows: IntArray | BoolArray | slice = slice(None)) -> Surface:
        """Return other triangles (k, 3), with the data of the triangles `rows`, on the points `kept`."""
        return replace(
            self,
            points=self.points[kept],
            triangles=triangles,
            texture=None if self.texture is None else self.texture[rows],
            point_data={name: values[kept] for name, values in self.point_data.items()},
            piece=self.piece[rows],
            shapes=None if self.shapes is None else self.shapes[:, kept],
            source_points=kept if self.source_points is None else self.source_points[kept],
            sheet=self.sheet[rows],
        )

    def only(self, rows: IntArray | BoolArray) -> Surface:
        """Return some of the triangles, on the points that they use."""
        kept, triangles = np.unique(self.triangles[rows], return_inverse=True)
        return self.mapped(triangles.reshape(-1, 3), kept, rows)

    def without_images(self) -> Surface:
        """Return the surface with texture coordinates, and no images for them."""
        return replace(self, pieces=tuple(piece._replace(image="") for piece in self.pieces))

    @property
    def images(self) -> tuple[list[str], IntArray]:
        """All images, and the number (m,) of the one on each triangle, -1 for none."""
        names = sorted({piece.image for piece in self.pieces} - {""}) if self.texture is not None else []
        number = [names.index(piece.image) if piece.image in names else -1 for piece in self.pieces]
        return names, np.array(number)[self.piece]

    @property
    def meshes(self) -> IntArray:
        """Numbers (m,) of the meshes of the file. Those that share points are one: groups may be regions of a surface.

        Meshes are never joined at their borders, as the lining of a mouth shares its rim with the lips.
        """
        known, owner = np.unique([piece.mesh for piece in self.pieces], return_inverse=True)
        corner, owner = self.triangles.ravel(), np.repeat(owner[self.piece], 3)
        first = np.full(len(self.points), -1)
        first[corner[::-1]] = owner[::-1]
        label = connected(np.stack([owner, first[corner]], axis=1), len(known))
        return np.asarray(label[owner[::3]])


def merged(surfaces: Sequence[Surface], *, of_one_file: bool = False) -> Surface:
    """Return several surfaces as one, with the point data that all of them have, and with texture if one has it.

    Those `of_one_file` may be of the same mesh; others are not, whatever the numbers of their meshes.
    """
    if len(surfaces) == 1:
        return surfaces[0]
    every = [surface.point_data for surface in surfaces]
    names = []
    for name in dict.fromkeys(name for data in every for name in data):
        known = [data[name].shape[1:] for data in every if name in data]
        if len(set(known)) == 1 and (len(known) == len(every) or name == COLORS):
            names.append(name)
    arrays = joined([(own.points, own.triangles, own.point_data) for own in surfaces], names, {COLORS: 255})
    texture = joined_texture([own.texture for own in surfaces], [len(own.triangles) for own in surfaces])
    count = max(0 if own.shapes is None else len(own.shapes) for own in surfaces)
    shapes = np.zeros((count, len(arrays[0]), 3))
    ends = np.cumsum([len(own.points) for own in surfaces])
    pieces: list[Piece] = []
    piece, mesh = [], 0
    for own, moved in zip(surfaces, np.split(shapes, ends[:-1], axis=1), strict=True):
        if own.shapes is not None:
            moved[: len(own.shapes)] = own.shapes
        piece.append(own.piece + len(pieces))
        pieces += [each._replace(mesh=each.mesh + mesh) for each in own.pieces]
        mesh = 0 if of_one_file else 1 + max(each.mesh for each in pieces)
    return Surface(
        *arrays[:2],
        texture,
        arrays[2],
        pieces=tuple(pieces),
        piece=np.concatenate(piece),
        shapes=shapes if count else None,
    )
