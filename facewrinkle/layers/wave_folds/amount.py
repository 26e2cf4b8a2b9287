"""Amounts of folds that a user asks for: none here, more there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ...anatomy.face import Face
from ...array_types import Array
from ...checks import finite
from ...errors import MeshError, ParameterError, check_range, unknown_name
from ...geometry.interpolation import smoothstep
from ..patterns_on_skin.region import Region

Amount = npt.ArrayLike | str | Mapping[str | Region, float]

MOST = 10.0
"""Largest factor that can be asked for."""

AROUND = (0.12, 0.4)
"""Distances from a landmark, in distances between the pupils, up to which its factor holds, and from which 1 does."""


def amounts(asked: Amount | None, face: Face) -> Array | None:
    """Return factors (n0,) of the depth of folds at the base vertices; None where nothing was asked for.

    Raises
    ------
    ParameterError
        For factors that are negative or too large, and for arrays of another length.
    MeshError, UnknownNameError
        For point data or a landmark that the face does not have.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> smooth = amounts({"glabella": 0.0}, face)
    >>> float(smooth.min()), float(smooth.max())
    (0.0, 1.0)
    """
    if asked is None:
        return None
    if isinstance(asked, Mapping):
        factors = np.ones(len(face.points))
        for where, factor in asked.items():
            check_range(f"the amount of folds at {where}", factor, 0.0, MOST)
            factors *= 1.0 + (float(factor) - 1.0) * _near(where, face)
        return factors
    if isinstance(asked, str):
        if asked not in face.mesh.point_data:
            raise MeshError(
                f"the mesh has no point data {asked!r}; it has {', '.join(face.mesh.point_data) or 'none'}. Name "
                "factors of the depth of folds, one per vertex."
            )
        asked = np.asarray(face.mesh.point_data[asked])
    return _checked(asked, face)


def _checked(asked: npt.ArrayLike, face: Face) -> Array:
    factors, n = finite("amount", asked), len(face.points)
    if factors.shape != (n,):
        raise ParameterError(
            f"amount must have one factor for each of the {n} vertices of face.mesh, received the shape "
            f"{factors.shape}. Or give a dictionary of landmarks and factors, such as {{'glabella': 0.0}}."
        )
    if not (factors >= 0.0).all() or not (factors <= MOST).all():
        raise ParameterError(f"amounts must lie in [0, {MOST:g}], received {factors.min():g} to {factors.max():g}.")
    return factors


def _near(where: str | Region, face: Face) -> Array:
    """Return a weight (n0,) in [0, 1]: 1 at a landmark or in a region, fading around."""
    if isinstance(where, Region):
        return where.laid(face).base_window
    if where not in face.landmarks:
        raise unknown_name("landmark", where, face.landmarks)
    away = np.linalg.norm(face.points - face.landmarks[where], axis=1) / face.frame.pupil_distance
    return 1.0 - smoothstep((away - AROUND[0]) / (AROUND[1] - AROUND[0]))
