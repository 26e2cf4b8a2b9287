"""Dirty meshes in the proportions met in the wild, and the outcome of fitting them.

Of ten thousand meshes from an exchange, 45 % ran through themselves, 22 % were not manifold, 16 % had degenerate
triangles, 11 % were open and 10 % badly oriented (Zhou and Jacobson, "Thingi10K", 2016). Here faces are
spoiled in these proportions, turned and scaled, and given to ``fit_face``: each must become a sound mesh that moves, or
be refused.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from itertools import cycle
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from analysis.subjects import FACES
from facewrinkle.anatomy.landmarks import read_landmarks
from facewrinkle.geometry import topology
from facewrinkle.geometry.normals import double_areas
from facewrinkle.mesh import to_polydata
from tools.self_intersections import self_intersections

from .runner import DIED, OUTPUT, run

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Mesh = tuple[Array, IntArray]
Random = np.random.Generator
Fault = Callable[[Array, IntArray, Random, float], Mesh]

SECONDS = 300
"""Time of the processor that a mesh may take, the compilation of the kernels included."""


@dataclass(frozen=True, eq=False)
class Dirty:
    """A face that was spoiled.

    Attributes
    ----------
    name : str
        Its number, the face, and the ways in which it was spoiled.
    mesh : pyvista.PolyData
    landmarks : dict of str to ndarray, shape (3,)
    faults : tuple of str
        Kinds of faults, keys of :data:`FAULTS`.
    """

    name: str
    mesh: pv.PolyData
    landmarks: dict[str, Array]
    faults: tuple[str, ...]


# --- faults ---------------------------------------------------------------------------------------------
# Each takes points, triangles, a random generator and the distance between the pupils; it returns a spoiled mesh.


def _some(random: Random, count: int, share: float) -> IntArray:
    return random.choice(count, max(1, int(share * count)), replace=False)


def spikes(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Move single points far off, as scanners do."""
    chosen = _some(random, len(points), 0.004)
    points[chosen] += random.normal(0.0, 0.25 * size, (len(chosen), 3))
    return points, triangles


