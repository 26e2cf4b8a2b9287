"""Files of faces: all that a face is made from. Muscles, skull and eyes are placed anew when a file is read."""

from __future__ import annotations

import dataclasses
import zipfile
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyvista as pv

from ..errors import LARGEST, FaceWrinkleError, MeshError, check_type, warn
from ..files import check_file, opened, path_of, written
from ..mesh import CORNERS, read_surface, to_polydata
from ..mesh.arrays import use_texture
from .atlas import Atlas
from .face import Face
from .head import BoundHairs
from .parts import Follows, Part

VERSION = 1
SUFFIX = ".face"
_DATA = "point_data/"
_PARTS = "parts"

Form = tuple[str, tuple[str | int | tuple[int, ...], ...], float, float | str]
_REAL, _WHOLE = "fiu", "iu"
HAIR_FORMS: dict[str, dict[str, Form]] = {
    "brows": {
        "triangles": (_WHOLE, ("hairs", "k"), 0, "m"),
        "weights": ("f", ("hairs", "k", 3), -2.0, 2.0),
        "heights": (_REAL, ("k",), -LARGEST, LARGEST),
        "color": (_REAL, (3,), 0.0, 255.0),
    },
    **{
        kind: {
            "triangles": (_WHOLE, (f"{kind} hairs", f"{kind} points"), 0, "m"),
            "weights": ("f", (f"{kind} hairs", f"{kind} points", 3), -1e4, 1e4),
            "heights": (_REAL, (f"{kind} hairs", f"{kind} points"), -LARGEST, LARGEST),
            "color": (_REAL, (3,), 0.0, 255.0),
        }
        for kind in ("cropped_hair", "beard")
    },
}
""":data:`FORMS` of the bound hair that a file may hold."""

FORMS: dict[str, Form] = {
    "points": ("f", ("n", 3), -LARGEST, LARGEST),
    "triangles": (_WHOLE, ("m", 3), 0, "n"),
    "texture": ("u", ("height", "width", (3, 4)), 0, 255),
    "source_points": (_WHOLE, ("n",), 0, 2**62),
    CORNERS: ("f", ("m", 6), -LARGEST, LARGEST),
    "part": (_WHOLE, ("m",), 0, "m"),
    "unit": (_REAL, (), 1e-9, 1e9),
    "age": (_REAL, (), -1.0, 1.0),
    "iris": (_REAL, (), -1.0, 1.0),
    "likeness": (_REAL, (), -LARGEST, 1.0),
    "landmarks": (_REAL, ("l", 3), -LARGEST, LARGEST),
    "confidences": (_REAL, ("l",), -np.inf, np.inf),
    **{f"{kind}/{name}": form for kind, forms in HAIR_FORMS.items() for name, form in forms.items()},
}
"""What arrays of a file must be: kinds of numbers, sizes (those of one letter or word are equal), least and greatest; a
greatest that is the name of a size is not reached."""

LARGEST_FILE = 2**31
"""The most bytes that the arrays of a face may take."""


