"""Waves at points, found once for each point: a face that is refined again and again asks for the same points again."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..base import SurfacePoints
from .field import WaveField
from .waves import Waves

MOST = 100_000
"""So many points are remembered, then all are forgotten; more at once never are."""

HOSTS, STEPS = 2**21, 2**20
"""Base triangles, and steps of a barycentric coordinate, that a key has room for."""


class Recall:
    """Waves at points of a face, the same to the last bit as if they were found anew.

    What finds them does so for each point alone, by operations that round the same in any company: loops, sums,
    products and square roots.

    Parameters
    ----------
    field : WaveField

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), layers=[fw.WaveFolds()])
    >>> sim.express("surprise")
    >>> first, again = sim.settle(afresh=True), sim.settle(afresh=True)
    >>> bool((first["W"] == again["W"]).all())
    True
    """

    def __init__(self, field: WaveField) -> None:
        self._field = field
        self._forget()

    def _forget(self) -> None:
        self._keys, self._rows = np.empty(0, np.int64), np.empty(0, np.int64)
        self._waves = Waves.none(0)

    def at(self, points: SurfacePoints) -> Waves:
        """Return the waves at points."""
        keys = _keys(points)
        if keys is None or not 0 < len(keys) <= MOST:
            return self._field.at(points)
        new = ~self._known(keys)[1]
        if len(self._keys) + np.count_nonzero(new) > MOST:
            self._forget()
            new[:] = True
        if new.any():
            found = self._field.at(points.taken(new))
            self._waves = self._waves.followed(slice(None), found)
            self._append(keys[new])
            if new.all():
                return found
        return self._waves.taken(self._rows[self._known(keys)[0]])

    def _known(self, keys: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
        """Places (n,) of keys among those that are known, and if they are there."""
        if not len(self._keys):
            return np.zeros(len(keys), np.int64), np.zeros(len(keys), bool)
        place = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        return place, self._keys[place] == keys

    def _append(self, keys: npt.NDArray[np.int64]) -> None:
        order = np.argsort(keys, kind="stable")
        place = np.searchsorted(self._keys, keys[order])
        self._rows = np.insert(self._rows, place, len(self._rows) + order)
        self._keys = np.insert(self._keys, place, keys[order])


def _keys(points: SurfacePoints) -> npt.NDArray[np.int64] | None:
    """Numbers (n,) of places: base triangle and weights of its corners; None where there is no room for them.

    Vertices of the base mesh have none: their triangle does not tell which of its corners they are.
    """
    steps = points.barycentric[:, :2] * STEPS
    whole = steps.astype(np.int64)
    inside = points.corners[:, 0] != points.corners[:, 1]
    if not inside.all() or (whole != steps).any() or points.host.max(initial=0) >= HOSTS:
        return None
    return np.asarray((points.host.astype(np.int64) * (STEPS + 1) + whole[:, 0]) * (STEPS + 1) + whole[:, 1])
