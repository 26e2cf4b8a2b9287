"""Landmarks on a face that has been found, from their places on the template's variants, and their confidences."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import cast

import numpy as np
from scipy.ndimage import grey_dilation, map_coordinates

from ...array_types import Array, BoolArray, IntArray
from ...mesh import closest_places, to_polydata
from ..landmarks import NAMES, complete
from .alignment import FINE
from .depth import peak
from .features import MOUTH, below_furrow, chin, furrow, lower_lip, rise_of_brows
from .matching import Match, certain
from .template import AT_REST, UNMEASURED, template

Landmarks = Mapping[str, Array]

OFF_FRONT = ("trichion", "zygion_l", "zygion_r", "gonion_l", "gonion_r", "eye_l_centre", "eye_r_centre")
"""Landmarks that cannot be read off the front view: completed from the template and the others."""

WITH_MOUTH = (*MOUTH, "subnasale", "pogonion", "menton")
"""Landmarks that move with the mouth, all of which come from one variant if its mouth is open or drawn aside."""

CHIN = ("pogonion", "menton")
"""Landmarks of the chin, which goes along with the mouth."""

# The face's mouth is that of the variant with the highest mean correlation around the landmarks of the mouth.
SIMILAR = 0.02
"""Variants whose correlation is lower than the highest by at most this may be as right: their scatter counts."""
PARTED = 0.1
"""Depth of the hollow between open lips, at least, in distances between the pupils: without it no variant with an open
mouth is right.
"""

# Confidence in a landmark: a share by correlation, 0 at the first and 1 at the second number, times a share by scatter.
LANDMARK_CORRELATION = (0.70, 0.95)
"""Correlation of curvature around a landmark: the second is that of faces that are like the template there."""
CHOICE = 0.03
"""A variant with a correlation lower by this around a landmark has a third of the weight there."""
DISAGREEMENT = 0.12
"""Scatter of a landmark among the variants that halves its confidence, in distances between the pupils."""
ESTIMATE = 0.3
"""Confidence of a landmark that cannot be measured, at most."""
UNSEEN, SEEN = 0.5, 0.7
"""Factor of the confidence in a lower lip that is not seen, and in a chin that is not seen to turn under; confidence in
one that is, at least.
"""


def placed_landmarks(
    points: Array, triangles: IntArray, matches: list[Match]
) -> tuple[dict[str, Array], dict[str, float], tuple[str, ...]]:
    """Return all landmarks on the surface, the confidence in each, and the names of those that are estimates.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    matches : list of Match
        Matches with the template's variants in their order, the mean face first.

    Raises
    ------
    LandmarkError
        If the landmarks are out of order.
    """
    match, variants = matches[0], [template(k).landmarks for k in range(len(matches))]
    around = [_correlation_around(m, landmarks) for m, landmarks in zip(matches, variants, strict=True)]
    correlations = dict(zip(NAMES, np.transpose(around), strict=True))
    mouth, similar = _mouth_variants(matches, variants, correlations)
    places, certainty, rivals = _consensus(matches, variants, correlations, mouth, similar)
    lip_seen, measured = True, cast(tuple[str, ...], ())
    if not matches[mouth].mouth_open:
        lip_seen, measured = _close_mouth(points, triangles, match, places)
        measured += _place_chin(points, triangles, match, places)
    _raise_brows(points, triangles, match, places)
    for name, place in places.items():
        others = place[None] if name in measured else rivals[name]
        scatter = np.sqrt(((others - place) ** 2).sum(axis=1).mean()) / match.pose.size
        certainty[name] = _share(certainty[name]) / (1.0 + (scatter / DISAGREEMENT) ** 2)
    certainty["lower_lip_mid"] *= 1.0 if lip_seen else UNSEEN
    for name in CHIN:
        certainty[name] = max(certainty[name], SEEN) if name in measured else UNSEEN * certainty[name]
    tip = peak(match.surface.depth, FINE, match.pose.local(places["nose_tip"])[:2])
    places["nose_tip"] = _raised(match, tip[None], match.surface.depth)[0]
    estimated = tuple(name for name in UNMEASURED if name not in measured)
    for name in estimated:
        certainty[name] = min(certainty[name], ESTIMATE)
    landmarks = _on_surface(points, triangles, complete(places, variants[0])[0])
    return landmarks, {name: float(np.clip(value, 0.0, 1.0)) for name, value in certainty.items()}, estimated


def _mouth_variants(
    matches: list[Match], variants: list[dict[str, Array]], correlations: Mapping[str, Array]
) -> tuple[int, BoolArray]:
    """The variant whose mouth is most like the face's, and True for those that may be as right."""
    likeness = np.mean([correlations[name] for name in MOUTH], axis=0)
    closed = [not _parted(match, landmarks) for match, landmarks in zip(matches, variants, strict=True)]
    likeness[[match.mouth_open and shut for match, shut in zip(matches, closed, strict=True)]] = -1.0
    best = int(np.argmax(likeness))
    return best, likeness > likeness[best] - SIMILAR


