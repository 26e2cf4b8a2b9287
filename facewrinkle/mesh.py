"""The edge: what users bring becomes plain arrays here, and plain arrays become PolyData again.

`read_surface` opens files and foreign objects, `prepare` checks and mends a surface until the algorithms can
rely on it, and `to_polydata` turns results into PolyData. No other module converts; this one also names the
arrays of a frame."""

from __future__ import annotations

import logging
import os
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from types import MappingProxyType
from typing import Any

import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkDataObject

from .errors import LARGEST, FaceWrinkleWarning, MeshError, ParameterError
from .formats import Polygons, read_obj, read_off
from .geometry import topology
from .geometry.refinement import RedGreenForest
from .geometry.transfer import carried, nearest_carried
from .ply import read_ply

__all__ = [
    "ARRAYS",
    "MUSCLES",
    "Surface",
    "carried_point_data",
    "prepare",
    "read_surface",
    "refilled",
    "refine",
    "to_polydata",
]

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

TEXTURE = "Texture Coordinates"
COLORS = "Colors"
OF_VTK = (".stl", ".glb", ".gltf", ".vtk", ".vtp", ".vtu", ".vtm", ".vtkhdf", ".hdf")
GLTF = (".glb", ".gltf")
READABLE = "OBJ, OFF, PLY, STL, glTF, VTK (.vtk, .vtp, .vtu, .vtm, .vtkhdf)"


# --- out ----------------------------------------------------------------------------------------


