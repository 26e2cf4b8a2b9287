"""PolyData made of plain arrays, the names of the arrays of a frame, and the state of a face in one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
import pyvista as pv
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray

from ..array_types import Array
from ..errors import MeshError, check_name
from ..geometry import BoxTree, barycentric, interpolated, nearest_values, split_vertices, vertex_normals

ARRAYS: Mapping[str, str] = MappingProxyType(
    {
        "lambda": "position along the muscle",
        "gamma": "position across the muscle",
        "epsilon": "compression across the deepest folds",
        "theta": "phase of the waves of folds, 0 on a bulge and pi in a furrow",
        "family": "number of the family of waves, -1 for none",
        "W": "height of the wrinkles (mm)",
        "split_gamma": "largest split criterion over the vertex's edges",
        "muscle": "index of the muscle whose contraction folds this place, -1 for none",
        "level": "level of refinement",
        "rest": "position at rest, in the unit of the mesh",
        "host": "index of the triangle of the face's own mesh that this place lies in",
    }
)
"""The point-data arrays of a frame and their contents."""

MUSCLES = "muscles"
"""The field-data array of a frame that lists the muscles' names."""

UNIT = "unit"
"""The field-data array of a frame that holds the millimeters per unit of its mesh."""

POSE = "pose"
"""The field-data array of a frame of a head that moves as a whole: a matrix (4, 4), in the unit of the mesh."""

GAZE = "gaze_"
"""Prefix, before the side, of the field-data arrays of a frame with the gazes: unit vectors on the head at rest."""

AGE = "age"
"""Field-data array of a frame with the age of its lines, in [0, 1], where :class:`facewrinkle.WaveFolds` draw them."""

JAW = "jaw_angle"
"""Field-data array of a frame with the turn of the mandible, radians, where muscles turn it."""

TONGUE = "tongue"
"""Field-data array of a frame with the share by which the tongue is put out, in [0, 1], where a muscle does that."""

MANDIBLE = "mandible"
"""Field-data array of a frame whose mandible moves besides turning about its hinge: a matrix (4, 4), in the unit of the
mesh, which is applied after the turn."""

OF_PART = "part_"
"""Prefix of the field-data arrays of a frame that hold the points (k, 3) of parts that a recording moves, such as
eyes, in the unit of the mesh; NaN for parts that simply follow the skin."""

PARTS = "parts"
"""Field-data array of a frame with its parts in one mesh that lists them; the point data `PART` number them."""

FIELDS = (MUSCLES, UNIT, POSE, AGE, JAW, TONGUE, MANDIBLE, PARTS)
"""The field-data arrays of a frame, besides those with a prefix."""

PART = "part"
"""Point-data array of a frame with its parts in one mesh: the number in `PARTS` of what each point belongs to."""

PointData = Mapping[str, np.ndarray] | pv.DataSetAttributes

# --- what anybody's meshes may have --------------------------------------------------------------------------

TEXTURE = "Texture Coordinates"
"""The point-data array of texture coordinates (n, 2); at seams, the first that a point has."""

COLORS = "Colors"
"""The point-data array of colors, see :func:`has_colors`; other arrays of this name are the user's own."""

CORNERS = "Texture Corners"
"""The cell-data array of texture coordinates (m, 6) of the three corners of each triangle, if there are seams."""


def has_colors(point_data: PointData) -> bool:
    """Return True if the point data of a mesh hold colors: uint8 or numbers from 0 to 1, (n, 3) or (n, 4).

    Examples
    --------
    >>> sheet = pv.Plane()
    >>> sheet.point_data["Colors"] = np.zeros((sheet.n_points, 3))
    >>> colors = has_colors(sheet.point_data)
    >>> sheet.point_data["Colors"] = np.arange(sheet.n_points)
    >>> colors, has_colors(sheet.point_data)
    (True, False)
    """
    colors = point_data.get(COLORS)
    if colors is None or colors.ndim != 2 or colors.shape[1] not in (3, 4):
        return False
    return bool(colors.dtype == np.uint8 or (colors.dtype.kind == "f" and colors.min() >= 0.0 and colors.max() <= 1.0))


def is_frame(mesh: pv.PolyData) -> bool:
    """Return True for a frame of a simulation: all other meshes may have arrays of the same names that mean anything.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> is_frame(fw.Simulation(face).step()), is_frame(face.mesh)
    (True, False)
    """
    points = mesh.GetPointData()
    return bool(mesh.GetFieldData().HasArray(UNIT) and points.HasArray("rest") and points.HasArray("level"))


