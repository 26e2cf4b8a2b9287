"""Rigs: a face with blend shapes that wrinkle, for other programs."""

from .rig import Rig, RigError, rig
from .write import write_rig

__all__ = ["Rig", "RigError", "rig", "write_rig"]
