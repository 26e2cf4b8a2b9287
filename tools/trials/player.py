"""Sequences of contraction rates played on a face, with every frame checked."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

import facewrinkle as fw
from facewrinkle.errors import ParameterError
from facewrinkle.geometry.interpolation import interpolated

from .oracle import DEEPEST, Oracle, off_the_way
from .sequences import Sequence

Array = npt.NDArray[np.float64]

LIMITS = {
    "not finite": 0.0,
    "energy": 1e-12,
    "inverted": 0.0,
    "eyes": DEEPEST,
    "lips": DEEPEST,
    "lids": DEEPEST,
    "teeth": DEEPEST,
    "off the way": 0.0,
    "not at rest": 0.0,
    "wrinkles": 0.0,
}
"""Kinds of faults, and the largest value that is none: frames that are not finite; growth of the energy at held rates,
relative to the largest of the sequence; triangles turned over; depths in mm; distance off the way beyond what is
allowed, mm; largest displacement after a release, mm; refined triangles that wrinkles turn over.
"""

RECORDED = ("off the way to the end",)
"""Kinds of values that are recorded beside the faults, and not judged: the distance off the way if only the end of the
transition counts, mm.
"""

AT_REST = 10
"""A release is over after so many frames exactly at rest."""

SETTLING_STEP, RAMPED_IN, SETTLED_AFTER, SETTLED = 0.2, 5, 100, 1e-4
"""Time step in which skin goes from rest to where it settles at held rates, s; steps in which the rates grow; the most
steps after that; and how far the last one may move it, mm.
"""

EVERY_SIMULATED = 8
"""One in so many sequences runs through a whole simulation, with wrinkles and refinement."""


class Skinned(Protocol):
    """A skin as it is moved and measured."""

    rates: Array
    displacement: Array

    def set_rates(self, rates: Array) -> None: ...
    def step(self) -> Array: ...
    def reset(self) -> None: ...
    def energy(self) -> float: ...


@dataclass(frozen=True, eq=False)
class Trial:
    """The values of each kind of fault in each frame of a sequence.

    Attributes
    ----------
    values : dict of str to ndarray, shape (f,)
        By the names in :data:`LIMITS` and :data:`RECORDED`.
    largest : ndarray, shape (f,)
        Largest displacement of a vertex, mm.
    """

    values: dict[str, Array]
    largest: Array

    def failed(self) -> dict[str, int]:
        """Return the number of frames with each kind of fault."""
        return {kind: int((self.values[kind] > limit).sum()) for kind, limit in LIMITS.items()}

    def recorded(self) -> dict[str, int]:
        """Return the number of frames in which each kind of value that is not judged is above 0."""
        return {kind: int((self.values[kind] > 0.0).sum()) for kind in RECORDED}

    def worst(self) -> dict[str, tuple[float, int]]:
        """Return the largest value of each kind, and its frame."""
        return {kind: (float(value.max()), int(value.argmax())) for kind, value in self.values.items()}


class Player:
    """Plays sequences on a face.

    Parameters
    ----------
    face : Face
    skin : Skinned, optional
        Default: a :class:`facewrinkle.Skin` of the face.

    Attributes
    ----------
    settling : Skinned or None
        The skin that tells where held rates lead; None for a skin that is given.

    Examples
    --------
    >>> face = fw.default_face()
    >>> still = Sequence(np.zeros((3, len(face.muscles))), (), False)
    >>> trial = Player(face).play(still)
    >>> len(trial.largest), sum(trial.failed().values())
    (3, 0)
    """

    def __init__(self, face: fw.Face, skin: Skinned | None = None) -> None:
        self.face, self.skin = face, fw.Skin(face) if skin is None else skin
        self.settling = fw.Skin(face, SETTLING_STEP) if skin is None else None
        self.oracle = Oracle(face)
        self.positions = self.oracle.rest

    def play(self, sequence: Sequence, simulated: bool = False) -> Trial:
        """Play a sequence, with wrinkles if `simulated`, and return its faults."""
        values = {kind: np.zeros(len(sequence.rates)) for kind in (*LIMITS, *RECORDED)}
        largest = np.zeros(len(sequence.rates))
        for f, found in enumerate(self.frames(sequence, simulated)):
            for kind, value in found.items():
                if kind == "largest":
                    largest[f] = value
                elif isinstance(value, np.ndarray):
                    values[kind][f + 1 - len(value) : f + 1] = value
                else:
                    values[kind][f] = value
        return Trial({kind: value[: f + 1] for kind, value in values.items()}, largest[: f + 1])

    def frames(self, sequence: Sequence, simulated: bool = False) -> Iterator[dict[str, float | Array]]:
        """Yield the values of each frame; those off the way for all frames of a transition at its end.

        A sequence ends early if the skin is not finite, or has come to rest for good.
        """
        energy, most, still = np.nan, 0.0, 0
        ends = {part.stop - 1 for part in sequence.transitions()}
        before = None
        path = [np.zeros_like(self.oracle.rest)]
        for f, (u, present, inverted) in enumerate(self._shapes(sequence, simulated)):
            self.positions = x = self.oracle.rest + u
            if not np.isfinite(x).all():
                yield {"not finite": 1.0}
                return
            angle = self.face.jaw_angle(dict(zip(self.face.muscles, sequence.rates[f].tolist(), strict=True)))
            found: dict[str, float | Array] = {**vars(self.oracle.findings(x, angle)), "wrinkles": inverted}
            found["largest"] = float(np.sqrt((u**2).sum(axis=1).max()))
            most = max(most, abs(present))
            held = f > 0 and np.array_equal(sequence.rates[f], sequence.rates[f - 1])
            if held and most > 0.0:
                found["energy"] = max(present - energy, 0.0) / most
            energy = present
            still = still + 1 if not u.any() else 0
            released = sequence.released and f >= sequence.starts[-1]
            last = f == len(sequence.rates) - 1 or (released and held and still >= AT_REST)
            path.append(u)
            if f in ends or last:
                way, resting = np.array(path), self._resting(sequence.rates[f + 2 - len(path) : f + 1])
                found["off the way to the end"] = off = off_the_way(way, before)[:, 0]
                found["off the way"] = off_the_way(way, before, resting)[:, 0] if resting and off.any() else off
                before, path = path[-2], path[-1:]
            if released and last:
                found["not at rest"] = float(found["largest"])
            yield found
            if last:
                return

    def _resting(self, rates: Array) -> Callable[[int], Array | None] | None:
        """Return what tells where the skin comes to rest at held rates (f, k); or None for a skin that is given."""
        if self.settling is None:
            return None
        found: dict[bytes, Array | None] = {}

        def resting(frame: int) -> Array | None:
            key = rates[frame].tobytes()
            if key not in found:
                found[key] = self.settled(rates[frame])
            return found[key]

        return resting

    def settled(self, rates: Array) -> Array | None:
        """Return where skin at rest goes (n, 3) as muscles contract to rates (k,) that are then held; or None.

        None means that it did not settle. No shape of the sequence has a part in it: skin that hangs where it should
        not be must not be its own excuse.
        """
        skin = self.settling
        assert skin is not None
        skin.reset()
        for step in range(1, RAMPED_IN + 1):
            skin.set_rates(rates * (step / RAMPED_IN))
            skin.step()
        last = np.inf
        for _ in range(SETTLED_AFTER):
            before = skin.displacement.copy()
            skin.step()
            moved = float(np.abs(skin.displacement - before).max())
            if max(moved, last) < SETTLED:
                return skin.displacement.copy()
            last = moved
        return None

    def _shapes(self, sequence: Sequence, simulated: bool) -> Iterator[tuple[Array, float, int]]:
        """Yield displacements (n, 3), energy, and the number of refined triangles that wrinkles turn over."""
        sim = fw.Simulation(self.face) if simulated else None
        if sim is None:
            self.skin.reset()
        for rates in sequence.rates:
            if sim is None:
                self.skin.set_rates(rates)
                self.skin.step()
                yield self.skin.displacement.copy(), float(self.skin.energy()), 0
                continue
            sim.contract(dict(zip(self.face.muscles, rates.tolist(), strict=True)))
            frame = sim.step()
            yield sim.skin.displacement.copy(), float(sim.skin.energy()), _turned_by_wrinkles(sim, frame.points)


def can_wrinkle(face: fw.Face) -> bool:
    """Return True if the mesh of a face can carry the wrinkles of all its muscles."""
    try:
        fw.Simulation(face).contract(dict.fromkeys(face.muscles, 1.0))
    except ParameterError:
        return False
    return True


def _turned_by_wrinkles(sim: fw.Simulation, points: Array) -> int:
    """Number of refined triangles that are turned over relative to the same skin without wrinkles."""
    bare = interpolated(sim.skin.points + sim.skin.displacement, sim.vertices.corners, sim.vertices.barycentric)
    return int((area_shares(bare, np.asarray(points) * sim.face.unit, sim.forest.triangles) <= 0.0).sum())


def area_shares(bare: Array, moved: Array, triangles: npt.NDArray[np.integer]) -> Array:
    """Return the signed areas (m,) of moved triangles along the normals that they had, relative to those they had.

    Triangles that had no area count as 1.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> area_shares(corners, corners * [2.0, -1.0, 1.0], np.array([[0, 1, 2]]))
    array([-2.])
    """
    before, after = (
        np.cross(p[triangles[:, 1]] - p[triangles[:, 0]], p[triangles[:, 2]] - p[triangles[:, 0]])
        for p in (bare, moved)
    )
    square = (before**2).sum(axis=1)
    return np.where(square > 0.0, (before * after).sum(axis=1) / np.where(square > 0.0, square, 1.0), 1.0)