def rest_of(mesh: pv.PolyData) -> np.ndarray:
    """Return where the points (n, 3) of a frame are at rest, and those of any other mesh as they are."""
    return np.asarray(mesh.point_data["rest"] if is_frame(mesh) else mesh.points, dtype=np.float64)


def to_polydata(
    points: np.ndarray,
    triangles: np.ndarray,
    point_data: Mapping[str, np.ndarray] | None = None,
    *,
    copy: bool = True,
) -> pv.PolyData:
    """Return a PolyData made of arrays.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Kept as float64.
    triangles : ndarray of int, shape (m, 3)
        Vertex numbers.
    point_data : mapping of str to ndarray, shape (n,) or (n, k), optional
        Arrays of the vertices; `ARRAYS` names those that facewrinkle itself writes.
    copy : bool
        If False, the mesh may share memory with the arrays, which must not be changed afterwards.

    Returns
    -------
    pyvista.PolyData

    Raises
    ------
    MeshError
        If a shape is wrong or a triangle uses a vertex that does not exist.

    Examples
    --------
    >>> import numpy as np
    >>> mesh = to_polydata(np.eye(3), np.array([[0, 1, 2]]), {"W": np.zeros(3)})
    >>> mesh.n_points, mesh.n_cells, mesh.points.dtype.name, mesh.array_names
    (3, 1, 'float64', ['W'])
    """
    points = numbers("points", points, copy).astype(np.float64, copy=False)
    triangles = numbers("triangles", triangles, copy)
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(f"points must have the shape (n, 3), received {points.shape}.")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not np.issubdtype(triangles.dtype, np.integer):
        raise MeshError(
            f"triangles must be integers of the shape (m, 3), received {triangles.dtype} of {triangles.shape}."
        )
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(points)):
        raise MeshError(
            f"triangles must use vertices from 0 to {len(points) - 1}, received {triangles.min()} to {triangles.max()}."
        )
    if triangles.dtype != np.int32:
        triangles = triangles.astype(np.int64)
    mesh, place, cells = pv.PolyData(), vtkPoints(), vtkCellArray()
    place.SetData(numpy_to_vtk(points))
    cells.SetData(3, numpy_to_vtk(triangles.ravel(), deep=True))
    mesh.SetPoints(place)
    mesh.SetPolys(cells)
    for name, values in (point_data or {}).items():
        values = np.array(values) if copy else np.asarray(values)
        if len(values) != len(points):
            raise MeshError(
                f"point data {name!r} must have {len(points)} rows, one for each point, received {len(values)}."
            )
        mesh.point_data.set_array(values, name)  # which, unlike an item, never becomes what the mesh is colored by
    return mesh


def use_texture(mesh: pv.PolyData, name: str | None) -> None:
    """Make a point-data array the texture coordinates of its mesh, in single precision: at others, VTK's writer of PLY
    files crashes. None is ignored.

    Examples
    --------
    >>> sheet = pv.Plane()
    >>> sheet.point_data["uv"] = np.zeros((sheet.n_points, 2))
    >>> use_texture(sheet, "uv")
    >>> sheet.active_texture_coordinates.dtype.name
    'float32'
    """
    if name is None or name not in mesh.point_data:
        return
    values = np.asarray(mesh.point_data[name])
    if values.dtype != np.float32:
        mesh.point_data[name] = values.astype(np.float32)
    mesh.point_data.active_texture_coordinates_name = name


def blended(shapes: np.ndarray) -> np.ndarray:
    """Several displacements (k, n, 3) as one (n, 3), each with a weight of its own."""
    return np.asarray(np.einsum("k,kni->ni", np.linspace(1.0, 2.0, len(shapes)) / max(len(shapes), 1), shapes))


def numbers(name: str, values: object, copy: bool = True) -> np.ndarray:
    """Return values as an array of real numbers; raise a MeshError for anything else."""
    try:
        array = np.array(values) if copy else np.asarray(values)
    except (TypeError, ValueError):  # rows of different lengths
        array = np.array(None)
    if array.dtype.kind not in "fiu":
        raise MeshError(f"{name} must be an array of real numbers, received {type(values).__name__} of {array.dtype}.")
    return array


