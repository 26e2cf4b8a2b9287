"""Faces in files: the mesh with its landmarks and unit; muscles, skull and eyes are placed anew when it is read."""

from __future__ import annotations

import dataclasses
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from ..errors import MeshError, OutputError
from ..mesh import to_polydata
from ..mesh.arrays import CORNERS
from ..mesh.checks import PART
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
    """
    names = list(face.landmarks)
    arrays: dict[str, Any] = {
        "version": VERSION,
        "points": face.points,
        "triangles": face.triangles,
        "unit": face.unit,
        "landmark_names": np.array(names),
        "landmarks": np.array([face.landmarks[name] for name in names]),
        "confidences": np.array([face.confidences.get(name, np.nan) for name in names]),
        "estimated": np.array(face.estimated, dtype=str),
        "texture_coordinates": np.array(face.mesh.point_data.active_texture_coordinates_name or "", dtype=str),
    }
    for name, values in face.mesh.point_data.items():
        if np.asarray(values).dtype.kind in "fiub" and "/" not in name:
            arrays[_DATA + name] = np.asarray(values)
    if CORNERS in face.mesh.cell_data:
        arrays["texture_corners"] = np.asarray(face.mesh.cell_data[CORNERS])
    if face.texture is not None:
        arrays["texture"] = face.texture
    for name, part in face.parts.items():
        arrays |= {
            f"{_PARTS}/{name}/points": np.asarray(part.mesh.points),
            f"{_PARTS}/{name}/triangles": np.asarray(part.mesh.regular_faces),
            f"{_PARTS}/{name}/{PART}": np.asarray(part.mesh.cell_data[PART]),
        }
        if (colours := part.mesh.point_data.get("Colors")) is not None:
            arrays[f"{_PARTS}/{name}/Colors"] = np.asarray(colours)
    target = Path(os.path.expanduser(path))
    try:
        with target.open("wb") as file:
            np.savez_compressed(file, **arrays)
    except OSError as problem:
        raise OutputError(f"{str(target)!r} cannot be written: {problem.strerror or problem}.") from None
    return target


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
    point_data = {key.removeprefix(_DATA): values for key, values in data.items() if key.startswith(_DATA)}
    mesh = to_polydata(data["points"], data["triangles"], point_data)
    if texture := str(data["texture_coordinates"]):
        mesh.point_data.active_texture_coordinates_name = texture
    if "texture_corners" in data:
        mesh.cell_data[CORNERS] = data["texture_corners"]
    names = data["landmark_names"].tolist()
    landmarks = dict(zip(names, data["landmarks"].astype(np.float64), strict=True))
    known = {n: float(c) for n, c in zip(names, data["confidences"], strict=True) if np.isfinite(c)}
    estimated = tuple(data["estimated"].tolist())
    face = Face.from_landmarks(mesh, landmarks, float(data["unit"]), atlas, estimated)
    parts = {
        name: follower(name, _part(data, name))
        for name in sorted({k.split("/")[1] for k in data if k.startswith(_PARTS)})
    }
    eyes = eyes_of(face.eyes, parts)
    return dataclasses.replace(face, confidences=known, texture=data.get("texture"), parts=parts, eyes=eyes)


def _part(data: dict[str, Any], name: str) -> pv.PolyData:
    key = f"{_PARTS}/{name}/"
    colours = {"Colors": data[key + "Colors"]} if key + "Colors" in data else {}
    mesh = to_polydata(data[key + "points"], data[key + "triangles"], colours)
    mesh.cell_data[PART] = data[key + PART]
    return mesh
