"""Several meshes, such as those of a scene, become one surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyvista as pv
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ...errors import MeshError
from ..arrays import COLORS, IMAGE, MESH, MOVED, TEXTURE, blended, images_of, name_images, to_polydata, use_texture
from ..seams import add_seams, corner_texture
from .polygons import Primitive

MISSING = {COLORS: np.uint8(255), MOVED: 0.0}
"""Values for meshes without colours or motion that are merged with others that have them."""


def from_primitives(primitives: list[Primitive], path: Path) -> pv.PolyData:
    """Return all meshes of a scene as one surface, with points that were split at seams of a mesh welded."""
    return merged_primitives(primitives, path)[0]


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
    mesh = to_polydata(points[kept], number[triangles])
    shapes = shapes[:, kept]
    if count or skinned.any():  # points on different bones may part
        mesh.point_data[MOVED] = blended(shapes) + skinned[kept] * np.ptp(points, axis=0).max()
    if any(part.colors is not None for part in primitives):
        mesh.point_data[COLORS] = colors[kept]
    if any(part.texture is not None for part in primitives):
        nothing = [np.zeros((len(part.triangles), 3, 2)) for part in primitives]
        at_corners = np.concatenate(
            [none if part.texture is None else part.texture for part, none in zip(primitives, nothing, strict=True)]
        )
        set_texture(mesh, at_corners)
    images = ["" if part.texture is None else part.image for part in primitives]
    lengths = [len(part.triangles) for part in primitives]
    set_meshes(mesh, np.repeat([part.mesh for part in primitives], lengths))
    set_images(mesh, np.concatenate([np.broadcast_to(i, m) for i, m in zip(images, lengths, strict=True)]))
    return mesh, kept, shapes


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
    links = coo_array(
        (np.ones(triangles.size, np.int8), (np.repeat(owner, 3), first[triangles.ravel()])), shape=(len(known),) * 2
    )
    count, label = connected_components(links, directed=False)
    if count > 1:
        surface.cell_data[MESH] = label[owner]


def set_images(mesh: pv.PolyData, images: np.ndarray) -> None:
    """Store the name of the image on each triangle (m,), "" for none, with the mesh."""
    known, number = np.unique(images, return_inverse=True)  # sorted, so "" comes first
    bare = int("" in known)
    if len(known) > bare:
        mesh.cell_data[IMAGE] = number.ravel() - bare
        name_images(mesh, known[bare:].tolist())


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
    starts = np.cumsum([0, *(surface.n_points for surface in surfaces[:-1])])
    data = {}
    for key in dict.fromkeys(key for surface in surfaces for key in surface.point_data):
        shape = next(surface.point_data[key].shape[1:] for surface in surfaces if key in surface.point_data)
        rows = [
            np.asarray(s.point_data[key]) if key in s.point_data else np.full((s.n_points, *shape), MISSING[key])
            for s in surfaces
            if key in s.point_data or key in MISSING
        ]
        if len(rows) == len(surfaces) and all(row.shape[1:] == shape for row in rows):
            data[key] = np.concatenate(rows)
    mesh = to_polydata(
        np.concatenate([surface.points for surface in surfaces]),
        np.concatenate([surface.regular_faces + start for surface, start in zip(surfaces, starts, strict=True)]),
        data,
    )
    owner, start = [], 0
    for surface in surfaces:
        own = np.asarray(surface.cell_data.get(MESH, np.zeros(surface.n_cells, np.int64)))
        owner.append(own + start)
        start += int(own.max(initial=0)) + 1
    set_meshes(mesh, np.concatenate(owner))
    corners = [corner_texture(surface) for surface in surfaces]
    if any(own is not None for own in corners):
        rows = [np.zeros((s.n_cells, 3, 2)) if c is None else c for s, c in zip(surfaces, corners, strict=True)]
        set_texture(mesh, np.concatenate(rows))
    if any(IMAGE in surface.cell_data for surface in surfaces):
        names = [np.array([*images_of(s), ""]) for s in surfaces]
        numbered = [np.asarray(s.cell_data.get(IMAGE, np.full(s.n_cells, -1))) for s in surfaces]
        set_images(mesh, np.concatenate([own[number] for own, number in zip(names, numbered, strict=True)]))
    return mesh