def to_polydata(
    points: np.ndarray, triangles: np.ndarray, point_data: Mapping[str, np.ndarray] | None = None
) -> pv.PolyData:
    """A PolyData that shares no memory with the arrays.

    Parameters
    ----------
    points : (n, 3) float
        Kept as float64.
    triangles : (m, 3) int
        Vertex numbers.
    point_data : mapping of name to (n,) or (n, k) array, optional
        The arrays of the vertices; those that facewrinkle itself writes are named in `ARRAYS`.

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
    points, triangles = _numbers("points", points).astype(np.float64, copy=False), _numbers("triangles", triangles)
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
    mesh = pv.PolyData.from_regular_faces(points, triangles)
    for name, values in (point_data or {}).items():
        values = np.asarray(values)
        if len(values) != len(points):
            raise MeshError(
                f"point data {name!r} must have {len(points)} rows, one for each point, received {len(values)}."
            )
        if values.dtype.kind in "fiu" and values.ndim <= 2:
            _add_array(mesh, name, values)
        else:  # PyVista keeps what VTK has no type for
            mesh.point_data[name] = values.copy()
    return mesh


def _add_array(mesh: pv.PolyData, name: str, values: np.ndarray) -> None:
    """What ``mesh.point_data[name] = values`` does, without its checks: a frame adds a dozen arrays."""
    array = numpy_to_vtk(values, deep=True)
    array.SetName(name)
    mesh.GetPointData().AddArray(array)


def _numbers(name: str, values: object) -> np.ndarray:
    """A copy as an array of real numbers."""
    try:
        array = np.array(values)
    except (TypeError, ValueError):  # rows of different lengths
        array = np.array(None)
    if array.dtype.kind not in "fiu":
        raise MeshError(f"{name} must be an array of real numbers, received {type(values).__name__} of {array.dtype}.")
    return array


def refilled(template: pv.PolyData, points: np.ndarray, point_data: Mapping[str, np.ndarray]) -> pv.PolyData:
    """A copy of a mesh with other points (n, 3) and other values in some arrays: faster than building it anew."""
    mesh = template.copy()
    vtk_to_numpy(mesh.GetPoints().GetData())[:] = points
    data = mesh.GetPointData()
    for name, values in point_data.items():
        vtk_to_numpy(data.GetArray(name))[...] = values
    return mesh


def carried_point_data(mesh: pv.PolyData, corners: np.ndarray, barycentric: np.ndarray) -> dict[str, np.ndarray]:
    """The point data of a mesh at places given by three of its vertices and weights (n, 3).

    Numbers are interpolated, labels come from the nearest vertex; normals, which do not interpolate, are left out.
    """
    out = {}
    for name, values in mesh.point_data.items():
        array = np.asarray(values)
        if name == "Normals":
            continue
        if array.dtype.kind == "f" or (array.dtype == np.uint8 and array.ndim > 1):  # colours
            flat = carried(array.reshape(len(array), -1).astype(np.float64), corners, barycentric)
            flat = np.rint(flat) if array.dtype == np.uint8 else flat
            out[name] = flat.reshape(-1, *array.shape[1:]).astype(array.dtype)
        else:
            out[name] = nearest_carried(array, corners, barycentric)
    return out


def refine(mesh: pv.PolyData, marked: np.ndarray) -> pv.PolyData:
    """Split the marked triangles of a mesh in four and close the mesh around them: red-green refinement in one go.

    Parameters
    ----------
    mesh : PolyData
        Triangles or polygons (which are triangulated). Not changed.
    marked : (m,) bool, or indices of triangles

    Returns
    -------
    PolyData
        The refined mesh with the interpolated point data. New points follow the old ones; none hangs on an edge.

    Raises
    ------
    MeshError
        If the mesh has no triangles, or the marks do not fit them.

    Examples
    --------
    >>> import pyvista as pv
    >>> fine = refine(pv.Plane(i_resolution=2, j_resolution=2).triangulate(), [0])
    >>> fine.n_cells, fine.n_points
    (12, 12)
    """
    source = read_surface(mesh)
    triangles = np.asarray(source.regular_faces, dtype=np.int32)
    if len(triangles) == 0:
        raise MeshError("the mesh has no faces to refine.")
    forest = RedGreenForest(triangles, n_points=source.n_points)
    forest.split(marked)
    points = carried(np.asarray(source.points, dtype=np.float64), forest.corners, forest.barycentric)
    data = carried_point_data(source, forest.corners, forest.barycentric)
    fine = to_polydata(points, forest.triangles, data)
    fine.point_data.active_texture_coordinates_name = source.point_data.active_texture_coordinates_name
    return fine


# --- in -----------------------------------------------------------------------------------------


def read_surface(source: object) -> pv.PolyData:
    """The triangles of a file or of a foreign mesh, with the points numbered as they are there.

    Polygons are split into triangles (along the shorter diagonal of a quad). A point keeps the first of its
    texture coordinates. Point data and field data come along; lines and loose points are passed over.

    Parameters
    ----------
    source : path, PyVista or VTK data set, or trimesh-like object
        OBJ, OFF, PLY, STL, glTF or a VTK format; a data set of faces; a multi-block of which one block holds
        faces; an object with `vertices` (n, 3) and `faces` (m, 3).

    Returns
    -------
    pyvista.PolyData
        Triangles only, float64 points; a new object.

    Raises
    ------
    MeshError
        If there is no such file, if it cannot be read, or if no single surface is in it.

    Warns
    -----
    FaceWrinkleWarning
        If points have further texture coordinates beside the first.

    Examples
    --------
    >>> import pyvista as pv
    >>> read_surface(pv.Plane(i_resolution=2, j_resolution=3)).n_cells
    12
    """
    if isinstance(source, str | Path):
        return _read_file(Path(os.path.expanduser(source)))  # Path.expanduser fails for unknown users
    if isinstance(source, vtkDataObject):
        return _from_dataset(source if isinstance(source, pv.DataObject) else pv.wrap(source), "the mesh")
    if hasattr(source, "vertices") and hasattr(source, "faces"):
        return _from_trimesh(source)
    raise MeshError(
        "a mesh must be a path, a PyVista or VTK data set, or an object with vertices and faces such as a "
        "trimesh.Trimesh, "
        f"received {type(source).__name__}."
    )


def _read_file(path: Path) -> pv.PolyData:
    check_file(path)
    match path.suffix.lower():
        case ".obj":
            return _from_polygons(read_obj(path), path.name)
        case ".off":
            return _from_polygons(read_off(path), path.name)
        case ".ply":
            return _from_polygons(read_ply(path), path.name)
        case ending if ending in OF_VTK:
            surface = _from_dataset(_read_with_vtk(path), path.name)
            return _sewn(surface, path.name) if ending in GLTF else surface
    ending = f"for {path.suffix!r}" if path.suffix else "for a file without an ending"
    raise MeshError(f"{path.name}: there is no reader {ending}. Export the mesh as one of: {READABLE}.")


def check_file(path: Path) -> None:
    """Raise a MeshError if a file is not there, cannot be opened, or is empty."""
    try:
        status = path.stat()
        if S_ISREG(status.st_mode):  # to open a pipe would wait for ever
            with path.open("rb"):
                pass
    except (FileNotFoundError, NotADirectoryError, ValueError):  # a null byte is a ValueError
        raise MeshError(
            f"there is no file {str(path)!r}. Check the path; it is relative to {str(Path.cwd())!r}."
        ) from None
    except OSError as problem:
        raise MeshError(f"{str(path)!r} cannot be opened: {problem.strerror}.") from None
    if not S_ISREG(status.st_mode):
        what = "a folder" if S_ISDIR(status.st_mode) else "no ordinary file"
        raise MeshError(f"{str(path)!r} is {what}, and a mesh file is needed.")
    if status.st_size == 0:
        raise MeshError(f"{path.name} is empty (0 bytes). Export it again.")


@contextmanager
def _complaints() -> Iterator[list[str]]:
    """Collects what VTK's readers complain of; they would print it several times over."""
    heard: list[str] = []

    def collect(record: logging.LogRecord) -> bool:
        heard.append(record.getMessage().splitlines()[0])
        return False

    root = logging.getLogger()
    root.addFilter(collect)
    try:
        with warnings.catch_warnings(), pv.vtk_verbosity("off"), pv.VtkErrorCatcher():
            warnings.simplefilter("ignore")
            yield heard
    finally:
        root.removeFilter(collect)


