"""A check of what layers return: they may be anyone's, and loops in machine code trust the lengths of arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..array_types import Array, BoolArray
from ..checks import finite, plain_and_finite
from ..errors import LARGEST, ParameterError, type_of
from ..mesh.arrays import ARRAYS
from .base import Displacement, Layer, SurfaceState

VECTORS = ("Normals", "rest")
"""Arrays of a frame with three numbers for each vertex; all others of its own have one."""

KINDS = tuple(np.dtype(kind) for kind in ("?", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f4", "f8"))
"""Types of numbers that meshes keep."""


def displacement_of(layer: Layer, state: SurfaceState) -> Displacement:
    """Return the displacement by a layer; raise a ParameterError that names it for arrays of another shape or type.

    Heights, shading offsets and directions must be finite, spacings greater than 0.

    Examples
    --------
    >>> from facewrinkle.layers.base import SurfacePoints
    >>> class Broken:
    ...     def displacement(self, state):
    ...         return Displacement(np.zeros(2), np.ones(2), np.zeros((2, 3)), np.zeros(2, bool))
    >>> place = SurfacePoints(*np.zeros((2, 1, 3)), np.zeros((1, 3), np.int32), np.ones((1, 3)), np.zeros(1, np.int32))
    >>> displacement_of(Broken(), SurfaceState(np.empty(0), place, place.corners, place.points, place.points))
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: the height of a layer (Broken) must have the shape (1,), received (2,).
    """
    found, n = layer.displacement(state), len(state.bare)
    if not isinstance(found, Displacement):
        raise ParameterError(
            f"displacement() of a layer ({type(layer).__name__}) must return a Displacement, received "
            f"{type_of(found)}. Return Displacement(height, spacing, across, active) of facewrinkle.layers.base."
        )
    checked: dict[str, Any] = {}
    for name, check in CHECKS.items():
        values, called = getattr(found, name), f"the {name} of a layer ({type(layer).__name__})"
        if values is not None or name != "shading_offset":
            checked[name] = check(called, values)
            shape = (n, 3) if name == "across" else (n,)
            if checked[name].shape != shape:
                raise ParameterError(f"{called} must have the shape {shape}, received {checked[name].shape}.")
    return replace(found, **checked)


def fields_of(layer: Layer, n: int) -> dict[str, npt.NDArray[Any]]:
    """Return the point data of a layer on n vertices; raise a ParameterError that names it for anything else.

    Examples
    --------
    >>> class Broken:
    ...     def fields(self):
    ...         return {"depth": np.zeros(2)}
    >>> fields_of(Broken(), 3)
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: the field 'depth' of a layer (Broken) must have a number, or a row of numbers,
    for each of the 3 vertices, received float64 of the shape (2,).
    """
    found, out = layer.fields(), dict[str, npt.NDArray[Any]]()
    if not isinstance(found, Mapping):
        raise ParameterError(
            f"fields() of a layer ({type(layer).__name__}) must return a dictionary of names and arrays, received "
            f"{type_of(found)}. Return {{}} if there are none."
        )
    for name, given in found.items():
        if not isinstance(name, str) or not name:
            raise ParameterError(
                f"the fields of a layer ({type(layer).__name__}) must have names, received {name!r} for one."
            )
        try:
            values = np.asarray(given)
        except ValueError:  # rows of different lengths
            values = np.array(None)
        rows = values.dtype in KINDS and values.ndim in (1, 2) and len(values) == n and values.shape[1:] != (0,)
        asked, shape = "a number, or a row of numbers,", values.shape
        if name in VECTORS:
            asked, shape = "three numbers", (n, 3)
        elif name in ARRAYS:
            asked, shape = "a number", (n,)
        if not rows or values.shape != shape:
            raise ParameterError(
                f"the field {name!r} of a layer ({type(layer).__name__}) must have {asked} for each of the {n} "
                f"vertices, received {values.dtype} of the shape {values.shape}."
            )
        out[name] = values
    return out


def _spacing(called: str, given: object) -> Array:
    """Return spacings as numbers; no detail, infinity, needs no triangles."""
    try:
        spacing = np.asarray(given, np.float64, order="C")
    except (TypeError, ValueError, OverflowError):
        return finite(called, given)  # tells what is wrong
    if not (spacing > 1.0 / LARGEST).all():
        broken = spacing[~(spacing > 1.0 / LARGEST)][0]
        raise ParameterError(f"{called} must be greater than 0, received {broken:g}. Infinity asks for no triangles.")
    return spacing


def _active(called: str, given: object) -> BoolArray:
    try:
        active = np.asarray(given, order="C")
    except ValueError:  # rows of different lengths
        active = np.array(None)
    if active.dtype != bool:
        raise ParameterError(
            f"{called} must hold True where the layer may displace the surface and False elsewhere, received "
            f"{active.dtype if active.ndim else type_of(given)}."
        )
    return active


CHECKS: Mapping[str, Callable[[str, Any], npt.NDArray[Any]]] = {
    "height": plain_and_finite,
    "spacing": _spacing,
    "across": plain_and_finite,
    "active": _active,
    "shading_offset": plain_and_finite,
}
"""What is checked of each array of a displacement."""


def over(below: Mapping[str, npt.NDArray[Any]], fields: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Return the point data of a layer, with that of the layers below where it has none itself: no muscle, no strain.

    Examples
    --------
    >>> below = {"muscle": np.array([3, -1]), "lambda": np.array([0.5, 0.0])}
    >>> found = over(below, {"muscle": np.array([-1, 4]), "lambda": np.array([0.0, 0.2])})
    >>> found["muscle"].tolist(), found["lambda"].tolist()
    ([3, 4], [0.5, 0.2])
    """
    of_muscle = fields["muscle"] >= 0 if "muscle" in fields and "muscle" in below else None
    out = dict(fields)
    for name in ("lambda", "gamma", "epsilon", "muscle"):
        if name in fields and name in below:
            own = fields[name] != 0 if of_muscle is None else of_muscle
            out[name] = np.where(own, fields[name], below[name])
    return out
