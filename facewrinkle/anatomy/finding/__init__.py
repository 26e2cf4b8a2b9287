"""Landmarks on any mesh of a face, from its shape alone.

The built-in head is the template, compared by depth maps (:mod:`.template`). Protruding points are taken for noses, at
every size and from all sides; the best of these poses are aligned with the template (:mod:`.search`). A smooth warp
gives the confidence that a surface is a face (:mod:`.matching`), and the places of the template's landmarks
(:mod:`.landmarks`); some are measured on the shape, and brows on the photo (:mod:`.features`).
"""

from .features import rise_of_dark_bands
from .landmarks import Found, find_landmarks
from .template import Pose, pose_from_landmarks

__all__ = ["Found", "Pose", "find_landmarks", "pose_from_landmarks", "rise_of_dark_bands"]