def _read_with_vtk(path: Path) -> Any:
    data = None
    with _complaints() as heard:
        try:
            data = pv.get_reader(str(path)).read()
        except Exception as problem:  # every format fails in its own way
            heard.append(str(problem).splitlines()[-1])
    if data is None or _is_empty(data):
        telling = [line for line in heard if not line.startswith("Algorithm")]
        reason = telling[0] if telling else "nothing is in it that VTK understands"
        raise MeshError(
            f"{path.name} cannot be read: {reason.rstrip('.')}. The file is damaged, or it is compressed "
            "(Draco, meshopt, quantised or sparse glTF). Export it without compression, or as OBJ or PLY."
        )
    return data


def _sewn(surface: pv.PolyData, name: str) -> pv.PolyData:
    """A mesh from a glTF file without the seams of its points, without the morph targets that VTK makes point data of,
    and with texture coordinates that go upwards.
    """
    data = surface.point_data
    shapes = [key for key in data if re.fullmatch(r"target\d+_\w+", key)]
    moved = [np.asarray(data[key]) for key in shapes if key.endswith("_position")]
    for key in shapes:
        data.remove(key)
    texture = data.active_texture_coordinates_name
    if texture is not None:
        data[texture] = np.asarray(data[texture]) * np.array([1, -1], np.float32) + np.array([0, 1], np.float32)
    triangles = np.asarray(surface.regular_faces)
    kept, number = welded(np.asarray(surface.points), np.array(moved).reshape(-1, surface.n_points, 3), triangles)
    if texture is not None:
        check_seams(np.asarray(data[texture]), kept, number, name)
    return _with_data(surface, number[triangles], kept) if len(kept) < surface.n_points else surface


