"""Fields of a frame in color, and all that is known at a vertex: what made the fold there, by which formula."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..array_types import Array, IntArray
from ..layers.base import Layer
from ..layers.muscle_wrinkles import MuscleWrinkles
from ..layers.patterns_on_skin.layer import PatternLayer
from ..layers.wave_folds import WaveFolds
from ..mesh import ARRAYS, rest_of
from ..plotting.fields import FIELD_COLORS, values_of
from .protocol import Part
from .visible_parts import VisibleParts

FIELDS = ("W", "epsilon", "lambda", "gamma", "theta", "split_gamma", "muscle", "family", "level")
"""Fields that a page can show."""


def colors(name: str) -> list[int]:
    """Return the colors of a field, 64 of red, green and blue, 0 to 255."""
    cmap = matplotlib.colormaps[FIELD_COLORS.get(name, ("viridis", None))[0]]
    return [round(255.0 * float(value)) for value in cmap(np.linspace(0.0, 1.0, 64))[:, :3].ravel()]


def colored(frame: pv.PolyData, name: str, parts: VisibleParts, layers: Sequence[Layer] = ()) -> Part:
    """Return a field of a frame for a page; one that the frame does not have means nothing anywhere.

    Its ``value``, for each drawn vertex, goes from 0 (the least) to 65534; it is 65535 where the field means nothing.
    Where its numbers stand for names, those that appear are told.
    """
    info: dict[str, Any] = {"name": name, "about": ARRAYS.get(name, ""), "unit": "mm" if name == "W" else ""}
    values = values_of(frame, name)
    scheme, limits = FIELD_COLORS.get(name, ("viridis", None))
    some = np.isfinite(values)
    largest = float(np.abs(values[some]).max(initial=0.0)) or 1.0
    low, high = limits or ((-largest, largest) if scheme == "RdBu_r" else (0.0, largest))
    names = labels(frame, layers).get(name, [])
    if names:
        present = np.unique(values[some]).astype(int)
        info["names"] = {int(each): names[each] for each in present if 0 <= each < len(names)}
    nothing = 65535
    numbers = np.full(len(values), nothing, np.uint16)
    share = np.clip((values[some] - low) / (high - low), 0.0, 1.0)
    numbers[some] = np.rint(share * (nothing - 1)).astype(np.uint16)
    return Part("field", "field", {"value": numbers[parts.origin]}, {**info, "range": [float(low), float(high)]})


def labels(frame: pv.PolyData, layers: Sequence[Layer]) -> Mapping[str, list[str]]:
    """Return the names that the numbers of muscles and families stand for."""
    waves = next((layer for layer in layers if isinstance(layer, WaveFolds)), None)
    muscles = [str(name) for name in frame.field_data["muscles"]] if "muscles" in frame.field_data else []
    return {"muscle": muscles, "family": list(waves.lines) if waves is not None else []}


def probe(frame: pv.PolyData, face: Face, layers: Sequence[Layer], corners: IntArray, shares: Array) -> dict[str, Any]:
    """Return what is known at a place of a frame: numbers interpolated there, and what makes the fold at the nearest
    corner.

    Parameters
    ----------
    frame : PolyData
    face : Face
    layers : sequence of Layer
        Those that made the frame, and nothing since.
    corners : ndarray of int, shape (3,)
        Vertices of a triangle.
    shares : ndarray, shape (3,)
        Barycentric coordinates in it.

    Returns
    -------
    dict
        With "made_by", "formula" with its "numbers", "values" of the fields, the "added" heights by name, mm, and
        where the place is ("place"), and was ("rest").
    """
    data = frame.point_data
    measured = [name for name in FIELDS if name not in ("muscle", "family", "level")]
    vertex = int(corners[int(np.argmax(shares))])
    values = {name: float(shares @ values_of(frame, name)[corners]) for name in measured}
    found: dict[str, Any] = {
        "vertex": vertex,
        "place": [round(float(x), 3) for x in shares @ np.asarray(frame.points, np.float64)[corners]],
        "rest": [float(x) for x in shares @ rest_of(frame)[corners]],
        "values": {name: round(value, 5) for name, value in values.items() if np.isfinite(value)},
        "level": int(np.asarray(data["level"])[vertex]) if "level" in data else 0,
    }
    makers = _makers(face, layers, vertex)
    if not makers:
        return found | {"made_by": "no fold here"}
    first = makers[0]
    words = {  # for the numbers of formulas; those that are fields are told with the fields
        "k0": "k0 (mm)", "rate": "contraction", "H At": "H At at k0 = 1", "A": "A(\u03b5)", "D": "depth D (mm)",
        "L": "wavelength L (mm)", "S": "strength S", "e": "e beyond the onset", "lower": "lower by (mm)",
        "alpha": "sharpness \u03b1",
    }  # fmt: skip
    numbers = {words.get(name, name): round(value, 5) for name, value in first["numbers"].items()}
    return found | {
        "made_by": first["name"] + ("" if values.get("W") else ", flat now"),
        "formula": first["formula"],
        "numbers": numbers,
        "added": {each["name"]: round(each["W"], 4) for each in makers if abs(each["W"]) > 1e-4},
    }


def _makers(face: Face, layers: Sequence[Layer], vertex: int) -> list[dict[str, Any]]:
    """All that adds to the height of a vertex: name, W in mm, formula and its numbers; what adds most comes first."""
    makers: list[dict[str, Any]] = []
    for layer in layers:
        if isinstance(layer, WaveFolds):
            families = list(layer.lines)
            formula = (
                "W = D (b \u2212 |s| (1 + s\u00b2)^\u03b1) / 2^\u03b1, s = \u03b8 / \u03c0; "
                "D = share \u00b7 S \u00b7 min(0.75 P (2 L / \u03c0) \u221ae, 0.22 L)"
            )
            for numbers in layer.explained(vertex):
                name = f"waves of the family {families[int(numbers.pop('family'))]!r}"
                makers.append(_maker(name, formula, numbers))
        elif isinstance(layer, MuscleWrinkles):
            muscles, formula = list(face.muscles), "W = k0 \u00b7 rate \u00b7 H At \u00b7 A(\u03b5) \u00b7 share"
            for numbers in layer.explained(vertex):
                makers.append(_maker(muscles[int(numbers.pop("muscle"))], formula, numbers))
        elif isinstance(layer, PatternLayer):
            height = float(layer.fields()[f"pattern_{layer.name}"][vertex])
            if height:
                made = " + ".join(type(pattern).__name__ for pattern in layer.patterns)
                formula = f"W = strength \u00b7 depth \u00b7 {made}(x, y, t)"
                makers.append(_maker(f"the pattern {layer.name!r}", formula, {"W": height}))
    return sorted(makers, key=lambda each: -each["depth"])


def _maker(name: str, formula: str, numbers: dict[str, float]) -> dict[str, Any]:
    height = numbers.pop("W")
    for of_fields in ("epsilon", "lambda", "gamma", "theta"):
        numbers.pop(of_fields, None)
    return {"name": name, "W": height, "depth": abs(numbers.get("D", height)), "formula": formula, "numbers": numbers}
