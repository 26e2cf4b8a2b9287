"""Rigs: a face with blend shapes that wrinkle, for other programs."""

from .linear_rig import Rig, RigError, rig
from .maps import Maps, bake_maps, write_maps
from .on_source import SourceShapes, on_source
from .poses import Performer
from .takes import Take, read_take
from .wrinkle_layers import WrinkleLayers, bake_layers, write_layers
from .write import write_page, write_rig

__all__ = [
    "Maps",
    "Performer",
    "Rig",
    "RigError",
    "SourceShapes",
    "Take",
    "WrinkleLayers",
    "bake_layers",
    "bake_maps",
    "on_source",
    "read_take",
    "rig",
    "write_layers",
    "write_maps",
    "write_page",
    "write_rig",
]
