"""Landmarks on any mesh of a face, from its shape alone.

The built-in head is the template (:mod:`.template`). Protruding points are taken for noses, at every size and from all
sides (:mod:`.candidates`); the best of these poses are aligned with the template on depth maps (:mod:`.depth`). A
smooth warp (:mod:`.warp`) gives the confidence that a surface is a face (:mod:`.matching`), and the places of the
template's landmarks (:mod:`.landmarks`); some are measured on the shape (:mod:`.features`).
"""

from .landmarks import Found, find_landmarks
from .template import Pose, pose_from_landmarks

__all__ = ["Found", "Pose", "find_landmarks", "pose_from_landmarks"]
