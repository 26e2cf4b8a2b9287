"""Folds that turn triangles over, or run through each other: action units and expressions, alone and in pairs.

Every pose is held until the skin rests, and folded at ages 0 and 1. Counted are triangles that folds turn over, and
pairs of triangles that run through each other with folds, farther than a millimeter from where bare skin does. Pairs of
units and expressions come in a random order, so that those of a run that was stopped are a sample.
"""

from __future__ import annotations

import warnings
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

import facewrinkle as fw
from analysis import subjects
from analysis.swept import swept_volumes
from facewrinkle.geometry.interpolation import interpolated
from facewrinkle.simulation.fold_layers import fold_layers
from tools.self_intersections import self_intersections

from .runner import DIED, OUTPUT, run

Array = npt.NDArray[np.float64]
Record = dict[str, Any]

AGES = (0.0, 1.0)
FACES = ("head-0", "ict-0", "makehuman")

GAZE = ("AU61", "AU62", "AU63", "AU64")
"""Units that turn the eyes and fold nothing."""

BESIDE = 1.0
"""Triangles within this distance, mm, of some that run through each other on bare skin do so there, too."""

SETTLED, MOST = 0.01, 120
"""Movement in a step, mm, below which skin rests, and the most steps to get there."""


def poses(face: fw.Face, alone: bool = False) -> list[tuple[str, ...]]:
    """Return names of units and expressions, and of the pairs of those that act on both sides, in random order."""
    names = [*face.atlas.action_units, *face.atlas.expressions]
    names = [name for name in names if not name.startswith(GAZE)]
    both = [name for name in names if not (name.startswith("AU") and name[-1] in "LR")]
    pairs = list(combinations(both, 2))
    np.random.default_rng(0).shuffle(pairs)
    return [(name,) for name in names] + ([] if alone else [(str(a), str(b)) for a, b in pairs])


class Held:
    """The motion of a skin that rests: it hands out the present positions of another."""

    def __init__(self, skin: fw.Skin) -> None:
        self._skin = skin

    def __getattr__(self, name: str) -> Any:
        return getattr(self._skin, name)

    def reset(self) -> None:
        """Leave the skin as it is."""

    def set_rates(self, rates: Array) -> None:
        """Leave the rates as they are."""

    def step(self) -> Array:
        """Return where the skin is."""
        return np.asarray(self._skin.points + self._skin.displacement)


class Folded:
    """A face that is folded at several ages, all on one skin."""

    def __init__(self, face: fw.Face) -> None:
        self.face, self.skin = face, fw.Skin(face)
        held = Held(self.skin)
        self.sims = {age: fw.Simulation(face, layers=fold_layers(face, "wave", age=age), motion=held) for age in AGES}

    def pose(self, names: tuple[str, ...]) -> None:
        """Hold a pose until the skin rests."""
        self.skin.set_rates(self.skin.rates_of(self.face.atlas.contractions(dict.fromkeys(names, 1.0))))
        before = np.inf
        for _ in range(MOST):
            now = self.skin.step().copy()
            if np.abs(now - before).max() < SETTLED:
                break
            before = now

    def measured(self, age: float) -> Record:
        """Count what folds turn over, and what runs through each other, in the pose that is held."""
        sim = self.sims[age]
        frame = sim.settle()
        triangles, points = np.asarray(sim.forest.triangles), np.asarray(frame.points) * self.face.unit
        bare = interpolated(sim.motion.step(), sim.vertices.corners, sim.vertices.barycentric)
        turned = (_crossed(points, triangles) * _crossed(bare, triangles)).sum(axis=1) <= 0.0
        volumes = swept_volumes(bare, points - bare, triangles)
        found, known = (self_intersections(p, triangles) for p in (points, bare))
        middle = (sim.vertices.points * self.face.unit)[triangles].mean(axis=1)
        new = found[~_near(middle[found[:, 0]], middle[np.unique(known)])]
        return {
            "turned": int(turned.sum()),
            "bare": len(known),
            "crossing": len(new),
            "where": [self._nearest(middle[t]) for t in np.unique(new)[:400]],
            "turned where": [self._nearest(middle[t]) for t in np.flatnonzero(turned)[:40]],
            "deep": float(np.ptp(frame["W"])),
            "net": float(volumes.sum() / max(np.abs(volumes).sum(), 1e-9)),
            "volume": float(np.abs(volumes).sum()),
        }

    def _nearest(self, place: Array) -> str:
        names = list(self.face.landmarks)
        where = np.array([self.face.landmarks[name] for name in names]) * self.face.unit
        return str(names[int(np.linalg.norm(where - place, axis=1).argmin())])


def _crossed(points: Array, triangles: npt.NDArray[np.integer]) -> Array:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _near(places: Array, others: Array) -> npt.NDArray[np.bool_]:
    """Tell which places (n, 3) lie within `BESIDE` of others (m, 3)."""
    if not len(others) or not len(places):
        return np.zeros(len(places), bool)
    return np.isfinite(cKDTree(others).query(places, distance_upper_bound=BESIDE)[0])


@cache
def _folded(name: str) -> Folded:
    return Folded(subjects.subject(name))


def play(name: str, *units: str) -> list[Record]:
    """Hold a pose of a face, and return what is counted at each age."""
    folded = _folded(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fw.FaceWrinkleWarning)
        folded.pose(units)
        return [{"pose": "+".join(units), "age": age, **folded.measured(age)} for age in AGES]


def crossings(
    *,
    faces: list[str] | None = None,
    alone: bool = False,
    workers: int = 1,
    minutes: float = 30.0,
    out: Path = OUTPUT,
) -> None:
    """Count triangles that folds turn over, and folds that run through each other.

    Parameters
    ----------
    faces
        Names of faces. Default: the built-in head, a captured face and MakeHuman's, where they are at hand.
    alone
        No pairs of units and expressions.
    workers
        Processes.
    minutes
        Time for each face after which no pose is begun.
    out
        Folder for crossings_FACE.jsonl, which a later run continues.
    """
    for name in faces or [name for name in FACES if name in subjects.names()]:
        cases = [(name, *pose) for pose in poses(subjects.subject(name), alone)]
        outcomes = run(out / f"crossings_{name}.jsonl", play, cases, workers=workers, minutes=minutes)
        _tell(name, [record for records in outcomes.values() if records != DIED for record in records])


def _net(records: list[Record]) -> float:
    """Share of the displaced volume of all poses that their folds take, or add."""
    displaced = sum(record["volume"] for record in records)
    return sum(abs(record["net"]) * record["volume"] for record in records) / max(displaced, 1e-9)


def _tell(name: str, records: list[Record]) -> None:
    for age in AGES:
        own = [record for record in records if record["age"] == age]
        turned, crossed = ([r for r in own if r[what]] for what in ("turned", "crossing"))
        print(
            f"{name}, age {age:g}: {len(own)} poses; {len(turned)} with triangles turned over, "
            f"{len(crossed)} crossing; net volume {_net(own):.2%} of what is displaced"
        )
        for record in sorted(crossed, key=lambda record: -record["crossing"])[:10]:
            places, counts = np.unique(record["where"], return_counts=True)
            at = ", ".join(f"{places[k]} {counts[k]}" for k in np.argsort(-counts)[:4])
            print(f"  {record['pose']}: {record['crossing']} pairs ({record['bare']} on bare skin) near {at}")