def write_face(face: Face, path: str | Path) -> Path:
    """Write a face, such as :func:`facewrinkle.fit_face` gives, to a file (a zip of NumPy arrays).

    Muscles that were changed are not in it: :func:`read_face` places those of an atlas.

    Raises
    ------
    OutputError
        If the file cannot be written.

    Warns
    -----
    FaceWrinkleWarning
        If muscles were changed.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = fw.write_face(fw.default_face(), f"{folder}/head.face")
    ...     fw.read_face(path).mesh.n_cells
    4517
    """
    check_type("face", face, Face)
    if changed := list(face.changed_muscles):
        warn(
            f"muscles that were changed are not stored: {', '.join(changed)}. read_face places those of the atlas; "
            "change them again with face.with_muscles, or put the changes into an atlas and give it to read_face."
        )
    names = list(face.landmarks)
    arrays: dict[str, Any] = {
        "version": VERSION,
        "unit": face.unit,
        "age": face.age,
        "iris": face.iris,
        "landmark_names": np.array(names),
        "landmarks": np.array([face.landmarks[name] for name in names]),
        "confidences": np.array([face.confidences.get(name, np.nan) for name in names]),
        "estimated": np.array(face.estimated, dtype=str),
        "report": np.array(face.report, dtype=str),
    }
    if face.likeness is not None:
        arrays["likeness"] = face.likeness
    for kind, hairs in face.bound_hair.items():
        arrays |= {f"{kind}/{name}": values for name, values in vars(hairs).items()}
    arrays |= _stored("", face)
    for name, part in face.parts.items():
        key = f"{_PARTS}/{name}/"
        arrays |= _stored(key, part)
        arrays |= {key + "follows": part.follows, key + "side": part.side}
    target = path_of(path)
    with written(target) as whole, whole.open("wb") as file:
        np.savez_compressed(file, **arrays)
    return target


def _stored(key: str, seen: Face | Part) -> dict[str, Any]:
    """The arrays of the mesh of a face or a part, and of what goes with it; their names begin with `key`."""
    mesh = seen.mesh
    arrays: dict[str, Any] = {
        key + "points": np.asarray(mesh.points),
        key + "triangles": np.asarray(mesh.regular_faces),
        key + "texture_coordinates": np.array(mesh.point_data.active_texture_coordinates_name or "", dtype=str),
    }
    numbers = {name: np.asarray(values) for name, values in mesh.point_data.items() if "/" not in name}
    arrays |= {key + _DATA + name: values for name, values in numbers.items() if values.dtype.kind in "fiub"}
    optional = {"texture": seen.texture, "source_points": seen.source_points, CORNERS: mesh.cell_data.get(CORNERS)}
    optional["part"] = seen.sheet if isinstance(seen, Part) else None
    return arrays | {key + name: values for name, values in optional.items() if values is not None}


def _restored(data: dict[str, Any]) -> pv.PolyData:
    """The mesh whose arrays `_stored` gave."""
    mesh = to_polydata(data["points"], data["triangles"], _within(data, _DATA))
    use_texture(mesh, str(data["texture_coordinates"]))
    if CORNERS in data:
        mesh.cell_data[CORNERS] = data[CORNERS]
    return mesh


def _part(data: dict[str, Any]) -> Part:
    """The part whose arrays `_stored` gave."""
    return Part(
        _restored(data), cast(Follows, str(data["follows"])), str(data["side"]), data.get("texture"),
        data.get("source_points"), data.get("part"),
    )  # fmt: skip


def _within(data: dict[str, Any], key: str) -> dict[str, Any]:
    """The arrays whose names begin with `key`, by the rest of their names."""
    return {name.removeprefix(key): values for name, values in data.items() if name.startswith(key)}


def read(path: str | Path) -> Face | pv.PolyData:
    """Read a face from a .face file, or the surface of any other mesh file.

    :func:`read_face` and :func:`facewrinkle.read_surface` do the same, each for one of them.

    Raises
    ------
    MeshError
        If the file cannot be read.

    Examples
    --------
    >>> import facewrinkle as fw, tempfile
    >>> face = fw.default_face()
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     paths = fw.write_face(face, f"{folder}/head.face"), fw.write_mesh(face.mesh, f"{folder}/head.ply")
    ...     [type(read(path)).__name__ for path in paths]
    ['Face', 'PolyData']
    """
    return read_face(path) if path_of(path).suffix.lower() == SUFFIX else read_surface(path)


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
    check_type("atlas", atlas, Atlas, optional=True)
    source = path_of(path)
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
            f"{source.name} was not written by facewrinkle, or is damaged{missing}. Write it again: "
            "facewrinkle fit MESH."
        ) from problem


