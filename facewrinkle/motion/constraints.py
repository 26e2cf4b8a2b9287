"""Skin that other tissue holds: the nose on its cartilage, the lips on the dental arch, their lining on the gums."""

from __future__ import annotations

import numpy as np

from ..anatomy import Face, lips_middle
from ..anatomy.teeth import ELLIPSE
from ..array_types import Array
from ..geometry import unit
from ..geometry.interpolation import smoothstep

CARTILAGE_RADIUS, LOOSE_RADIUS = 7.0, 20.0
"""Reach of the cartilage around the line from the tip of the nose to its base, and of the loose skin around the tip, on
a face of average size, mm.
"""

LOOSE = 0.92
"""Share of its tethers that the skin on the tip of the nose lacks."""

SPINE_RADIUS, SPINE = 8.0, 2.0
"""Reach of the bone under the base of the nose, the anterior nasal spine, on a face of average size, mm, and how many
times as many tethers as elsewhere it adds there: skin and cartilage are bound to it.
"""

GUMS_FROM, GUMS_TO = 2.0, 8.0
"""Distances above and below the line between the lips: skin behind the lips is lining of the lips up to the first, and
holds to the gums from the second on, mm.
"""

VESTIBULE_DEPTH = 30.0
"""Distance behind the lips up to which there are gums in front of teeth, mm."""

LIP_LINE, AROUND_LIPS = 4.0, 6.0
"""Depth of the line where the lips meet behind their red, and reach of the lips' tethers around this line, mm."""

MODIOLUS, KNOT = (0.085, 0.03, -0.02), 4.5
"""Place of the modiolus from the corner of the mouth, [outwards, up, forward] in distances between the pupils, and its
size, the standard deviation of a Gaussian, on a face of average size, mm.
"""


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
    tip, base = face.landmarks["nose_tip"], face.landmarks["subnasale"]
    line, offset = base - tip, face.points - tip
    along = np.clip(offset @ line / (line @ line), 0.0, 1.0)
    away = np.array([((offset - share * line) ** 2).sum(axis=1) for share in (along[:, None], 0.0)])
    reach = np.array([CARTILAGE_RADIUS, LOOSE_RADIUS]) * face.frame.scale
    firm, near = np.exp(-away / reach[:, None] ** 2)
    on_bone = np.exp(-((face.points - base) ** 2).sum(axis=1) / (SPINE_RADIUS * face.frame.scale) ** 2)
    return firm, LOOSE * near * (1.0 - on_bone) - SPINE * on_bone


def on_gums(face: Face) -> Array:
    """Return the share (n,) in which the skin is lining behind the lips that holds to the gums: no muscle pulls it.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> bool(on_gums(face)[face.tissue.normals @ face.frame.axes[2] > 0.0].any())
    False
    """
    left, up, forward = face.frame.axes
    width = abs((face.landmarks["mouth_l"] - face.landmarks["mouth_r"]) @ left)
    side, height, depth = from_lips(face).T
    behind = (np.abs(side) < 0.6 * width) & (face.tissue.normals @ forward < 0.0)
    behind &= ((face.points - face.landmarks["subnasale"]) @ up < 0.0) & (depth > -VESTIBULE_DEPTH * face.frame.scale)
    return np.asarray(behind * smoothstep((np.abs(height) / face.frame.scale - GUMS_FROM) / (GUMS_TO - GUMS_FROM)))


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
    out = np.array([MODIOLUS, MODIOLUS]) * [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]]
    knots = corners + face.frame.pupil_distance * out @ face.frame.axes
    square = ((face.points - knots[:, None]) ** 2).sum(axis=2)
    return corners, np.exp(-0.5 * square / (KNOT * face.frame.scale) ** 2)


def lip_tethers(face: Face) -> tuple[Array, Array]:
    """Return the share (n,) in which each vertex is part of the lips, and the unit directions (n, 3) of the tethers.

    Tethers point along the normals of the tissue; near the lips, where these point every way as lips fold over, they
    turn to point straight off the dental arch.
    """
    scale, axes = face.frame.scale, face.frame.axes
    middle = lips_middle(face.landmarks) - LIP_LINE * scale * axes[2]
    square = np.full(len(face.points), np.inf)
    for corner in (face.landmarks["mouth_l"], face.landmarks["mouth_r"]):
        line, offset = corner - middle, face.points - middle
        along = np.clip(offset @ line / (line @ line), 0.0, 1.0)
        square = np.minimum(square, ((offset - along[:, None] * line) ** 2).sum(axis=1))
    near = np.exp(-square / (AROUND_LIPS * scale) ** 2)
    half = scale * np.array(ELLIPSE["upper"])
    local = from_lips(face) + np.array([0.0, 0.0, half[1] + face.behind_lips * scale])
    off = unit(np.stack([local[:, 0] / half[0] ** 2, np.zeros(len(local)), local[:, 2] / half[1] ** 2], axis=1))
    return near, unit(face.tissue.normals + near[:, None] * (off @ axes - face.tissue.normals))