def welded(points: np.ndarray, shapes: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One point in place of all those that a seam of texture or shading splits it into.

    They lie on borders, at the same place, and move alike; those of lips or lids that touch move differently.

    Parameters
    ----------
    points : (n, 3) float
    shapes : (k, n, 3) float
        Displacements of the mesh's morph targets.
    triangles : (m, 3) int

    Returns
    -------
    kept : (p,) int
        Points that are kept, the first of each seam.
    number : (n,) int
        Which of the kept ones each point is.
    """
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    border = np.unique(edges[count == 1])
    first = np.arange(len(points))
    if len(border):
        rows = np.concatenate([points[None], shapes])[:, border].transpose(1, 0, 2).reshape(len(border), -1)
        _, one, same = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        first[border] = border[one][same.ravel()]
    kept, number = np.unique(first, return_inverse=True)
    return kept, number.ravel()


def check_seams(texture: np.ndarray, kept: np.ndarray, number: np.ndarray, name: str) -> None:
    """Warn if points that `welded` made one have several texture coordinates (n, 2)."""
    seams = len(np.unique(number[(texture != texture[kept[number]]).any(axis=1)]))
    if seams:
        warn_of_seams(name, seams, stacklevel=6)


def _is_empty(data: Any) -> bool:
    if isinstance(data, pv.MultiBlock):
        return all(_is_empty(block) for block in data)
    return data is None or (isinstance(data, pv.DataSet) and data.n_points == 0)


def warn_of_seams(name: str, count: int, stacklevel: int = 5) -> None:
    """Warn that points have further texture coordinates."""
    warnings.warn(
        f"{name}: the texture has seams; where points have several texture coordinates, the first were kept "
        f"(points: {count}).",
        FaceWrinkleWarning,
        stacklevel=stacklevel,
    )


def _from_polygons(polygons: Polygons, name: str) -> pv.PolyData:
    padded = [number for face in polygons.faces for number in (len(face), *face)]
    mesh = pv.PolyData()
    mesh.points = polygons.points
    mesh.faces = np.array(padded, dtype=np.int64)
    if polygons.texture is not None:
        mesh.point_data[TEXTURE] = polygons.texture
        mesh.point_data.active_texture_coordinates_name = TEXTURE
    if polygons.colors is not None:
        mesh.point_data[COLORS] = polygons.colors
    if polygons.seams:
        warn_of_seams(name, polygons.seams)
    return _from_dataset(mesh, name)


def _from_trimesh(source: Any) -> pv.PolyData:
    faces = _numbers("faces", source.faces)
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise MeshError(f"faces must have the shape (m, 3), received {faces.shape}. Triangulate the mesh first.")
    mesh = to_polydata(source.vertices, faces)
    visual = getattr(source, "visual", None)
    texture = getattr(visual, "uv", None)
    if texture is not None and len(texture) == mesh.n_points:
        mesh.point_data[TEXTURE] = np.array(texture, dtype=np.float64)
        mesh.point_data.active_texture_coordinates_name = TEXTURE
    if visual is not None and getattr(visual, "kind", None) == "vertex":
        mesh.point_data[COLORS] = np.array(visual.vertex_colors)
    return mesh


def _from_dataset(data: Any, name: str) -> pv.PolyData:
    """The triangles of any data set that holds one surface."""
    if isinstance(data, pv.MultiBlock):
        blocks = [(path, block) for path, block in _leaves(data) if _count_faces(block)]
        if len(blocks) != 1:
            found = ", ".join(f"{path!r} ({_count_faces(block)} faces)" for path, block in blocks[:8])
            raise MeshError(
                f"{name} must hold one surface, and holds {len(blocks)}{': ' + found if found else ''}. "
                "Pass the block that is the face, or export the face alone."
            )
        return _from_dataset(blocks[0][1], f"{name}, block {blocks[0][0]!r}")
    if not isinstance(data, pv.DataSet):
        raise MeshError(f"{name} is a {type(data).__name__}, which holds no surface. Pass a PolyData.")
    if not isinstance(data, pv.PolyData):
        data = _faces_of_grid(data.cast_to_unstructured_grid(), name)
    if data.n_points == 0:
        raise MeshError(f"{name} has no points.")
    if not _count_faces(data):
        raise MeshError(
            f"{name} has {data.n_points} points and no faces. A surface is needed: export polygons (not "
            "points, lines or, in "
            "PLY, triangle strips), or reconstruct one with mesh.reconstruct_surface()."
        )
    _check_cells(data, name)
    return _with_data(data, _triangles(data), np.arange(data.n_points))


def _leaves(data: pv.MultiBlock, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """The blocks that are no multi-blocks, with their paths."""
    for number, (key, block) in enumerate(zip(data.keys(), data, strict=True)):
        path = f"{prefix}{key or number}"
        if isinstance(block, pv.MultiBlock):
            yield from _leaves(block, f"{path}/")
        else:
            yield path, block


def _count_faces(data: Any) -> int:
    if isinstance(data, pv.PolyData):
        return data.n_faces + data.n_strips
    return data.n_cells if isinstance(data, pv.DataSet) else 0


def _faces_of_grid(grid: pv.UnstructuredGrid, name: str) -> pv.PolyData:
    """The faces of an unstructured grid; unlike with `extract_surface`, its points keep their numbers."""
    faces = {pv.CellType.TRIANGLE, pv.CellType.POLYGON, pv.CellType.QUAD}
    passed_over = {pv.CellType.VERTEX, pv.CellType.POLY_VERTEX, pv.CellType.LINE, pv.CellType.POLY_LINE}
    others = {pv.CellType(kind) for kind in np.unique(grid.celltypes)} - faces - passed_over
    if others:
        raise MeshError(
            f"{name} must hold triangles, quads or polygons, and holds "
            f"{', '.join(sorted(kind.name for kind in others))}. "
            "Take its surface first: mesh.extract_surface()."
        )
    kept = np.isin(grid.celltypes, [int(kind) for kind in faces])
    mesh = pv.PolyData()
    mesh.points = grid.points
    mesh.faces = grid.cells[np.repeat(kept, np.diff(grid.cell_offsets) + 1)]
    mesh.point_data.update(grid.point_data)
    return mesh


def _check_cells(mesh: pv.PolyData, name: str) -> None:
    """Raise a MeshError for faces that would lead VTK out of its arrays, where it brings the interpreter down."""
    for cells in (mesh.GetPolys(), mesh.GetStrips()):
        ends, numbers = vtk_to_numpy(cells.GetOffsetsArray()), vtk_to_numpy(cells.GetConnectivityArray())
        if (np.diff(ends) < 3).any() or (len(ends) and (ends[0] != 0 or ends[-1] != len(numbers))):
            raise MeshError(
                f"each face of {name} must have three points or more. The data are damaged: export it again."
            )
        if len(numbers) and (numbers.min() < 0 or numbers.max() >= mesh.n_points):
            raise MeshError(
                f"the faces of {name} must use points from 0 to {mesh.n_points - 1}, received {numbers.min()} to "
                f"{numbers.max()}. The data are damaged: export it again."
            )


def _triangles(mesh: pv.PolyData) -> np.ndarray:
    """(m, 3) vertex numbers of the faces, polygons and strips split."""
    whole = mesh if mesh.n_strips == 0 and mesh.is_all_triangles else mesh.triangulate()
    return np.array(whole.regular_faces, dtype=np.int64)


def _with_data(source: pv.PolyData, triangles: np.ndarray, kept: np.ndarray) -> pv.PolyData:
    """The triangles on the points `kept` of `source`, with the data of these points and the field data.

    Normals stay behind: VTK goes on shading with them after the points have moved.
    """
    stale = {source.point_data.active_normals_name, "Normals"}
    names = [name for name in source.point_data if name not in stale]
    mesh = to_polydata(
        np.asarray(source.points)[kept], triangles, {name: source.point_data[name][kept] for name in names}
    )
    for active in ("active_texture_coordinates_name", "active_scalars_name"):
        name = getattr(source.point_data, active)
        if name in names:
            setattr(mesh.point_data, active, name)
    mesh.field_data.update(source.field_data)
    return mesh


# --- checks -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Surface:
    """One connected, manifold, consistently oriented surface that faces outward.

    Attributes
    ----------
    mesh : pyvista.PolyData
        With the point data of the input.
    triangles : (m, 3) int32
    points : (n, 3) float64
    source_points : (n,) int
        The number that each point has in the input.
    report : tuple of str
        What was mended, one sentence each.
    """

    mesh: pv.PolyData
    triangles: np.ndarray
    points: np.ndarray
    source_points: np.ndarray
    report: tuple[str, ...]


def prepare(mesh: object, near: np.ndarray | None = None, forward: np.ndarray | None = None) -> Surface:
    """A clean copy of a surface, on which the algorithms can rely.

    Degenerate and duplicate triangles are dropped, one component is chosen, the triangles are oriented alike
    and outward, and unused points are dropped. What changes the surface is reported.

    Parameters
    ----------
    mesh : anything that `read_surface` takes
        Not changed.
    near : (k, 3) float, optional
        Landmarks. The component that is nearest to most of them is chosen; without them the one of the
        largest area.
    forward : (3,) float, optional
        The direction in which the face looks. The inside of the surface lies behind it. Without it, the
        inside is taken to be where the centroid is, which holds for closed surfaces and for masks that bulge
        outward.

    Returns
    -------
    Surface

    Raises
    ------
    MeshError
        If there are no points or faces; for points that are not finite; for edges with three or more
        triangles; for a surface that cannot be oriented, such as a Möbius strip.
    ParameterError
        For landmarks or a direction of the wrong shape, not finite, or zero.

    Warns
    -----
    FaceWrinkleWarning
        Once for each kind of change.

    Examples
    --------
    >>> import pyvista as pv
    >>> surface = prepare(pv.Plane(i_resolution=2, j_resolution=2))
    >>> surface.points.shape, surface.triangles.shape, surface.report
    ((9, 3), (8, 3), ())
    """
    near = None if near is None else _vectors("near", np.atleast_2d(near))
    forward = None if forward is None else _vectors("forward", np.atleast_2d(forward))[0]
    source = read_surface(mesh)
    points = np.asarray(source.points)
    _check_finite(points)
    report: list[str] = []
    triangles = _without_degenerate(points, np.asarray(source.regular_faces), report)
    triangles = _one_component(points, triangles, near, report)
    _check_manifold(triangles)
    triangles = _oriented(points, triangles, forward, report)
    kept, renumbered = np.unique(triangles, return_inverse=True)
    for sentence in report:
        warnings.warn(sentence, FaceWrinkleWarning, stacklevel=2)
    clean = _with_data(source, renumbered.reshape(-1, 3), kept)
    return Surface(
        mesh=clean,
        triangles=renumbered.reshape(-1, 3).astype(np.int32),
        points=np.array(clean.points),
        source_points=kept,
        report=tuple(report),
    )


def _vectors(name: str, values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != 3 or not np.isfinite(values).all() or not values.any():
        raise ParameterError(
            f"{name} must be finite vectors of three numbers that are not all zero, received {values}."
        )
    return values


def _check_finite(points: np.ndarray) -> None:
    broken = np.flatnonzero(~(np.abs(points) < LARGEST).all(axis=1))
    if len(broken):
        raise MeshError(
            f"{len(broken)} of {len(points)} points are NaN, infinite or beyond {LARGEST:g}, the first is point "
            f"{broken[0]}: {points[broken[0]]}. "
            "Delete them in a modeller, or export the mesh again."
        )


def _without_degenerate(points: np.ndarray, triangles: np.ndarray, report: list[str]) -> np.ndarray:
    """The triangles that have an area, each once."""
    corners = points[triangles]
    longest = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    has_area = doubled > 1e-10 * longest  # rounding leaves about 1e-16 of a triangle that has none
    if not has_area.all():
        report.append(f"Dropped degenerate triangles (no area): {np.sum(~has_area)} of {len(triangles)}.")
        triangles = triangles[has_area]
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    if len(first) < len(triangles):
        report.append(f"Dropped duplicate triangles: {len(triangles) - len(first)} of {len(triangles)}.")
        triangles = triangles[np.sort(first)]
    if not len(triangles):
        raise MeshError("all triangles are degenerate: none has an area. Export the mesh again.")
    return triangles


def _check_manifold(triangles: np.ndarray) -> None:
    crowded = topology.non_manifold_edges(triangles)
    if len(crowded):
        a, b = crowded[0]
        shared = int(((triangles == a).any(axis=1) & (triangles == b).any(axis=1)).sum())
        raise MeshError(
            f"an edge must have one or two triangles; {len(crowded)} edges have more, the one between points "
            f"{a} and {b} "
            f"has {shared}. Clean the mesh in a modeller, or with pymeshlab's "
            "meshing_repair_non_manifold_edges "
            "(pip install facewrinkle[remesh])."
        )


def _one_component(points: np.ndarray, triangles: np.ndarray, near: np.ndarray | None, report: list[str]) -> np.ndarray:
    """The triangles of the component that is nearest to most landmarks, or that has the largest area."""
    label = topology.components(triangles)
    counts = np.bincount(label)
    if len(counts) == 1:
        return triangles
    if near is None:
        votes = np.bincount(label, weights=_areas(points, triangles))
        reason = "the largest"
    else:
        used, first = np.unique(triangles, return_index=True)
        _, nearest = cKDTree(points[used]).query(near)
        votes = np.bincount(label[first[nearest] // 3], minlength=len(counts))
        reason = f"nearest to {votes.max()} of {len(near)} landmarks"
    chosen = int(np.argmax(votes))
    others = np.sort(np.delete(counts, chosen))[::-1]
    listed = ", ".join(map(str, others[:10])) + (", ..." if len(others) > 10 else "")
    report.append(
        f"Kept one of {len(counts)} separate parts, {reason}, with {counts[chosen]} triangles; left out "
        "parts of "
        f"{listed} triangles."
    )
    return triangles[label == chosen]


def _areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def _oriented(points: np.ndarray, triangles: np.ndarray, forward: np.ndarray | None, report: list[str]) -> np.ndarray:
    """The triangles, all oriented alike and outward."""
    alike = topology.oriented(triangles)
    turned = int((alike != triangles).any(axis=1).sum())
    if turned:
        report.append(f"Turned triangles that were oriented against their neighbours: {turned} of {len(triangles)}.")
    if _enclosed_volume(points, alike, forward) < 0:
        report.append("The surface was oriented inward; all its triangles were turned.")
        alike = alike[:, [0, 2, 1]]
    return alike


def _enclosed_volume(points: np.ndarray, triangles: np.ndarray, forward: np.ndarray | None) -> float:
    """The signed volume between the surface and an apex inside it; 0 where it is too small to tell.

    The apex is the centroid, moved far back along `forward`. For a closed surface it does not matter; for an
    open one the volume grows with the part of the area vector that looks forward.
    """
    corners = points[triangles]
    areas = _areas(points, triangles)
    apex = np.average(corners.mean(axis=1), axis=0, weights=areas)
    if forward is not None:
        apex = apex - forward / np.linalg.norm(forward) * np.linalg.norm(np.ptp(corners, axis=(0, 1)))
    a, b, c = (corners[:, corner] - apex for corner in range(3))
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
    return volume if abs(volume) > 1e-6 * areas.sum() ** 1.5 else 0.0
