"""Minimisation of the energy of a step: a quasi-Newton iteration with a constant, prefactored matrix."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU, splu

from ..geometry.nested_dissection import nested_dissection
from . import _skin_kernels as kernels

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.integer]

DISSECTED_FROM = 50_000
"""With more vertices nested dissection orders the factors, as minimum degree takes many times as long; with fewer, the
factors of minimum degree are a twentieth smaller.
"""

CONVERGED = 1e-18
"""Predicted decrease of the energy per area at which a step has converged: displacements of less than 1e-6 mm."""

LEFT_OVER = 0.05
"""Share of the squared residual that a minimisation may leave to the next one."""

ROUNDING = 1e-14
"""Relative error of an energy: a step may raise it by this much."""

MAX_HALVINGS = 12
"""The most step lengths that the line search tries."""

MEMORY = 5
"""Number of steps from which the curvature is learnt."""


class Minimiser:
    """L-BFGS with a prefactored matrix as the first guess of the curvature, and a backtracking line search.

    The steps that it learns the curvature from are remembered from one minimisation to the next, until `reset`.

    Parameters
    ----------
    matrices : list of sparse arrays, shape (n, n)
        Guess of the curvature for each coordinate; symmetric and positive definite.
    points : ndarray, shape (n, 3)
        Rest positions.
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.
    iterations : int
        The most iterations; fewer are made if the minimisation converges.

    Examples
    --------
    Three points that springs of stiffness 2 pull to the place (1, 1, 1):

    >>> from scipy.sparse import eye_array
    >>> minimiser = Minimiser([2.0 * eye_array(3).tocsr()] * 3, np.eye(3), np.ones(3), iterations=3)
    >>> def energy(u, gradient):
    ...     gradient[:] = 2.0 * (u - 1.0)
    ...     return float(((u - 1.0) ** 2).sum())
    >>> minimiser.minimised(energy, np.zeros((3, 3))).tolist()
    [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
    """

    def __init__(self, matrices: list[csr_array], points: Array, area: Array, iterations: int) -> None:
        self.factors = Factors(matrices, points)
        self._area, self._iterations = area, iterations
        self.reset()

    def reset(self) -> None:
        """Forget the steps that were made."""
        self._memory: list[tuple[Array, Array, float]] = []

    def minimised(self, objective: Callable[[Array, Array], float], start: Array) -> Array:
        """Return displacements (n, 3) at which the objective is lower than at `start`, and lowest if it converged.

        The objective returns its value at its first argument (n, 3) and writes its gradient to the second.
        """
        gradient, trial = np.empty_like(start), np.empty_like(start)
        u = start.copy()
        value = objective(u, gradient)
        enough = LEFT_OVER * self._residual(gradient)
        for _ in range(self._iterations):
            direction = -self._inverse_curvature(gradient)
            slope = _inner(direction, gradient)
            if slope >= 0.0:
                self.reset()
                direction = -self.factors.solved(gradient)
                slope = _inner(direction, gradient)
            if -slope < CONVERGED * self._area.sum():
                break
            length = 1.0
            for _ in range(MAX_HALVINGS):
                candidate = u + length * direction
                new = objective(candidate, trial)
                if new <= value + 1e-4 * length * slope + ROUNDING * abs(value):
                    break
                length *= 0.5
            else:
                self.reset()
                break
            self._remember(candidate - u, trial - gradient)
            u, value = candidate, new
            gradient, trial = trial, gradient
            if self._residual(gradient) < enough:
                break
        return u

    def _residual(self, gradient: Array) -> float:
        return float(np.einsum("nk,nk,n->", gradient, gradient, 1.0 / self._area))

    def _inverse_curvature(self, gradient: Array) -> Array:
        """Return the inverse of the curvature times the gradient: the two loops of L-BFGS over remembered steps."""
        q, shares = gradient.copy(), []
        for step, change, curvature in reversed(self._memory):
            shares.append(kernels.two_loop_update(q, change, step, curvature, 0.0))
        q = self.factors.solved(q)
        for (step, change, curvature), share in zip(self._memory, reversed(shares), strict=True):
            kernels.two_loop_update(q, step, change, curvature, share)
        return q

    def _remember(self, step: Array, change: Array) -> None:
        curvature = _inner(step, change)
        if curvature > 1e-12 * _inner(step, step):
            self._memory = [*self._memory[-(MEMORY - 1) :], (step, change, curvature)]


def _inner(left: Array, right: Array) -> float:
    return float(np.vdot(left, right))


class Factors:
    """Factors L D L^T of three symmetric matrices of one pattern, one for each coordinate, side by side.

    They are kept in single precision: they only guess the direction of a step, and solving with them takes as long as
    reading them from memory.

    Attributes
    ----------
    lower : ndarray of float32, shape (nnz, 3)
        Entries of the three factors L.

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> double = diags_array([2.0, 2.0]).tocsr()
    >>> Factors([double] * 3, np.zeros((2, 3))).solved(np.ones((2, 3))).tolist()
    [[0.5, 0.5, 0.5], [0.5, 0.5, 0.5]]
    """

    def __init__(self, matrices: list[csr_array], points: Array) -> None:
        n = len(points)
        self._inverse, self._scratch = np.empty((n, 3)), np.empty((n, 3))
        order, ordering = np.arange(n), "MMD_AT_PLUS_A"
        if n > DISSECTED_FROM:
            order, ordering = nested_dissection((matrices[0].indptr, matrices[0].indices), points), "NATURAL"
        options = {"SymmetricMode": True}
        for k, matrix in enumerate(matrices):  # one by one: on fine meshes factors take gigabytes
            ordered = matrix[order][:, order].tocsc()
            self._keep(k, order, splu(ordered, permc_spec=ordering, diag_pivot_thresh=0.0, options=options))

    def _keep(self, k: int, order: IntArray, factor: SuperLU) -> None:
        """Keep what solving for coordinate k needs of its factors."""
        self._inverse[:, k] = 1.0 / factor.U.diagonal()
        lower = factor.L.tocsc()
        lower.sort_indices()
        if k == 0:
            self._pattern = lower.indptr, lower.indices.astype(np.uint32)
            self.lower = np.empty((lower.nnz, 3), np.float32)
            self._order = np.empty_like(factor.perm_r), np.empty_like(factor.perm_c)
            self._order[0][order], self._order[1][order] = factor.perm_r, factor.perm_c
        self.lower[:, k] = lower.data

    def solved(self, right: Array) -> Array:
        """Return the solutions (n, 3) for right-hand sides (n, 3)."""
        out = np.empty_like(right)
        kernels.solve(*self._pattern, self.lower, self._inverse, *self._order, right, self._scratch, out)
        return out
