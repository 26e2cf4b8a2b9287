"""Pictures of frames: skin, eyes and brows under studio lights, wireframes, fields in color, and tears."""

from ..array_types import Image
from .fields import FIELD_COLORS
from .images import figure, save_picture, side_by_side, stacked
from .scene import Scene, picture, pictures
from .views import CLOSE, VIEWS, Style, View, closeup
from .wet import TearScene

__all__ = [
    "CLOSE",
    "FIELD_COLORS",
    "VIEWS",
    "Image",
    "Scene",
    "Style",
    "TearScene",
    "View",
    "closeup",
    "figure",
    "picture",
    "pictures",
    "save_picture",
    "side_by_side",
    "stacked",
]
