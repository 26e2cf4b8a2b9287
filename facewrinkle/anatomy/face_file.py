"""Files of faces: the mesh with its landmarks and unit. Muscles, skull and eyes are placed anew when a file is read."""

from __future__ import annotations

import dataclasses
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..errors import MeshError, OutputError
from ..mesh import to_polydata
from ..mesh.arrays import CORNERS, PART
from ..mesh.files import replaced
from .atlas import Atlas
from .face import Face
from .parts import eyes_of, follower

VERSION = 1
SUFFIX = ".face"
_DATA = "point_data/"
_PARTS = "parts"


def write_face(face: Face, path: str | Path) -> Path:
    """Write a face, such as :func:`facewrinkle.fit_face` gives, to a file (a zip of NumPy arrays).

    Raises
    ------
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = fw.write_face(fw.default_face(), f"{folder}/head.face")
    ...     fw.read_face(path).mesh.n_cells
    4517
    """
    names = list(face.landmarks)
    arrays: dict[str, Any] = {
        "version": VERSION,
        "unit": face.unit,
        "age": face.age,
        "landmark_names": np.array(names),
        "landmarks": np.array([face.landmarks[name] for name in names]),
        "confidences": np.array([face.confidences.get(name, np.nan) for name in names]),
        "estimated": np.array(face.estimated, dtype=str),
        "report": np.array(face.report, dtype=str),
    }
    if face.likeness is not None:
        arrays["likeness"] = face.likeness
    arrays |= _stored("", face.mesh, face.texture)
    for name, part in face.parts.items():
        arrays |= _stored(f"{_PARTS}/{name}/", part.mesh, part.texture)
    target = Path(os.path.expanduser(path))
    try:
        with replaced(target) as whole, whole.open("wb") as file:
            np.savez_compressed(file, **arrays)
    except OSError as problem:
        raise OutputError(f"{str(target)!r} cannot be written: {problem.strerror or problem}.") from None
    return target


def _stored(key: str, mesh: pv.PolyData, texture: npt.NDArray[np.uint8] | None) -> dict[str, Any]:
    """The arrays of a mesh and its texture; their names begin with `key`."""
    arrays: dict[str, Any] = {
        key + "points": np.asarray(mesh.points),
        key + "triangles": np.asarray(mesh.regular_faces),
        key + "texture_coordinates": np.array(mesh.point_data.active_texture_coordinates_name or "", dtype=str),
    }
    for name, values in mesh.point_data.items():
        if np.asarray(values).dtype.kind in "fiub" and "/" not in name:
            arrays[key + _DATA + name] = np.asarray(values)
    for name in (CORNERS, PART):
        if name in mesh.cell_data:
            arrays[key + name] = np.asarray(mesh.cell_data[name])
    return arrays if texture is None else arrays | {key + "texture": texture}


def _restored(data: dict[str, Any], key: str) -> tuple[pv.PolyData, npt.NDArray[np.uint8] | None]:
    """The mesh and texture whose arrays `_stored` gave."""
    data = {name.removeprefix(key): values for name, values in data.items() if name.startswith(key)}
    point_data = {name.removeprefix(_DATA): values for name, values in data.items() if name.startswith(_DATA)}
    mesh = to_polydata(data["points"], data["triangles"], point_data)
    if texture := str(data["texture_coordinates"]):
        mesh.point_data.active_texture_coordinates_name = texture
    for name in (CORNERS, PART):
        if name in data:
            mesh.cell_data[name] = data[name]
    return mesh, data.get("texture")


def read_face(path: str | Path, atlas: Atlas | None = None) -> Face:
    """Read a face that :func:`write_face` wrote.

    Parameters
    ----------
    path : str or Path
    atlas : Atlas, optional
        Other muscles than those that come with the package.

    Raises
    ------
    MeshError
        If there is no such file, or it is damaged, of another kind or of a later version.

    Examples
    --------
    >>> import tempfile
    >>> import facewrinkle as fw
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     face = read_face(write_face(fw.default_face(), f"{folder}/head.face"))
    >>> face.unit, len(face.landmarks)
    (1.0, 33)
    """
    source = Path(os.path.expanduser(path))
    try:
        with source.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            data = {name: stored[name] for name in stored.files}
        return _face(data, source.name, atlas)
    except OSError as problem:
        raise MeshError(f"{str(source)!r} cannot be read: {problem.strerror or problem}.") from None
    except (KeyError, TypeError, AttributeError, ValueError, EOFError, zipfile.BadZipFile) as problem:
        if isinstance(problem, MeshError):
            raise
        raise MeshError(
            f"{source.name} is no face that facewrinkle wrote, or it is damaged ({problem}). Make it anew: "
            "facewrinkle fit MESH."
        ) from None


def _face(data: dict[str, Any], name: str, atlas: Atlas | None) -> Face:
    if int(data["version"]) > VERSION:
        raise MeshError(f"{name} was written by a later facewrinkle (format {data['version']}, known is {VERSION}).")
    mesh, texture = _restored(data, "")
    names = data["landmark_names"].tolist()
    landmarks = dict(zip(names, data["landmarks"].astype(np.float64), strict=True))
    known = {n: float(c) for n, c in zip(names, data["confidences"], strict=True) if np.isfinite(c)}
    estimated = tuple(data["estimated"].tolist())
    face = Face.from_landmarks(mesh, landmarks, float(data["unit"]), atlas, estimated)
    parts = {
        name: follower(name, *_restored(data, f"{_PARTS}/{name}/"))
        for name in sorted({k.split("/")[1] for k in data if k.startswith(_PARTS)})
    }
    eyes = eyes_of(face.eyes, parts, face.frame)
    report = tuple(data["report"].tolist())
    likeness = float(data["likeness"]) if "likeness" in data else None
    return dataclasses.replace(
        face, confidences=known, texture=texture, parts=parts, eyes=eyes, report=report, likeness=likeness,
        age=float(data.get("age", 0.0)),
    )  # fmt: skip
