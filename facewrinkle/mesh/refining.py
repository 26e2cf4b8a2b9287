"""Red-green refinement of a PolyData in one step."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..errors import MeshError
from ..geometry.interpolation import interpolated
from ..geometry.refinement import RedGreenForest
from .arrays import interpolated_point_data, to_polydata, use_texture
from .formats.reading import MeshLike, read_surface
from .seams import refine_seams


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
    source = read_surface(mesh)
    triangles = np.asarray(source.regular_faces, dtype=np.int32)
    if len(triangles) == 0:
        raise MeshError("the mesh has no faces to refine.")
    forest = RedGreenForest(triangles, n_points=source.n_points)
    forest.split(marked)
    points = interpolated(np.asarray(source.points, dtype=np.float64), forest.corners, forest.barycentric)
    data = interpolated_point_data(dict(source.point_data), forest.corners, forest.barycentric)
    fine = to_polydata(points, forest.triangles, data)
    use_texture(fine, source.point_data.active_texture_coordinates_name)
    refine_seams(source, fine, forest)
    return fine
