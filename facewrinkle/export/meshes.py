"""The mesh of a moment as a file for other programs: glTF, OBJ or PLY, with normals, texture and colours."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.optimize import linear_sum_assignment

from ..anatomy.face import Face
from ..appearance.companion_meshes import companion_meshes
from ..errors import MeshError, OutputError
from ..geometry.normals import vertex_normals
from ..mesh import UNIT, split_at_seams, with_normals
from ..mesh.files import output_file, replaced
from .gltf import CLEAR, WATER, gltf
from .model import Model

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")


def write_mesh(
    frame: pv.PolyData,
    path: str | Path,
    face: Face | None = None,
    *,
    parts: bool = False,
    tears: Iterable[pv.PolyData] = (),
) -> Path:
    """Write the mesh of a moment for other programs, refined and wrinkled as it is, with normals, texture and colours.

    glTF holds all in one file, in metres and upright, as the format asks: points stay as they are, and the nodes scale
    and turn them by right angles, so that a face that is given looks along +z with +y up. OBJ comes with NAME.mtl, and
    OBJ and PLY with the texture as NAME_texture.png. Points at seams of the texture are split where the format needs it
    (glTF, PLY); their positions and normals are the same. For VTK's own formats, with all fields, there is
    ``frame.save``.

    Parameters
    ----------
    frame : PolyData
        A frame of a simulation, or the mesh of a face.
    path : path
        Ends in .glb, .gltf, .obj or .ply. An existing file is replaced.
    face : Face, optional
        The face of the frame, for its texture, and for the unit of a mesh that is no frame (else millimetres).
    parts : bool
        In glTF, write what came with the face (eyes, teeth, hair), else eyes, and between parted lips teeth, as meshes
        of their own.
    tears : iterable of PolyData
        Surfaces of tears at this moment. glTF holds them as a transparent mesh "tears", OBJ as a group of this name
        with a material of its own; PLY knows neither, and they are a file beside it, NAME_tears.ply.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    MeshError
        If there are no triangles, or no texture coordinates for the face's texture.
    OutputError
        If the file cannot be written.
    MissingPackageError
        For glTF without pygltflib (extra `export`).

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import tempfile
    >>> face = fw.default_face()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = fw.write_mesh(face.mesh, f"{folder}/head.obj", face)
    ...     sorted(file.name for file in path.parent.iterdir())
    ['head.mtl', 'head.obj', 'head_texture.png']

    With a tear, one second after it came out:

    >>> tears = fw.tears.surfaces(fw.tears.preset("one_tear", face), 1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = fw.write_mesh(face.mesh, f"{folder}/crying.ply", tears=tears)
    ...     sorted(file.name for file in path.parent.iterdir())
    ['crying.ply', 'crying_tears.ply']
    """
    model = _model(frame, face)
    path, water = output_file(path, SUFFIXES), _water(tears)
    match path.suffix.lower():
        case ".obj":
            files = _obj(model, path, water)
        case ".ply":
            files = _ply(model, path) | ({} if water is None else _ply(water, tears_of_ply(path)))
        case ending:
            others = companion_meshes(face, frame) if parts and face is not None else {}
            models = {"face": model} | {name: _part(part, _own_texture(face, name)) for name, part in others.items()}
            if water is not None:
                models["tears"] = water
            files = {path: gltf(models, _unit(frame, face), _upright(face), binary=ending == ".glb")}
    for name, content in files.items():
        try:
            with replaced(name) as whole:
                whole.write_bytes(content)
        except OSError as problem:
            raise OutputError(f"{str(name)!r} cannot be written: {problem.strerror}. Name another file.") from None
    return path


def _own_texture(face: Face | None, name: str) -> Image | None:
    part = None if face is None else face.parts.get(name)
    return None if part is None else part.texture


def _part(part: pv.PolyData, image: Image | None) -> Model:
    """What is drawn beside the skin, with `paint` or a texture."""
    points, triangles = np.asarray(part.points, np.float64), np.asarray(part.triangulate().regular_faces, np.int64)
    normals = part.point_data.get("Normals")  # an eye has those of its cornea
    return Model(
        points=points,
        normals=vertex_normals(points, triangles) if normals is None else np.asarray(normals),
        triangles=triangles,
        origin=np.arange(len(points)),
        uv=None if image is None else np.asarray(part.active_texture_coordinates, dtype=np.float64),
        colours=_colours(part, "paint"),
        png=None if image is None else _png(image),
        cutout=image is not None and image.shape[2] == 4,
    )


def tears_of_ply(path: Path) -> Path:
    """Where the tears of a PLY file are."""
    return path.with_name(f"{path.stem}_tears{path.suffix}")


def companion_files(path: Path, *, textured: bool, tears: bool) -> list[Path]:
    """The files that :func:`write_mesh` writes beside one."""
    match path.suffix.lower():
        case ".obj":
            found = [path.with_suffix(".mtl")] if textured or tears else []
        case ".ply":
            found = [tears_of_ply(path)] if tears else []
        case _:
            return []
    return [*found, _image(path)] if textured else found


def _water(tears: Iterable[pv.PolyData]) -> Model | None:
    """All tears as one."""
    surfaces = [tear for tear in tears if tear.n_cells]
    if not surfaces:
        return None
    return replace(_part(pv.merge(surfaces) if len(surfaces) > 1 else surfaces[0], None), colours=None, clear=True)


def _unit(frame: pv.PolyData, face: Face | None) -> float:
    """Millimetres per unit of the mesh."""
    if face is not None:
        return face.unit
    return float(frame.field_data[UNIT][0]) if UNIT in frame.field_data else 1.0


def _upright(face: Face | None) -> Array | None:
    """The rotation by right angles that brings the face closest to +y up and +z forward; none where it is so."""
    if face is None or not face.landmarks:
        return None
    axes = face.frame.axes
    rows, columns = linear_sum_assignment(-np.abs(axes))
    turn = np.zeros((3, 3))
    turn[rows, columns] = np.sign(axes[rows, columns])
    return None if np.linalg.det(turn) < 0.0 or (turn == np.eye(3)).all() else turn


def _model(frame: pv.PolyData, face: Face | None) -> Model:
    if not isinstance(frame, pv.PolyData) or not frame.n_cells or not frame.is_all_triangles:
        raise MeshError(
            "a mesh of triangles is needed, such as a frame or the mesh of a face. Pass other meshes through "
            "read_surface."
        )
    shaded = with_normals(frame)
    shaded.point_data[ORIGIN] = np.arange(frame.n_points)
    apart = split_at_seams(shaded)
    uv, image = apart.active_texture_coordinates, None if face is None else face.texture
    if image is not None and uv is None:
        raise MeshError(
            "the face has a texture, and the frame has no texture coordinates by which it would lie on it. Is it a "
            "frame of this face?"
        )
    return Model(
        points=np.asarray(apart.points, dtype=np.float64),
        normals=np.asarray(apart.point_data["Normals"], dtype=np.float64),
        triangles=np.asarray(apart.regular_faces, dtype=np.int64),
        origin=np.asarray(apart.point_data[ORIGIN]),
        uv=None if uv is None else np.asarray(uv, dtype=np.float64),
        colours=_colours(apart),
        png=None if image is None else _png(image),
    )


ORIGIN = " origin"


def _png(image: Image) -> bytes:
    from PIL import Image as Pillow

    stream = BytesIO()
    Pillow.fromarray(image).save(stream, format="PNG")
    return stream.getvalue()


def _colours(mesh: pv.PolyData, name: str = "Colors") -> Image | None:
    colours = mesh.point_data.get(name)
    if colours is None or colours.ndim != 2 or colours.shape[1] < 3:
        return None
    rgb = np.asarray(colours)[:, :3]
    return rgb if rgb.dtype == np.uint8 else np.rint(255.0 * np.clip(rgb, 0.0, 1.0)).astype(np.uint8)


# --- OBJ ----------------------------------------------------------------------------------------


def _obj(model: Model, path: Path, water: Model | None = None) -> dict[Path, bytes]:
    """The files of an OBJ. Its corners name position, texture and normal one by one: nothing is split at seams."""
    n = int(model.origin.max()) + 1
    lines = [f"# {n} vertices, {len(model.triangles)} triangles"]
    material = path.with_suffix(".mtl")
    if model.png is not None or water is not None:
        lines += [f"mtllib {material.name}", "g face", "usemtl skin"]
    if model.colours is None:
        lines += _rows("v %.9g %.9g %.9g", model.points[:n])
    else:
        lines += _rows("v %.9g %.9g %.9g %.4g %.4g %.4g", np.hstack([model.points[:n], model.colours[:n] / 255.0]))
    lines += _rows("vn %.6g %.6g %.6g", model.normals[:n])
    corner = model.origin[model.triangles] + 1
    if model.uv is not None:
        lines += _rows("vt %.9g %.9g", model.uv)
        numbers = np.stack([corner, model.triangles + 1, corner], axis=2)
        lines += _rows("f %d/%d/%d %d/%d/%d %d/%d/%d", numbers.reshape(-1, 9))
    else:
        lines += _rows("f %d//%d %d//%d %d//%d", np.repeat(corner, 2, axis=1))
    if water is not None:
        corner = np.repeat(water.triangles + 1, 2, axis=1) + n
        lines += ["g tears", "usemtl tears", *_rows("v %.9g %.9g %.9g", water.points)]
        lines += [*_rows("vn %.6g %.6g %.6g", water.normals), *_rows("f %d//%d %d//%d %d//%d", corner)]
    files = {path: ("\n".join(lines) + "\n").encode()}
    if model.png is None and water is None:
        return files
    look = ["newmtl skin", "Kd 1 1 1", "Ks 0 0 0"]
    if model.png is not None:
        image = _image(path)
        look += [f"map_Kd {image.name}"]
        files[image] = model.png
    if water is not None:
        look += ["newmtl tears", "Kd 1 1 1", "Ks 1 1 1", "Ns 900", f"Ni {WATER}", f"d {CLEAR}", "illum 7"]
    return files | {material: ("\n".join(look) + "\n").encode()}


def _image(path: Path) -> Path:
    """Where the texture goes: pictures of the mesh may have its own name."""
    return path.with_name(f"{path.stem}_texture.png")


def _rows(form: str, values: np.ndarray) -> list[str]:
    return [form % tuple(row) for row in values.tolist()]


# --- PLY ----------------------------------------------------------------------------------------


def _ply(model: Model, path: Path) -> dict[Path, bytes]:
    """The files of a binary PLY."""
    columns: list[tuple[str, str, np.ndarray]] = [
        ("x y z", "f4", model.points),
        ("nx ny nz", "f4", model.normals),
    ]
    if model.uv is not None:
        columns.append(("s t", "f4", model.uv))
    if model.colours is not None:
        columns.append(("red green blue", "u1", model.colours))
    names = [(name, kind) for group, kind, _ in columns for name in group.split()]
    vertices = np.empty(len(model.points), [(name, "<" + kind) for name, kind in names])
    for group, _, values in columns:
        for name, column in zip(group.split(), values.T, strict=True):
            vertices[name] = column
    faces = np.empty(len(model.triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, model.triangles
    image = _image(path)
    header = ["ply", "format binary_little_endian 1.0"]
    header += [f"comment TextureFile {image.name}"] if model.png is not None else []
    header += [f"element vertex {len(vertices)}"]
    header += [f"property {'float' if kind == 'f4' else 'uchar'} {name}" for name, kind in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header\n"]
    files = {path: "\n".join(header).encode() + vertices.tobytes() + faces.tobytes()}
    return files | ({image: model.png} if model.png is not None else {})