def _consensus(
    matches: list[Match], variants: list[dict[str, Array]], correlations: Mapping[str, Array], mouth: int,
    similar: BoolArray,
) -> tuple[dict[str, Array], dict[str, float], dict[str, Array]]:  # fmt: skip
    """Means of the landmarks over the variants, their correlations, and the places (k, 3) that the variants give.

    Landmarks that move with the mouth come from the `mouth` variant if that is not at rest.
    """
    rest = len(AT_REST)
    names = [name for name in NAMES if name not in OFF_FRONT]
    by_variant = np.array([_placed(match, variants[k], names) for k, match in enumerate(matches)])
    certainty = {name: float(values[:rest].mean()) for name, values in correlations.items()}
    places, rivals = {}, {}
    for name, candidates in zip(names, by_variant.swapaxes(0, 1), strict=True):
        correlation = correlations[name][:rest]
        weights = np.exp((correlation - correlation.max()) / CHOICE)
        places[name] = np.average(candidates[:rest], axis=0, weights=weights)
        rivals[name] = candidates[:rest]
        if name in WITH_MOUTH:
            rivals[name] = candidates[similar]
            if mouth >= rest:
                places[name], certainty[name] = candidates[mouth], float(correlations[name][mouth])
    return places, certainty, rivals


def _close_mouth(
    points: Array, triangles: IntArray, match: Match, places: dict[str, Array]
) -> tuple[bool, tuple[str, ...]]:
    """Move the landmarks of a closed mouth and of the chin to where its furrow is.

    Return True if a lower lip is seen, and the names of those that were measured on the furrow and below it.
    """
    expected = match.pose.local(np.array([places[name] for name in MOUTH]))[:, :2]
    found = furrow(points, triangles, match.pose, expected)
    if found is None:
        places["lower_lip_mid"], lip_seen = _lower_lip(points, triangles, match, places)
        return lip_seen, ()
    ends, meeting = found
    ends = expected[:2] + certain(ends - expected[:2])
    left, right = ends[:, 0] - expected[:2, 0]
    sideways = np.sign(left) * min(abs(left), abs(right)) if left * right > 0.0 else 0.0
    raised = certain(np.array([[0.0, meeting - expected[2:, 1].mean()]]))[0, 1]
    lips = expected[2:] + np.array([sideways, raised])
    places |= dict(zip(MOUTH, _raised(match, np.concatenate([ends, lips]), match.surface.depth), strict=True))
    chin = match.pose.local(np.array([places[name] for name in CHIN]))[:, :2] + [0.0, raised]
    places |= dict(zip(CHIN, _raised(match, chin, match.surface.depth), strict=True))
    lip = below_furrow(points, triangles, match.pose, float(lips[1, 0]), meeting)
    if lip is None:
        places["lower_lip_mid"], lip_seen = _lower_lip(points, triangles, match, places)
        return lip_seen, MOUTH[:2]
    places["lower_lip_mid"] = _raised(match, np.array([[lips[1, 0], lip]]), match.surface.depth)[0]
    return True, (*MOUTH[:2], "lower_lip_mid")