def refilled(template: pv.PolyData, points: np.ndarray, point_data: Mapping[str, np.ndarray]) -> pv.PolyData:
    """Copy a mesh with new points (n, 3) and new values in some arrays: faster than building it from scratch.

    Examples
    --------
    >>> import numpy as np
    >>> flat = to_polydata(np.eye(3), np.array([[0, 1, 2]]), {"W": np.zeros(3)})
    >>> frame = refilled(flat, 2.0 * np.eye(3), {"W": np.ones(3)})
    >>> frame["W"].tolist(), flat["W"].tolist(), float(frame.points.max())
    ([1.0, 1.0, 1.0], [0.0, 0.0, 0.0], 2.0)
    """
    mesh = template.copy()
    vtk_to_numpy(mesh.GetPoints().GetData())[:] = points
    data = mesh.GetPointData()
    for name, values in point_data.items():
        vtk_to_numpy(data.GetArray(name))[...] = values
    return mesh


def reshaped(blank: pv.PolyData, points: np.ndarray, normals: np.ndarray | None = None) -> pv.PolyData:
    """Return a mesh with points (n, 3), perhaps normals (n, 3), and triangles and point data of another, not copied.

    Examples
    --------
    >>> import numpy as np
    >>> flat = to_polydata(np.eye(3), np.array([[0, 1, 2]]), {"W": np.zeros(3)})
    >>> moved = reshaped(flat, 2.0 * np.eye(3), np.eye(3))
    >>> moved.array_names, float(moved.points.max()), float(flat.points.max())
    (['W', 'Normals'], 2.0, 1.0)
    """
    mesh, places = pv.PolyData(), vtkPoints()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points)))
    mesh.SetPoints(places)
    mesh.SetPolys(blank.GetPolys())
    data = mesh.GetPointData()
    data.ShallowCopy(blank.GetPointData())
    if normals is not None:
        array = numpy_to_vtk(np.ascontiguousarray(normals))
        array.SetName("Normals")
        data.AddArray(array)
    return mesh


