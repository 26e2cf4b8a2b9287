"""A face and what is under its skin: landmarks, skull, eyes, lids, teeth and muscles; how they are found on a mesh.

Other rooms take here what most of them need; the rest, by its module.
"""

from .atlas import Atlas, Mixture, load_atlas, printed_atlas
from .cavities import Cavities, Lining
from .eyeball import Eyeball, gaze_of
from .eyelid_opening import EyelidOpening
from .face import Face, per_face
from .face_file import read_face, write_face
from .fitting import default_face, fit_face, millimeters, surface
from .head import BoundHairs, load_head
from .identity import Identity, hair_cover
from .landmarks import MEAN_PUPIL_DISTANCE, MIDLINE, NAMES, FaceFrame, frame_of, lips_middle, mirrored_name, of_side
from .muscles import (
    Crease,
    EyeMuscle,
    JawMuscle,
    JointWeights,
    LidMuscle,
    LinearMuscle,
    Muscle,
    SheetMuscle,
    SphincterMuscle,
    TongueMuscle,
    within,
    zones,
)
from .parts import Part
from .skull import Tissue
from .teeth import teeth_of

__all__ = [
    "MEAN_PUPIL_DISTANCE",
    "MIDLINE",
    "NAMES",
    "Atlas",
    "BoundHairs",
    "Cavities",
    "Crease",
    "EyeMuscle",
    "Eyeball",
    "EyelidOpening",
    "Face",
    "FaceFrame",
    "Identity",
    "JawMuscle",
    "JointWeights",
    "LidMuscle",
    "LinearMuscle",
    "Lining",
    "Mixture",
    "Muscle",
    "Part",
    "SheetMuscle",
    "SphincterMuscle",
    "Tissue",
    "TongueMuscle",
    "default_face",
    "fit_face",
    "frame_of",
    "gaze_of",
    "hair_cover",
    "lips_middle",
    "load_atlas",
    "load_head",
    "millimeters",
    "mirrored_name",
    "of_side",
    "per_face",
    "printed_atlas",
    "read_face",
    "surface",
    "teeth_of",
    "within",
    "write_face",
    "zones",
]
