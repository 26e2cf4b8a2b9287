"""Meshes with seams, which have one vertex on the mesh and several on the texture: refined, and split at the seams."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..geometry import RedGreenForest, interpolated, refined_values, split_vertices
from .arrays import CORNERS, TEXTURE, corner_texture, interpolated_point_data, to_polydata, use_texture
from .formats.reading import MeshLike, surface_in
from .surface import Surface


def refine(mesh: MeshLike, marked: npt.ArrayLike) -> pv.PolyData:
    """Split the marked triangles of a mesh in four and close the mesh around them, in one step of red-green refinement.

    Parameters
    ----------
    mesh : PolyData, or anything that `read_surface` takes
        Of triangles or polygons, which are triangulated. Not changed.
    marked : array_like of bool, shape (m,), or indices of triangles

    Returns
    -------
    PolyData
        The refined mesh with interpolated point data. New points follow the old ones; no vertex hangs on an edge.

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
    source = surface_in(mesh)
    triangles = source.triangles.astype(np.int32)
    forest = RedGreenForest(triangles, n_points=len(source.points))
    forest.split(marked)
    points = interpolated(source.points, forest.corners, forest.barycentric)
    data = interpolated_point_data(source.point_data, forest.corners, forest.barycentric)
    texture = None if source.texture is None else refined_values(source.texture, triangles, forest)
    return Surface(points, forest.triangles, texture, data, active=source.active).mesh


def refine_seams(source: pv.PolyData, fine: pv.PolyData, forest: RedGreenForest) -> None:
    """Give a refined mesh the texture coordinates at the corners of its source, interpolated, if it has seams."""
    if CORNERS in source.cell_data:
        corners = np.asarray(source.cell_data[CORNERS], dtype=np.float64).reshape(-1, 3, 2)
        fine.cell_data[CORNERS] = refined_values(corners, source.regular_faces, forest).reshape(-1, 6)


def split_at_seams(mesh: pv.PolyData) -> pv.PolyData:
    """Return the mesh as pictures and files need it: with points at seams once for each of their texture coordinates.

    Parameters
    ----------
    mesh : PolyData
        A frame, the mesh of a face, or a mesh from :func:`facewrinkle.read_surface`. Not changed.

    Returns
    -------
    PolyData
        The points of the mesh in their order, then their twins at the seams, with exactly the same position, normal and
        data. The mesh itself if it has no seams.

    Examples
    --------
    >>> import numpy as np
    >>> from facewrinkle.mesh import add_seams
    >>> sheet = to_polydata([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.array([[0, 1, 2], [2, 1, 3]]))
    >>> add_seams(sheet, np.array([[[0, 0], [1, 0], [0, 1]], [[0, 1], [0.5, 0], [1, 1]]]))
    >>> apart = split_at_seams(sheet)
    >>> apart.n_points, apart.active_texture_coordinates[[1, 4]].tolist()
    (5, [[1.0, 0.0], [0.5, 0.0]])
    """
    corners = corner_texture(mesh) if mesh.GetCellData().HasArray(CORNERS) else None
    if corners is None:
        return mesh
    parts = split_vertices(mesh.regular_faces, corners, mesh.n_points)
    data = {name: np.asarray(values)[parts.origin] for name, values in mesh.point_data.items()}
    name = mesh.point_data.active_texture_coordinates_name or TEXTURE
    apart = to_polydata(np.asarray(mesh.points)[parts.origin], parts.triangles, data | {name: parts.values})
    use_texture(apart, name)
    apart.point_data.active_normals_name = mesh.point_data.active_normals_name
    apart.field_data.update(mesh.field_data)
    return apart
