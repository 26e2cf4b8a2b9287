"""Triangles as PolyData: from data sets of VTK, the polygons of files, and the meshes of a scene, which become one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from vtkmodules.util.numpy_support import vtk_to_numpy

from ...array_types import Array
from ...errors import MeshError, type_of
from ...geometry import connected
from ..arrays import (
    COLORS,
    CORNERS,
    IMAGE,
    MESH,
    MOVED,
    NAME,
    PART,
    PARTS,
    TEXTURE,
    add_seams,
    blended,
    corner_texture,
    drop_frame_data,
    is_frame,
    joined,
    labels_of,
    set_labels,
    to_polydata,
    use_texture,
    with_data,
)
from .polygons import Primitive, polygon_triangles

MISSING = {COLORS: 255, MOVED: 0}
"""Values for meshes without colors or motion that are merged with others that have them."""


def merged_primitives(primitives: list[Primitive], path: Path) -> tuple[pv.PolyData, np.ndarray, np.ndarray]:
    """Return all meshes of a scene as one surface, the points (p,) of all primitives that it keeps, and their morph
    targets (k, p, 3).
    """
    if not primitives:
        raise MeshError(f"{path.name} holds no triangles. Export the face with its geometry, as a mesh.")
    starts = np.cumsum([0, *(len(part.points) for part in primitives)])
    count = max(0 if part.shapes is None else len(part.shapes) for part in primitives)
    shapes = np.zeros((count, starts[-1], 3))
    skinned = np.zeros((starts[-1], 3))
    colors = np.full((starts[-1], 3), 255, np.uint8)
    for part, start, end in zip(primitives, starts[:-1], starts[1:], strict=True):
        if part.shapes is not None:
            shapes[: len(part.shapes), start:end] = part.shapes
        if part.weights is not None:
            skinned[start:end] = part.weights @ np.cos(np.outer(np.arange(part.weights.shape[1]), [1.0, 1.4, 1.7]))
        if part.colors is not None:
            colors[start:end] = part.colors
    points = np.concatenate([part.points for part in primitives])
    triangles = np.concatenate([part.triangles + start for part, start in zip(primitives, starts[:-1], strict=True)])
    owner = np.repeat([float(part.mesh) for part in primitives], np.diff(starts))
    kept, number = welded(points, np.concatenate([shapes, skinned[None], np.outer(owner, np.ones(3))[None]]), triangles)
    lengths = [len(part.triangles) for part in primitives]
    whole = Primitive(
        points[kept],
        number[triangles],
        joined_texture([part.texture for part in primitives], lengths),
        colors[kept] if any(part.colors is not None for part in primitives) else None,
        image=np.concatenate([np.broadcast_to(part.image, m) for part, m in zip(primitives, lengths, strict=True)]),
        mesh=np.repeat([part.mesh for part in primitives], lengths),
        name=np.repeat([part.name for part in primitives], lengths),
    )
    mesh, shapes = surface_of(whole, path.name), shapes[:, kept]
    if count or skinned.any():  # points on different bones may part
        mesh.point_data[MOVED] = blended(shapes) + skinned[kept] * np.ptp(points, axis=0).max()
    return mesh, kept, shapes


def joined_texture(textures: Sequence[np.ndarray | None], lengths: Sequence[int]) -> np.ndarray | None:
    """Texture coordinates (m, 3, 2) at the corners of several meshes, 0 on those without; None if all are."""
    if all(own is None for own in textures):
        return None
    rows = [np.zeros((m, 3, 2)) if own is None else own for own, m in zip(textures, lengths, strict=True)]
    return np.concatenate(rows)


def surface_of(mesh: Primitive, name: str) -> pv.PolyData:
    """The mesh of a file as PolyData, its points as they are; `name` is for errors."""
    _check_counts(len(mesh.points), len(mesh.triangles), name)
    surface = to_polydata(mesh.points, mesh.triangles)
    if mesh.colors is not None:
        surface.point_data[COLORS] = _colors(mesh.colors)
    set_meshes(surface, np.broadcast_to(mesh.mesh, len(mesh.triangles)))
    set_labels(surface, NAME, np.broadcast_to(mesh.name, len(mesh.triangles)))
    if mesh.texture is not None:
        set_texture(surface, mesh.texture)
        set_labels(surface, IMAGE, np.broadcast_to(mesh.image, len(mesh.triangles)))
    return surface


def set_meshes(surface: pv.PolyData, owner: np.ndarray) -> None:
    """Store which mesh of its file each triangle (m,) belongs to, if there are several.

    Meshes that share points are one: groups of a file may be regions of one surface.
    """
    if len(owner) and (owner == owner[0]).all():
        return
    known, owner = np.unique(owner, return_inverse=True)
    triangles = np.asarray(surface.regular_faces)
    first = np.full(surface.n_points, -1)
    first[triangles.ravel()[::-1]] = np.repeat(owner, 3)[::-1]
    label = connected(np.stack([np.repeat(owner, 3), first[triangles.ravel()]], axis=1), len(known))
    if label.any():
        surface.cell_data[MESH] = label[owner]


def set_texture(mesh: pv.PolyData, at_corners: np.ndarray) -> None:
    """Give a mesh texture coordinates (m, 3, 2): points get the first of theirs, corners their own if these differ."""
    triangles = np.asarray(mesh.regular_faces)
    texture = np.zeros((mesh.n_points, 2))
    texture[triangles.ravel()[::-1]] = at_corners.reshape(-1, 2)[::-1]  # the first is written last
    mesh.point_data[TEXTURE] = texture
    use_texture(mesh, TEXTURE)
    add_seams(mesh, at_corners)


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


def merged_surfaces(surfaces: list[pv.PolyData]) -> pv.PolyData:
    """Return several surfaces as one, with the point data that all of them have, and with texture if one has it."""
    if len(surfaces) == 1:
        return surfaces[0]
    names = []
    for name in dict.fromkeys(name for surface in surfaces for name in surface.point_data):
        known = [surface.point_data[name].shape[1:] for surface in surfaces if name in surface.point_data]
        if len(set(known)) == 1 and (len(known) == len(surfaces) or name in MISSING):
            names.append(name)
    mesh = joined(surfaces, names, MISSING)
    owner, start = [], 0
    for surface in surfaces:
        own = np.asarray(surface.cell_data.get(MESH, np.zeros(surface.n_cells, np.int64)))
        owner.append(own + start)
        start += int(own.max(initial=0)) + 1
    set_meshes(mesh, np.concatenate(owner))
    lengths = [surface.n_cells for surface in surfaces]
    texture = joined_texture([corner_texture(surface) for surface in surfaces], lengths)
    if texture is not None:
        set_texture(mesh, texture)
    for array in (IMAGE, NAME):
        set_labels(mesh, array, np.concatenate([labels_of(surface, array) for surface in surfaces]))
    return mesh


def _colors(values: np.ndarray) -> np.ndarray:
    """Colors as uint8 or from 0 to 1, of values up to 1, up to 255 or, in 16 bits, up to 65535."""
    if values.dtype == np.uint8 or not values.size or not values.max() > 1:
        return values
    share = values / (255.0 if values.max() <= 255 else 65535.0)
    return np.asarray(np.rint(255.0 * np.clip(share, 0.0, 1.0)), dtype=np.uint8)


def from_dataset(data: Any, name: str) -> pv.PolyData:
    """Triangles of any data set that holds one surface; `name` is for errors."""
    if isinstance(data, pv.MultiBlock):
        leaves = data.recursive_iterator("items", prepend_names=True, separator="/")
        blocks = [(path, block) for path, block in leaves if _count_faces(block)]
        if not blocks:
            raise MeshError(f"{name} holds no surface: none of its {data.n_blocks} blocks has faces.")
        return merged_surfaces([from_dataset(block, f"{name}, block {path!r}") for path, block in blocks])
    if not isinstance(data, pv.PolyData):
        raise MeshError(
            f"{name} must hold triangles, quads or polygons, and is {type_of(data)}. Take its surface first: "
            "mesh.extract_surface()."
        )
    _check_counts(data.n_points, _count_faces(data), name)
    _check_cells(data, name)
    surface = with_data(data, _triangles(data), np.arange(data.n_points))
    if data.is_all_triangles:
        surface.cell_data.update(_known_cell_data(data, surface.n_cells))
    if is_frame(surface):
        if PART in surface.point_data and PARTS in surface.field_data:
            set_meshes(surface, np.asarray(surface.point_data[PART])[np.asarray(surface.regular_faces)[:, 0]])
        drop_frame_data(surface)
    return surface


def _check_counts(n_points: int, n_faces: int, name: str) -> None:
    if n_points == 0:
        raise MeshError(f"{name} has no points: it is empty, or not a mesh. Export it again, or name another file.")
    if n_faces == 0:
        raise MeshError(
            f"{name} has {n_points} points and no faces. A surface is needed: export polygons (not points or lines), "
            "or reconstruct one with mesh.reconstruct_surface()."
        )


def _known_cell_data(data: pv.PolyData, count: int) -> dict[str, np.ndarray]:
    """The cell data of a surface that was read before; other programs may give the same names to anything."""
    labels = {array: ((count,), "iu") for array in (IMAGE, NAME) if array + "s" in data.field_data}
    kinds = {CORNERS: ((count, 6), "f"), MESH: ((count,), "iu")} | labels
    known = {key: np.asarray(data.cell_data[key]) for key in kinds if key in data.cell_data}
    return {key: a for key, a in known.items() if a.shape == kinds[key][0] and a.dtype.kind in kinds[key][1]}


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
