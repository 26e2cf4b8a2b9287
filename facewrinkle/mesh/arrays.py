"""Plain arrays become PolyData here; the arrays of a frame and their names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

import numpy as np
import pyvista as pv
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPointData

from ..errors import MeshError
from ..geometry.interpolation import interpolated, nearest_values
from ..geometry.normals import vertex_normals
from ..geometry.seams import of_same_triangles

ARRAYS: Mapping[str, str] = MappingProxyType(
    {
        "lambda": "position along the dominant muscle",
        "gamma": "position across the dominant muscle",
        "epsilon": "compression along the dominant muscle",
        "W": "height of the wrinkles (mm)",
        "split_gamma": "largest split criterion over the vertex's edges",
        "muscle": "index of the dominant muscle, -1 for none",
        "level": "level of refinement",
        "rest": "position at rest, in the unit of the mesh",
    }
)
"""The point-data arrays of a frame and what they hold."""

MUSCLES = "muscles"
"""The field-data array of a frame that lists the muscles' names."""

UNIT = "unit"
"""The field-data array of a frame that holds the millimetres per unit of its mesh."""

POSE = "pose"
"""The field-data array of a frame of a head that moves as a whole: a matrix (4, 4), in the unit of the mesh."""

GAZE = "gaze_"
"""With the side, the field data that say where an eye looks: a unit vector on the head at rest."""

OF_PART = "part_"
"""Begins the names of field-data arrays of a frame with the points (k, 3) of parts beside the skin that a recording
moves, in the unit of the mesh; NaN for those that are carried along."""

SOURCE = "source point"
"""The point-data array of parts beside a skin: the number that each point has in the mesh that was given."""

TEXTURE = "Texture Coordinates"
"""The point-data array of texture coordinates (n, 2); at seams of the texture the first that a point has."""

COLORS = "Colors"
"""Colours of points, of uint8 or from 0 to 1."""

PART = "part"
"""Cell data that number the connected parts of what is not skin."""

CORNERS = "Texture Corners"
"""The cell-data array of texture coordinates (m, 6) of the three corners of each triangle, where there are seams."""

IMAGE, IMAGES = "image", "images"
"""The cell-data array of the image that lies on each triangle, -1 for none, and the field-data array that these number:
files of images, `a.glb#3` for one in a glTF file, `a.usdz[b.png]` for one in a USD package; see :func:`images_of`."""

MOVED = "moved"
"""The point-data array of a mesh that others animated: where its points go (n, 3), all its shapes or moments in one.

Borders at one place that part as the mesh moves, such as closed lips, are told by it from seams."""


def name_images(mesh: pv.PolyData, names: Iterable[str]) -> None:
    """Keep the names of images with a mesh: VTK has no letters beyond ASCII."""
    mesh.field_data[IMAGES] = [name.encode("unicode_escape").decode("ascii") for name in names]


def images_of(mesh: pv.PolyData) -> list[str]:
    """The names of the images that :data:`IMAGE` numbers.

    Examples
    --------
    >>> sheet = pv.Plane()
    >>> name_images(sheet, ["größe.png"])
    >>> images_of(sheet)
    ['größe.png']
    """
    names = np.asarray(mesh.field_data.get(IMAGES, []), dtype=str)
    return [name.encode("ascii").decode("unicode_escape") for name in names.tolist()]


