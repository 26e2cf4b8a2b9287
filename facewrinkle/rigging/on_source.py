"""The shapes of a rig on exactly the vertices of the mesh that was given, whatever was mended inside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..array_types import Array, IntArray, Single
from ..errors import ParameterError
from ..files import output_file, written
from ..geometry import BoxTree
from ..mesh import MeshLike, corner_texture, surface_in
from ..progress import bar
from .fields import CUT, Baker, faded, shape_fields
from .linear_rig import Rig
from .maps import around_head
from .poses import Pose


@dataclass(frozen=True, eq=False)
class SourceShapes:
    """Shapes by the vertex numbers of a mesh as it was given; made by :func:`facewrinkle.on_source`.

    Attributes
    ----------
    names : tuple of str
        Names of the k shapes.
    points : ndarray, shape (n, 3)
        The mesh at rest, in its own unit and axes.
    deltas : ndarray of float32, shape (k, n, 3)
        Displacements in each shape, in the same.
    reached : ndarray of bool, shape (n,)
        False where nothing that the rig moves is near, within a tenth of the distance between the pupils: for loose
        points, say. These move with what is nearest.
    unit : float
        Millimeters per unit of the mesh.
    chart : ndarray, shape (n, 2), optional
        Texture coordinates of the rig's maps, if the mesh has none.

    Examples
    --------
    One shape that lifts one of two vertices of a mesh in meters:

    >>> deltas = np.float32([[[0.0, 0, 0], [0, 0, 0.01]]])
    >>> shapes = SourceShapes(("up",), np.eye(2, 3), deltas, np.ones(2, bool), 1000.0)
    >>> float(np.abs(shapes.deltas[0]).max() * shapes.unit)
    10.0
    """

    names: tuple[str, ...]
    points: Array
    deltas: Single
    reached: npt.NDArray[np.bool_]
    unit: float
    chart: Array | None = None

    def save(self, path: str | Path) -> Path:
        """Write all as arrays of NumPy (.npz), called as the attributes are.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        path = output_file(path, (".npz",))
        with written(path) as whole, open(whole, "wb") as file:
            np.savez(file, **{name: value for name, value in vars(self).items() if value is not None})
        return path


def on_source(rig: Rig, mesh: MeshLike) -> SourceShapes:
    """Return the shapes of a rig on the vertices of the mesh that its face was fitted to.

    Vertices that repair has kept have the displacement that they have in the rig; merged twins that of each other; and
    all others that of the nearest place of the skin. Eyes, teeth, lashes and hair move by their own vertices, also
    where the rig shows painted ones in their place.

    Parameters
    ----------
    rig : Rig
        Of any level; level 0 makes nothing that is not used here.
    mesh : MeshLike
        What :func:`facewrinkle.fit_face` was given; see :func:`facewrinkle.read_surface` for the numbers of its
        vertices. (Those of OBJ, OFF and PLY files are as in the file; of glTF, points that seams split are one.)

    Returns
    -------
    SourceShapes

    Raises
    ------
    ParameterError
        If the face of the rig was made of another mesh.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> head = fw.default_face()
    >>> face = fw.fit_face(head.mesh, head.landmarks)
    >>> shapes = on_source(fw.rig(face, "jawOpen", wrinkles="none", level=0), head.mesh)
    >>> shapes.deltas.shape == (1, head.mesh.n_points, 3), bool(shapes.reached.all())
    (True, True)
    """
    face, points = rig.face, surface_in(mesh).points
    size, skin = face.frame.pupil_distance, rig.deltas[:, : len(face.points)]
    deltas, known = np.zeros((len(rig.names), len(points), 3), np.float32), np.zeros(len(points), bool)
    for rows, rest, moved in _pieces(rig, skin):
        # Half the vertices of a face lie closer than this to their places in its mesh.
        if rows.max() >= len(points) or np.median(np.linalg.norm(points[rows] - rest, axis=1)) > 0.01 * size:
            raise ParameterError(
                f"the rig was made of another mesh than the one that was given, which has {len(points)} vertices: fit "
                "the face to this mesh."
            )
        deltas[: len(moved), rows], known[rows] = moved, True
    left = np.flatnonzero(~known)
    if known.any() and len(left):
        away, nearest = cKDTree(points[known]).query(points[left])
        twins = away <= 1e-6 * np.ptp(points, axis=0).max()  # which repair has merged
        deltas[:, left[twins]], known[left[twins]] = deltas[:, np.flatnonzero(known)[nearest[twins]]], True
        left = left[~twins]
    if len(left):
        cells, weights, distance = BoxTree(face.points, face.triangles).closest(points[left])
        deltas[:, left] = np.einsum("nc,kncx->knx", weights, skin[:, face.triangles[cells]])
        known[left] = distance < 0.1 * size
    chart = around_head(face, points) if rig.wrinkles == "maps" and corner_texture(face.mesh) is None else None
    return SourceShapes(rig.names, points, deltas, known, face.unit, chart)


def _pieces(rig: Rig, skin: Single) -> Iterator[tuple[IntArray, Array, Single]]:
    """Yield the numbers of vertices that are kept, their places at rest, and their displacements in the first shapes.

    Targets that others drive move no parts.
    """
    face = rig.face
    own = np.arange(len(face.points)) if face.source_points is None else face.source_points
    yield own, face.points, skin
    parts = {name: part for name, part in face.parts.items() if part.source_points is not None}
    if not parts:
        return
    plain = OwnParts(replace(face, parts=parts), [], 0)
    moved = shape_fields(rig.shapes, rig.poses, rig.posing.neutral(), plain, bar)
    for name, part in parts.items():
        assert part.source_points is not None
        both = moved[name]
        shown, _ = faded(both[..., :3], both[..., 3:], np.asarray(part.mesh.regular_faces), CUT / face.unit)
        yield part.source_points, np.asarray(part.mesh.points), shown


class OwnParts(Baker):
    """Places the parts that came with a face in poses, also those that are not drawn as they are."""

    def placed(self, pose: Pose, parts: bool = True) -> dict[str, Array]:
        """Return all parts in a pose; their normals are left at 0."""
        found = self.face.parts_at(self.frame(pose))
        return {name: np.pad(np.asarray(mesh.points, np.float64), ((0, 0), (0, 3))) for name, mesh in found.items()}
