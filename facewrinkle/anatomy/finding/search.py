"""The search of a mesh for a face, in steps: candidate poses, the best of them aligned, and matches with the template.

Where the whole mesh shows no face, its parts are searched, and then what stands on a floor.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from ...array_types import Array, IntArray
from ...errors import LandmarkError
from ...geometry.sampling import surface_samples
from ...geometry.topology import components
from ...mesh.repair import areas_doubled, votes_of
from ...progress import Progress
from ..landmarks import REFUSED
from .candidates import SAMPLES, SIZES, candidates, distinct
from .matching import COARSE, FINE, Match, aligned, matched, pose_score, surface_map, template_map
from .template import VARIANTS, Pose, template

NO_FACE = (
    "no face was found on the mesh: nothing on it looks like one. If it is a face, give landmarks; required are, on "
    "one side at least, eye_l_inner, eye_l_outer, mouth_l, brow_l_mid; nose_tip, upper_lip_mid, lower_lip_mid."
)

# The effort of the search. The confidence of a match tells faces from other things, see `matching`.
TRIED, REFINED = 40, 3
"""Candidates that are aligned, and the best of these that are matched."""
SURE = 0.75
"""Confidence above which no other pose is matched: below it a face is doubted."""
HOPELESS = 0.25
"""Confidence below which only the mean template is tried: it is refused, whatever the others show."""

# The parts of a mesh that are searched.
FEWEST_TRIANGLES = 200
"""Triangles of a mesh, at least: spread over a face, they are a third of the distance between the pupils in size."""
MOST_LAYERS = 25.0
"""Area of all triangles over that of their bounding box, at most: heads have 0.3 to 0.6, and a surface that lies over
itself so often, such as triangles at random, takes minutes to search.
"""
PARTS = 3
"""Parts of a mesh that are searched by themselves where the whole shows no face, at most."""
UNEVEN = 0.004
"""Unevenness of a floor, at most, over the diagonal of the bounding box."""
PART_LOSS = 0.1
"""The part that makes up most of what is seen is the face, unless it is by so much less like one than with the others:
lashes and the shells of eyes, which fill its eyes, are left out.
"""

STEPS = len(SIZES) + TRIED + REFINED + len(VARIANTS)
"""Steps of the search of a mesh or a part of it, at most."""


def _search(points: Array, triangles: IntArray, pose: Pose | None) -> Iterator[tuple[list[Match], IntArray]]:
    """Yield, after each step, the matches with the template's variants so far, and the triangles that are the face.

    The steps are sizes, poses, the best of these, and variants of the template. With a known pose, no other is tried.
    """
    poses = [] if pose is None else [(1.0, pose)]
    for _ in _scored_poses(points, triangles, poses) if pose is None else ():
        yield [], triangles
    tried = []
    for _, start in distinct(poses, REFINED):
        tried.append(_aligned_match(points, triangles, start))
        yield [], triangles
        if tried[-1].confidence > SURE:
            break
    best = max(tried, key=lambda match: match.confidence)
    part = _face_part(points, triangles, best)
    if len(part) < len(triangles):
        alone = _aligned_match(points, part, best.pose)
        if alone.confidence > best.confidence - PART_LOSS:
            best, triangles = alone, part
    matches = [best]
    yield matches, triangles
    for variant in range(1, len(VARIANTS) if best.confidence > HOPELESS else 1):
        pose = best.pose
        if template(variant).mouth_open:
            pose = aligned(points, triangles, pose, variant)
        matches.append(matched(points, triangles, pose, variant))
        yield matches, triangles


def _aligned_match(points: Array, triangles: IntArray, pose: Pose) -> Match:
    return matched(points, triangles, aligned(points, triangles, pose))


def _scored_poses(points: Array, triangles: IntArray, poses: list[tuple[float, Pose]]) -> Iterator[None]:
    """Fill in aligned candidates with their scores, the best first, in steps."""
    starts: list[tuple[float, Pose]] = []
    for found in candidates(surface_samples(points, triangles, SAMPLES)):
        starts += found
        yield
    starts.sort(key=lambda pair: pair[0])
    for _, start in distinct(starts, TRIED):
        pose = aligned(points, triangles, start)
        poses.append((pose_score(surface_map(points, triangles, pose, COARSE), template_map(COARSE)), pose))
        yield
    poses.sort(key=lambda pair: -pair[0])


def searched(points: Array, triangles: IntArray, pose: Pose | None, progress: Progress) -> tuple[list[Match], IntArray]:
    """Search a mesh as a whole, and its parts if that shows no face: beside a large thing a face is small or hidden.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    pose : Pose or None
        The pose, if it is known: then no other is tried.
    progress : Progress

    Returns
    -------
    matches : list of Match
        Matches with the template's variants, the mean face first.
    triangles : ndarray of int, shape (k, 3)
        Those of the part that is the face.
    """
    found: list[tuple[list[Match], IntArray]] = []
    others = chain(_parts(points, triangles), _off_the_floor(points, triangles))
    for part in chain([triangles], () if pose is not None else others):
        *_, (matches, face) = progress(_search(points, part, pose), "Finding the face", STEPS)
        found.append((matches, face))
        if matches[0].confidence > REFUSED:
            break
    return max(found, key=lambda result: result[0][0].confidence)


def check_surface(points: Array, triangles: IntArray) -> None:
    """Raise an error for triangles that cannot be a surface with a face, however they are searched.

    Raises
    ------
    LandmarkError
        If too few of them hang together, or if they lie over each other again and again.
    """
    remedy = "Give a finer mesh, or at least three landmarks that are not in a line."
    connected = np.bincount(_labelled_parts(points, triangles, 7)[1], minlength=1).max()
    if connected < FEWEST_TRIANGLES:
        raise LandmarkError(
            f"no face was found on the mesh: its triangles are no surface that could show one, as {connected} of "
            f"{len(triangles)} hang together; {FEWEST_TRIANGLES} are needed at least. {remedy}"
        )
    x, y, z = np.ptp(points[triangles], axis=(0, 1))
    layers = 0.25 * areas_doubled(points, triangles).sum() / max(x * y + y * z + z * x, 1e-300)
    if layers > MOST_LAYERS:
        raise LandmarkError(
            "no face was found on the mesh: its triangles are no surface, but lie over each other. Their area must be "
            f"at most {MOST_LAYERS:g} times that of their bounding box, received {layers:.3g} times. Check that the "
            "file holds what it should, or give landmarks."
        )


def _labelled_parts(points: Array, triangles: IntArray, decimals: int) -> tuple[IntArray, IntArray]:
    """Rows of the triangles that keep three corners when points are welded, and the connected part of each."""
    welded = np.unique(np.round(points, decimals), axis=0, return_inverse=True)[1].reshape(-1)[triangles]
    proper = np.flatnonzero((welded != np.roll(welded, 1, axis=1)).all(axis=1)).astype(np.int64)
    return proper, components(welded[proper]).astype(np.int64) if len(proper) else proper


def _parts(points: Array, triangles: IntArray) -> Iterator[IntArray]:
    """The parts of a mesh that could be a face by themselves, those with the most triangles first."""
    proper, label = _labelled_parts(points, triangles, 7)
    count = np.bincount(label)
    for part in np.argsort(-count, kind="stable")[:PARTS]:
        if FEWEST_TRIANGLES <= count[part] < len(proper):
            yield triangles[proper[label == part]]


def _off_the_floor(points: Array, triangles: IntArray) -> Iterator[IntArray]:
    """The triangles off a plane that is most of the surface, such as a table that a scan has grown together with."""
    area = areas_doubled(points, triangles)
    cloud = surface_samples(points, triangles, 2000)
    flat = np.ones(len(cloud), bool)
    for _ in range(5):  # refit the plane to the half of the points closest to it
        centre = cloud[flat].mean(axis=0)
        normal = np.linalg.svd(cloud[flat] - centre, full_matrices=False)[2][2]
        off = np.abs((cloud - centre) @ normal)
        flat = off <= max(float(np.median(off)), UNEVEN)
    on_floor = (np.abs((points - centre) @ normal) < UNEVEN)[triangles].all(axis=1)
    if area[on_floor].sum() > 0.5 * area.sum() and len(triangles) - on_floor.sum() >= FEWEST_TRIANGLES:
        yield triangles[~on_floor]


def _face_part(points: Array, triangles: IntArray, match: Match) -> IntArray:
    """The triangles of the part to which most of what is seen belongs."""
    pose, surface = match.pose, match.surface
    local = pose.local(points)
    proper, label = _labelled_parts(local, triangles, 6)
    if not len(proper) or label.max() == 0:
        return triangles
    x, y = np.meshgrid(FINE.x, FINE.y)
    shown = surface.weight > 0.5
    places = np.column_stack([x[shown], y[shown], surface.depth[shown]])
    votes = votes_of(local, triangles[proper], label, places)
    return triangles[proper[label == np.argmax(votes)]]
