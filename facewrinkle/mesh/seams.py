"""Texture coordinates of meshes with seams: one vertex on the mesh, several on the texture."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from ..geometry.refinement import RedGreenForest
from ..geometry.seams import refined_values, split_vertices
from .arrays import CORNERS, TEXTURE, to_polydata, use_texture


def corner_texture(mesh: pv.PolyData) -> np.ndarray | None:
    """Return texture coordinates (m, 3, 2) at the corners of the triangles, or None."""
    if CORNERS in mesh.cell_data:
        return np.asarray(mesh.cell_data[CORNERS], dtype=np.float64).reshape(-1, 3, 2)
    of_points = mesh.active_texture_coordinates
    return None if of_points is None else np.asarray(of_points, dtype=np.float64)[mesh.regular_faces]


def add_seams(mesh: pv.PolyData, corners: np.ndarray) -> None:
    """Store texture coordinates (m, 3, 2) at the corners of the triangles with the mesh, if they have seams."""
    if split_vertices(mesh.regular_faces, corners, mesh.n_points).origin.size > mesh.n_points:
        mesh.cell_data[CORNERS] = corners.reshape(-1, 6)


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
