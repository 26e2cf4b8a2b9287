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

from ..arguments import checked
from ..errors import FaceWrinkleError, MeshError
from ..mesh import to_polydata
from ..mesh.arrays import CORNERS, PART, use_texture
from ..mesh.files import written
from ..mesh.formats.reading import check_file
from .atlas import Atlas
from .face import Face
from .parts import eyes_of, follower

VERSION = 1
SUFFIX = ".face"
_DATA = "point_data/"
_PARTS = "parts"
_OF_MESH = ("points", "triangles", "texture_coordinates", "texture", CORNERS, PART)
_OF_FACE = ("version", "unit", "landmark_names", "landmarks", "confidences", "estimated", "report", "likeness")
_NAMES = {*_OF_MESH, *_OF_FACE}

LARGEST_FILE = 2**31
"""The most bytes that the arrays of a face may take."""


@checked
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
    with written(target) as whole, whole.open("wb") as file:
        np.savez_compressed(file, **arrays)
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
        use_texture(mesh, texture)
    for name in (CORNERS, PART):
        if name in data:
            mesh.cell_data[name] = data[name]
    return mesh, data.get("texture")


@checked
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
    check_file(source)
    try:
        return _face(_arrays(source), source.name, atlas)
    except FaceWrinkleError:
        raise
    except OSError as problem:
        raise MeshError(f"{str(source)!r} cannot be read: {problem.strerror or problem}.") from problem
    except Exception as problem:  # zip files and arrays can be damaged in many ways
        missing = f", {problem} is missing" if isinstance(problem, KeyError) else ""
        raise MeshError(
            f"{source.name} is no face that facewrinkle wrote, or it is damaged{missing}. Make it anew: "
            "facewrinkle fit MESH."
        ) from problem


def _arrays(source: Path) -> dict[str, Any]:
    """The arrays of a file that mean something here."""
    with zipfile.ZipFile(source) as archive:
        size = sum(entry.file_size for entry in archive.infolist() if _is_known(entry.filename.removesuffix(".npy")))
    if size > LARGEST_FILE:
        raise MeshError(
            f"{source.name} would take {size / 2**30:.1f} GB of memory, and a face takes {LARGEST_FILE / 2**30:.0f} GB "
            "at most. Make it anew: facewrinkle fit MESH."
        )
    with source.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files if _is_known(name)}


def _is_known(name: str) -> bool:
    return name in _NAMES or name.startswith((_DATA, f"{_PARTS}/"))


def _face(data: dict[str, Any], name: str, atlas: Atlas | None) -> Face:
    if int(data["version"]) > VERSION:
        raise MeshError(f"{name} was written by a later facewrinkle (format {data['version']}, known is {VERSION}).")
    mesh, texture = _restored(data, "")
    for name in ("landmark_names", "estimated", "report"):
        if data[name].dtype.kind != "U" and data[name].size:
            raise MeshError(f"{name} must be text, received {data[name].dtype}. The file is damaged: make it anew.")
    for name in ("points", "landmarks"):
        if data[name].dtype.kind != "f" or not np.isfinite(data[name]).all():
            raise MeshError(f"{name} must be finite numbers. The file is damaged: make it anew.")
    if not 0.0 < float(data["unit"]) < np.inf:
        raise MeshError(f"unit must be a finite number greater than 0, received {data['unit']}. Make the file anew.")
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
