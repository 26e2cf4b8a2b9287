"""The landmarks of a face that has been found, and how far they can be trusted."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import grey_dilation, map_coordinates
from scipy.spatial import cKDTree
from threadpoolctl import ThreadpoolController

from ...errors import LARGEST, LandmarkError, MeshError
from ...geometry.rigid_alignment import closest_rotations
from ...geometry.sampling import surface_samples
from ...geometry.topology import components
from ...mesh import read_surface, to_polydata
from ..landmarks import NAMES, REFUSED, complete
from .alignment import COARSE, FINE, laid_on, likeness, seen, template_map
from .depth import Pose, foremost
from .matching import DOUBT, Match, matched
from .mouth import MOUTH, corners, lower_lip
from .samples import coarsened
from .search import SIZES, candidates, distinct
from .template import LOOKS, PEOPLE, template

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

LOWER = (*MOUTH, "subnasale", "pogonion", "menton")
"""Landmarks that a template shows all or not at all."""

SAMPLES = 40_000

SURE, HOPELESS = 0.75, 0.25
"""Confidence above which no other pose is tried, and below which no other template is."""

MANY = 150_000
"""Triangles beyond which a pose is laid on fewer of them."""

REACH = 4.5
"""What lies farther from a face than this has nothing to do with it, in distances between the pupils."""

PARTS = 3
"""Parts of a mesh that are searched by themselves where the whole shows no face, at most."""

THIN = 0.02
"""What is thinner than this share of its largest extent is no face, but a floor or a wall."""

FLOOR = 0.004
"""How uneven a floor may be, over the diagonal of the bounding box."""

CHOICE = 0.03
"""A template whose relief around a landmark correlates less by this counts a third."""

CLOSE = 0.02
"""Templates whose mouths correlate less than the best one's by at most this might be as right."""

DISAGREEMENT = 0.12
"""Scatter of a landmark among the templates that halves its confidence, in distances between the pupils."""

PARTED = 0.1
"""Depth of the hollow between open lips, at least, in distances between the pupils."""

UNLIKE, ALIKE = 0.70, 0.95
"""Correlation of relief around a landmark that means nothing, and that of faces that are like the template there."""

ESTIMATE = 0.3
"""Confidence of an estimate, at most."""

ON_A_LINE, MISFIT = 0.2, 0.45
"""Given landmarks say nothing of the pose if they scatter less than the first to the side of a line, or if they lie
farther than the second from where they are on the template, in distances between the pupils.
"""

