"""Fields in color: their color maps, ranges and scalar bars."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista as pv

from ..array_types import Array
from ..errors import ParameterError, unknown_name
from ..mesh import ARRAYS, MUSCLES

FIELD_COLORS: dict[str, tuple[str, tuple[float, float] | None]] = {
    "W": ("RdBu_r", None),
    "epsilon": ("RdBu_r", None),
    "lambda": ("viridis", (0.0, 1.0)),
    "gamma": ("viridis", None),
    "theta": ("twilight", (-3.15, 3.15)),
    "split_gamma": ("YlOrRd", None),
    "muscle": ("Paired", None),
    "level": ("YlGnBu", None),
}
"""Color maps of fields, and their ranges; None stands for the range of the values."""

FOLDED = {
    "lambda": ("muscle",), "gamma": ("muscle",), "muscle": ("muscle",), "epsilon": ("muscle", "family"),
    "theta": ("family",), "family": ("family",),
}  # fmt: skip
"""Fields that mean nothing where no muscle, or no family of waves, folds the skin: the arrays that tell by -1."""


def values_of(frame: pv.PolyData, name: str) -> Array:
    """Return a field, NaN where it means nothing: lambda, for one, means something only where a muscle folds skin."""
    values = np.full(frame.n_points, np.nan)
    if name in frame.point_data:
        values[:] = frame.point_data[name]
    folded = [np.asarray(frame.point_data[own]) >= 0 for own in FOLDED.get(name, ()) if own in frame.point_data]
    if folded:
        values[~np.any(folded, axis=0)] = np.nan
    return values


def field_coloring(skin: pv.PolyData, name: str, height: int) -> dict[str, Any]:
    """Return options of `add_mesh` that color skin by a field, with a scalar bar for a window `height` pixels high.

    Raises
    ------
    UnknownNameError
        For a field that the skin does not have.
    ParameterError
        For a field with several numbers per vertex.
    """
    if name not in skin.point_data:
        raise unknown_name("field", name, [n for n in ARRAYS if n in skin.point_data])
    if skin.point_data[name].ndim > 1:
        raise ParameterError(
            f"a picture is colored by one number per vertex; {name!r} has {skin.point_data[name].shape[1]}."
        )
    values = values_of(skin, name)
    colors, limits = FIELD_COLORS.get(name, ("viridis", None))
    largest = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    title = f"{name} (mm)\n" if name == "W" else f"{name}\n"
    bar: dict[str, Any] = {
        "title": title,
        "title_font_size": height // 40,
        "label_font_size": height // 50,
        "color": "white",
        "fmt": "%.2g",
        "vertical": True,
        "position_x": 0.82,
        "position_y": 0.2,
        "height": 0.6,
        "width": 0.06,
    }
    options: dict[str, Any] = {"cmap": colors, "nan_color": "#8d8580", "specular": 0.0, "clim": limits}
    if colors == "RdBu_r":
        options["clim"] = (-largest, largest)
    if name in ("muscle", "level"):
        values = values[np.asarray(skin.regular_faces)].max(axis=1)  # names and levels are not interpolated
    if name == "muscle":
        values, names = _without_sides(values, [str(muscle) for muscle in skin.field_data[MUSCLES]])
        count = max(len(names), 1)
        options |= {"annotations": dict(enumerate(names)), "clim": (-0.5, count - 0.5), "n_colors": count}
        bar |= {"n_labels": 0, "position_x": 0.91}
    if name == "level":
        levels = {level: str(level) for level in range(int(largest) + 1)}
        options |= {"annotations": levels, "clim": (-0.5, largest + 0.5), "n_colors": len(levels)}
        bar |= {"n_labels": 0}
    return options | {"scalars": values, "show_scalar_bar": True, "scalar_bar_args": bar}


def _without_sides(muscles: Array, names: Sequence[str]) -> tuple[Array, list[str]]:
    """Indices of muscles (NaN for none) among the names without sides, and these names."""
    stems = [name.removesuffix("_l").removesuffix("_r") for name in names]
    known = list(dict.fromkeys(stems))
    number = np.array([known.index(stem) for stem in stems] + [np.nan])
    return number[np.where(np.isnan(muscles), -1, muscles).astype(int)], known
