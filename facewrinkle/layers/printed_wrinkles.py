"""The wrinkles of Zhang, Sim and Tan as their paper prints them: Eqs. 3 to 18, and the loop of Section 4.3.

What fails in print fails here: furrows begin and end in a step, amplitudes have no bound, and wrinkles stay after the
face has relaxed. :class:`facewrinkle.MuscleWrinkles` mends this.
"""

from __future__ import annotations

import numpy as np

from ..anatomy.face import Face
from ..array_types import Array
from ..errors import check_whole
from ..geometry.equations import EdgeWeights, anisotropy
from ..geometry.refinement import Change
from ..geometry.topology import vertex_rings
from .base import Displacement, Layer, SurfacePoints, SurfaceState
from .compression import StrainField
from .muscle_wrinkles import Folds

ITERATIONS = 250
"""Iterations of an expression: the seconds in Table 1 of the paper times its frames per second give 230 to 260."""


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
    >>> sim.express("surprise")
    >>> *_, frame = sim.run(20)
    >>> bool(frame["W"].max() > 0.1)
    True
    """

    def __init__(self, iterations: int = ITERATIONS) -> None:
        self.iterations = check_whole("iterations", iterations, 1, 1e9)

    # --- Eq. 3: W = H A At ---------------------------------------------------------------------------

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.Layer`."""
        self._muscles, self._zones, self._unit = list(face.muscles.values()), face.zones, face.unit
        self._depth = np.array([muscle.wrinkles.depth for muscle in self._muscles])
        self._metric, self._folds = StrainField.of(face).metric, Folds.none(0)
        self._edges: EdgeWeights | None = None
        self._height = np.empty(0)
        self._left, self._time = self.iterations, -1.0

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """See :class:`facewrinkle.Layer`. H At is computed once, where a new vertex rests."""
        new = Folds.at(created, self._muscles, self._zones, self._metric, self._unit)
        self._folds = self._folds.followed(change.kept, new)
        self._height = np.concatenate([self._height[change.kept], np.zeros(len(created.points))])
        self._epsilon, self._edges = np.zeros(len(self._folds.muscle)), None

    def displacement(self, state: SurfaceState) -> Displacement:
        """See :class:`facewrinkle.Layer`."""
        folds = self._folds
        if not state.rates.any():
            self._left = self.iterations
        elif self._left and state.time != self._time:
            self._left, self._time = self._left - 1, state.time
            k0 = self._depth * state.rates  # in proportion to the contraction rate (Section 5)
            self._epsilon = self._compression(state)
            height = k0[folds.muscle] * (folds.height / self.iterations) * anisotropy(self._epsilon)
            self._height = self._height + np.bincount(folds.vertices, height, len(self._height))
        n = len(self._height)
        active = np.zeros(n, bool)
        active[folds.vertices[state.rates[folds.muscle] > 0.0]] = True
        return Displacement(self._height, np.full(n, np.inf), np.zeros((n, 3)), active, undeformed=True)

    # --- Eqs. 8 and 9: the compression epsilon, by the edges around a vertex --------------------------

    def _compression(self, state: SurfaceState) -> Array:
        """Epsilon of each vertex and muscle, on the surface that moves but has no wrinkles."""
        if self._edges is None:
            vertices, points = self._folds.vertices, state.vertices.points
            directions = np.empty((len(vertices), 3))
            for k, muscle in enumerate(self._muscles):
                own = self._folds.muscle == k
                directions[own] = muscle.fold_direction(points[vertices[own]])
            rings = vertex_rings(state.triangles, len(state.bare))
            self._edges = EdgeWeights(points * self._unit, rings, vertices, directions)
        return self._edges.epsilon(state.bare)

    def fields(self) -> dict[str, np.ndarray]:
        """Return lambda, gamma and epsilon of the muscle with the largest H At at each vertex, its index, and W."""
        return {**self._folds.leading(self._epsilon), "W": self._height.copy()}
