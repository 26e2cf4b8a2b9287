"""The landmarks of a face that has been found, and how far they can be trusted."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

from ...errors import LARGEST, LandmarkError, MeshError
from ...geometry.topology import components
from ...mesh import read_surface, to_polydata
from ..landmarks import NAMES, complete
from .alignment import COARSE, FINE, laid_on, likeness, seen, template_map
from .depth import Pose, foremost
from .matching import Match, matched
from .samples import spread
from .search import SIZES, candidates, distinct
from .template import PEOPLE, template

Array = npt.NDArray[np.float64]
Triangles = npt.NDArray[np.int64]

UNMEASURED = (
    "trichion",
    "forehead_mid",
    *(f"brow_{side}_{part}" for side in "lr" for part in ("inner", "mid", "outer")),
    *(f"{name}_{side}" for name in ("malar", "zygion", "gonion") for side in "lr"),
    "eye_l_centre",
    "eye_r_centre",
)
"""Landmarks that the shape does not show: always estimates."""

OFF_FRONT = ("trichion", "zygion_l", "zygion_r", "gonion_l", "gonion_r", "eye_l_centre", "eye_r_centre")
"""Landmarks that cannot be read off the front view: carried over from the template by the others."""

SAMPLES = 30_000

SURE, HOPELESS = 0.75, 0.25
"""Confidence above which no other pose is tried, and below which no other template is."""

CHOICE = 0.03
"""A template whose relief around a landmark correlates less by this counts a third."""

DISAGREEMENT = 0.12
"""Scatter of a landmark among the templates that halves its confidence, in distances between the pupils."""

NO_FACE = (
    "no face was found on the mesh: nothing on it looks like one. If it is a face, give landmarks; required are, on "
    "one side at least, eye_l_inner, eye_l_outer, mouth_l, brow_l_mid; nose_tip, upper_lip_mid, lower_lip_mid."
)
Watch = Callable[[Iterable[None], int], Iterable[None]]


@dataclass(frozen=True, eq=False)
class Found:
    """A face that was found on a mesh.

    Attributes
    ----------
    landmarks : dict of str to ndarray, shape (3,)
        In the coordinates and the unit of the mesh.
    confidences : dict of str to float
        How far each can be trusted, 0 to 1.
    estimated : tuple of str
        The landmarks that cannot be measured on the shape, or are hidden.
    confidence : float
        Likeness to a face, at most 1; other things stay below 0.5.
    pose : Pose
        Rotation (`axes`), scale (`size`) and translation (`origin`).
    """

    landmarks: dict[str, Array]
    confidences: dict[str, float]
    estimated: tuple[str, ...]
    confidence: float
    pose: Pose


def find_landmarks(mesh: pv.DataSet | str | Path, watch: Watch | None = None) -> Found:
    """Find a face on a mesh by its shape: any unit, any direction, either winding, with or without other parts.

    Parameters
    ----------
    mesh : PolyData or path
        Not changed. It may have holes, loose parts and faults.
    watch : callable, optional
        Given the steps of the search and their number, gives them back one by one: to show progress. Default: a bar
        on stderr where that is a terminal.

    Returns
    -------
    Found
        Whatever looks most like a face; its `confidence` says whether it is one.

    Raises
    ------
    MeshError
        If there is no surface, or points are not finite.
    LandmarkError
        If nothing on the mesh looks like a face at all.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> head = fw.default_face()
    >>> found = find_landmarks(head.mesh.rotate_x(70).scale(0.001))
    >>> found.confidence > 0.9
    True
    """
    points, triangles = _surface(mesh)
    middle, diagonal = 0.5 * (points.min(axis=0) + points.max(axis=0)), float(np.linalg.norm(np.ptp(points, axis=0)))
    points = (points - middle) / diagonal
    search = _Search(points, triangles)
    for _ in (watch or bar)(search.steps(), search.STEPS):
        pass
    match = search.matches[0]
    try:
        landmarks, confidences = _landmarks(points, search.triangles, search.matches)
    except LandmarkError:  # the template's landmarks fell into disorder
        raise LandmarkError(NO_FACE) from None
    hidden = [name for name in NAMES if name not in UNMEASURED and confidences[name] < 0.2]
    pose = match.pose
    return Found(
        {name: point * diagonal + middle for name, point in landmarks.items()},
        {name: value * match.confidence for name, value in confidences.items()},
        (*UNMEASURED, *hidden),
        match.confidence,
        Pose(pose.axes, pose.origin * diagonal + middle, pose.size * diagonal, pose.stretch),
    )


def _surface(mesh: object) -> tuple[Array, Triangles]:
    """Points and those triangles that have an area."""
    source = read_surface(mesh)
    points, triangles = np.array(source.points, dtype=np.float64), np.array(source.regular_faces, dtype=np.int64)
    corners = points[triangles]
    if not (np.abs(corners) < LARGEST).all():
        raise MeshError("points of the mesh are NaN, infinite or huge. Delete them in a modeller, or export it again.")
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    triangles = triangles[area > 1e-12 * (sides**2).sum(axis=2).max(axis=1, initial=0.0)]
    if not len(triangles):
        raise MeshError("the mesh has no triangles with an area. Export it again.")
    used, renumbered = np.unique(triangles, return_inverse=True)
    return points[used], renumbered.reshape(-1, 3)


class _Search:
    """The search in steps: `matches` with all templates, the mean one's first, and the `triangles` of the face."""

    TRIED, REFINED = 40, 3
    STEPS = len(SIZES) + TRIED + REFINED + len(PEOPLE)

    def __init__(self, points: Array, triangles: Triangles) -> None:
        self.points, self.triangles = points, triangles
        self.matches: list[Match] = []

    def steps(self) -> Iterator[None]:
        """Do one step after the other: sizes, poses, the best of these, and templates."""
        points, triangles = self.points, self.triangles
        starts: list[tuple[float, Pose]] = []
        for found in candidates(spread(points, triangles, SAMPLES)):
            starts += found
            yield
        starts.sort(key=lambda pair: pair[0])
        poses: list[tuple[float, Pose]] = []
        for _, start in distinct(starts, self.TRIED):
            pose = laid_on(points, triangles, start)
            poses.append((likeness(seen(points, triangles, pose, COARSE), template_map(COARSE)), pose))
            yield
        if not poses:
            raise LandmarkError(NO_FACE)
        poses.sort(key=lambda pair: -pair[0])
        matches = []
        for _, pose in distinct(poses, self.REFINED):
            matches.append(matched(points, triangles, laid_on(points, triangles, pose)))
            yield
            if matches[-1].confidence > SURE:
                break
        best = max(matches, key=lambda match: match.confidence)
        part = _face_part(points, triangles, best)
        if len(part) < len(triangles):
            alone = matched(points, part, laid_on(points, part, best.pose))
            best, self.triangles = max((alone, part), (best, triangles), key=lambda pair: pair[0].confidence)
        self.matches.append(best)
        yield
        for person in range(1, len(PEOPLE) if best.confidence > HOPELESS else 1):
            self.matches.append(matched(points, self.triangles, best.pose, person))
            yield