FEWEST = 200
"""Triangles that show a face, at least: on it they are a third of the distance between the pupils in size."""

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
        Likeness to a face, at most 1; other things stay below 0.6.
    pose : Pose
        Rotation (`axes`), scale (`size`) and translation (`origin`).

    Examples
    --------
    What a search may give; the nose was measured, the hairline was not:

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
    mesh: pv.DataSet | str | Path,
    watch: Watch | None = None,
    given: Mapping[str, npt.ArrayLike] | None = None,
) -> Found:
    """Find a face on a mesh by its shape: any unit, any direction, either winding, with or without other parts.

    Parameters
    ----------
    mesh : PolyData or path
        Not changed. It may have holes, loose parts and faults.
    watch : callable, optional
        Given the steps of the search and their number, gives them back one by one: to show progress. Default: a bar
        on stderr where that is a terminal.
    given : dict, optional
        Landmarks that are known. Three or more that do not lie on a line say where the face is, and nothing else is
        searched; fewer do not guide the search.

    Returns
    -------
    Found
        Whatever looks most like a face; its `confidence` says whether it is one.

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
    points, triangles = _surface(mesh)
    middle, diagonal = 0.5 * (points.min(axis=0) + points.max(axis=0)), float(np.linalg.norm(np.ptp(points, axis=0)))
    points = (points - middle) / diagonal
    marks = {name: (np.asarray(point, dtype=np.float64) - middle) / diagonal for name, point in (given or {}).items()}
    pose = posed_by(marks)
    if pose is None and len(triangles) < FEWEST:
        raise LandmarkError(
            f"no face was found on the mesh: its {len(triangles)} triangles are too few to show one; {FEWEST} are "
            "needed at least. Give a finer mesh, or at least three landmarks that are not in a line."
        )
    with _blas().limit(limits=1, user_api="blas"):  # its threads wait for each other longer than they work here
        search = _searched(points, triangles, pose, watch or bar)
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


@cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController()


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


def _searched(points: Array, triangles: Triangles, pose: Pose | None, watch: Watch) -> _Search:
    """The whole searched, and part by part where it shows no face: in front of a large thing one is small or hidden."""
    found: list[_Search] = []
    others = chain(_parts(points, triangles), _off_the_floor(points, triangles))
    for part in chain([triangles], () if pose is not None else others):
        search = _Search(points, part, pose)
        try:
            for _ in watch(search.steps(), search.STEPS):
                pass
        except LandmarkError:  # nothing looks like a face
            continue
        found.append(search)
        if search.matches[0].confidence > REFUSED:
            break
    if not found:
        raise LandmarkError(NO_FACE)
    return max(found, key=lambda search: search.matches[0].confidence)


def _parts(points: Array, triangles: Triangles) -> Iterator[Triangles]:
    """The parts of a mesh that could be a face by themselves, those with the most triangles first."""
    welded = np.unique(np.round(points, 7), axis=0, return_inverse=True)[1].reshape(-1)[triangles]
    whole = (welded != np.roll(welded, 1, axis=1)).all(axis=1)
    if not whole.any():
        return
    triangles, label = triangles[whole], components(welded[whole])
    count = np.bincount(label)
    order = [part for part in np.argsort(-count, kind="stable") if FEWEST <= count[part] < len(triangles)]
    for part in order[:PARTS]:
        alone = triangles[label == part]
        corners = points[np.unique(alone)]
        along = np.linalg.svd(corners - corners.mean(axis=0), full_matrices=False)[2]
        extent = np.ptp(corners @ along.T, axis=0)
        if extent.min() > THIN * extent.max():
            yield alone


def _off_the_floor(points: Array, triangles: Triangles) -> Iterator[Triangles]:
    """What stands on a plane that is most of the surface, as a scan does on a table that it has grown together with."""
    corners = points[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    cloud = surface_samples(points, triangles, 2000)
    flat = np.ones(len(cloud), bool)
    for _ in range(5):  # the plane of most of the surface: that of what is close to it
        centre = cloud[flat].mean(axis=0)
        normal = np.linalg.svd(cloud[flat] - centre, full_matrices=False)[2][2]
        away = np.abs((cloud - centre) @ normal)
        flat = away <= max(float(np.median(away)), FLOOR)
    on_floor = (np.abs((corners - centre) @ normal) < FLOOR).all(axis=1)
    if area[on_floor].sum() > 0.5 * area.sum() and len(triangles) - on_floor.sum() >= FEWEST:
        yield triangles[~on_floor]


class _Search:
    """The search in steps: `matches` with all templates, the mean one's first, and the `triangles` of the face."""

    TRIED, REFINED = 40, 3
    STEPS = len(SIZES) + TRIED + REFINED + len(LOOKS)

    def __init__(self, points: Array, triangles: Triangles, pose: Pose | None) -> None:
        self.points, self.triangles, self.pose = points, triangles, pose
        self.matches: list[Match] = []

    def steps(self) -> Iterator[None]:
        """Do one step after the other: sizes, poses, the best of these, and templates."""
        points, triangles = self.points, self.triangles
        if self.pose is None:
            poses = yield from self._likely()
        else:
            poses = [(1.0, self.pose)]
        matches = []
        for _, pose in distinct(poses, self.REFINED):
            matches.append(matched(points, triangles, laid_on(*_near(points, triangles, pose), pose)))
            yield
            if matches[-1].confidence > SURE:
                break
        best = max(matches, key=lambda match: match.confidence)
        part = _face_part(points, triangles, best)
        if len(part) < len(triangles):
            alone = matched(points, part, laid_on(*_near(points, part, best.pose), best.pose))
            best, self.triangles = max((alone, part), (best, triangles), key=lambda pair: pair[0].confidence)
        self.matches.append(best)
        yield
        for person in range(1, len(LOOKS) if best.confidence > HOPELESS else 1):
            agape = template(person).agape
            pose = laid_on(*_near(points, self.triangles, best.pose), best.pose, person) if agape else best.pose
            self.matches.append(matched(points, self.triangles, pose, person))
            yield

    def _likely(self) -> Generator[None, None, list[tuple[float, Pose]]]:
        """Poses in which something looks like a face, the likeliest first."""
        points, triangles = self.points, self.triangles
        starts: list[tuple[float, Pose]] = []
        for found in candidates(surface_samples(points, triangles, SAMPLES)):
            starts += found
            yield
        starts.sort(key=lambda pair: pair[0])
        poses: list[tuple[float, Pose]] = []
        for _, start in distinct(starts, self.TRIED):
            near = _near(points, triangles, start)
            pose = laid_on(*near, start)
            poses.append((likeness(seen(*near, pose, COARSE), template_map(COARSE)), pose))
            yield
        if not poses:
            raise LandmarkError(NO_FACE)
        poses.sort(key=lambda pair: -pair[0])
        return poses


