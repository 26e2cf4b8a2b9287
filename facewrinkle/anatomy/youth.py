"""Childlike proportions of a face: the skin of children is thick, smooth and full, and folds less."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..array_types import Array
from ..geometry.smoothstep import smoothstep
from .landmarks import FaceFrame

CHILD, ADULT = 0.24, 0.31
"""Height of the face from the root of the nose to the chin, times how far the tip of the nose stands out before its
base, both in distances between the pupils: both grow with the years. Adults have at least the second (0.31 to 0.51 on
thirty-two labelled faces).
"""

CHILDS_FOLDS, YOUNG_FOLDS = 0.25, 0.6
"""Depth of the fine folds of a child, and of a face of age -1, relative to those of an adult."""


def childlike(landmarks: Mapping[str, Array], frame: FaceFrame) -> float:
    """Return how childlike the proportions of a face are, from 0 (an adult's) to 1 (an infant's).

    Examples
    --------
    >>> import facewrinkle as fw
    >>> small = {"width": 0.5, "length": -1.0, "nose_length": -1.0, "chin": -1.0, "jaw": -1.0, "age": -1.0}
    >>> faces = fw.default_face(), fw.default_face(small)
    >>> [round(childlike(face.landmarks, face.frame), 1) for face in faces]
    [0.0, 0.9]
    """
    height = np.linalg.norm(landmarks["nasion"] - landmarks["menton"]) / frame.pupil_distance
    out = (landmarks["nose_tip"] - landmarks["subnasale"]) @ frame.axes[2] / frame.pupil_distance
    return float(smoothstep((ADULT - height * max(out, 0.0)) / (ADULT - CHILD)))


def fold_depth(landmarks: Mapping[str, Array], frame: FaceFrame, age: float) -> float:
    """Return the depth of the fine folds of a face relative to those of an adult.

    Parameters
    ----------
    landmarks : mapping of str to ndarray, shape (3,)
    frame : FaceFrame
    age : float
        From -1 (young) to 1 (old); from 0 on it makes no difference.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> [round(fold_depth(face.landmarks, face.frame, age), 2) for age in (-1.0, 0.0, 1.0)]
    [0.6, 1.0, 1.0]
    """
    young = 1.0 - (1.0 - YOUNG_FOLDS) * max(-age, 0.0)
    return young * (1.0 - (1.0 - CHILDS_FOLDS) * childlike(landmarks, frame))