def noise(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Add noise of up to a third of an edge."""
    a, b = points[triangles[:, 0]], points[triangles[:, 1]]
    spread = 0.3 * np.median(np.linalg.norm(a - b, axis=1)) * random.uniform(0.3, 1.0)
    return points + random.normal(0.0, spread, points.shape), triangles


def lump(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Add a ball that is stuck halfway through the skin."""
    ball = pv.Sphere(radius=random.uniform(0.1, 0.8) * size, center=points[random.integers(len(points))],
                     theta_resolution=12, phi_resolution=12)  # fmt: skip
    return _combined((points, triangles), (np.asarray(ball.points, float), np.asarray(ball.regular_faces, np.int64)))


def shell(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Add a second skin, partly under the first one, partly over it."""
    wave = 0.02 * size * np.sin(points @ random.normal(0.0, 3.0 / size, (3, 3)))
    return _combined((points, triangles), (points + wave, triangles[:, [0, 2, 1]]))


def pinch(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Drag a place through the skin beside it."""
    at = points[random.integers(len(points))]
    near = np.exp(-((points - at) ** 2).sum(axis=1) / (0.15 * size) ** 2)[:, None]
    return points + near * random.normal(0.0, 0.25 * size, 3), triangles


def fins(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Add triangles on edges that have two already."""
    picked = triangles[_some(random, len(triangles), 0.003)]
    tips = points[picked].mean(axis=1) + random.normal(0.0, 0.1 * size, (len(picked), 3))
    numbers = len(points) + np.arange(len(picked))
    return np.vstack([points, tips]), np.vstack([triangles, np.column_stack([picked[:, :2], numbers])])


def wall(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Add a sheet across the inside that shares edges with the skin."""
    loop = triangles[_some(random, len(triangles), 0.01)][:, :2]
    return np.vstack([points, points.mean(axis=0)]), np.vstack(
        [triangles, np.column_stack([loop, np.full(len(loop), len(points))])]
    )


def wrongly_welded(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Weld points of different places."""
    one, other = (_some(random, len(points), 0.001) for _ in range(2))
    number = np.arange(len(points))
    number[one] = other
    return points, number[triangles]


def needles(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Make edges of length 0."""
    picked = triangles[_some(random, len(triangles), 0.002)]
    points[picked[:, 1]] = points[picked[:, 0]]
    return points, triangles


def caps(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Split edges on one side only, and seal the gaps with triangles without area."""
    chosen = _some(random, len(triangles), 0.002)
    a, b, c = triangles[chosen].T
    middle = len(points) + np.arange(len(chosen))
    kept = np.delete(triangles, chosen, axis=0)
    new = [np.column_stack(t) for t in ((a, middle, c), (middle, b, c), (a, b, middle))]
    return np.vstack([points, 0.5 * (points[a] + points[b])]), np.vstack([kept, *new])


def doubles(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Repeat triangles, and add some that have a point twice."""
    again = triangles[_some(random, len(triangles), 0.01)]
    return points, np.vstack([triangles, again[:, [1, 2, 0]], again[:5, [0, 0, 1]]])


def holes(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Leave out single triangles."""
    return points, np.delete(triangles, _some(random, len(triangles), 0.005), axis=0)


def ragged(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Tear off the back, with a ragged rim."""
    depth = points[triangles].mean(axis=1) @ np.array([0.0, 0.2, 1.0])
    limit = np.quantile(depth, random.uniform(0.1, 0.35))
    return points, triangles[depth + random.normal(0.0, 0.1 * size, len(depth)) > limit]


def apart(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Split points along a seam, as at the border of a texture."""
    side = points[triangles].mean(axis=1) @ random.normal(size=3)
    over = side > np.median(side)
    return np.vstack([points, points]), np.where(over[:, None], triangles + len(points), triangles)


def flipped(points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Turn triangles over, some or all."""
    chosen = _some(random, len(triangles), random.choice([0.01, 0.3, 1.0]))
    triangles[chosen] = triangles[chosen][:, ::-1]
    return points, triangles


def crossed(points: Array, triangles: IntArray) -> int:
    """Return the number of triangles that run through others."""
    proper = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return len(np.unique(self_intersections(points, triangles[proper])))


def self_intersecting(fault: Fault, points: Array, triangles: IntArray, random: Random, size: float) -> Mesh:
    """Apply the fault again and again until more of the mesh runs through itself than before."""
    before = crossed(points, triangles)
    while True:
        spoiled = fault(points.copy(), triangles.copy(), random, size)
        if crossed(*spoiled) > before:
            return spoiled


FAULTS: Mapping[str, tuple[float, tuple[Fault, ...]]] = {
    "self-intersecting": (0.45, (spikes, noise, lump, shell, pinch)),
    "not manifold": (0.22, (fins, wall, wrongly_welded)),
    "degenerate": (0.16, (needles, caps, doubles)),
    "open": (0.11, (holes, ragged, apart)),
    "badly oriented": (0.10, (flipped,)),
}
"""Kinds of faults: the share of the meshes that have one, and the functions that make it."""


def _combined(one: Mesh, other: Mesh) -> Mesh:
    return np.vstack([one[0], other[0]]), np.vstack([one[1], other[1] + len(one[0])])


# --- the corpus ------------------------------------------------------------------------------------------


@cache
def clean_faces() -> list[tuple[str, Mesh, dict[str, Array]]]:
    """Return name, mesh and landmarks of faces to spoil: built-in heads, and real ones that are at hand."""
    found = []
    for name, identity in (("head", {}), ("old head", {"age": 1.0, "jaw": 0.6}), ("broad head", {"width": 0.9})):
        head = fw.default_face(identity)
        found.append((name, (head.points, head.triangles.astype(np.int64)), head.landmarks))
    for stem in ("mediapipe_canonical_face_model", "makehuman_head_male", "ict_face_narrow"):
        path = FACES / f"{stem}.obj"
        if path.exists():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", fw.FaceWrinkleWarning)
                mesh, marks = fw.read_surface(path), read_landmarks(FACES / f"{stem}.landmarks.json")
            points, triangles = np.asarray(mesh.points), np.asarray(mesh.regular_faces, np.int64)
            found.append((stem.split("_")[0], (points, triangles), marks))
    return found


@cache
def ways_to_spoil(count: int, seed: int) -> list[dict[str, Fault]]:
    """Return the faults of each mesh by their kinds; the shares of :data:`FAULTS` are met exactly."""
    random = np.random.default_rng(seed)
    kinds: list[list[str]] = [[] for _ in range(count)]
    for kind, (share, _) in FAULTS.items():
        for i in random.choice(count, max(1, round(share * count)), replace=False):
            kinds[i].append(kind)
    turns = {kind: cycle(np.roll(np.array(ways), random.integers(9))) for kind, (_, ways) in FAULTS.items()}
    return [{kind: next(turns[kind]) for kind in of_mesh} for of_mesh in kinds]  # each way has its turn


def spoiled(count: int, seed: int, number: int) -> Dirty:
    """Return one of the dirty faces of a corpus, which is the same for the same count and seed."""
    faces, faults = clean_faces(), ways_to_spoil(count, seed)[number]
    random = np.random.default_rng([seed, number])
    name, (points, triangles), marks = faces[number % len(faces)]
    size = float(np.linalg.norm(marks["eye_l_outer"] - marks["eye_r_outer"]) / 1.4)
    points, triangles = points.copy(), triangles.copy()
    for kind, fault in faults.items():
        spoil = partial(self_intersecting, fault) if kind == "self-intersecting" else fault
        points, triangles = spoil(points, triangles, random, size)
    turn = Rotation.random(rng=random).as_matrix()
    scale, shift = 10.0 ** random.uniform(-3.0, 3.0), random.normal(0.0, 5.0, 3)
    landmarks = {mark: scale * (turn @ place + size * shift) for mark, place in marks.items()}
    dirty = to_polydata(scale * (points @ turn.T + size * shift), triangles)
    done = ", ".join(fault.__name__ for fault in faults.values())
    return Dirty(f"{number} {name}: {done or 'clean'}", dirty, landmarks, tuple(faults))


def flaws(face: fw.Face) -> list[str]:
    """Return the flaws of the mesh of a face that was fitted."""
    triangles, points = face.triangles, face.points
    sides = np.linalg.norm(points[triangles] - np.roll(points[triangles], 1, axis=1), axis=2).max(axis=1)
    found = {
        "edges with three triangles": len(topology.non_manifold_edges(triangles)) > 0,
        "not oriented alike": not topology.is_oriented(triangles),
        "in pieces": topology.sheets(triangles).max() > 0,
        "points not finite": not np.isfinite(points).all(),
        "degenerate triangles": bool((double_areas(points, triangles) <= 1e-10 * sides**2).any()),
        "loose points": len(np.unique(triangles)) != len(points),
    }
    return [flaw for flaw, is_there in found.items() if is_there]


def flaws_in_motion(face: fw.Face) -> list[str]:
    """Return the flaws of the first frames of a face that was fitted."""
    sim = fw.Simulation(face)
    if face.landmarks:
        sim.express("surprise")
    frames = [sim.step() for _ in range(2)]
    reach = np.ptp(face.points, axis=0).max()
    found = {
        "frames not finite": not all(np.isfinite(frame.points).all() for frame in frames),
        "frames blown up": any(np.ptp(frame.points, axis=0).max() > 2.0 * reach for frame in frames),
    }
    return [flaw for flaw, is_there in found.items() if is_there]


def verdict(dirty: Dirty, find: bool = False, play: bool = True) -> tuple[str, tuple[str, ...]]:
    """Return "fitted", "refused" or the flaws of the fitted face and its motion, and the sentences reported."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fw.FaceWrinkleWarning)
        try:
            face = fw.fit_face(dirty.mesh, None if find else dirty.landmarks)
        except fw.FaceWrinkleError as problem:
            return "refused", (str(problem),)
        return ", ".join(flaws(face) + (flaws_in_motion(face) if play else [])) or "fitted", face.report


def play(count: int, seed: int, find: bool, played: bool, number: int) -> list[str]:
    """Return the name of a mesh, the verdict on it, and what was reported."""
    dirty = spoiled(count, seed, number)
    found, report = verdict(dirty, find, played)
    return [dirty.name, found, " ".join(report)[:300]]


def corpus(
    *,
    count: int = 100,
    find: bool = False,
    every: int = 1,
    workers: int = 1,
    minutes: float = np.inf,
    seed: int = 0,
    out: Path = OUTPUT,
) -> None:
    """Fit dirty meshes; print the verdicts that are neither "fitted" nor "refused", and a summary.

    Parameters
    ----------
    count
        Meshes.
    find
        Find the landmarks, too.
    every
        Play the first frames of one in so many meshes.
    workers
        Processes.
    minutes
        Time after which no mesh is begun.
    seed
        Of the faults.
    out
        Folder for corpus.jsonl, which a later run continues.
    """
    cases = [(count, seed, find, number % every == 0, number) for number in range(count)]
    outcomes = run(out / "corpus.jsonl", play, cases, workers=workers, minutes=minutes, seconds=SECONDS)
    counts: Counter[str] = Counter()
    for (*_, number), outcome in outcomes.items():
        found = outcome if outcome == DIED else outcome[1]
        counts[found] += 1
        if found not in ("fitted", "refused"):
            print(number, outcome)
    print(", ".join(f"{found}: {count}" for found, count in counts.most_common()))