def _near(points: Array, triangles: Triangles, pose: Pose) -> tuple[Array, Triangles]:
    """What a pose is laid on: all, or what is about it, as fine as it takes, where that is less work."""
    if len(triangles) <= MANY:
        return points, triangles
    return coarsened(points, triangles, pose.origin, REACH * pose.size, 0.5 * COARSE.step * pose.size)


def posed_by(marks: Mapping[str, Array]) -> Pose | None:
    """The pose in which the template's landmarks are closest to given ones; none if these are too few or do not fit.

    Examples
    --------
    >>> marks = template().landmarks
    >>> pose = posed_by({name: 7.0 * marks[name] + 1.0 for name in ("nasion", "mouth_l", "mouth_r")})
    >>> round(pose.size, 6), np.allclose(pose.origin, 1.0)
    (7.0, True)
    """
    names = [name for name in NAMES if name in marks and name not in UNMEASURED]
    if len(names) < 3:
        return None
    model, face = (np.array([source[name] for name in names]) for source in (template().landmarks, marks))
    from_, to = model - model.mean(axis=0), face - face.mean(axis=0)
    if np.linalg.svd(from_, compute_uv=False)[1] < ON_A_LINE:
        return None
    axes = closest_rotations(from_.T @ to)
    size = float((from_ @ axes * to).sum() / (from_**2).sum())
    if size <= 0.0 or np.linalg.norm(to / size - from_ @ axes, axis=1).max() > MISFIT:
        return None
    return Pose(axes, face.mean(axis=0) - size * model.mean(axis=0) @ axes, size, np.ones(3))


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
    pose, view, persons = matches[0].pose, matches[0].view, len(PEOPLE)
    templates = [template(k).landmarks for k in range(len(matches))]
    names = [name for name in NAMES if name not in OFF_FRONT]
    places = np.array([_placed(match, templates[k], names) for k, match in enumerate(matches)])
    trusts = dict(zip(NAMES, np.transpose([_alike(m, templates[k]) for k, m in enumerate(matches)]), strict=True))
    mouth = np.mean([trusts[name] for name in MOUTH], axis=0)
    mouth[[match.agape and not _parted(match, templates[k]) for k, match in enumerate(matches)]] = -1.0
    look = int(np.argmax(mouth))
    there, sure, rivals = {}, {name: float(trust[:persons].mean()) for name, trust in trusts.items()}, {}
    for name, at in zip(names, places.swapaxes(0, 1), strict=True):
        trust = trusts[name][:persons]
        there[name] = np.average(at[:persons], axis=0, weights=np.exp((trust - trust.max()) / CHOICE))
        rivals[name] = at[:persons]
        if name in LOWER:
            rivals[name] = at[mouth > mouth[look] - CLOSE]
            if look >= persons:
                there[name], sure[name] = at[look], float(trusts[name][look])
    lip = True
    if not matches[look].agape:
        there |= _mouth(points, triangles, matches[0], there)
        there["lower_lip_mid"], lip = _lower_lip(points, triangles, matches[0], there)
    for name, place in there.items():
        scatter = np.sqrt(((rivals[name] - place) ** 2).sum(axis=1).mean()) / pose.size
        sure[name] = _certain(sure[name]) / (1.0 + (scatter / DISAGREEMENT) ** 2)
    sure["lower_lip_mid"] *= 1.0 if lip else 0.5
    tip = foremost(view.depth, FINE, pose.local(there["nose_tip"])[:2])
    there["nose_tip"] = _raised(matches[0], tip[None], view.depth)[0]
    landmarks, _ = complete(there, templates[0])
    on_skin = [name for name in NAMES if not name.endswith("centre")]
    skin = to_polydata(points, triangles)
    closest: Any = skin.find_closest_cell(np.array([landmarks[n] for n in on_skin]), return_closest_point=True)
    landmarks |= dict(zip(on_skin, np.asarray(closest[1], dtype=np.float64), strict=True))
    for name in UNMEASURED:
        sure[name] = min(sure[name], ESTIMATE)
    return landmarks, {name: float(np.clip(value, 0.0, 1.0)) for name, value in sure.items()}