def closest_places(mesh: pv.PolyData, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles (n,) and places (n, 3) of a mesh that are closest to points (n, 3).

    Examples
    --------
    >>> import numpy as np
    >>> corner = to_polydata(4.0 * np.eye(3)[:, [1, 2, 0]], np.array([[0, 1, 2]]))
    >>> cells, places = closest_places(corner, np.array([[9.0, 0, 0], [0, 0, 9]]))
    >>> cells.tolist(), places.tolist()
    ([0, 0], [[4.0, 0.0, 0.0], [0.0, 0.0, 4.0]])
    """
    own, triangles = np.asarray(mesh.points, np.float64), mesh.regular_faces
    cells, weights, _ = BoxTree(own, triangles).closest(np.atleast_2d(np.asarray(points, np.float64)))
    return cells.astype(np.int32), interpolated(own, triangles[cells].astype(np.int32), weights)


def interpolated_point_data(
    point_data: Mapping[str, np.ndarray], corners: np.ndarray, barycentric: np.ndarray
) -> dict[str, np.ndarray]:
    """Interpolate the point data of a mesh at points given by three of its vertices and their weights (n, 3).

    Labels come from the nearest vertex. Normals cannot be interpolated and are left out.

    Examples
    --------
    >>> import numpy as np
    >>> data = {"W": np.array([0.0, 1.0, 3.0]), "muscle": np.array([5, 5, 8])}
    >>> interpolated_point_data(data, np.array([[0, 1, 2]], np.int32), np.array([[0.25, 0.25, 0.5]]))
    {'W': array([1.75]), 'muscle': array([8])}
    """
    out = {}
    for name, values in point_data.items():
        array = np.asarray(values)
        if name == "Normals":
            continue
        if array.dtype.kind == "f" or (array.dtype == np.uint8 and array.ndim > 1):  # colors
            flat = interpolated(array.reshape(len(array), -1).astype(np.float64), corners, barycentric)
            flat = np.rint(flat) if array.dtype == np.uint8 else flat
            out[name] = flat.reshape(-1, *array.shape[1:]).astype(array.dtype)
        else:
            out[name] = nearest_values(array, corners, barycentric)
    return out


def with_normals(mesh: pv.PolyData) -> pv.PolyData:
    """Return a shallow copy with up-to-date normals: those of a frame, else new ones, as the old may be stale."""
    shaded = mesh.copy(deep=False)
    if not (is_frame(shaded) and shaded.GetPointData().HasArray("Normals")):
        shaded.point_data["Normals"] = vertex_normals(mesh.points, mesh.regular_faces)
    shaded.GetPointData().SetActiveNormals("Normals")  # else PyVista makes others, and drops texture coordinates
    return shaded


def corner_texture(mesh: pv.PolyData) -> np.ndarray | None:
    """Return texture coordinates (m, 3, 2) at the corners of the triangles, or None."""
    if CORNERS in mesh.cell_data and mesh.cell_data[CORNERS].shape == (mesh.n_cells, 6):
        return np.asarray(mesh.cell_data[CORNERS], dtype=np.float64).reshape(-1, 3, 2)
    of_points = mesh.active_texture_coordinates
    return None if of_points is None else np.asarray(of_points, dtype=np.float64)[mesh.regular_faces]


def add_seams(mesh: pv.PolyData, corners: np.ndarray) -> None:
    """Store texture coordinates (m, 3, 2) at the corners of the triangles with the mesh, if they have seams."""
    if split_vertices(mesh.regular_faces, corners, mesh.n_points).origin.size > mesh.n_points:
        mesh.cell_data[CORNERS] = corners.reshape(-1, 6)


def set_texture(mesh: pv.PolyData, corners: np.ndarray, name: str = TEXTURE) -> None:
    """Give a mesh texture coordinates (m, 3, 2): points get the first of theirs, corners their own if these differ."""
    texture: np.ndarray = np.zeros((mesh.n_points, 2), np.float32)
    texture[mesh.regular_faces.ravel()[::-1]] = corners.reshape(-1, 2)[::-1]  # the first is written last
    mesh.point_data.set_array(texture, name)
    mesh.point_data.active_texture_coordinates_name = name
    add_seams(mesh, corners)


def in_bytes(colors: np.ndarray) -> npt.NDArray[np.uint8]:
    """Return colors as bytes, which they may be already; others are numbers from 0 to 1.

    Examples
    --------
    >>> in_bytes(np.array([[0.0, 0.5, 2.0]])).tolist()
    [[0, 128, 255]]
    """
    return colors if colors.dtype == np.uint8 else np.rint(255.0 * np.clip(colors, 0.0, 1.0)).astype(np.uint8)


def joined(
    meshes: Sequence[tuple[np.ndarray, np.ndarray, PointData]],
    names: Iterable[str],
    missing: Mapping[str, float],
) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Return several meshes as one, their points and triangles one after the other.

    Each has points (n, 3), triangles (m, 3) and point data. Of these, the result has the arrays of the given names, in
    the widest form that one of the meshes has; those that lack it get the number in `missing`, or else 0. Colors
    without transparency are opaque beside others, and those from 0 to 1 become bytes.

    Examples
    --------
    >>> corner = np.eye(3), np.array([[0, 1, 2]])
    >>> _, triangles, data = joined([(*corner, {"W": np.ones(3)}), (*corner, {})], ["W"], {})
    >>> triangles.tolist(), data["W"].tolist()
    ([[0, 1, 2], [3, 4, 5]], [1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    """
    counts = [len(points) for points, _, _ in meshes]
    joint = {}
    for name in names:
        owns: list[np.ndarray | None] = [data.get(name) for _, _, data in meshes]
        if name == COLORS:
            owns = [in_bytes(data[name]) if has_colors(data) else data.get(name) for _, _, data in meshes]
        widest = max((own for own in owns if own is not None), key=lambda own: own.shape[1:])
        rows = [np.full((count, *widest.shape[1:]), missing.get(name, 0), widest.dtype) for count in counts]
        for own, row in zip(owns, rows, strict=True):
            if own is not None:
                row.reshape(len(row), -1)[:, : own[:1].size] = own.reshape(len(own), -1)
        joint[name] = np.concatenate(rows)
    starts = np.cumsum([0, *counts[:-1]])
    triangles = [own + start for (_, own, _), start in zip(meshes, starts, strict=True)]
    return np.concatenate([points for points, _, _ in meshes]), np.concatenate(triangles), joint


def joined_texture(textures: Sequence[np.ndarray | None], lengths: Sequence[int]) -> np.ndarray | None:
    """Texture coordinates (m, 3, 2) at the corners of several meshes, 0 on those without; None if all are."""
    if all(own is None for own in textures):
        return None
    rows = [np.zeros((m, 3, 2)) if own is None else own for own, m in zip(textures, lengths, strict=True)]
    return np.concatenate(rows)


def values_at(frame: pv.PolyData, name: str, places: npt.ArrayLike) -> np.ndarray:
    """Return the values of an array of a frame at places (n, 3) of the face at rest, interpolated in the triangles that
    these lie in; labels are those of the nearest vertex.

    Raises
    ------
    UnknownNameError
        For an array that the frame does not have.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> sim = fw.Simulation(face)
    >>> sim.express("surprise")
    >>> height = values_at(sim.settle(), "W", [face.landmarks["forehead_mid"]])
    >>> height.shape, bool(abs(height[0]) < 3.0)
    ((1,), True)
    """
    check_name("array of the frame", name, frame.point_data)
    rest, triangles = rest_of(frame), np.asarray(frame.regular_faces, np.int32)
    cells, near = closest_places(to_polydata(rest, triangles), np.asarray(places, np.float64))
    corners = triangles[cells]
    return interpolated_point_data({name: frame.point_data[name]}, corners, barycentric(near, rest[corners]))[name]


# --- the state of a face in a frame --------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class FrameState:
    """The state of a face in one frame, in the unit and coordinates of its mesh.

    Attributes
    ----------
    points : ndarray, shape (n0, 3)
        The base vertices; they come first in every frame, before those of split triangles.
    pose : ndarray, shape (4, 4), optional
        Motion of the head as a whole since rest; None if the frame does not hold it.
    gazes : mapping of str to ndarray, shape (3,)
        Unit directions in which the eyes look, by side ("l", "r"), on the head at rest; empty if the frame has none.
    parts : mapping of str to ndarray, shape (k, 3)
        Points of the parts that move by themselves, by name; NaN for points that follow the skin.
    jaw_angle : float, optional
        Turn of the mandible, radians; None if it has to be measured on the skin.
    mandible : ndarray, shape (4, 4), optional
        Motion of the mandible after that turn, such as forward or aside, on the head at rest.
    tongue : float
        Share by which the tongue is put out, in [0, 1].

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> sim = fw.Simulation(face)
    >>> sim.look(yaw=30)
    >>> state = face.state_of(sim.step())
    >>> state.points.shape == face.points.shape, state.gazes["l"].round(2)
    (True, array([0.5 , 0.04, 0.86]))
    """

    points: Array
    pose: Array | None
    gazes: Mapping[str, Array]
    parts: Mapping[str, Array]
    jaw_angle: float | None = None
    mandible: Array | None = None
    tongue: float = 0.0

    @classmethod
    def of(cls, frame: pv.PolyData, n_points: int) -> FrameState:
        """Read the state of a face with `n_points` base vertices from a frame.

        Raises
        ------
        MeshError
            If the frame has fewer points.
        """
        if frame.n_points < n_points:
            raise MeshError(
                f"a frame of this face has {n_points} points or more, received {frame.n_points}. "
                "Is it one of another face?"
            )
        fields = frame.GetFieldData()  # PyVista's own is slow to read, and pictures do so for each frame
        keys = [fields.GetArrayName(k) for k in range(fields.GetNumberOfArrays() if is_frame(frame) else 0)]
        data = frame.field_data
        return cls(
            np.asarray(frame.points, dtype=np.float64)[:n_points],
            np.asarray(data[POSE], dtype=np.float64) if POSE in keys else None,
            {key[len(GAZE) :]: np.array(data[key], np.float64).ravel() for key in keys if key.startswith(GAZE)},
            {key[len(OF_PART) :]: np.asarray(data[key]) for key in keys if key.startswith(OF_PART)},
            float(data[JAW][0]) if JAW in keys else None,
            np.asarray(data[MANDIBLE], dtype=np.float64) if MANDIBLE in keys else None,
            float(data[TONGUE][0]) if TONGUE in keys else 0.0,
        )

    @property
    def head(self) -> Array:
        """The pose as a matrix (4, 4); the identity if the frame does not hold it."""
        return np.eye(4) if self.pose is None else self.pose

    def to_rest(self, points: Array) -> Array:
        """Return points (k, 3) of the frame, moved with the head back to rest."""
        back = np.linalg.inv(self.head)
        return np.asarray(points @ back[:3, :3].T + back[:3, 3])

    def from_rest(self, points: Array) -> Array:
        """Return points (k, 3) of the head at rest, moved with the head to where they are in the frame."""
        return np.asarray(points @ self.head[:3, :3].T + self.head[:3, 3])