def _arrays(source: Path) -> dict[str, Any]:
    """The arrays of a file."""
    with opened(source) as file:
        with zipfile.ZipFile(file) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > LARGEST_FILE:
            raise MeshError(
                f"{source.name} would take {size / 2**30:.1f} GB of memory, and a face takes "
                f"{LARGEST_FILE / 2**30:.0f} GB at most. Write it again: facewrinkle fit MESH."
            )
        file.seek(0)
        with np.load(file, allow_pickle=False) as stored:
            return dict(stored)


def _check(data: dict[str, Any]) -> None:
    """Raise a MeshError unless the arrays of a mesh, and of what goes with it, are what others rely on."""
    sizes: dict[str, int] = {}
    for name, (kinds, shape, low, high) in FORMS.items():
        values = data.get(name)
        if values is None or (values.size == 0 and name in ("landmarks", "confidences")):
            continue
        fits = values.dtype.kind in kinds and values.ndim == len(shape) and values.size > 0
        for axis, size in zip(shape, values.shape, strict=False):
            allowed = (sizes.setdefault(axis, size),) if isinstance(axis, str) else np.atleast_1d(axis)
            fits = fits and size in allowed
        most = sizes[high] - 1 if isinstance(high, str) else high
        if not (fits and (name == "confidences" or (low <= float(values.min()) and float(values.max()) <= most))):
            raise MeshError(
                f"{name} must be {'whole ' if kinds == _WHOLE else ''}numbers of the shape {shape} from {low:g} to "
                f"{most:g}, received {values.dtype} of {values.shape}"
            )
    texture = data.get(_DATA + str(data["texture_coordinates"]))
    if texture is not None and (texture.shape != (sizes["n"], 2) or not np.isfinite(texture).all()):
        raise MeshError(f"texture coordinates must be finite, of the shape {(sizes['n'], 2)}")


def _face(data: dict[str, Any], file: str, atlas: Atlas | None) -> Face:
    if int(data["version"]) > VERSION:
        raise MeshError(f"{file} was written by a later facewrinkle (format {data['version']}, known is {VERSION}).")
    parts = sorted({key.split("/")[0] for key in _within(data, f"{_PARTS}/")})
    for key in ("", *(f"{_PARTS}/{name}/" for name in parts)):
        try:
            _check(_within(data, key))
        except MeshError as problem:
            raise MeshError(
                f"{file} was not written by facewrinkle, or is damaged: its {key}{problem}. Write it again: "
                "facewrinkle fit MESH."
            ) from None
    unit, mesh = float(data["unit"]), _restored(data)
    if not 1e-3 < unit * mesh.length < 1e8:  # the diagonal, mm
        raise MeshError(
            f"{file} is damaged: its face is {unit * mesh.length:g} mm large. Write it again: facewrinkle fit MESH."
        )
    names = data["landmark_names"].tolist()
    landmarks = dict(zip(names, data["landmarks"].astype(np.float64), strict=True))
    known = {n: float(c) for n, c in zip(names, data["confidences"], strict=True) if np.isfinite(c)}
    of_parts = _within(data, f"{_PARTS}/")
    hair = {kind: _within(data, f"{kind}/") for kind in HAIR_FORMS}
    others: dict[str, Any] = {
        "estimated": tuple(data["estimated"].tolist()),
        "parts": {name: _part(_within(of_parts, f"{name}/")) for name in parts},
        "confidences": known,
        "texture": data.get("texture"),
        "source_points": data.get("source_points"),
        "bound_hair": {kind: BoundHairs(**arrays) for kind, arrays in hair.items() if arrays},
        "report": tuple(data["report"].tolist()),
        "likeness": float(data["likeness"]) if "likeness" in data else None,
        "age": float(data["age"]),
        "iris": float(data.get("iris", 0.0)),
    }
    if landmarks:
        return Face.from_landmarks(mesh, landmarks, unit, atlas, **others)
    return dataclasses.replace(Face.without_anatomy(mesh, unit), **others)