def _mouth(points: Array, triangles: Triangles, match: Match, there: Mapping[str, Array]) -> dict[str, Array]:
    """The corners of the mouth where the furrow between the lips shows them; the lips go with both."""
    expected = match.pose.local(np.array([there[name] for name in MOUTH]))[:, :2]
    ends = corners(points, triangles, match.pose, expected)
    if ends is None:
        return {}
    square = ((ends - expected[:2]) ** 2).sum(axis=1, keepdims=True)
    ends = expected[:2] + (ends - expected[:2]) * square / (square + DOUBT**2)
    left, right = ends[:, 0] - expected[:2, 0]
    aside = np.sign(left) * min(abs(left), abs(right)) if left * right > 0.0 else 0.0
    flat = np.concatenate([ends, expected[2:] + np.array([aside, 0.0])])
    return dict(zip(MOUTH, _raised(match, flat, match.view.depth), strict=True))


def _lower_lip(points: Array, triangles: Triangles, match: Match, there: Mapping[str, Array]) -> tuple[Array, bool]:
    """The lower lip, out of the furrow below it, and whether a lip is seen."""
    upper, lower = match.pose.local(np.array([there["upper_lip_mid"], there["lower_lip_mid"]]))[:, :2]
    rise, is_seen = lower_lip(points, triangles, match.pose, upper, lower)
    if rise == 0.0:
        return there["lower_lip_mid"], is_seen
    return _raised(match, np.array([[lower[0], lower[1] + rise]]), match.view.depth)[0], is_seen


def _certain(trust: float) -> float:
    return float(np.clip((trust - UNLIKE) / (ALIKE - UNLIKE), 0.0, 1.0))


def _placed(match: Match, landmarks: Mapping[str, Array], names: list[str]) -> Array:
    """Where landmarks of a template are on the surface (n, 3)."""
    flat = match.warp(_flat(landmarks, names))
    places = _raised(match, flat, match.view.depth)
    if match.agape:  # on the lips, not between them
        lips = [names.index(name) for name in ("upper_lip_mid", "lower_lip_mid")]
        places[lips] = _raised(match, flat[lips], grey_dilation(match.view.depth, size=(5, 5)))
    return places


def _parted(match: Match, landmarks: Mapping[str, Array]) -> bool:
    """Whether there is a hollow between the lips."""
    upper, lower = match.warp(_flat(landmarks, ("upper_lip_mid", "lower_lip_mid")))
    x, y = (upper + (lower - upper) * np.linspace(0.0, 1.0, 13)[:, None]).T
    depth = map_coordinates(match.view.depth, FINE.index(np.column_stack([x, y])), order=1, mode="nearest")
    return bool(depth.min() < min(depth[:3].max(), depth[-3:].max()) - PARTED)


def _raised(match: Match, flat: Array, depth: Array) -> Array:
    """Places (n, 2) of what is seen, on the surface."""
    height = map_coordinates(depth, FINE.index(flat), order=1, mode="nearest")
    return match.pose.world(np.column_stack([flat, height]))


def _alike(match: Match, landmarks: Mapping[str, Array]) -> Array:
    """Correlation of relief around a template's landmarks."""
    return np.asarray(map_coordinates(match.trust, FINE.index(_flat(landmarks, NAMES)), order=1, mode="nearest"))


def _flat(landmarks: Mapping[str, Array], names: Iterable[str]) -> Array:
    return np.array([landmarks[name][:2] for name in names])
