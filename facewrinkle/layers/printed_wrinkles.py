"""The wrinkles of Zhang, Sim and Tan as their paper prints them: Eqs. 3 to 18, and the loop of Section 4.3.

What fails in print fails here: furrows begin and end in a step, amplitudes have no bound, and wrinkles stay after the
face has relaxed. :class:`facewrinkle.MuscleWrinkles` mends this.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..anatomy.face import Face
from ..anatomy.muscles import Muscle
from ..array_types import Array, BoolArray, IntArray
from ..errors import check_whole
from ..geometry.equations import EdgeWeights, anisotropy
from ..geometry.refinement import Change
from ..geometry.topology import vertex_rings
from .base import Displacement, Layer, SurfacePoints, SurfaceState
from .entries import Entries, sorted_by_vertex

ITERATIONS = 250
"""Iterations of an expression: the seconds in Table 1 of the paper times its frames per second give 230 to 260."""


@dataclass(frozen=True, eq=False)
class Amplitudes(Entries):
    """H At of the muscles, with an entry per vertex and muscle whose wrinkling region it lies in.

    Attributes
    ----------
    muscle : ndarray of int, shape (p,)
    product : ndarray, shape (p,)
        H At at k0 = 1.
    coordinates : ndarray, shape (p, 2)
        lambda and gamma (sphincter: r and psi).
    direction : ndarray, shape (p, 3)
        Across the folds.
    """

    muscle: IntArray
    product: Array
    coordinates: Array
    direction: Array

    @classmethod
    def none(cls) -> Self:
        """Return no entries of no vertices."""
        return cls(np.zeros(1, np.int32), np.empty(0, np.int32), np.empty(0), np.empty((0, 2)), np.empty((0, 3)))

    @classmethod
    def at(cls, vertices: SurfacePoints, muscles: list[Muscle], zones: BoolArray) -> Self:
        """Evaluate muscles, which may touch the base triangles `zones` (k, m0), at vertices."""
        parts = [(np.empty(0, int), *cls.none().columns)]
        for k, muscle in enumerate(muscles):
            where = np.flatnonzero(zones[k][vertices.host])
            where = where[muscle.wrinkling_region(vertices.points[where])]
            x = vertices.points[where]
            coordinates = np.stack(muscle.coordinates(x), 1)
            parts.append(
                (where, np.full(len(where), k), muscle.unit_amplitude(x), coordinates, muscle.fold_direction(x))
            )
        where, *columns = (np.concatenate(column) for column in zip(*parts, strict=True))
        return cls(*sorted_by_vertex(where, *columns, n=len(vertices.points)))


class PrintedWrinkles(Layer):
    """The layer of wrinkles as printed: in each iteration, ``H At / N`` times A is added to the height of each vertex.

    Parameters
    ----------
    iterations : int
        N, the number of time steps in which an expression is made. Heights are added in the first N steps of a
        contraction.

    Notes
    -----
    The paper weights edges by ``cos(theta)`` (Eq. 9), whose sum over the edges around a vertex is 0 where they are
    symmetric; here it is ``|cos(theta)|``. Everything else is as printed, if the muscles have ``ends="paper"``,
    ``falloff="paper"``, and no `folds` of their own, as those of :func:`facewrinkle.anatomy.atlas.printed_atlas`.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), layers=[PrintedWrinkles(iterations=20)])
    >>> sim.express("frowning")
    >>> *_, frame = sim.run(20)
    >>> bool(frame["W"].min() < -0.1)
    True
    """

    def __init__(self, iterations: int = ITERATIONS) -> None:
        self.iterations = check_whole("iterations", iterations, 1, 1e9)

    # --- Eq. 3: W = H A At ---------------------------------------------------------------------------

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.layers.base.Layer`."""
        self._muscles, self._zones, self._unit = list(face.muscles.values()), face.zones, face.unit
        self._depth = np.array([muscle.wrinkles.depth for muscle in self._muscles])
        self._amplitudes = Amplitudes.none()
        self._edges: EdgeWeights | None = None
        self._height = np.empty(0)
        self._left, self._time = self.iterations, -1.0

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """See :class:`facewrinkle.layers.base.Layer`. H At is computed once, where a new vertex rests."""
        new = Amplitudes.at(created, self._muscles, self._zones)
        self._amplitudes = self._amplitudes.followed(change.kept, new)
        self._height = np.concatenate([self._height[change.kept], np.zeros(len(created.points))])
        self._epsilon, self._edges = np.zeros(len(self._amplitudes.muscle)), None

    def displacement(self, state: SurfaceState) -> Displacement:
        """See :class:`facewrinkle.layers.base.Layer`."""
        table = self._amplitudes
        if not state.rates.any():
            self._left = self.iterations
        elif self._left and state.time != self._time:
            self._left, self._time = self._left - 1, state.time
            k0 = self._depth * state.rates  # in proportion to the contraction rate (Section 5)
            self._epsilon = self._compression(state, table)
            height = k0[table.muscle] * (table.product / self.iterations) * anisotropy(self._epsilon)
            self._height = self._height + np.bincount(table.vertices, height, len(self._height))
        n = len(self._height)
        active = np.zeros(n, bool)
        active[table.vertices[state.rates[table.muscle] > 0.0]] = True
        return Displacement(self._height, np.full(n, np.inf), np.zeros((n, 3)), active, undeformed=True)

    # --- Eqs. 8 and 9: the compression epsilon, by the edges around a vertex --------------------------

    def _compression(self, state: SurfaceState, table: Amplitudes) -> Array:
        """Epsilon of each vertex and muscle, on the surface that moves but has no wrinkles."""
        if self._edges is None:
            self._edges = EdgeWeights(
                state.vertices.points * self._unit,
                vertex_rings(state.triangles, len(state.bare)),
                table.vertices,
                table.direction,
            )
        return self._edges.epsilon(state.bare)

    def fields(self) -> dict[str, np.ndarray]:
        """Return lambda, gamma and epsilon of the muscle with the largest H At at each vertex, its index, and W."""
        table, n = self._amplitudes, len(self._height)
        order = np.argsort(np.abs(table.product), kind="stable")
        out = {name: np.zeros(n) for name in ("lambda", "gamma", "epsilon")} | {"muscle": np.full(n, -1)}
        vertex = table.vertices[order]  # of several muscles, the last one stays
        out["lambda"][vertex], out["gamma"][vertex] = table.coordinates[order].T
        out["epsilon"][vertex], out["muscle"][vertex] = self._epsilon[order], table.muscle[order]
        return {**out, "W": self._height.copy()}
