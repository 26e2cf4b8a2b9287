"""Units of meshes: given by name or number, or taken from the size of the face."""

from __future__ import annotations

import numpy as np

from ..errors import ParameterError, unknown_name, warn
from .landmarks import MEAN_PUPIL_DISTANCE

UNITS = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "in": 25.4}
"""Millimetres, by name."""

ALLOWED, USUAL = (1.0, 10_000.0), (30.0, 120.0)
"""Ranges of the distance between the pupils, mm: outside the first is an error, outside the second a warning. A wrong
unit is off by a factor of ten or more.
"""


def millimetres(units: str | float) -> float:
    """Millimetres per unit.

    Examples
    --------
    >>> millimetres("in"), millimetres(3)
    (25.4, 3.0)
    """
    if isinstance(units, str):
        if units not in UNITS:
            raise unknown_name("unit", units, UNITS)
        return UNITS[units]
    try:
        unit = float(units)
    except (TypeError, ValueError, OverflowError):
        unit = np.nan
    if not 0.0 < unit < np.inf:
        raise ParameterError(f"units must be a name or a positive number of mm per unit, received {units!r}.")
    return unit


def unit_of_face(units: str | float | None, pupil_distance: float) -> float:
    """Millimetres per unit of a face: as given, or such that its pupils are as far apart as an adult's.

    Examples
    --------
    >>> unit_of_face(None, pupil_distance=6.3)
    10.0
    """
    if units is None:
        return MEAN_PUPIL_DISTANCE / pupil_distance
    unit = millimetres(units)
    apart = f"with units={units!r} the pupils are {pupil_distance * unit:.3g} mm apart"
    usual = "an adult's are 50 to 76"
    if not ALLOWED[0] <= pupil_distance * unit <= ALLOWED[1]:
        raise ParameterError(
            f"{apart}; {ALLOWED[0]:g} to {ALLOWED[1]:g} is allowed, and {usual}. Leave units out to take the size from "
            "the face."
        )
    if not USUAL[0] <= pupil_distance * unit <= USUAL[1]:
        warn(f"{apart}; {usual}. Leave units out to take the size from the face.")
    return unit
