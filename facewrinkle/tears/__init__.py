"""Tears that drip (`drop`) and tears that flow down the skin (`stream`), after Lin and Cheng, Section 4."""

from .drop import DrippingTear
from .presets import PRESETS, Preset, preset, surfaces
from .stream import SheddingTear
from .support_surface import lid_point

__all__ = ["PRESETS", "DrippingTear", "Preset", "SheddingTear", "lid_point", "preset", "surfaces"]
