"""Triangles as PolyData, from data sets of VTK and from the polygons of files."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pyvista as pv
from vtkmodules.util.numpy_support import vtk_to_numpy

from ...errors import MeshError, type_of
from ..arrays import COLORS, CORNERS, IMAGE, IMAGES, MESH, PART, TEXTURE, to_polydata, use_texture, with_data
from ..seams import add_seams
from .merging import merged_surfaces, set_images, set_meshes
from .polygons import Polygons, polygon_triangles


def from_polygons(polygons: Polygons, name: str) -> pv.PolyData:
    """Triangles of the polygons of a file; `name` is for errors."""
    _check_counts(len(polygons.points), len(polygons.counts), name)
    split = polygon_triangles(polygons.points[polygons.vertices], polygons.counts)
    surface = to_polydata(polygons.points, polygons.vertices[split])
    face = np.repeat(np.arange(len(polygons.counts)), polygons.counts)[split[:, 0]]
    if polygons.texture is not None:
        surface.point_data[TEXTURE] = polygons.texture
        use_texture(surface, TEXTURE)
    if polygons.colors is not None:
        surface.point_data[COLORS] = _colours(polygons.colors)
    if polygons.corners is not None:
        add_seams(surface, polygons.corners[split])
    if polygons.meshes is not None:
        set_meshes(surface, polygons.meshes[face])
    if polygons.images is not None and polygons.texture is not None:
        set_images(surface, polygons.images[face])
    return surface


def _colours(values: np.ndarray) -> np.ndarray:
    """Colours as uint8 or from 0 to 1, of values up to 1, up to 255 or, in 16 bits, up to 65535."""
    if values.dtype == np.uint8 or not values.size or not values.max() > 1:
        return values
    share = values / (255.0 if values.max() <= 255 else 65535.0)
    return np.asarray(np.rint(255.0 * np.clip(share, 0.0, 1.0)), dtype=np.uint8)


def from_dataset(data: Any, name: str) -> pv.PolyData:
    """Triangles of any data set that holds one surface; `name` is for errors."""
    if isinstance(data, pv.MultiBlock):
        blocks = [(path, block) for path, block in _leaves(data) if _count_faces(block)]
        if not blocks:
            raise MeshError(f"{name} holds no surface: none of its {data.n_blocks} blocks has faces.")
        return merged_surfaces([from_dataset(block, f"{name}, block {path!r}") for path, block in blocks])
    if not isinstance(data, pv.DataSet):
        raise MeshError(f"{name} is {type_of(data)}, which holds no surface. Pass a PolyData.")
    if not isinstance(data, pv.PolyData):
        _check_grid(data, name)
        data = _faces_of_grid(data.cast_to_unstructured_grid(), name)
    _check_counts(data.n_points, _count_faces(data), name)
    _check_cells(data, name)
    surface = with_data(data, _triangles(data), np.arange(data.n_points))
    if data.is_all_triangles:
        surface.cell_data.update(_known_cell_data(data, surface.n_cells))
    if PART in surface.point_data and surface.point_data[PART].dtype.kind in "iu":  # a frame of a simulation
        set_meshes(surface, np.asarray(surface.point_data[PART])[np.asarray(surface.regular_faces)[:, 0]])
    return surface


def _check_counts(n_points: int, n_faces: int, name: str) -> None:
    if n_points == 0:
        raise MeshError(f"{name} has no points: it is no mesh, or empty. Export it again, or name another file.")
    if n_faces == 0:
        raise MeshError(
            f"{name} has {n_points} points and no faces. A surface is needed: export polygons (not points or lines), "
            "or reconstruct one with mesh.reconstruct_surface()."
        )


def _known_cell_data(data: pv.PolyData, count: int) -> dict[str, np.ndarray]:
    """The cell data of a surface that was read before; other programs may give the same names to anything."""
    known = {key: np.asarray(data.cell_data[key]) for key in (CORNERS, IMAGE, MESH) if key in data.cell_data}
    if IMAGES not in data.field_data:
        known.pop(IMAGE, None)
    kinds = {CORNERS: ((count, 6), "f"), IMAGE: ((count,), "iu"), MESH: ((count,), "iu")}
    return {key: a for key, a in known.items() if a.shape == kinds[key][0] and a.dtype.kind in kinds[key][1]}


def _leaves(data: pv.MultiBlock, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the blocks that are no multi-blocks themselves, with their paths."""
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


def _check_grid(data: Any, name: str) -> None:
    """Raise a MeshError for a grid that only states its points or cells: VTK, which makes them all from a few numbers,
    ends the interpreter if they do not fit into the memory.
    """
    if isinstance(data, pv.ImageData | pv.RectilinearGrid):
        raise MeshError(
            f"{name} must hold triangles, quads or polygons, and is a grid of {' x '.join(map(str, data.dimensions))} "
            "points. Take its surface first, such as mesh.contour() or mesh.extract_surface() gives."
        )
    if isinstance(data, pv.StructuredGrid) and math.prod(data.dimensions) != data.n_points:
        raise MeshError(
            f"{name} is a grid of {' x '.join(map(str, data.dimensions))} points, and holds {data.n_points}. The "
            "data are damaged: export it again."
        )


def _faces_of_grid(grid: pv.UnstructuredGrid, name: str) -> pv.PolyData:
    """Faces of an unstructured grid; unlike `extract_surface`, this keeps the numbers of the points."""
    faces = {pv.CellType.TRIANGLE, pv.CellType.POLYGON, pv.CellType.QUAD}
    ignored = {pv.CellType.VERTEX, pv.CellType.POLY_VERTEX, pv.CellType.LINE, pv.CellType.POLY_LINE}
    others = {pv.CellType(kind) for kind in np.unique(grid.celltypes)} - faces - ignored
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
    """Raise a MeshError for faces that would make VTK read beyond its arrays and crash the interpreter."""
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
    """Triangles (m, 3) of the faces, with polygons and strips split."""
    if mesh.n_strips:
        mesh = mesh.triangulate()
    if mesh.is_all_triangles:
        return np.array(mesh.regular_faces, dtype=np.int64)
    polys = mesh.GetPolys()
    ends, vertices = vtk_to_numpy(polys.GetOffsetsArray()), vtk_to_numpy(polys.GetConnectivityArray())
    split = polygon_triangles(np.asarray(mesh.points, dtype=np.float64)[vertices], np.diff(ends))
    return np.array(vertices[split], dtype=np.int64)