def _place_chin(points: Array, triangles: IntArray, match: Match, places: dict[str, Array]) -> tuple[str, ...]:
    """Move the landmarks of the chin to where its profile turns under; return the names of those that were measured."""
    lowest, height = chin(points, triangles, match.pose, match.pose.local(places["menton"]))
    places["menton"] = match.pose.world(lowest)
    if height is None:
        return ()
    front = np.array([[match.pose.local(places["pogonion"])[0], height]])
    places["pogonion"] = _raised(match, front, match.surface.depth)[0]
    return CHIN


def _raise_brows(points: Array, triangles: IntArray, match: Match, places: dict[str, Array]) -> None:
    """Move the landmarks of the brows to the ridge above the orbits."""
    names = [name for name in NAMES if name.startswith("brow_")]
    flat = match.pose.local(np.array([places[name] for name in names]))[:, :2]
    rise = rise_of_brows(points, triangles, match.pose, dict(zip(names, flat, strict=True)))
    flat[:, 1] += certain(np.array([[0.0, rise]]))[0, 1]
    places |= dict(zip(names, _raised(match, flat, match.surface.depth), strict=True))


def _lower_lip(points: Array, triangles: IntArray, match: Match, places: Landmarks) -> tuple[Array, bool]:
    """The lower lip, moved up from the furrow below it if need be, and True if a lip is seen."""
    upper, lower = match.pose.local(np.array([places["upper_lip_mid"], places["lower_lip_mid"]]))[:, :2]
    rise, lip_seen = lower_lip(points, triangles, match.pose, upper, lower)
    if rise == 0.0:
        return places["lower_lip_mid"], lip_seen
    return _raised(match, np.array([[lower[0], lower[1] + rise]]), match.surface.depth)[0], lip_seen


def _share(correlation: float) -> float:
    low, high = LANDMARK_CORRELATION
    return float(np.clip((correlation - low) / (high - low), 0.0, 1.0))


def _placed(match: Match, landmarks: Landmarks, names: list[str]) -> Array:
    """Places (k, 3) of a variant's landmarks on the surface."""
    flat = match.warp(_flat(landmarks, names))
    places = _raised(match, flat, match.surface.depth)
    if match.mouth_open:  # on the lips, not between them
        lips = [names.index(name) for name in ("upper_lip_mid", "lower_lip_mid")]
        places[lips] = _raised(match, flat[lips], grey_dilation(match.surface.depth, size=(5, 5)))
    return places


def _parted(match: Match, landmarks: Landmarks) -> bool:
    """True if there is a hollow between the lips."""
    upper, lower = match.warp(_flat(landmarks, ("upper_lip_mid", "lower_lip_mid")))
    x, y = (upper + (lower - upper) * np.linspace(0.0, 1.0, 13)[:, None]).T
    depth = map_coordinates(match.surface.depth, FINE.index(np.column_stack([x, y])), order=1, mode="nearest")
    return bool(depth.min() < min(depth[:3].max(), depth[-3:].max()) - PARTED)


def _raised(match: Match, flat: Array, depth: Array) -> Array:
    """Places (k, 3) on the surface of places (k, 2) in the front view."""
    height = map_coordinates(depth, FINE.index(flat), order=1, mode="nearest")
    return match.pose.world(np.column_stack([flat, height]))


def _correlation_around(match: Match, landmarks: Landmarks) -> Array:
    """Correlation of curvature around a variant's landmarks, in the order of NAMES."""
    return np.asarray(map_coordinates(match.correlation, FINE.index(_flat(landmarks, NAMES)), order=1, mode="nearest"))


def _flat(landmarks: Landmarks, names: Iterable[str]) -> Array:
    return np.array([landmarks[name][:2] for name in names])


def _on_surface(points: Array, triangles: IntArray, landmarks: dict[str, Array]) -> dict[str, Array]:
    """The landmarks, with all but the centres of the eyes moved to the closest points of the surface."""
    names = [name for name in NAMES if not name.endswith("centre")]
    skin = to_polydata(points, triangles)
    _, places = closest_places(skin, np.array([landmarks[name] for name in names]))
    return landmarks | dict(zip(names, places, strict=True))
