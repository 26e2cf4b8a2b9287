"""The mesh of one frame as a file for other programs: glTF, OBJ or PLY, with normals, texture and colors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..appearance.seen import companion_meshes
from ..array_types import Array
from ..files import output_file, write_whole, written
from ..mesh import UNIT, MeshLike, is_frame, triangle_mesh
from ..progress import tell
from .gltf import gltf
from .model import WATER_INDEX, WATER_OPACITY, Model, Morphs, WeightTrack, part_model, skin_model, tears_model
from .usd import SUFFIXES as USD
from .usd import write_usd

HELD = "points, triangles, normals, texture and colors; VTK's formats (frame.save, --series) hold all arrays"
"""What an OBJ or PLY holds of a frame."""


def write_mesh(
    frame: MeshLike,
    path: str | Path,
    face: Face | None = None,
    *,
    parts: bool = False,
    tears: Iterable[pv.PolyData] = (),
) -> Path:
    """Write the mesh of one frame for other programs, refined and wrinkled, with normals, texture and colors.

    glTF holds everything in one file, in meters and upright, as the format asks: points stay as they are, and the nodes
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
        The face of the frame: its texture and axes, and the unit of a mesh that is no frame (else millimeters).
    parts : bool
        In glTF, add meshes for eyes, brows and lashes, for the teeth between parted lips, and for all parts that came
        with the face, such as hair.
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
    path = output_file(path, (".glb", ".gltf", ".obj", ".ply"))
    texture = path.with_name(f"{path.stem}_texture.png")  # pictures may be named like the mesh
    if is_frame(frame) and path.suffix.lower() in (".obj", ".ply"):
        tell(f"{path.name} holds {HELD}.")
    match path.suffix.lower():
        case ".obj":
            files = obj_files(skin, path, texture, water)
        case ".ply":
            files = ply_files(skin, path, texture)
            if water is not None:
                files |= ply_files(water, path.with_name(f"{path.stem}_tears.ply"), texture)
        case suffix:
            models = {"face": skin} | (part_models(face, frame) if parts and face is not None else {})
            if water is not None:
                models["tears"] = water
            unit = float(frame.field_data[UNIT][0]) if is_frame(frame) else 1.0
            unit = unit if face is None else face.unit
            files = {path: gltf(models, unit, upright_rotation(face), binary=suffix == ".glb")}
    for name, content in files.items():
        write_whole(name, content)
    return list(files)


def part_models(face: Face, frame: pv.PolyData, always: bool = False) -> dict[str, Model]:
    """Return all that is seen beside the skin, by name, with the textures of parts that came with the face.

    For `always` see :func:`facewrinkle.appearance.seen.companion_meshes`.
    """
    textures = {name: part.texture for name, part in face.parts.items()}
    return {name: part_model(mesh, textures.get(name)) for name, mesh in companion_meshes(face, frame, always).items()}


def write_models(
    path: Path,
    models: Mapping[str, Model],
    face: Face,
    morphs: Mapping[str, Morphs],
    tracks: Mapping[str, WeightTrack] | None = None,
    dense: bool = False,
) -> list[Path]:
    """Write meshes with blend shapes as glTF or USD; return the file, and then the pictures beside it."""
    unit, turn, suffix = face.unit, upright_rotation(face), path.suffix.lower()
    with written(path) as whole:
        if suffix in USD:
            return [path, *write_usd(whole, models, unit, turn, morphs, tracks, path)]
        binary = suffix == ".glb"
        whole.write_bytes(gltf(models, unit, turn, binary=binary, morphs=morphs, dense=dense, tracks=tracks))
    return [path]


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


def obj_files(skin: Model, path: Path, texture: Path, tears: Model | None = None) -> dict[Path, bytes]:
    """Return the content of an OBJ file and of the files that belong to it.

    The corners of its triangles name position, texture and normal one by one: nothing is split at seams.
    """
    material = path.with_suffix(".mtl")
    plain = skin.png is None and tears is None
    lines = _skin_lines(skin, [] if plain else [f"mtllib {material.name}", "g face", "usemtl skin"])
    if tears is not None:
        lines += _tears_lines(tears, skin.origin.max() + 1)
    files = {path: _text(lines)}
    if plain:
        return files
    lines = ["newmtl skin", "Kd 1 1 1", "Ks 0 0 0"]
    if skin.png is not None:
        lines += [f"map_Kd {texture.name}"]
        files[texture] = skin.png
    if tears is not None:
        lines += ["newmtl tears", "Kd 1 1 1", "Ks 1 1 1", "Ns 900", f"Ni {WATER_INDEX}", f"d {WATER_OPACITY}"]
        lines += ["illum 7"]
    return files | {material: _text(lines)}


def _skin_lines(skin: Model, material: list[str]) -> list[str]:
    n = int(skin.origin.max()) + 1
    lines = [f"# {n} vertices, {len(skin.triangles)} triangles", *material]
    if skin.colors is None:
        lines += _rows("v %.9g %.9g %.9g", skin.points[:n])
    else:
        lines += _rows("v %.9g %.9g %.9g %.4g %.4g %.4g", np.hstack([skin.points[:n], skin.colors[:n] / 255.0]))
    lines += _rows("vn %.6g %.6g %.6g", skin.normals[:n])
    corners = skin.origin[skin.triangles] + 1
    if skin.uv is None:
        return lines + _rows("f %d//%d %d//%d %d//%d", np.repeat(corners, 2, axis=1))
    lines += _rows("vt %.9g %.9g", skin.uv)
    numbers = np.stack([corners, skin.triangles + 1, corners], axis=2)
    return lines + _rows("f %d/%d/%d %d/%d/%d %d/%d/%d", numbers.reshape(-1, 9))


def _tears_lines(tears: Model, n: int) -> list[str]:
    """Return a group of tears behind a skin of n vertices."""
    corners = np.repeat(tears.triangles + 1, 2, axis=1) + n
    lines = ["g tears", "usemtl tears", *_rows("v %.9g %.9g %.9g", tears.points)]
    return lines + _rows("vn %.6g %.6g %.6g", tears.normals) + _rows("f %d//%d %d//%d %d//%d", corners)


def _rows(form: str, values: np.ndarray) -> list[str]:
    return [form % tuple(row) for row in values.tolist()]


def _text(lines: list[str]) -> bytes:
    return ("\n".join(lines) + "\n").encode()


def ply_files(model: Model, path: Path, texture: Path) -> dict[Path, bytes]:
    """Return the content of a PLY file, and of the texture beside it."""
    columns: list[tuple[str, str, np.ndarray]] = [
        ("x y z", "f4", model.points),
        ("nx ny nz", "f4", model.normals),
    ]
    if model.uv is not None:
        columns.append(("s t", "f4", model.uv))
    if model.colors is not None:
        columns.append(("red green blue", "u1", model.colors))
    names = [(name, kind) for group, kind, _ in columns for name in group.split()]
    vertices = np.empty(len(model.points), [(name, "<" + kind) for name, kind in names])
    for group, _, values in columns:
        for name, column in zip(group.split(), values.T, strict=True):
            vertices[name] = column
    faces = np.empty(len(model.triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, model.triangles
    header = ["ply", "format binary_little_endian 1.0"]
    header += [f"comment TextureFile {texture.name}"] if model.png is not None else []
    header += [f"element vertex {len(vertices)}"]
    header += [f"property {'float' if kind == 'f4' else 'uchar'} {name}" for name, kind in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header\n"]
    files = {path: "\n".join(header).encode() + vertices.tobytes() + faces.tobytes()}
    return files if model.png is None else files | {texture: model.png}
