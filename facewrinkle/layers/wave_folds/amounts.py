"""How much of the folds a user asks for, by places: none here, more there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ...anatomy.face import Face
from ...array_types import Array
from ...checks import finite
from ...errors import ParameterError, check_range, unknown_name
from ...geometry.interpolation import smoothstep
from ..patterns_on_skin.region import Region

Amount = npt.ArrayLike | Mapping[str | Region, float]

MOST = 10.0
"""Largest factor that can be asked for."""

AROUND = (0.12, 0.4)
"""Distances from a landmark, in distances between the pupils, up to which its factor holds, and from which 1 does."""

MIDLINE = 0.15
"""Distance from the midline over which the factors of the two sides blend, in distances between the pupils."""

REGIONS: Mapping[str, tuple[str, ...]] = {
    "forehead": ("forehead_mid", "brow_l_mid", "brow_r_mid"),
    "between the brows": ("glabella",),
    "crow's feet": ("eye_l_outer", "eye_r_outer"),
    "nose": ("nasion", "sellion", "ala_l", "ala_r"),
    "cheeks": ("malar_l", "malar_r"),
    "mouth": ("mouth_l", "mouth_r", "upper_lip_mid", "lower_lip_mid"),
    "chin": ("pogonion", "menton"),
}
"""Regions with a factor of their own, by the landmarks that they lie around."""

SIDES = ("left", "right")
"""Names of the subject's sides."""


def amounts(asked: Amount | None, face: Face) -> Array | None:
    """Return factors (n0,) of the depth of folds at the base vertices; None where nothing was asked for.

    Raises
    ------
    ParameterError
        For factors that are negative or too large, and for arrays of another length.
    UnknownNameError
        For a name that is none of a side, a region or a landmark of the face.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> smooth = amounts({"glabella": 0.0}, face)
    >>> float(smooth.min()), float(smooth.max())
    (0.0, 1.0)
    >>> uneven = amounts({"left": 0.5, "chin": 2.0}, face)
    >>> float(uneven[face.points[:, 0].argmax()]), float(uneven[face.points[:, 0].argmin()])
    (0.5, 1.0)
    """
    if asked is None:
        return None
    if isinstance(asked, Mapping):
        given = {at: check_range(f"the amount of folds at {at}", factor, 0.0, MOST) for at, factor in asked.items()}
        factors = _by_sides(given.pop("left", 1.0), given.pop("right", 1.0), face)
        for where, factor in given.items():
            factors *= 1.0 + (factor - 1.0) * _near(where, face)
        return factors
    factors, n = finite("amount", asked), len(face.points)
    if factors.shape != (n,):
        raise ParameterError(
            f"amount must have one factor for each of the {n} vertices of face.mesh, received the shape "
            f"{factors.shape}. Or give a dictionary of landmarks and factors, such as {{'glabella': 0.0}}."
        )
    if not (factors >= 0.0).all() or not (factors <= MOST).all():
        raise ParameterError(f"amounts must lie in [0, {MOST:g}], received {factors.min():g} to {factors.max():g}.")
    return factors


def _by_sides(left: float, right: float, face: Face) -> Array:
    """Return the factors (n0,) of two sides, which blend in the middle."""
    if left == right:
        return np.full(len(face.points), left)
    aside = (face.points - face.frame.origin) @ face.frame.axes[0] / face.frame.pupil_distance
    return np.asarray(right + (left - right) * smoothstep(0.5 + 0.5 * aside / MIDLINE))


def _near(where: str | Region, face: Face) -> Array:
    """Return a weight (n0,) in [0, 1]: 1 at a landmark or in a region, fading around."""
    if isinstance(where, Region):
        return where.laid(face).base_window
    if where in REGIONS:  # of which a face may lack some landmarks
        away = [1.0 - _near(place, face) for place in REGIONS[where] if place in face.landmarks]
        return 1.0 - np.prod(away, axis=0) * np.ones(len(face.points))
    if where not in face.landmarks:
        raise unknown_name("landmark or region of folds", where, [*face.landmarks, *REGIONS, *SIDES])
    away_from = np.linalg.norm(face.points - face.landmarks[where], axis=1) / face.frame.pupil_distance
    return 1.0 - smoothstep((away_from - AROUND[0]) / (AROUND[1] - AROUND[0]))
