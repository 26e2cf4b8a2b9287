"""Regions of the skin, by the landmarks that are nearest on the face at rest."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..array_types import Array

ANCHORS = {
    "forehead": ("trichion", "forehead_mid", "brow_{}_mid trichion", "brow_{}_outer trichion"),
    "glabella": ("glabella",),
    "brow": ("brow_{}_inner", "brow_{}_mid", "brow_{}_outer"),
    "eyelids": ("eye_{}_inner", "eye_{}_outer", "eye_{}_inner eye_{}_outer"),
    "temple": ("brow_{}_outer zygion_{}", "brow_{}_outer brow_{}_outer zygion_{} trichion"),
    "nose": ("sellion", "nasion nose_tip", "nose_tip", "ala_{}", "ala_{} sellion"),
    "cheek": ("malar_{}", "zygion_{}", "malar_{} mouth_{}", "malar_{} ala_{}", "mouth_{} gonion_{}"),
    "upper lip": ("subnasale", "ala_{} mouth_{}"),
    "mouth": (
        "upper_lip_mid", "lower_lip_mid", "mouth_{}", "upper_lip_mid mouth_{}", "lower_lip_mid mouth_{}",
    ),
    "chin": ("pogonion", "menton", "mouth_{} menton"),
    "jaw": ("gonion_{}", "gonion_{} menton", "mouth_{} gonion_{} gonion_{}"),
}  # fmt: skip
"""Points that stand for each region: landmarks, or means of several; {} is either side."""

REGIONS = ("none", *ANCHORS, "elsewhere")
"""Names of the numbers in the label ``region``; "none" is no skin, "elsewhere" the rest of the head, ears and neck."""

FAR = 0.75
"""Skin further than this from all points is elsewhere, in distances between the pupils."""


def anchors_of(face: Face) -> tuple[Array, npt.NDArray[np.uint8]]:
    """Return the points (k, 3) that stand for regions, in the unit of the face, and the numbers (k,) of these.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> points, number = anchors_of(fw.default_face())
    >>> len(points) == len(number), REGIONS[number[0]], REGIONS[number[-1]]
    (True, 'forehead', 'jaw')
    """
    points, numbers = [np.empty((0, 3))], []
    for number, entries in enumerate(ANCHORS.values(), start=1):
        for entry in entries:
            for side in "lr" if "{}" in entry else "m":
                names = entry.replace("{}", side).split()
                if all(name in face.landmarks for name in names):
                    points.append(np.mean([face.landmarks[name] for name in names], axis=0)[None])
                    numbers.append(number)
    return np.concatenate(points), np.array(numbers, np.uint8)


def regions_at(face: Face, rest: Array) -> npt.NDArray[np.uint8]:
    """Return the numbers (p,) in :data:`REGIONS` of places (p, 3) on the face at rest, in its unit.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> named = ("pogonion", "nose_tip", "gonion_l")
    >>> [REGIONS[k] for k in regions_at(face, np.array([face.landmarks[name] for name in named]))]
    ['chin', 'nose', 'jaw']
    """
    points, numbers = anchors_of(face)
    out = np.full(len(rest), REGIONS.index("elsewhere"), np.uint8)
    if len(points):
        distance, nearest = cKDTree(points).query(rest, distance_upper_bound=FAR * face.frame.pupil_distance)
        near = np.isfinite(distance)
        out[near] = numbers[nearest[near]]
    return out
