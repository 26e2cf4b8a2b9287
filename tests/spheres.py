"""Lines on spheres for the tests of tears."""

from __future__ import annotations

import numpy as np


def meridian(azimuth: float, radius: float = 50.0) -> np.ndarray:
    """Points down a sphere about the origin, from near its top to near its bottom."""
    polar = np.linspace(0.3, 2.8, 30)
    x, y = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
    return radius * np.stack([x, np.cos(polar), y], axis=1)
