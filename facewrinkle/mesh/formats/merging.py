"""Triangles as surfaces: from data sets of VTK, the polygons of files, and the meshes of a scene, which become one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from vtkmodules.util.numpy_support import vtk_to_numpy

from ...array_types import Array
from ...errors import MeshError, type_of
from ..arrays import COLORS, blended
from ..surface import Surface, merged
from .polygons import polygon_triangles


def merged_primitives(primitives: list[Surface], path: Path) -> tuple[Surface, np.ndarray, np.ndarray]:
    """Return all meshes of a scene as one surface, the points (p,) of all primitives that it keeps, and their morph
    targets (k, p, 3).
    """
    if not primitives:
        raise MeshError(f"{path.name} holds no triangles. Export the face with its geometry, as a mesh.")
    whole = checked(merged(primitives, of_one_file=True), path.name)
    shapes = np.zeros((0, len(whole.points), 3)) if whole.shapes is None else whole.shapes
    skinned = np.concatenate([_by_bones(part) for part in primitives])
    owner = np.repeat([float(part.pieces[0].mesh) for part in primitives], [len(part.points) for part in primitives])
    told_apart = np.concatenate([shapes, skinned[None], np.outer(owner, np.ones(3))[None]])
    kept, number = welded(whole.points, told_apart, whole.triangles)
    size, shapes = np.ptp(whole.points, axis=0).max(), shapes[:, kept]
    whole = replace(whole, shapes=None, weights=None).mapped(number[whole.triangles], kept)
    if len(shapes) or skinned.any():  # points on different bones may part
        whole = replace(whole, shapes=(blended(shapes) + size * skinned[kept])[None])
    return replace(whole, source_points=None), kept, shapes


def _by_bones(part: Surface) -> np.ndarray:
    """Vectors (n, 3) that differ between points on different bones."""
    if part.weights is None:
        return np.zeros((len(part.points), 3))
    return np.asarray(part.weights @ np.cos(np.outer(np.arange(part.weights.shape[1]), [1.0, 1.4, 1.7])))


def checked(surface: Surface, name: str) -> Surface:
    """Return the mesh of a file, with usual colors; `name` is for errors."""
    _check_counts(len(surface.points), len(surface.triangles), name)
    if COLORS not in surface.point_data:
        return surface
    return replace(surface, point_data={COLORS: _colors(surface.point_data[COLORS])})


def welded(points: np.ndarray, shapes: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge the points into which seams of texture or shading split a point.

    Such points lie on borders, at the same place, and move alike; points of lips or lids that touch move differently.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    shapes : ndarray, shape (k, n, 3)
        Displacements of the mesh's morph targets, and whatever else tells points apart.
    triangles : ndarray of int, shape (m, 3)

    Returns
    -------
    kept : ndarray of int, shape (p,)
        Points that are kept, the first of each seam.
    number : ndarray of int, shape (n,)
        Position of each point among the kept ones.
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


def _colors(values: np.ndarray) -> np.ndarray:
    """Colors as uint8 or from 0 to 1, of values up to 1, up to 255 or, in 16 bits, up to 65535."""
    if values.dtype == np.uint8 or not values.size or not values.max() > 1:
        return values
    share = values / (255.0 if values.max() <= 255 else 65535.0)
    return np.asarray(np.rint(255.0 * np.clip(share, 0.0, 1.0)), dtype=np.uint8)


def from_dataset(data: Any, name: str) -> Surface:
    """Triangles of any data set that holds one surface; `name` is for errors."""
    if isinstance(data, pv.MultiBlock):
        leaves = data.recursive_iterator("items", prepend_names=True, separator="/")
        blocks = [(path, block) for path, block in leaves if _count_faces(block)]
        if not blocks:
            raise MeshError(f"{name} holds no surface: none of its {data.n_blocks} blocks has faces.")
        return merged([from_dataset(block, f"{name}, block {path!r}") for path, block in blocks])
    if not isinstance(data, pv.PolyData):
        raise MeshError(
            f"{name} must hold triangles, quads or polygons, and is {type_of(data)}. Take its surface first: "
            "mesh.extract_surface()."
        )
    _check_counts(data.n_points, _count_faces(data), name)
    _check_cells(data, name)
    return Surface.of(data, None if data.is_all_triangles and data.n_faces == data.n_cells else _triangles(data))


def _check_counts(n_points: int, n_faces: int, name: str) -> None:
    if n_points == 0:
        raise MeshError(f"{name} has no points: it is empty, or not a mesh. Export it again, or name another file.")
    if n_faces == 0:
        raise MeshError(
            f"{name} has {n_points} points and no faces. A surface is needed: export polygons (not points or lines), "
            "or reconstruct one with mesh.reconstruct_surface()."
        )


def _count_faces(data: Any) -> int:
    if isinstance(data, pv.PolyData):
        return data.n_faces + data.n_strips
    return data.n_cells if isinstance(data, pv.DataSet) else 0


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


# --- colors as glTF and USD store them ------------------------------------------------------------------------


def srgb(light: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Colors in sRGB of linear light (n, 3) or (n, 4), as glTF and USD store it."""
    linear = np.clip(light[:, :3].astype(np.float64), 0.0, 1.0)
    share = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return np.asarray(np.rint(255.0 * share), dtype=np.uint8)


def linear_light(colors: npt.NDArray[np.uint8]) -> Array:
    """Linear light (n, 3), from 0 to 1, of colors in sRGB: the inverse of :func:`srgb`.

    Examples
    --------
    >>> grays = np.arange(256, dtype=np.uint8)[:, None].repeat(3, axis=1)
    >>> bool((srgb(linear_light(grays)) == grays).all())
    True
    """
    share = colors / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
