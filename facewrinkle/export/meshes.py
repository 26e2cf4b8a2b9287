"""The mesh of one frame as a file for other programs: glTF, OBJ or PLY, with normals, texture and colours."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..appearance.seen import companion_meshes
from ..array_types import Array
from ..files import output_file, written
from ..mesh import UNIT, MeshLike, triangle_mesh
from .gltf import gltf
from .model import Model, part_model, skin_model, tears_model
from .obj_ply import obj_files, ply_files

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")


def write_mesh(
    frame: MeshLike,
    path: str | Path,
    face: Face | None = None,
    *,
    parts: bool = False,
    tears: Iterable[pv.PolyData] = (),
) -> Path:
    """Write the mesh of one frame for other programs, refined and wrinkled, with normals, texture and colours.

    glTF holds everything in one file, in metres and upright, as the format asks: points stay as they are, and the nodes
    scale them, and turn them by right angles until the face looks along +z with +y up. OBJ comes with NAME.mtl, and
    OBJ and PLY with the texture as NAME_texture.png. Where the format needs it (glTF, PLY), points at seams of the
    texture are split; their positions and normals are the same. ``frame.save`` writes VTK's own formats, with all
    fields.

    Parameters
    ----------
    frame : PolyData, or anything that `read_surface` takes
        A frame of a simulation, the mesh of a face, or any other mesh.
    path : path
        Ends in .glb, .gltf, .obj or .ply. An existing file is replaced.
    face : Face, optional
        The face of the frame: its texture and axes, and the unit of a mesh that is no frame (else millimetres).
    parts : bool
        In glTF, add meshes for eyes, for the teeth between parted lips, and for all parts that came with the face, such
        as hair.
    tears : iterable of PolyData
        Surfaces of tears at this time. In glTF they are a transparent mesh "tears", in OBJ a group of this name with a
        material of its own; PLY knows neither, and they go to a second file, NAME_tears.ply.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    MeshError
        If there are no triangles, or no texture coordinates for the face's texture.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import tempfile
    >>> face = fw.default_face()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = fw.write_mesh(face.mesh, f"{folder}/head.obj", face)
    ...     sorted(file.name for file in path.parent.iterdir())
    ['head.mtl', 'head.obj', 'head_texture.png']

    With a tear, one second after it left the eye:

    >>> tears = fw.tears.surfaces(fw.tears.preset("one_tear", face), 1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = fw.write_mesh(face.mesh, f"{folder}/crying.ply", tears=tears)
    ...     sorted(file.name for file in path.parent.iterdir())
    ['crying.ply', 'crying_tears.ply']
    """
    return write_mesh_files(frame, path, face, parts=parts, tears=tears)[0]


def write_mesh_files(
    frame: MeshLike,
    path: str | Path,
    face: Face | None = None,
    *,
    parts: bool = False,
    tears: Iterable[pv.PolyData] = (),
) -> list[Path]:
    """Write a mesh as :func:`write_mesh` does; return its file, and then those beside it."""
    frame = triangle_mesh(frame)
    skin, water = skin_model(frame, face), tears_model(tears)
    path = output_file(path, SUFFIXES)
    match path.suffix.lower():
        case ".obj":
            files = obj_files(skin, path, _texture_file(path), water)
        case ".ply":
            files = ply_files(skin, path, _texture_file(path))
            if water is not None:
                files |= ply_files(water, path.with_name(f"{path.stem}_tears.ply"), _texture_file(path))
        case suffix:
            models = {"face": skin} | (part_models(face, frame) if parts and face is not None else {})
            if water is not None:
                models["tears"] = water
            unit = float(frame.field_data[UNIT][0]) if UNIT in frame.field_data else 1.0
            unit = unit if face is None else face.unit
            files = {path: gltf(models, unit, upright_rotation(face), binary=suffix == ".glb")}
    for name, content in files.items():
        with written(name) as whole:
            whole.write_bytes(content)
    return list(files)


def _texture_file(path: Path) -> Path:
    """Path of the texture of a mesh file, unlike that of pictures, which may be named like the mesh."""
    return path.with_name(f"{path.stem}_texture.png")


def part_models(face: Face, frame: pv.PolyData, always: bool = False) -> dict[str, Model]:
    """Return all that is seen beside the skin, by name, with the textures of parts that came with the face.

    For `always` see :func:`facewrinkle.appearance.seen.companion_meshes`.
    """
    textures = {name: part.texture for name, part in face.parts.items()}
    return {name: part_model(mesh, textures.get(name)) for name, mesh in companion_meshes(face, frame, always).items()}


def upright_rotation(face: Face | None) -> Array | None:
    """Return the rotation by right angles that brings a face closest to +y up and +z forward; None for no turn."""
    if face is None or not face.landmarks:
        return None
    from scipy.optimize import linear_sum_assignment  # every command would import it

    axes = face.frame.axes
    rows, columns = linear_sum_assignment(-np.abs(axes))
    rotation = np.zeros((3, 3))
    rotation[rows, columns] = np.sign(axes[rows, columns])
    return None if np.linalg.det(rotation) < 0.0 or (rotation == np.eye(3)).all() else rotation
