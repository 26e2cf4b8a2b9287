"""Smooth transitions between 0 and 1."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import Array


def smoothstep(t: npt.ArrayLike) -> Array:
    """Rise ``3 t^2 - 2 t^3`` from 0 at t <= 0 to 1 at t >= 1, level at both ends.

    Examples
    --------
    >>> smoothstep([-1.0, 0.0, 0.5, 2.0])
    array([0. , 0. , 0.5, 1. ])
    """
    t = np.clip(np.asarray(t, dtype=np.float64), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))
