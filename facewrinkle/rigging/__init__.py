"""Rigs: a face with blend shapes that wrinkle, for other programs."""

from .page import write_page
from .rig import Rig, RigError, rig
from .sheet import sheet
from .write import write_rig

__all__ = ["Rig", "RigError", "rig", "sheet", "write_page", "write_rig"]
