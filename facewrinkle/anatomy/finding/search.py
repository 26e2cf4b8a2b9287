"""The search of a mesh for a face, in steps: candidate poses, the best of them aligned, and matches with the template.

Where the whole mesh shows no face, its parts are searched.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from ...array_types import Array, IntArray
from ...errors import LandmarkError
from ...geometry import compiled, components, double_areas, surface_samples, unit
from ...mesh.repair import votes_of
from ...progress import Progress
from ..landmarks import DOUBTED, REFUSED
from .matching import COARSE, FINE, Match, aligned, matched, pose_score, surface_map, template_map
from .template import VARIANTS, Pose, template

# --- candidates: protruding points are taken for noses, at every size and seen from all sides -------------------------

SIZES = np.geomspace(1 / 45.0, 1 / 2.9, 15)
"""Distance between the pupils over the diagonal of the bounding box: from a whole body on a floor to a narrow mask."""


SAMPLES = 40_000
"""Points spread over a mesh, among which noses are looked for, and over the template, of which its polar map is made.
"""

MAP_RADIUS = 1.2
"""Radius of the polar maps about noses, in distances between the pupils."""

RINGS, SECTORS = 9, 36


@cache
def _template_map() -> tuple[Array, Array]:
    """The template's heights and their weights, both (rings, sectors), about its nose."""
    face = template()
    points = surface_samples(face.points, face.triangles, SAMPLES)
    heights = _polar_map(points, face.landmarks["nose_tip"], np.eye(3), MAP_RADIUS, RINGS, SECTORS)
    heights = 0.5 * (heights + heights[:, (SECTORS // 2 - 1 - np.arange(SECTORS)) % SECTORS])
    ring, seen = (np.arange(RINGS)[:, None] + 0.5) / RINGS, heights > -0.9
    return np.where(seen, heights, 0.0), np.where(seen, ring, 0.0)


def candidates(points: Array) -> Iterator[list[tuple[float, Pose]]]:
    """Yield poses at which a face could be, with their mismatches: a list for each size.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Spread evenly over the surface.
    """
    middle = points.mean(axis=0)
    along = np.linalg.svd(points - middle, full_matrices=False)[2]
    along[2] *= np.linalg.det(along)
    # Along their own axes, points are thinned alike however they are turned.
    points = (points - middle) @ along.T
    for size in SIZES * float(np.linalg.norm(np.ptp(points, axis=0))):
        yield [
            (cost, Pose(pose.axes @ along, pose.origin @ along + middle, pose.size, pose.stretch))
            for cost, pose in _at_size(points, size)
        ]


def thinned(points: Array, spacing: float) -> Array:
    """Return the first of the points in every cube of a grid with this spacing."""
    cell = np.floor(points / spacing).astype(np.int64)
    cell -= cell.min(axis=0)
    number = np.ravel_multi_index(tuple(cell.T), tuple(cell.max(axis=0) + 1))
    return points[np.sort(np.unique(number, return_index=True)[1])]


def distinct(found: list[tuple[float, Pose]], n: int) -> list[tuple[float, Pose]]:
    """Return the first n poses of a list that are not close to an earlier one."""
    kept: list[tuple[float, Pose]] = []
    for value, pose in found:
        if not any(_same(pose, other) for _, other in kept):
            kept.append((value, pose))
            if len(kept) == n:
                break
    return kept


def _same(a: Pose, b: Pose) -> bool:
    """True if neither origins nor ends of axes are far apart for the size of the face."""
    apart = [a.origin - b.origin, *(a.origin + a.size * a.axes - b.origin - b.size * b.axes)]
    return bool(np.linalg.norm(apart, axis=1).max() < 0.4 * max(a.size, b.size))


def _at_size(points: Array, size: float) -> list[tuple[float, Pose]]:
    """The best four poses of every nose at one size, with their mismatches."""
    points = thinned(points, 0.06 * size)
    noses = _noses(points, size)
    axes = np.array([_directions(nose, _within(points, nose, 0.8 * size)) for nose in noses])
    cost, roll = _best_rolls(
        points, noses, axes, 1.6 * MAP_RADIUS * size, MAP_RADIUS * size, *_template_map(),
        0.15, 0.12,
    )  # fmt: skip
    tip = template().landmarks["nose_tip"]
    found = []
    for k, nose in enumerate(noses):
        for a in np.argsort(cost[k], kind="stable")[:4]:
            angle = 2.0 * np.pi * roll[k, a] / SECTORS
            across, over, ahead = axes[k, a]
            left = np.cos(angle) * across + np.sin(angle) * over
            rolled = np.array([left, np.cross(ahead, left), ahead])
            found.append((float(cost[k, a]), Pose(rolled, nose - size * tip @ rolled, size, np.ones(3))))
    return found


def _noses(points: Array, size: float) -> Array:
    """The 40 points (k, 3) that protrude most, none within the width of a nose of another."""
    coarse = thinned(points, 0.12 * size)
    tree = cKDTree(coarse)
    pairs = tree.query_pairs(0.55 * size, output_type="ndarray")
    near = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(coarse), len(coarse)))
    count = 1.0 + np.bincount(pairs.ravel(), minlength=len(coarse))[:, None]
    protrusion = coarse - (coarse + near @ coarse + near.T @ coarse) / count
    free = np.ones(len(coarse), bool)
    chosen: list[Array] = []
    for p in np.argsort(-np.linalg.norm(protrusion, axis=1), kind="stable"):
        if free[p]:
            free[tree.query_ball_point(coarse[p], 0.25 * size)] = False
            close = _within(points, coarse[p], 0.12 * size)
            chosen.append(close[np.argmax(close @ protrusion[p])])
            if len(chosen) == 40:
                break
    return np.array(chosen)


def _directions(nose: Array, around: Array) -> Array:
    """Frames (a, 3, 3) whose last rows are the directions in which a nose may look: away from the points around it."""
    ahead = nose - around.mean(axis=0)
    length = np.linalg.norm(ahead)
    return _tilted_frames() @ _frame(ahead / length if length > 0.0 else np.array([0.0, 0.0, 1.0]))


@cache
def _tilted_frames() -> Array:
    """Frames (a, 3, 3) whose last rows are z, where a nose protrudes, and directions around it that it may have."""
    directions = [
        (np.cos(turn) * np.sin(tilt), np.sin(turn) * np.sin(tilt), np.cos(tilt))
        for tilt, n in ((0.0, 1), (0.38, 6), (0.76, 9))  # angles, and the number of directions at each
        for turn in 2.0 * np.pi * np.arange(n) / n
    ]
    return np.array([_frame(np.array(direction)) for direction in directions])


def _frame(ahead: Array) -> Array:
    """A right-handed frame (3, 3) with this last row."""
    across = unit(np.cross(ahead, np.eye(3)[int(np.argmin(np.abs(ahead)))]))
    return np.array([across, np.cross(ahead, across), ahead])


def _within(points: Array, place: Array, reach: float) -> Array:
    """The points that lie within reach of a place."""
    offset = points - place
    return points[np.einsum("ij,ij->i", offset, offset) <= reach * reach]


@compiled
def _best_rolls(
    points: Array, noses: Array, axes: Array, reach: float, radius: float, template: Array, weights: Array,
    cap: float, missing: float,
) -> tuple[Array, IntArray]:  # fmt: skip
    """Mismatch (k, a) of every candidate at its best roll, and that roll in sectors: nose k looks along axes[k, a, 2].

    Only points within reach of a nose are compared.
    """
    cost, roll = np.empty(axes.shape[:2]), np.empty(axes.shape[:2], np.int64)
    for k in range(axes.shape[0]):
        around = points[((points - noses[k]) ** 2).sum(axis=1) <= reach * reach]
        for a in range(axes.shape[1]):
            heights = _polar_map(around, noses[k], axes[k, a], radius, *template.shape)
            values = _mismatch(heights, template, weights, cap, missing)
            cost[k, a], roll[k, a] = values.min(), 2 * np.argmin(values)
    return cost, roll


@compiled
def _polar_map(points: Array, nose: Array, axes: Array, radius: float, rings: int, sectors: int) -> Array:
    """Largest height of the points over the rings and sectors about a nose, over the radius; -inf where there is none.

    `axes` are two directions across and the direction in which the nose looks; the rings are of equal width.
    """
    heights = np.full((rings, sectors), -np.inf)
    for p in range(points.shape[0]):
        dx, dy, dz = points[p, 0] - nose[0], points[p, 1] - nose[1], points[p, 2] - nose[2]
        x = dx * axes[0, 0] + dy * axes[0, 1] + dz * axes[0, 2]
        y = dx * axes[1, 0] + dy * axes[1, 1] + dz * axes[1, 2]
        ring = int(np.sqrt(x * x + y * y) / radius * rings)
        if ring < rings:
            turn = np.arctan2(y, x) / (2.0 * np.pi)
            sector = int((turn - np.floor(turn)) * sectors) % sectors
            z = (dx * axes[2, 0] + dy * axes[2, 1] + dz * axes[2, 2]) / radius
            heights[ring, sector] = max(heights[ring, sector], z)
    return heights


@compiled
def _mismatch(heights: Array, template: Array, weights: Array, cap: float, missing: float) -> Array:
    """Mean difference (sectors / 2,) of two polar maps, with the first turned by every even number of sectors.

    A common difference of their heights does not count, larger ones count as `cap`, and places without surface as
    `missing`, over the radius.
    """
    sectors = heights.shape[1]
    twice = np.concatenate((heights, heights), axis=1)
    cost = np.empty(sectors // 2)
    for turn in range(sectors // 2):
        difference = twice[:, 2 * turn : 2 * turn + sectors] - template
        known = weights * np.isfinite(difference)
        offset = (known * np.minimum(np.maximum(difference, -cap), cap)).sum() / (known.sum() + 1e-12)
        off = np.minimum(np.abs(difference - offset), cap)
        cost[turn] = (missing * weights + known * (off - missing)).sum()
    return cost / weights.sum()


# --- the search -------------------------------------------------------------------------------------------------------

NO_FACE = (
    "no face was found on the mesh: nothing on it looks like one. If it is a face, give landmarks; required are, on "
    "one side at least, eye_l_inner, eye_l_outer, mouth_l, brow_l_mid; nose_tip, upper_lip_mid, lower_lip_mid."
)

# The parts of a mesh that are searched.
FEWEST_TRIANGLES = 200
"""Triangles of a mesh, at least: spread over a face, they are a third of the distance between the pupils in size."""


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
    best, face = _best_match(points, triangles, [pose] if pose else _promising_poses(points, triangles, progress))
    for part in () if pose else _parts(points, triangles):
        if best.confidence > REFUSED:
            break
        other, its_face = _best_match(points, part, _promising_poses(points, part, progress))
        if other.confidence > best.confidence:
            best, face = other, its_face
    matches = [best]
    for variant in progress(range(1, len(VARIANTS)), "Finding the landmarks", len(VARIANTS) - 1):
        start = aligned(points, face, best.pose, variant) if template(variant).mouth_open else best.pose
        matches.append(matched(points, face, start, variant))
    return matches, face


def _promising_poses(points: Array, triangles: IntArray, progress: Progress) -> list[Pose]:
    """Three poses at which a surface is most like the template, the best first, of forty that are aligned."""
    samples = surface_samples(points, triangles, SAMPLES)
    sizes = progress(candidates(samples), "Looking for noses", len(SIZES))
    starts = [start for found in sizes for start in found]
    tried = distinct(sorted(starts, key=lambda pair: pair[0]), 40)
    scored = []
    for _, start in progress(tried, "Finding the face", len(tried)):
        pose = aligned(points, triangles, start)
        scored.append((pose_score(surface_map(points, triangles, pose, COARSE), template_map(COARSE)), pose))
    return [pose for _, pose in distinct(sorted(scored, key=lambda pair: -pair[0]), 3)]


def _best_match(points: Array, triangles: IntArray, poses: list[Pose]) -> tuple[Match, IntArray]:
    """The best match with the mean face, and the triangles of the part that is the face."""
    matches: list[Match] = []
    for pose in poses:
        matches.append(_aligned_match(points, triangles, pose))
        if matches[-1].confidence > DOUBTED:
            break
    best = max(matches, key=lambda match: match.confidence)
    part = _face_part(points, triangles, best)
    if len(part) < len(triangles):
        alone = _aligned_match(points, part, best.pose)
        # Unless it is much less like a face, lashes and the shells of eyes, which fill its eyes, are left out.
        if alone.confidence > best.confidence - 0.1:
            return alone, part
    return best, triangles


def _aligned_match(points: Array, triangles: IntArray, pose: Pose) -> Match:
    return matched(points, triangles, aligned(points, triangles, pose))


def check_surface(points: Array, triangles: IntArray) -> None:
    """Raise a LandmarkError where too few triangles hang together for a surface that could show a face, or where they
    lie in many layers.
    """
    connected = np.bincount(_labeled_parts(points, triangles, 7)[1], minlength=1).max()
    if connected < FEWEST_TRIANGLES:
        raise LandmarkError(
            f"no face was found on the mesh: its largest connected piece has {connected} of {len(triangles)} "
            f"triangles, and at least {FEWEST_TRIANGLES} are needed. Give a finer mesh, or at least three landmarks "
            "that are not in a line."
        )
    centres = points[triangles].mean(axis=1)
    low, high = np.quantile(centres, (0.01, 0.99), axis=0)  # points far off do not make the box larger
    inside = ((low <= centres) & (centres <= high)).all(axis=1)
    layers = 0.5 * double_areas(points, triangles[inside]).sum() / max(float(((high - low) ** 2).sum()), 1e-300)
    most = 50.0  # that of heads is about 1, that of noise 100 and more
    if layers > most:
        raise LandmarkError(
            "no face was found on the mesh: its triangles are no surface, as their area is "
            f"{layers:.0f} times the squared diagonal of their box; {most:g} times is the most, and faces have "
            "about 1. Is it noise, or do its faces use wrong points? Export the mesh again, or give at "
            "least three landmarks that are not in a line."
        )


def _labeled_parts(points: Array, triangles: IntArray, decimals: int) -> tuple[IntArray, IntArray]:
    """Rows of the triangles that keep three corners when points are welded, and the connected part of each."""
    welded = np.unique(np.round(points, decimals), axis=0, return_inverse=True)[1].reshape(-1)[triangles]
    proper = np.flatnonzero((welded != np.roll(welded, 1, axis=1)).all(axis=1)).astype(np.int64)
    return proper, components(welded[proper]).astype(np.int64) if len(proper) else proper


def _parts(points: Array, triangles: IntArray) -> Iterator[IntArray]:
    """The parts of a mesh, three at most, that could be a face by themselves, those with the most triangles first."""
    proper, label = _labeled_parts(points, triangles, 7)
    count = np.bincount(label)
    for part in np.argsort(-count, kind="stable")[:3]:
        if FEWEST_TRIANGLES <= count[part] < len(proper):
            yield triangles[proper[label == part]]


def _face_part(points: Array, triangles: IntArray, match: Match) -> IntArray:
    """The triangles of the part to which most of what is seen belongs."""
    pose, surface = match.pose, match.surface
    local = pose.local(points)
    proper, label = _labeled_parts(local, triangles, 6)
    if not len(proper) or label.max() == 0:
        return triangles
    x, y = np.meshgrid(FINE.x, FINE.y)
    shown = surface.weight > 0.5
    places = np.column_stack([x[shown], y[shown], surface.depth[shown]])
    votes = votes_of(local, triangles[proper], label, places)
    return triangles[proper[label == np.argmax(votes)]]