def to_polydata(
    points: np.ndarray,
    triangles: np.ndarray,
    point_data: Mapping[str, np.ndarray] | None = None,
    *,
    copy: bool = True,
) -> pv.PolyData:
    """A PolyData of arrays.

    Parameters
    ----------
    points : (n, 3) float
        Kept as float64.
    triangles : (m, 3) int
        Vertex numbers.
    point_data : mapping of name to (n,) or (n, k) array, optional
        The arrays of the vertices; those that facewrinkle itself writes are named in `ARRAYS`.
    copy : bool
        False: it may keep the very arrays, which nobody may change then. Otherwise it shares no memory with them.

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
    mesh = of_own_arrays(points, triangles, {})
    for name, values in (point_data or {}).items():
        values = np.array(values) if copy else np.asarray(values)
        if len(values) != len(points):
            raise MeshError(
                f"point data {name!r} must have {len(points)} rows, one for each point, received {len(values)}."
            )
        if values.dtype.kind in "fiu" and values.ndim <= 2:
            _add_array(mesh.GetPointData(), name, values)
        else:  # PyVista keeps what VTK has no type for
            mesh.point_data[name] = values
    return mesh


def blended(shapes: np.ndarray) -> np.ndarray:
    """Displacements (k, n, 3) as one (n, 3), in which all have a share of their own; see `MOVED`."""
    return np.asarray(np.tensordot(np.linspace(1.0, 2.0, len(shapes)) / max(len(shapes), 1), shapes, axes=1))


def of_own_arrays(points: np.ndarray, triangles: np.ndarray, point_data: Mapping[str, np.ndarray]) -> pv.PolyData:
    """What `to_polydata` does with arrays that need no checks, and that nobody else changes: a tear in each frame."""
    mesh, place, cells = pv.PolyData(), vtkPoints(), vtkCellArray()
    place.SetData(numpy_to_vtk(points))
    cells.SetData(3, numpy_to_vtk(triangles.ravel(), deep=True))
    mesh.SetPoints(place)
    mesh.SetPolys(cells)
    data = mesh.GetPointData()
    for name, values in point_data.items():
        _add_array(data, name, values)
    return mesh


def _add_array(data: vtkPointData, name: str, values: np.ndarray) -> None:
    """What ``mesh.point_data[name] = values`` does, without its checks: a frame adds a dozen arrays."""
    array = numpy_to_vtk(values)
    array.SetName(name)
    data.AddArray(array)


def numbers(name: str, values: object, copy: bool = True) -> np.ndarray:
    """An array of real numbers; a copy, or the very array."""
    try:
        array = np.array(values) if copy else np.asarray(values)
    except (TypeError, ValueError):  # rows of different lengths
        array = np.array(None)
    if array.dtype.kind not in "fiu":
        raise MeshError(f"{name} must be an array of real numbers, received {type(values).__name__} of {array.dtype}.")
    return array


def array_of(mesh: pv.PolyData, name: str) -> np.ndarray | None:
    """What ``mesh.point_data.get(name)`` is, as a plain array of numbers: a tear asks for it in each frame."""
    array = mesh.GetPointData().GetArray(name)
    return None if array is None else np.asarray(array)


def points_and_triangles(mesh: pv.PolyData) -> tuple[np.ndarray, np.ndarray]:
    """What ``mesh.points`` and ``mesh.regular_faces`` are, as plain arrays: a tear asks for them in each frame."""
    polys, points = mesh.GetPolys(), np.asarray(mesh.GetPoints().GetData())
    if polys.IsHomogeneous() != 3:
        return points, mesh.regular_faces
    return points, np.asarray(polys.GetConnectivityArray()).reshape(-1, 3)


def refilled(template: pv.PolyData, points: np.ndarray, point_data: Mapping[str, np.ndarray]) -> pv.PolyData:
    """A copy of a mesh with other points (n, 3) and other values in some arrays: faster than building it anew.

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


def interpolated_point_data(
    point_data: Mapping[str, np.ndarray], corners: np.ndarray, barycentric: np.ndarray
) -> dict[str, np.ndarray]:
    """The point data of a mesh at places given by three of its vertices and weights (n, 3).

    Numbers are interpolated, labels come from the nearest vertex; normals, which do not interpolate, are left out.

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
        if array.dtype.kind == "f" or (array.dtype == np.uint8 and array.ndim > 1):  # colours
            flat = interpolated(array.reshape(len(array), -1).astype(np.float64), corners, barycentric)
            flat = np.rint(flat) if array.dtype == np.uint8 else flat
            out[name] = flat.reshape(-1, *array.shape[1:]).astype(array.dtype)
        else:
            out[name] = nearest_values(array, corners, barycentric)
    return out


def with_normals(mesh: pv.PolyData) -> pv.PolyData:
    """A shallow copy with normals that are right: a frame's are, those of any other mesh may be stale."""
    shaded = mesh.copy(deep=False)
    if "split_gamma" not in shaded.point_data:
        shaded.point_data["Normals"] = vertex_normals(mesh.points, mesh.regular_faces)
    shaded.point_data.active_normals_name = "Normals"  # or PyVista makes others, and drops texture coordinates
    return shaded


def with_data(source: pv.PolyData, triangles: np.ndarray, kept: np.ndarray) -> pv.PolyData:
    """The triangles on the points `kept` of `source`, with the data of these points, texture seams and the field data.

    Normals stay behind: VTK goes on shading with them after the points have moved.
    """
    stale = {source.point_data.active_normals_name, "Normals"}
    names = [name for name in source.point_data if name not in stale]
    mesh = to_polydata(
        np.asarray(source.points)[kept], triangles, {name: source.point_data[name][kept] for name in names}
    )
    texture, scalars = source.point_data.active_texture_coordinates_name, source.point_data.active_scalars_name
    if texture in names:
        mesh.point_data.active_texture_coordinates_name = texture
    if scalars in names and scalars != texture:  # PyVista makes the first array both; filters of VTK then drop it
        mesh.point_data.active_scalars_name = scalars
    mesh.field_data.update(source.field_data)
    if CORNERS in source.cell_data:
        corners = np.asarray(source.cell_data[CORNERS], dtype=np.float64).reshape(-1, 3, 2)
        own = of_same_triangles(corners, np.asarray(source.regular_faces), np.asarray(kept)[triangles])
        if own is not None:
            mesh.cell_data[CORNERS] = own.reshape(-1, 6)
    return mesh
