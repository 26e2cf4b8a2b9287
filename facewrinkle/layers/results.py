"""A check of what layers return: they may be anyone's, and loops in machine code trust the lengths of arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..array_types import Array, BoolArray
from ..checks import finite, plain, plain_and_finite
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
    changed: dict[str, Any] = {}
    for name, shape in {"height": (n,), "across": (n, 3), "shading_offset": (n,)}.items():
        values = getattr(found, name)
        if values is None and name == "shading_offset":
            continue
        checked = plain_and_finite(_called(name, layer), values)
        if checked is not values:
            changed[name] = checked
        _check_shape(name, checked.shape, shape, layer)
    if not (plain(found.spacing) and found.spacing.min(initial=np.inf) > 1.0 / LARGEST):
        changed["spacing"] = _spacing(found.spacing, layer)
    _check_shape("spacing", changed.get("spacing", found.spacing).shape, (n,), layer)
    if type(found.active) is not np.ndarray or found.active.dtype != bool or not found.active.flags.c_contiguous:
        changed["active"] = _active(found.active, layer)
    _check_shape("active", changed.get("active", found.active).shape, (n,), layer)
    return replace(found, **changed) if changed else found


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


def _called(name: str, layer: Layer) -> str:
    return f"the {name} of a layer ({type(layer).__name__})"


def _check_shape(name: str, received: tuple[int, ...], shape: tuple[int, ...], layer: Layer) -> None:
    if received != shape:
        raise ParameterError(f"{_called(name, layer)} must have the shape {shape}, received {received}.")


def _spacing(given: object, layer: Layer) -> Array:
    """Return spacings as numbers; no detail, infinity, needs no triangles."""
    called = _called("spacing", layer)
    try:
        spacing = np.array(given, np.float64, order="C")
    except (TypeError, ValueError, OverflowError):
        return finite(called, given)  # tells what is wrong
    if not (spacing > 1.0 / LARGEST).all():
        broken = spacing[~(spacing > 1.0 / LARGEST)][0]
        raise ParameterError(f"{called} must be greater than 0, received {broken:g}. Infinity asks for no triangles.")
    return spacing


def _active(given: object, layer: Layer) -> BoolArray:
    try:
        active = np.array(given, order="C")
    except ValueError:  # rows of different lengths
        active = np.array(None)
    if active.dtype != bool:
        raise ParameterError(
            f"{_called('active', layer)} must hold True where the layer may displace the surface and False elsewhere, "
            f"received {active.dtype if active.ndim else type_of(given)}."
        )
    return active


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
