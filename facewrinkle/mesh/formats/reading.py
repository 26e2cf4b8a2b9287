"""Triangles, from files and from meshes of other libraries."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pyvista as pv
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkPolyData

from ...errors import MeshError
from ...files import check_file, check_inside, path_of, reading, text_of
from ..arrays import COLORS, numbers, to_polydata
from ..surface import Surface
from .gltf import read_gltf_file
from .merging import checked, from_dataset, merged_primitives
from .ply import read_ply
from .polygons import read_obj, read_off, read_stl
from .probing import OF_VTK, probe
from .usd import read_usd_file

GLTF = (".glb", ".gltf", ".vrm")
USD = (".usd", ".usda", ".usdc", ".usdz")
READERS = {".obj": read_obj, ".off": read_off, ".stl": read_stl, ".ply": read_ply}


class HasMeshes(Protocol):
    """Several meshes of another library, such as a trimesh.Scene."""

    def to_geometry(self) -> Any:
        """Return all of them as one."""


class HasFaces(Protocol):
    """A mesh of another library, such as a trimesh.Trimesh."""

    @property
    def vertices(self) -> Any:
        """Points (n, 3)."""

    @property
    def faces(self) -> Any:
        """Triangles (m, 3)."""


MeshLike = pv.DataSet | pv.MultiBlock | vtkDataObject | HasFaces | HasMeshes | Surface | str | Path
"""All that :func:`read_surface` takes; every function that takes a mesh takes these."""


def read_surface(source: MeshLike) -> pv.PolyData:
    """Return the triangles of a file or of a mesh of another library, with the points numbered as in the source.

    Polygons are split into triangles (along the shorter diagonal of a quad). If the texture has seams, points keep
    the first of their texture coordinates, and the cell data "Texture Corners" holds those of all corners. What else a
    file tells, such as names of objects and images, goes along to :func:`facewrinkle.fit_face`. What a simulation has
    written to its frames is left out; other point data and field data are kept; lines and loose points are ignored.

    Parameters
    ----------
    source : path, PolyData or multi-block of PyVista or VTK, or trimesh-like object
        OBJ, OFF, PLY, STL, glTF, USD or a VTK format; a PolyData, or a multi-block of several; an object with
        `vertices` (n, 3) and `faces` (m, 3), or a trimesh.Scene of such.

    Returns
    -------
    pyvista.PolyData
        Triangles only, float64 points; a new object.

    Raises
    ------
    MeshError
        If there is no such file, if it cannot be read, or if it holds no surface.

    Examples
    --------
    >>> import pyvista as pv
    >>> read_surface(pv.Plane(i_resolution=2, j_resolution=3)).n_cells
    12
    """
    return surface_in(source).to_polydata()


def surface_in(source: MeshLike) -> Surface:
    """Return what :func:`read_surface` does, as arrays."""
    if isinstance(source, Surface):
        return source
    if isinstance(source, str | Path):
        path = path_of(source)
        check_file(path)
        with reading(path):
            return _read_by_ending(path)
    if isinstance(source, vtkDataObject):
        return from_dataset(source if isinstance(source, pv.DataObject) else pv.wrap(source), "the mesh")
    source = one_mesh(source)
    if hasattr(source, "vertices") and hasattr(source, "faces"):
        return _from_trimesh(source)
    raise MeshError(
        "a mesh must be a path, a PyVista or VTK data set, or an object with vertices and faces such as a "
        f"trimesh.Trimesh, received {type(source).__name__}."
    )


def one_mesh(source: Any) -> Any:
    """Return a scene of trimesh, as it reads from most files, as one mesh; anything else as it is.

    Raises
    ------
    MeshError
        For a scene without meshes.
    """
    if not hasattr(source, "to_geometry"):
        return source
    mesh = source.to_geometry()
    if not len(getattr(mesh, "faces", ())):
        raise MeshError("the scene has no mesh: it is empty, or holds only lines or points. Load another file.")
    return mesh


def triangle_mesh(mesh: MeshLike) -> pv.PolyData:
    """Return a mesh of triangles as it is, with all its arrays, and any other by :func:`read_surface`.

    Examples
    --------
    >>> sheet = pv.Plane().triangulate()
    >>> triangle_mesh(sheet) is sheet, triangle_mesh(pv.Plane()).is_all_triangles
    (True, True)
    """
    mesh = pv.wrap(mesh) if isinstance(mesh, vtkPolyData) else mesh
    return mesh if isinstance(mesh, pv.PolyData) and mesh.n_cells and mesh.is_all_triangles else read_surface(mesh)


def _read_by_ending(path: Path) -> Surface:
    ending = path.suffix.lower()
    if ending in READERS:
        return checked(READERS[ending](path), path.name)
    if ending in (*GLTF, *USD):
        return merged_primitives(read_gltf_file(path) if ending in GLTF else read_usd_file(path), path)[0]
    if ending in OF_VTK:
        # The file may have come from anywhere, and name any image.
        return from_dataset(_read_with_vtk(path), path.name).without_images()
    if path.suffix == ".face":
        raise MeshError(f"{path.name} holds a face that has been fitted: facewrinkle.read_face(path), or --face PATH.")
    ending = f"for {path.suffix!r}" if path.suffix else "for a file without an ending"
    raise MeshError(
        f"{path.name}: there is no reader {ending}. Export the mesh as one of: OBJ, OFF, PLY, STL, glTF, VTK (.vtk, "
        ".vtp, .vtm, .vtkhdf), USD."
    )


def _read_with_vtk(path: Path) -> Any:
    if path.suffix.lower() == ".vtm":
        _check_pieces(path)
    probe(path)
    data, messages = None, []
    with pv.vtk_verbosity("off"), pv.VtkErrorCatcher(send_to_logging=False) as caught:
        try:
            reader = pv.get_reader(str(path)).reader  # whose own read() repeats errors in the log of Python
            reader.Update()
            data = pv.wrap(reader.GetOutputDataObject(0))
        except Exception as problem:  # every format fails in its own way
            messages = [str(problem).splitlines()[-1]]
    messages = [event.alert.splitlines()[0] for event in caught.error_events if event.alert] + messages
    if data is None or _is_empty(data):
        useful = [line for line in messages if not line.startswith("Algorithm")]
        reason = useful[0] if useful else "VTK finds nothing in it"
        raise MeshError(
            f"{path.name} cannot be read: {reason.rstrip('.')}. The file is damaged or of another format: "
            "export it again, or as OBJ or PLY."
        )
    return data


def _check_pieces(path: Path) -> None:
    """Raise a MeshError if a multi-block file names pieces outside its folder, or what is no ordinary file."""
    for name in re.findall(r"""\bfile\s*=\s*["']([^"']*)["']""", text_of(path)):
        piece = path.parent / html.unescape(name)
        check_inside(path.parent, piece, path.name, name)
        check_file(piece)


def _is_empty(data: Any) -> bool:
    if isinstance(data, pv.MultiBlock):
        return next(data.recursive_iterator(skip_none=True, skip_empty=True), None) is None
    return isinstance(data, pv.DataSet) and data.n_points == 0


def _from_trimesh(source: Any) -> Surface:
    faces = numbers("faces", source.faces)
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise MeshError(f"faces must have the shape (m, 3), received {faces.shape}. Triangulate the mesh first.")
    surface = Surface.of(to_polydata(source.vertices, faces))  # which checks them
    visual = getattr(source, "visual", None)
    texture = getattr(visual, "uv", None)
    if texture is not None and len(texture) == len(surface.points):
        surface = replace(surface, texture=np.array(texture, dtype=np.float64)[faces])
    if visual is not None and getattr(visual, "kind", None) == "vertex":
        surface = replace(surface, point_data={COLORS: np.array(visual.vertex_colors)})
    return surface
