"""The wrinkles of Zhang, Sim and Tan as their paper prints them: Eqs. 3 to 18.

What fails in print fails here: furrows begin and end in a step, and amplitudes have no bound.
:class:`facewrinkle.MuscleWrinkles` mends this.
"""

from __future__ import annotations

import numpy as np

from ..anatomy import Face
from ..array_types import Array
from ..errors import ParameterError
from ..geometry import Change, EdgeWeights, anisotropy, vertex_rings
from .base import Displacement, Layer, SurfacePoints, SurfaceState
from .compression import StrainField
from .entries import scattered
from .muscle_wrinkles import Folds


class PrintedWrinkles(Layer):
    """The layer of wrinkles as printed: ``W = H A At`` along the normals of the undeformed surface (Eq. 3).

    Notes
    -----
    Two sentences of the paper contradict each other. Section 4.3 saves H At "averaged by the number of iterations", and
    each of these applies it times A: heights add up, and stay when the muscle lets go. Section 3.2.2 has that "wrinkles
    disappear unless the skin surface is compressed". Here H At is saved for each vertex, and each time step multiplies
    it by k0 A as they are now: the same as adding H At times the change of k0 A in each. Heights are those of Eq. 3,
    whatever the number of steps, and what relaxes is smooth again.

    The paper weights edges by ``cos(theta)`` (Eq. 9), whose sum over the edges around a vertex is 0 where they are
    symmetric; here it is ``|cos(theta)|``. All else is as printed, if the muscles have ``ends="paper"``,
    ``falloff="paper"``, and no `folds` of their own, as those of :func:`facewrinkle.anatomy.atlas.printed_atlas`.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), layers=[PrintedWrinkles()])
    >>> sim.express("surprise")
    >>> *_, frame = sim.run(20)
    >>> bool(frame["W"].max() > 0.1)
    True
    """

    timeless = True

    # --- Eq. 3: W = H A At ---------------------------------------------------------------------------

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.Layer`."""
        self._muscles, self._zones, self._unit = list(face.muscles.values()), face.zones, face.unit
        self._depth = np.array([muscle.wrinkles.depth for muscle in self._muscles])
        self._metric, self._folds = StrainField.of(face).metric, Folds.none(0)
        self._edges: EdgeWeights | None = None
        self._rates = np.zeros(len(self._muscles))

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """See :class:`facewrinkle.Layer`. H At is computed once, where a new vertex rests."""
        new = Folds.at(created, self._muscles, self._zones, self._metric, self._unit)
        self._folds = self._folds.followed(change.kept, new)
        self._edges = None
        self._epsilon, self._heights = np.zeros((2, len(self._folds.muscle)))
        self._height = np.zeros(len(self._folds.starts) - 1)

    def displacement(self, state: SurfaceState) -> Displacement:
        """See :class:`facewrinkle.Layer`."""
        folds, n = self._folds, len(state.bare)
        if len(state.rates) != len(self._muscles):
            raise ParameterError(
                "wrinkles as printed are as deep as muscles are contracted, and nothing contracts them here: a motion "
                "that no muscle drives moves the surface. Use MuscleWrinkles, which reads the compression of the skin."
            )
        self._epsilon = self._compression(state)
        k0 = self._depth * state.rates  # in proportion to the contraction rate (Section 5)
        self._rates, self._heights = state.rates, k0[folds.muscle] * folds.height * anisotropy(self._epsilon)
        self._height = np.asarray(np.bincount(folds.vertices, self._heights, n), np.float64)
        active = np.zeros(n, bool)
        active[folds.vertices[state.rates[folds.muscle] > 0.0]] = True
        return Displacement(self._height, np.full(n, np.inf), np.zeros((n, 3)), active, undeformed=True)

    # --- Eqs. 8 and 9: the compression epsilon, by the edges around a vertex --------------------------

    def _compression(self, state: SurfaceState) -> Array:
        """Epsilon of each vertex and muscle, on the surface that moves but has no wrinkles."""
        vertices, points = self._folds.vertices, state.bare / self._unit
        if self._edges is None:
            rings = vertex_rings(state.triangles, len(points))
            self._edges = EdgeWeights(state.vertices.points * self._unit, rings, vertices)
        directions = np.empty((len(vertices), 3))
        for k, muscle in enumerate(self._muscles):
            own = self._folds.muscle == k
            directions[own] = muscle.fold_direction(points[vertices[own]])
        return self._edges.epsilon(state.bare, directions)

    def fields(self) -> dict[str, np.ndarray]:
        """Return lambda, gamma and epsilon of the dominant muscle at each vertex, its index, and W."""
        where, lead = self._folds.lead(self._rates)
        epsilon = scattered(where, self._epsilon[lead], 0.0)
        return {**self._folds.leading(where, lead), "epsilon": epsilon, "W": self._height.copy()}

    def fields_of(self, muscle: int) -> dict[str, np.ndarray]:
        """Return lambda, gamma, epsilon and W of one muscle in its wrinkling region ("region"), 0 elsewhere."""
        return self._folds.of(muscle, self._epsilon, self._heights)