def bar(steps: Iterable[None], count: int) -> Iterable[None]:
    """The steps, with a bar on stderr while they are done where that is a terminal."""
    from rich.console import Console
    from rich.progress import track

    console = Console(stderr=True)
    return track(steps, "Finding the face", count, console=console, transient=True) if console.is_terminal else steps


def _face_part(points: Array, triangles: Triangles, match: Match) -> Triangles:
    """The triangles of the part that most of what is seen belongs to, where that is most of the face."""
    pose, view = match.pose, match.view
    welded = np.unique(np.round(pose.local(points), 6), axis=0, return_inverse=True)[1].reshape(-1)[triangles]
    whole = np.flatnonzero((welded != np.roll(welded, 1, axis=1)).all(axis=1))
    label = components(welded[whole])
    if label.max() == 0:
        return triangles
    x, y = np.meshgrid(FINE.x, FINE.y)
    shown = view.weight > 0.5
    where = np.column_stack([x[shown], y[shown], view.depth[shown]])
    used, first = np.unique(triangles[whole], return_index=True)
    nearest = cKDTree(pose.local(points[used])).query(where)[1]
    votes = np.bincount(label[first[nearest] // 3], minlength=label.max() + 1)
    chosen = int(np.argmax(votes))
    return triangles[whole[label == chosen]] if votes[chosen] > 0.6 * votes.sum() else triangles


def _landmarks(points: Array, triangles: Triangles, matches: list[Match]) -> tuple[dict[str, Array], dict[str, float]]:
    """All landmarks on the surface, from where every template has them, and how far each can be trusted."""
    pose, view = matches[0].pose, matches[0].view
    people = [template(person).landmarks for person in range(len(matches))]
    names = [name for name in NAMES if name not in OFF_FRONT]
    trusts = dict(zip(NAMES, np.transpose([_alike(m, people[k]) for k, m in enumerate(matches)]), strict=True))
    places = np.array([m.warp(_flat(people[k], names)) for k, m in enumerate(matches)])
    weights = np.transpose([np.exp((trusts[name] - trusts[name].max()) / CHOICE) for name in names])[..., None]
    there = (weights * places).sum(axis=0) / weights.sum(axis=0)
    there[names.index("nose_tip")] = foremost(view.depth, FINE, there[names.index("nose_tip")])
    height = map_coordinates(view.depth, FINE.index(there), order=1, mode="nearest")
    read = dict(zip(names, pose.world(np.column_stack([there, height])), strict=True))
    landmarks, _ = complete(read, people[0])
    on_skin = [name for name in NAMES if not name.endswith("centre")]
    skin = to_polydata(points, triangles)
    closest: Any = skin.find_closest_cell(np.array([landmarks[n] for n in on_skin]), return_closest_point=True)
    landmarks |= dict(zip(on_skin, np.asarray(closest[1], dtype=np.float64), strict=True))
    spread = dict(zip(names, np.sqrt(places.var(axis=0).sum(axis=1)), strict=True))
    cap = dict.fromkeys(UNMEASURED, 0.3)
    sure = {
        name: float(np.clip(t.mean(), 0.0, cap.get(name, 1.0)) / (1.0 + (spread.get(name, 0.0) / DISAGREEMENT) ** 2))
        for name, t in trusts.items()
    }
    return landmarks, sure


def _alike(match: Match, landmarks: Mapping[str, Array]) -> Array:
    """Correlation of relief around a template's landmarks."""
    return np.asarray(map_coordinates(match.trust, FINE.index(_flat(landmarks, NAMES)), order=1, mode="nearest"))


def _flat(landmarks: Mapping[str, Array], names: Iterable[str]) -> Array:
    return np.array([landmarks[name][:2] for name in names])
