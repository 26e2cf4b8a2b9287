"""Patterns where they belong on a face, found by its landmarks."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

from ...anatomy import MEAN_PUPIL_DISTANCE, MIDLINE, Face, of_side
from ...array_types import Array
from ...errors import LandmarkError, ParameterError, check_name, check_whole, unknown_name
from ...geometry import closest_point, triangle_normals, unit
from .region import Compression, check_size


@lru_cache(maxsize=1)
def table() -> dict[str, dict[str, Any]]:
    """Return the presets as data, by name without a side."""
    return tomllib.loads(files(__package__).joinpath("data", "patterns.toml").read_text(encoding="utf-8"))


def proportion(pattern: object) -> float:
    """Return the depth of a pattern relative to the shorter side of its region, as its preset has it, or a fortieth.

    Examples
    --------
    >>> round(proportion("dimple"), 2), proportion(abs)
    (0.05, 0.025)
    """
    entry = next((entry for entry in table().values() if entry["pattern"] == pattern), None)
    return 0.025 if entry is None else float(entry["depth"]) / (MEAN_PUPIL_DISTANCE * min(entry["size"]))


def names() -> tuple[str, ...]:
    """Return the names of all presets; those of one side end in _l or _r, the subject's own.

    Examples
    --------
    >>> names()[:3]
    ('forehead', 'eye_corner_l', 'eye_corner_r')
    """
    ends = {name: ("",) if entry["landmark"] in MIDLINE else ("_l", "_r") for name, entry in table().items()}
    return tuple(name + end for name, sides in ends.items() for end in sides)


def placed(name: str, face: Face, /, **changes: Any) -> dict[str, Any]:
    """Return the parameters of :class:`facewrinkle.PatternLayer` for a preset on a face.

    Parameters
    ----------
    name : str
        One of :func:`names`.
    face : Face
    **changes
        Parameters of :class:`facewrinkle.PatternLayer` that differ; `size` in distances between the pupils. With
        ``strength="skin"`` the pattern appears as the skin under it is compressed. The wrinkles of the right side have
        the seed after that of the left, so that no face is its own mirror image; with ``variation=0`` all are even.

    Raises
    ------
    UnknownNameError
        For an unknown preset.
    LandmarkError
        If the face has no landmarks.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> placed("frown", fw.default_face(), depth=2.0)["depth"]
    2.0
    """
    if name not in names():
        raise unknown_name("preset", name, [*names(), *table()])
    if not isinstance(face, Face):
        raise ParameterError(
            f"a preset is placed on a Face, received {type(face).__name__}. Use fit_face(mesh, landmarks)."
        )
    if not face.landmarks:
        raise LandmarkError(
            f"the preset {name!r} is placed by landmarks, and this surface has none. Use fit_face(mesh, landmarks), or "
            "a PatternLayer with a center, an up direction and a size."
        )
    stem, side = (name, "") if name in table() else (name[:-2], name[-1])
    entry, frame = table()[stem], face.frame
    outward = np.array([-1.0 if side == "r" else 1.0, 1.0, 1.0])
    to_place = frame.axes.T * frame.pupil_distance
    size = check_size(changes.pop("size", entry["size"])) * frame.pupil_distance
    given: dict[str, Any] = {
        "center": _outside(
            face, face.landmarks[of_side(entry["landmark"], side)] + to_place @ (outward * entry.get("offset", 0.0))
        ),
        "up": frame.axes.T @ (outward * entry.get("up", [0.0, 1.0, 0.0])),
        "depth": entry["depth"] * frame.pupil_distance * face.unit / MEAN_PUPIL_DISTANCE,
        "mirrored": side == "r",
        "seed": check_whole("seed", changes.pop("seed", 0), 0, 2**62) + (side == "r"),
        "name": name,
        **entry["parameters"],
    }
    if isinstance(changes.get("strength"), str):
        check_name("strength", changes["strength"], ["skin"])
        skin = entry["skin"]
        along = tuple((frame.axes.T @ np.asarray(skin["along"], dtype=np.float64)).tolist())
        changes["strength"] = Compression(skin["low"], skin["full"], along)
    return {"pattern": entry["pattern"], "size": tuple(size.tolist()), **given, **changes}


def _outside(face: Face, place: Array) -> Array:
    """The closest point of the surface on skin that faces away from the head: not inside a lid or a lip."""
    middle = face.frame.world(np.array([0.0, 0.0, -0.8]))  # of the head, in distances between the pupils
    away = unit(face.points[face.triangles].mean(axis=1) - middle)
    facing = (triangle_normals(face.points, face.triangles) * away).sum(axis=1) > 0.2  # a cosine
    return closest_point(face.points, face.triangles[facing], place).point


def sides_of(name: str) -> list[str]:
    """Return the presets of both sides if `name` leaves the side out, otherwise the one preset.

    Examples
    --------
    >>> sides_of("dimple"), sides_of("frown")
    (['dimple_l', 'dimple_r'], ['frown'])
    """
    return [f"{name}_l", f"{name}_r"] if f"{name}_l" in names() else [name]
