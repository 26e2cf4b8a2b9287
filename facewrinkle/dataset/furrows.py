"""Furrows of a frame, one by one: connected regions of skin that lie below the smooth surface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ..array_types import Array
from ..geometry import connected
from ..mesh import MUSCLES, rest_of

DEEP = 0.05
"""Skin this far below the smooth surface is part of a furrow, mm."""


@dataclass(frozen=True)
class Furrow:
    """A furrow.

    Attributes
    ----------
    number : int
        From 1, the deepest first; in a clip, that of the same furrow in the frame before.
    source : str
        The muscle or the family of waves that makes most of it.
    depth : float
        Greatest depth below the smooth surface, mm.
    length : float
        Distance between its ends at rest, mm.
    """

    number: int
    source: str
    depth: float
    length: float


def furrows_of(
    frame: pv.PolyData, families: tuple[str, ...] = (), unit: float = 1.0
) -> tuple[npt.NDArray[Any], list[Furrow]]:
    """Return the number of the furrow at each vertex (n,), 0 for none, and the furrows.

    Parameters
    ----------
    frame : PolyData
        Of :meth:`facewrinkle.Simulation.step`.
    families : tuple of str
        Names of the families of waves, in the order of their numbers.
    unit : float
        The unit of the mesh in mm.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), folds="paper")
    >>> sim.express("surprise")
    >>> number, furrows = furrows_of(sim.settle())
    >>> len(furrows) >= 2, {furrow.source.split("_")[0] for furrow in furrows}, int(number.max()) == len(furrows)
    (True, {'frontalis'}, True)
    """
    height = np.asarray(frame.point_data["W"])
    triangles = frame.regular_faces
    deep = height <= -DEEP
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = edges[deep[edges].all(axis=1)]
    component = connected(edges, len(height))
    rest = unit * rest_of(frame)
    found = []
    members = np.flatnonzero(deep)
    members = members[np.argsort(component[members], kind="stable")]
    for vertices in np.split(members, np.flatnonzero(np.diff(component[members])) + 1):
        length = float(np.ptp(rest[vertices] @ _direction(rest[vertices]))) if len(vertices) else 0.0
        if length >= 3.0:  # mm; shorter ones are not counted
            found.append((float(-height[vertices].min()), length, vertices))
    found.sort(key=lambda entry: (-entry[0], int(entry[2][0])))
    number = np.zeros(len(height), np.int64)
    for k, (_, _, vertices) in enumerate(found, start=1):
        number[vertices] = k
    sources = _sources(frame, number, families)
    furrows = [Furrow(k, sources[k], depth, length) for k, (depth, length, _) in enumerate(found, start=1)]
    return number, furrows


class FurrowTracker:
    """Gives furrows the same numbers from frame to frame.

    A furrow is the same as one of the frame before if they share skin: the face at rest tells where each lies. Numbers
    go on so that as much skin as possible keeps its own; a furrow without a match gets a new number.

    Parameters
    ----------
    reach : float
        Places at rest that are no further apart than this count as shared, in the unit of the mesh.

    Examples
    --------
    Two furrows, of which one gets longer and becomes the deeper one:

    >>> places = np.array([[0.0, 0, 0], [1, 0, 0], [0, 9, 0], [1, 9, 0]])
    >>> tracker = FurrowTracker(0.5)
    >>> first = tracker(places, np.array([1, 0, 2, 2]), [Furrow(1, "a", 2.0, 3.0), Furrow(2, "b", 1.0, 3.0)])
    >>> number, furrows = tracker(places, np.array([2, 2, 1, 1]), [Furrow(1, "b", 3.0, 3.0), Furrow(2, "a", 2.0, 4.0)])
    >>> number.tolist(), [(furrow.number, furrow.source) for furrow in furrows]
    ([1, 1, 2, 2], [(2, 'b'), (1, 'a')])
    """

    def __init__(self, reach: float) -> None:
        self._reach, self._last = reach, 0
        self._before: tuple[cKDTree, npt.NDArray[Any]] | None = None

    def __call__(
        self, rest: Array, number: npt.NDArray[Any], furrows: list[Furrow]
    ) -> tuple[npt.NDArray[Any], list[Furrow]]:
        """Return the numbers of the furrow at each vertex (n,), and the furrows, both renumbered."""
        own = np.flatnonzero(number)
        new = np.zeros(len(furrows) + 1, np.int64)
        if self._before is not None and len(own):
            tree, known = self._before
            distance, near = tree.query(rest[own], distance_upper_bound=self._reach)
            some = np.isfinite(distance)
            shared = np.zeros((len(furrows) + 1, self._last + 1), np.int64)
            np.add.at(shared, (number[own[some]], known[near[some]]), 1)
            now, then = linear_sum_assignment(shared, maximize=True)
            new[now] = np.where(shared[now, then] > 0, then, 0)
        fresh = 1 + np.flatnonzero(new[1:] == 0)
        new[fresh] = self._last + 1 + np.arange(len(fresh))
        self._last = int(max(new.max(), self._last))
        number = new[number]
        self._before = (cKDTree(rest[own]), number[own]) if len(own) else None
        return number, [replace(furrow, number=int(new[furrow.number])) for furrow in furrows]


def _direction(points: Array) -> Array:
    """The unit vector along which points spread most."""
    centred = points - points.mean(axis=0)
    return np.asarray(np.linalg.eigh(centred.T @ centred)[1][:, -1])


def _sources(frame: pv.PolyData, number: npt.NDArray[Any], families: tuple[str, ...]) -> list[str]:
    """The name of the muscle or family that is strongest at most vertices of each number, from 0."""
    muscles = [str(name) for name in frame.field_data[MUSCLES]] if MUSCLES in frame.field_data else []
    count = int(number.max(initial=0)) + 1
    names, votes = ["skin"], [np.full(count, 0.5)]
    for array, known in (("muscle", muscles), ("family", list(families))):
        if array in frame.point_data and known:
            own = np.asarray(frame.point_data[array]).astype(np.int64)
            some = (own >= 0) & (own < len(known)) & (number > 0)
            names += known
            votes.append(np.bincount(number[some] * len(known) + own[some], minlength=count * len(known)))
    columns = np.concatenate([each.reshape(count, -1) for each in votes], axis=1)
    return [names[k] for k in columns.argmax(axis=1)]
