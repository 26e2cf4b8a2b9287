"""Landmarks on a mesh of a face: their places, from those on the template's variants, and the confidence in each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.ndimage import grey_dilation, map_coordinates
from threadpoolctl import threadpool_limits

from ...array_types import Array, IntArray
from ...errors import LARGEST, LandmarkError, MeshError
from ...mesh import MeshLike, closest_places, surface_in, to_polydata
from ...mesh.repair import degenerate
from ...progress import Progress, bar
from ..landmarks import MOUTH_LANDMARKS, NAMES, complete
from .features import below_furrow, chin, furrow, openings
from .matching import FINE, Match, certain, share
from .search import NO_FACE, check_surface, searched
from .template import AT_REST, UNMEASURED, Pose, peak, pose_from_landmarks, template

CHIN = ("pogonion", "menton")
"""Landmarks of the chin, which goes along with the mouth."""


@dataclass(frozen=True, eq=False)
class Found:
    """A face that was found on a mesh.

    Attributes
    ----------
    landmarks : dict of str to ndarray, shape (3,)
        In the coordinates and the unit of the mesh.
    confidences : dict of str to float
        Confidence in each, 0 to 1.
    estimated : tuple of str
        The landmarks that cannot be measured on the shape, or are hidden.
    confidence : float
        Likeness to a face, at most 1; other things stay below 0.6.
    pose : Pose
        Rotation (`axes`), scale (`size`) and translation (`origin`).

    Examples
    --------
    A possible outcome of a search; the nose was measured, the hairline was not:

    >>> pose = Pose(np.eye(3), origin=np.zeros(3), size=6.3, stretch=np.ones(3))
    >>> places = {"nose_tip": np.array([0.0, -3.2, 4.5]), "trichion": np.array([0.0, 8, 1])}
    >>> found = Found(places, {"nose_tip": 0.97, "trichion": 0.4}, ("trichion",), 0.97, pose)
    >>> [name for name in found.landmarks if name not in found.estimated], found.confidence > 0.6
    (['nose_tip'], True)
    """

    landmarks: dict[str, Array]
    confidences: dict[str, float]
    estimated: tuple[str, ...]
    confidence: float
    pose: Pose


def find_landmarks(
    mesh: MeshLike,
    given: Mapping[str, npt.ArrayLike] | None = None,
    *,
    progress: Progress | None = None,
) -> Found:
    """Find a face on a mesh by its shape: any unit, any direction, either winding, with or without other parts.

    Parameters
    ----------
    mesh : PolyData, or anything that `read_surface` takes
        Not changed. It may have holes, loose parts and faults.
    given : dict, optional
        Landmarks that are known. Three or more that do not lie on a line say where the face is, and nothing else is
        searched; fewer do not guide the search.
    progress : callable, optional
        Shows progress: called with the steps of the search, what is done, and the number of steps; returns the steps,
        to be done one by one. Default: a bar on stderr where that is a terminal.

    Returns
    -------
    Found
        Whatever looks most like a face; its `confidence` tells faces from other things.

    Raises
    ------
    MeshError
        If there is no surface, or points are not finite.
    LandmarkError
        If nothing on the mesh looks like a face at all, or if it has fewer than 200 triangles and not three landmarks
        are given.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> head = fw.default_face()
    >>> found = find_landmarks(head.mesh.rotate_x(70).scale(0.001))
    >>> found.confidence > 0.9
    True
    """
    points, triangles = _regular_surface(mesh)
    middle, diagonal = 0.5 * (points.min(axis=0) + points.max(axis=0)), float(np.linalg.norm(np.ptp(points, axis=0)))
    points = (points - middle) / diagonal
    marks = {name: (np.asarray(point, dtype=np.float64) - middle) / diagonal for name, point in (given or {}).items()}
    pose = pose_from_landmarks(marks)
    if pose is None:
        check_surface(points, triangles)
    with threadpool_limits(1, "blas"):  # its threads wait for each other longer than they work here
        matches, face = searched(points, triangles, pose, progress or bar)
    match = matches[0]
    try:
        landmarks, confidences, estimated = placed_landmarks(points, face, matches)
    except LandmarkError:  # the template's landmarks fell into disorder
        raise LandmarkError(NO_FACE) from None
    hidden = [name for name in NAMES if name not in UNMEASURED and confidences[name] < 0.2]
    return Found(
        {name: point * diagonal + middle for name, point in landmarks.items()},
        {name: value * match.confidence for name, value in confidences.items()},
        (*estimated, *hidden),
        match.confidence,
        replace(match.pose, origin=match.pose.origin * diagonal + middle, size=match.pose.size * diagonal),
    )


def _regular_surface(mesh: MeshLike) -> tuple[Array, IntArray]:
    """The triangles of a mesh that have an area, and the points that they use."""
    source = surface_in(mesh)
    points, triangles = source.points, source.triangles
    if not (np.abs(points[triangles]) < LARGEST).all():
        raise MeshError("points of the mesh are NaN, infinite or huge. Delete them, or export the mesh again.")
    triangles = triangles[~degenerate(points, triangles)]
    if not len(triangles):
        raise MeshError("the mesh has no triangles with an area. Export it again.")
    used, renumbered = np.unique(triangles, return_inverse=True)
    return points[used], renumbered.reshape(-1, 3)


# --- their places ---------------------------------------------------------------------------------------------


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
    around = [
        map_coordinates(m.correlation, FINE.index(_flat(landmarks, NAMES)), order=1, mode="nearest")
        for m, landmarks in zip(matches, variants, strict=True)
    ]
    correlations = dict(zip(NAMES, np.transpose(around), strict=True))
    alike = np.mean([correlations[name] for name in MOUTH_LANDMARKS], axis=0)
    mouth = int(np.argmax(alike))
    places, certainty = _consensus(matches, variants, correlations, mouth)
    found = furrow(points, triangles, match.pose, _mouth_of(match, places))
    if found is not None:
        corners = [_placed(m, variant, MOUTH_LANDMARKS)[:2] for m, variant in zip(matches, variants, strict=True)]
        # A variant whose corners lie elsewhere has another mouth.
        apart = match.pose.local(np.array(corners))[..., :2] - found[0]
        alike -= 0.5 * np.linalg.norm(apart, axis=2).mean(axis=1)
        if (other := int(np.argmax(alike))) != mouth:
            mouth = other
            places, certainty = _consensus(matches, variants, correlations, mouth)
            found = furrow(points, triangles, match.pose, _mouth_of(match, places))
    measured = (
        *_place_eyes(points, triangles, match, places),
        *_place_mouth(points, triangles, match, places, found, matches[mouth].mouth_open),
        *_place_chin(points, triangles, match, places),
    )
    for name in places:
        # The second is the correlation of faces that are like the template there.
        certainty[name] = share(certainty[name], (0.70, 0.95))
    shown = {"eye_l_outer", "eye_r_outer", "mouth_l", "mouth_r", "lower_lip_mid"}
    for name in shown - {*measured}:  # measured where the furrow or opening shows it
        certainty[name] *= 0.5
    for name in CHIN:  # measured where it is seen to turn under
        certainty[name] = max(certainty[name], 0.7) if name in measured else 0.5 * certainty[name]
    tip = peak(match.surface.depth, FINE, match.pose.local(places["nose_tip"])[:2])
    places["nose_tip"] = _raised(match, tip[None], match.surface.depth)[0]
    estimated = tuple(name for name in UNMEASURED if name not in measured)
    for name in estimated:
        certainty[name] = min(certainty[name], 0.3)
    landmarks = complete(places, variants[0])[0]
    names = [name for name in NAMES if not name.endswith("centre")]
    _, skin = closest_places(to_polydata(points, triangles), np.array([landmarks[name] for name in names]))
    landmarks |= dict(zip(names, skin, strict=True))
    return landmarks, {name: float(np.clip(value, 0.0, 1.0)) for name, value in certainty.items()}, estimated


def _consensus(
    matches: list[Match], variants: list[dict[str, Array]], correlations: Mapping[str, Array], mouth: int
) -> tuple[dict[str, Array], dict[str, float]]:
    """Means of the landmarks over the variants, and their correlations.

    Landmarks that move with the mouth come from the `mouth` variant if that is not at rest.
    """
    with_mouth = (*MOUTH_LANDMARKS, "subnasale", *CHIN) if mouth >= len(AT_REST) else ()
    rest = len(AT_REST)
    # Some cannot be read off the front view: they are completed from the template and the others.
    off_front = ("trichion", "zygion_l", "zygion_r", "gonion_l", "gonion_r", "eye_l_centre", "eye_r_centre")
    names = [name for name in NAMES if name not in off_front]
    by_variant = np.array([_placed(match, variants[k], names) for k, match in enumerate(matches)])
    certainty = {name: float(values[:rest].mean()) for name, values in correlations.items()}
    places = {}
    for name, candidates in zip(names, by_variant.swapaxes(0, 1), strict=True):
        chosen = [mouth] if name in with_mouth else range(rest)
        correlation = correlations[name][chosen]
        weights = np.exp((correlation - correlation.max()) / 0.03)  # the best has most of it
        places[name], certainty[name] = (
            np.average(candidates[chosen], axis=0, weights=weights),
            float(correlation.mean()),
        )
    return places, certainty


def _mouth_of(match: Match, places: Mapping[str, Array]) -> Array:
    """Landmarks (4, 2) of the mouth in the front view."""
    return match.pose.local(np.array([places[name] for name in MOUTH_LANDMARKS]))[:, :2]


def _place_eyes(points: Array, triangles: IntArray, match: Match, places: dict[str, Array]) -> tuple[str, ...]:
    """Move the corners of open eyes to the ends of their openings; return the names of those that are seen there."""
    names = ("eye_l_outer", "eye_l_inner", "eye_r_inner", "eye_r_outer")  # from left to right
    expected = match.pose.local(np.array([places[name] for name in names]))[:, :2]
    ends = openings(points, triangles, match.pose, expected.reshape(2, 2, 2)).reshape(4, 2)
    placed = _raised(match, expected + certain(ends - expected), match.surface.depth)
    seen = {name: place for name, place in zip(names, placed, strict=True) if np.isfinite(place).all()}
    places |= seen
    return tuple(seen)


def _place_mouth(
    points: Array,
    triangles: IntArray,
    match: Match,
    places: dict[str, Array],
    found: tuple[Array, float] | None,
    opened: bool,
) -> tuple[str, ...]:
    """Move the corners of the mouth to the ends of its furrow or opening, if it was `found`, and the lower lip above
    the fold of the chin; lips and chin go along if it is closed.

    Return the names of those that are seen there.
    """
    if found is None:
        return ()
    expected, seen = _mouth_of(match, places), (*MOUTH_LANDMARKS[:2], "lower_lip_mid")
    ends, meeting = found
    ends = expected[:2] + certain(ends - expected[:2])
    places |= dict(zip(seen[:2], _raised(match, ends, match.surface.depth), strict=True))
    lips = expected[2:]
    if not opened:
        left, right = ends[:, 0] - expected[:2, 0]
        sideways = np.sign(left) * min(abs(left), abs(right)) if left * right > 0.0 else 0.0
        raised = certain(np.array([[0.0, meeting - lips[:, 1].mean()]]))[0, 1]
        lips = lips + np.array([sideways, raised])
        places |= dict(zip(MOUTH_LANDMARKS[2:], _raised(match, lips, match.surface.depth), strict=True))
        chin = match.pose.local(np.array([places[name] for name in CHIN]))[:, :2] + [0.0, raised]
        places |= dict(zip(CHIN, _raised(match, chin, match.surface.depth), strict=True))
    lip = below_furrow(points, triangles, match.pose, float(lips[1, 0]), meeting)
    if lip is None:
        return seen[:2]
    places["lower_lip_mid"] = match.pose.world(lip)
    return seen


def _place_chin(points: Array, triangles: IntArray, match: Match, places: dict[str, Array]) -> tuple[str, ...]:
    """Move the landmarks of the chin to where its profile turns under; return the names of those that were measured."""
    lowest, front = chin(points, triangles, match.pose, match.pose.local(places["menton"]))
    places["menton"] = match.pose.world(lowest)
    if front is None:
        return ()
    places["pogonion"] = match.pose.world(front)
    return CHIN


def _placed(match: Match, landmarks: Mapping[str, Array], names: Sequence[str]) -> Array:
    """Places (k, 3) of a variant's landmarks on the surface."""
    flat = match.warp(_flat(landmarks, names))
    places = _raised(match, flat, match.surface.depth)
    if match.mouth_open:  # on the lips, not between them
        lips = [names.index(name) for name in ("upper_lip_mid", "lower_lip_mid")]
        places[lips] = _raised(match, flat[lips], grey_dilation(match.surface.depth, size=(5, 5)))
    return places


def _raised(match: Match, flat: Array, depth: Array) -> Array:
    """Places (k, 3) on the surface of places (k, 2) in the front view."""
    height = map_coordinates(depth, FINE.index(flat), order=1, mode="nearest")
    return match.pose.world(np.column_stack([flat, height]))


def _flat(landmarks: Mapping[str, Array], names: Iterable[str]) -> Array:
    return np.array([landmarks[name][:2] for name in names])
