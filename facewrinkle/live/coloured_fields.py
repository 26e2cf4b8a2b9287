"""Fields of a frame as numbers for a page, with their colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..errors import unknown_name
from ..layers.base import Layer
from ..layers.wave_folds import WaveFolds
from ..mesh import ARRAYS
from ..plotting.fields import FIELD_COLOURS, FOLDED
from .visible_parts import VisibleParts

NOTHING = 65535
"""The number of vertices where a field means nothing."""

FIELDS = ("W", "epsilon", "lambda", "gamma", "theta", "split_gamma", "muscle", "family", "level")
"""Fields that a page can show."""

NAMED = ("muscle", "family", "level")
"""Fields of whole numbers."""


@dataclass(frozen=True, eq=False)
class ColouredField:
    """A field of one number per vertex.

    Attributes
    ----------
    values : ndarray of uint16, shape (n,)
        From 0 (the least) to 65534, for each drawn vertex; 65535 where the field means nothing.
    info : dict
        Name, meaning, unit, range.
    """

    values: npt.NDArray[np.uint16]
    info: dict[str, Any]


def colours(name: str) -> list[int]:
    """Return the colours of a field, 64 of red, green and blue, 0 to 255."""
    cmap = matplotlib.colormaps[FIELD_COLOURS.get(name, ("viridis", None))[0]]
    return [round(255.0 * float(value)) for value in cmap(np.linspace(0.0, 1.0, 64))[:, :3].ravel()]


def coloured(frame: pv.PolyData, name: str, parts: VisibleParts, layers: Sequence[Layer] = ()) -> ColouredField:
    """Return a field of a frame for a page; one that the frame does not have means nothing anywhere.

    Where its numbers stand for names, those that appear are told.
    """
    origin = parts.origin
    info: dict[str, Any] = {"name": name, "about": ARRAYS.get(name, ""), "unit": "mm" if name == "W" else ""}
    if name not in frame.point_data:
        return ColouredField(np.full(len(origin), NOTHING, np.uint16), {**info, "range": [0.0, 1.0]})
    values = np.array(frame.point_data[name], np.float64)
    folded = [np.asarray(frame.point_data[own]) >= 0 for own in FOLDED.get(name, ()) if own in frame.point_data]
    if folded:
        values[~np.any(folded, axis=0)] = np.nan
    scheme, limits = FIELD_COLOURS.get(name, ("viridis", None))
    some = np.isfinite(values)
    largest = float(np.abs(values[some]).max(initial=0.0)) or 1.0
    low, high = limits or ((-largest, largest) if scheme == "RdBu_r" else (0.0, largest))
    names = labels(frame, layers).get(name, [])
    if names:
        present = np.unique(values[some]).astype(int)
        info["names"] = {int(each): names[each] for each in present if 0 <= each < len(names)}
    numbers = np.full(len(values), NOTHING, np.uint16)
    share = np.clip((values[some] - low) / (high - low), 0.0, 1.0)
    numbers[some] = np.rint(share * (NOTHING - 1)).astype(np.uint16)
    return ColouredField(numbers[origin], {**info, "range": [float(low), float(high)]})


def check_field(name: str | None) -> str | None:
    """Return the name of a field, or None."""
    if name is not None and name not in FIELDS:
        raise unknown_name("field", name, FIELDS)
    return name


def labels(frame: pv.PolyData, layers: Sequence[Layer]) -> Mapping[str, list[str]]:
    """Return the names that the numbers of muscles and families stand for."""
    waves = next((layer for layer in layers if isinstance(layer, WaveFolds)), None)
    muscles = [str(name) for name in frame.field_data["muscles"]] if "muscles" in frame.field_data else []
    return {"muscle": muscles, "family": list(waves.lines) if waves is not None else []}
