"""Muscles: their reach, their pull, the folds of the skin over them, and the bones, lids and eyes that they turn.

Everything here is a function of rest positions, in the unit of the mesh that the muscle was placed on, and is computed
once per vertex. Angles are in radians. Paper: Zhang, Sim, Tan, Eqs. 1-2 (linear), 12-13 (sheet), 14-18 (sphincter).
"""

from .base import FRONTS, WRINKLES, Fronts, Muscle, Wrinkles, unknown_property, within, zones
from .crease import Crease
from .joint_muscles import TURNS, EyeMuscle, JawMuscle, JointWeights, LidMuscle, TongueMuscle, turned
from .skin_muscles import LinearMuscle, SheetMuscle, SphincterMuscle, TriangularMuscle

__all__ = [
    "FRONTS",
    "TURNS",
    "WRINKLES",
    "Crease",
    "EyeMuscle",
    "Fronts",
    "JawMuscle",
    "JointWeights",
    "LidMuscle",
    "LinearMuscle",
    "Muscle",
    "SheetMuscle",
    "SphincterMuscle",
    "TongueMuscle",
    "TriangularMuscle",
    "Wrinkles",
    "turned",
    "unknown_property",
    "within",
    "zones",
]
