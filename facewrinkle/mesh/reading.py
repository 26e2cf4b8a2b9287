"""Files and foreign meshes become triangles as PolyData."""

from __future__ import annotations

import logging
import os
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkDataObject

from ..errors import MeshError
from .arrays import TEXTURE, numbers, to_polydata, with_data
from .formats import Polygons, read_obj, read_off
from .ply import read_ply
from .seams import add_seams

COLORS = "Colors"
LINEAR = "COLOR_0"
"""Colours of glTF, in linear light."""
OF_VTK = (".stl", ".glb", ".gltf", ".vtk", ".vtp", ".vtu", ".vtm", ".vtkhdf", ".hdf")
GLTF = (".glb", ".gltf")
READABLE = "OBJ, OFF, PLY, STL, glTF, VTK (.vtk, .vtp, .vtu, .vtm, .vtkhdf)"


def read_surface(source: object) -> pv.PolyData:
    """The triangles of a file or of a foreign mesh, with the points numbered as they are there.

    Polygons are split into triangles (along the shorter diagonal of a quad). Where the texture has seams, points keep
    the first of their texture coordinates, and the cell data "Texture Corners" holds those of all corners. Point data
    and field data come along; lines and loose points are passed over.

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
            return from_polygons(read_obj(path), path.name)
        case ".off":
            return from_polygons(read_off(path), path.name)
        case ".ply":
            return from_polygons(read_ply(path), path.name)
        case ending if ending in OF_VTK:
            surface = _from_dataset(_read_with_vtk(path), path.name)
            return _sewn(surface) if ending in GLTF else surface
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


def _sewn(surface: pv.PolyData) -> pv.PolyData:
    """A mesh from a glTF file without the seams of its points, without the morph targets that VTK makes point data of,
    with texture coordinates that go upwards and with colours as they are seen.
    """
    data = surface.point_data
    shapes = [key for key in data if re.fullmatch(r"target\d+_\w+", key)]
    moved = [np.asarray(data[key]) for key in shapes if key.endswith("_position")]
    for key in shapes:
        data.remove(key)
    texture = data.active_texture_coordinates_name
    if texture is not None:
        data[texture] = np.asarray(data[texture]) * np.array([1, -1], np.float32) + np.array([0, 1], np.float32)
    if LINEAR in data:
        light = np.clip(np.asarray(data.pop(LINEAR), dtype=np.float64), 0.0, 1.0)
        share = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055)
        data[COLORS] = np.rint(255.0 * share[:, :3]).astype(np.uint8)
    triangles = np.asarray(surface.regular_faces)
    kept, number = welded(np.asarray(surface.points), np.array(moved).reshape(-1, surface.n_points, 3), triangles)
    if len(kept) == surface.n_points:
        return surface
    whole = with_data(surface, number[triangles], kept)
    if texture is not None:
        add_seams(whole, np.asarray(data[texture], dtype=np.float64)[triangles])
    return whole


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


def _is_empty(data: Any) -> bool:
    if isinstance(data, pv.MultiBlock):
        return all(_is_empty(block) for block in data)
    return data is None or (isinstance(data, pv.DataSet) and data.n_points == 0)


def from_polygons(polygons: Polygons, name: str) -> pv.PolyData:
    """The triangles of the polygons of a file, with its name for errors."""
    padded = [number for face in polygons.faces for number in (len(face), *face)]
    mesh = pv.PolyData()
    mesh.points = polygons.points
    mesh.faces = np.array(padded, dtype=np.int64)
    if polygons.texture is not None:
        mesh.point_data[TEXTURE] = polygons.texture
        mesh.point_data.active_texture_coordinates_name = TEXTURE
    if polygons.colors is not None:
        mesh.point_data[COLORS] = polygons.colors
    surface = _from_dataset(mesh, name)
    if polygons.corners is not None:
        add_seams(surface, _at_triangles(polygons.corners, polygons.faces, mesh))
    return surface


def _at_triangles(values: np.ndarray, faces: list[list[int]], mesh: pv.PolyData) -> np.ndarray:
    """Values (c, d) of the corners of polygons, at the corners (m, 3, d) of the triangles that they are split into."""
    mesh.cell_data["polygon"] = np.arange(len(faces))
    whole = mesh.triangulate()
    polygon, vertex = np.array([(i, vertex) for i, face in enumerate(faces) for vertex in face], dtype=np.int64).T
    place = polygon * mesh.n_points + vertex
    order = np.argsort(place, kind="stable")
    wanted = whole.cell_data["polygon"].astype(np.int64)[:, None] * mesh.n_points + whole.regular_faces
    return np.asarray(values[order[np.searchsorted(place[order], wanted)]])


def _from_trimesh(source: Any) -> pv.PolyData:
    faces = numbers("faces", source.faces)
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
    return with_data(data, _triangles(data), np.arange(data.n_points))


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
