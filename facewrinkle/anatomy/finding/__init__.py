"""Landmarks on any mesh of a face, from its shape alone.

The built-in head is the template. Protruding points are taken for noses, at every size and from all sides
(:mod:`.search`); the best of these poses are made exact (:mod:`.alignment`) on depth maps (:mod:`.depth`); a smooth
warp (:mod:`.warp`) says where each of the template's landmarks lies.
"""

from .depth import Pose
from .landmarks import Found, find_landmarks, posed_by

__all__ = ["Found", "Pose", "find_landmarks", "posed_by"]
