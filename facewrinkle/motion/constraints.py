"""Skin that other tissue holds: the nose on its cartilage, the lips on the dental arch, their lining on the gums."""

from __future__ import annotations

import numpy as np

from ..anatomy import Face, lips_middle
from ..anatomy.teeth import ELLIPSE
from ..array_types import Array
from ..geometry import unit
from ..geometry.interpolation import smoothstep

# Lengths are those of a face of average size, mm.


def from_lips(face: Face) -> Array:
    """Return the vertices (n, 3) as [left, up, forward] from the middle of the lips, in the unit of the mesh.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> nose = np.linalg.norm(face.points - face.landmarks["nose_tip"], axis=1).argmin()
    >>> bool(from_lips(face)[nose, 1] > 0.0)
    True
    """
    return face.frame.scale * (face.frame.local_mm(face.points) - face.frame.local_mm(lips_middle(face.landmarks)))


def _squares_from(points: Array, start: Array, end: Array) -> Array:
    """Return the squared distances (n,) of points (n, 3) from the straight line between two others."""
    line, offset = end - start, points - start
    along = np.clip(offset @ line / (line @ line), 0.0, 1.0)
    return np.asarray(((offset - along[:, None] * line) ** 2).sum(axis=1))


def tip_of_nose(face: Face) -> tuple[Array, Array]:
    """Return the share (n,) in which the skin sits on the cartilage between the tip of the nose and its base, and the
    share (n,) of its tethers that it lacks there: cartilage gives way where the bone ends. Its base sits on the bone.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> firm, free = tip_of_nose(face)
    >>> tip = np.linalg.norm(face.points - face.landmarks["nose_tip"], axis=1).argmin()
    >>> bool(firm[tip] > 0.9), bool(free[tip] > 0.9)
    (True, True)
    """
    tip, base, scale = face.landmarks["nose_tip"], face.landmarks["subnasale"], face.frame.scale
    # Cartilage reaches 7 mm around the line between them; skin is loose, and lacks most of its tethers, around the tip.
    firm = np.exp(-_squares_from(face.points, tip, base) / (7.0 * scale) ** 2)
    near = np.exp(-((face.points - tip) ** 2).sum(axis=1) / (20.0 * scale) ** 2)
    # Under the base is the anterior nasal spine: skin and cartilage are bound to it by two times more tethers.
    on_bone = np.exp(-((face.points - base) ** 2).sum(axis=1) / (8.0 * scale) ** 2)
    return firm, 0.92 * near * (1.0 - on_bone) - 2.0 * on_bone


def on_gums(face: Face) -> Array:
    """Return the share (n,) in which the skin is lining behind the lips that holds to the gums: no muscle pulls it.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> bool(on_gums(face)[face.tissue.normals @ face.frame.axes[2] > 0.0].any())
    False
    """
    (left, up, forward), scale = face.frame.axes, face.frame.scale
    width = abs((face.landmarks["mouth_l"] - face.landmarks["mouth_r"]) @ left)
    side, height, depth = from_lips(face).T
    behind = (np.abs(side) < 0.6 * width) & (face.tissue.normals @ forward < 0.0)
    # Farther behind the lips than 30 mm, there are no gums in front of teeth.
    behind &= ((face.points - face.landmarks["subnasale"]) @ up < 0.0) & (depth > -30.0 * scale)
    # It is lining of the lips up to 2 mm above and below the line between them, and holds to the gums from 8 mm on.
    return np.asarray(behind * smoothstep((np.abs(height) / scale - 2.0) / 6.0))


def modioli(face: Face) -> tuple[Array, Array]:
    """Return the corners (2, 3) of the mouth, and the share (2, n) in which the skin is on the modiolus of each, the
    knot of the muscles that meet there.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> corners, share = modioli(face)
    >>> bool(share.max() > 0.8), bool((share[:, face.points[:, 1] > corners[0, 1] + 20.0] < 0.01).all())
    (True, True)
    """
    corners = np.array([face.landmarks[f"mouth_{side}"] for side in "lr"])
    out = np.array([[0.085, 0.03, -0.02], [-0.085, 0.03, -0.02]])  # [left, up, forward] in distances between the pupils
    knots = corners + face.frame.pupil_distance * out @ face.frame.axes
    square = ((face.points - knots[:, None]) ** 2).sum(axis=2)
    return corners, np.exp(-0.5 * square / (4.5 * face.frame.scale) ** 2)  # the size of a modiolus


def lip_tethers(face: Face) -> tuple[Array, Array]:
    """Return the share (n,) in which each vertex is part of the lips, and the unit directions (n, 3) of the tethers.

    Tethers point along the normals of the tissue; near the lips, where these point every way as lips fold over, they
    turn to point straight off the dental arch.
    """
    scale, axes = face.frame.scale, face.frame.axes
    middle = lips_middle(face.landmarks) - 4.0 * scale * axes[2]  # the lips meet behind their red
    square = np.minimum(*(_squares_from(face.points, middle, face.landmarks[f"mouth_{side}"]) for side in "lr"))
    near = np.exp(-square / (6.0 * scale) ** 2)  # so far the tethers of the lips reach
    half = scale * np.array(ELLIPSE["upper"])
    local = from_lips(face) + np.array([0.0, 0.0, half[1] + face.behind_lips * scale])
    off = unit(np.stack([local[:, 0] / half[0] ** 2, np.zeros(len(local)), local[:, 2] / half[1] ** 2], axis=1))
    return near, unit(face.tissue.normals + near[:, None] * (off @ axes - face.tissue.normals))
