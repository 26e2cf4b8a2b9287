"""Minimization of the energy of a step: a quasi-Newton iteration with a constant, prefactored matrix."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import SuperLU

from ..array_types import Array
from ..errors import ParameterError
from ..geometry.laplacian import symmetric_factors
from . import _skin_kernels as kernels
from .contacts import Compliance, Contacts

Objective = Callable[[Array, Array], float]


@dataclass(frozen=True, eq=False)
class Minimum:
    """The end of a minimization.

    Attributes
    ----------
    u : ndarray, shape (n, 3)
        The start itself if nothing lowers the objective there.
    before, value : float
        The objective at the start and there, contacts included.
    converged : bool
        False if the iterations did not suffice; the objective is then still lower than at the start.
    iterations : int
    """

    u: Array
    before: float
    value: float
    converged: bool
    iterations: int


class Minimizer:
    """L-BFGS with a prefactored matrix as the first guess of the curvature, and a backtracking line search.

    Contacts are no part of the curvature that is learnt: the quadratic model of each iteration is minimized with all
    contacts that its step would meet, so that a step neither enters what it meets nor is stopped far from it.
    The steps that the curvature is learnt from are remembered from one minimization to the next, until `reset`.

    Parameters
    ----------
    factors : Factors
        Those of a guess of the curvature.
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.
    iterations : int
        The most iterations; fewer are made if the minimization converges.
    contacts : Contacts, optional

    Attributes
    ----------
    memory : tuple
        The steps that the curvature is learnt from.

    Examples
    --------
    Three points that springs of stiffness 2 pull to the place (1, 1, 1):

    >>> from scipy.sparse import eye_array
    >>> factors = Factors([2.0 * eye_array(3).tocsr()] * 3)
    >>> minimizer = Minimizer(factors, np.ones(3), iterations=3)
    >>> def energy(u, gradient):
    ...     gradient[:] = 2.0 * (u - 1.0)
    ...     return float(((u - 1.0) ** 2).sum())
    >>> minimizer.minimized(energy, np.zeros((3, 3))).u.tolist()
    [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
    """

    def __init__(self, factors: Factors, area: Array, iterations: int, contacts: Contacts | None = None) -> None:
        self.factors = factors
        self._area, self._iterations, self._contacts = area, iterations, contacts
        self._total_area = math.fsum(area)
        self._compliance = Compliance(factors.solved, len(area))
        self.reset()

    def reset(self) -> None:
        """Forget the steps that were made."""
        self.memory: tuple[tuple[Array, Array, float], ...] = ()

    def minimized(self, objective: Objective, start: Array) -> Minimum:
        """Return displacements (n, 3) at which the objective and the energy of contacts are lower than at `start`.

        The objective returns its value at its first argument (n, 3) and writes its gradient to the second.
        """
        u, here, there = start, np.empty((2, *start.shape)), np.empty((2, *start.shape))
        before = value = self._evaluated(objective, u, here)
        if not math.isfinite(value):
            raise ParameterError(
                "the energy of the skin is not finite: a length or strength of a muscle, a rate, or the material is "
                "far too large. Give smaller ones."
            )
        # So small a share of the squared residual, or a decrease of the energy per area by the last iteration, leaves
        # the rest to the next minimization: some hundredths of a millimeter.
        enough, small = 0.05 * self._residual(here[1]), 1e-6
        if enough == 0.0:
            return Minimum(u, before, value, True, 0)
        length, fine = 1.0, False
        for iteration in range(self._iterations):
            direction, slope = self._direction(here, fine)
            if -slope <= 1e-18 * self._total_area:  # displacements of less than 1e-6 mm
                return Minimum(u, before, value, True, iteration)
            found = self._line_search(objective, u, value, direction, slope, min(2.0 * length, 1.0), there)
            if found is None:  # not even the shortest step lowers the energy: it is at its rounding, or the memory errs
                if fine and not self.memory:
                    return Minimum(u, before, value, -slope <= 1e-9 * abs(value), iteration)
                fine = fine or not self.memory
                self.reset()
                value = self._evaluated(objective, u, here)
                continue
            candidate, value, length = found
            self._remember(candidate - u, there[0] - here[0])
            u, here, there = candidate, there, here
            if -slope <= small * self._total_area or self._residual(here[1]) <= enough:
                return Minimum(u, before, value, True, iteration + 1)
        return Minimum(u, before, value, False, self._iterations)

    def _evaluated(self, objective: Objective, u: Array, gradients: Array) -> float:
        """Return the energy at displacements (n, 3); write its gradients (2, n, 3) without contacts, and with them."""
        free, total = gradients
        value = objective(u, free)
        total[:] = free
        return value if self._contacts is None else value + self._contacts.energy(u, total)

    def _residual(self, gradient: Array) -> float:
        """Return the sum of the squares of a gradient (n, 3), per area."""
        return float(np.einsum("nk,nk,n", gradient, gradient, 1.0 / self._area))

    def _direction(self, at: Array, fine: bool) -> tuple[Array, float]:
        """Return a direction in which the objective falls from where it was last evaluated, and its slope.

        If it is to be `fine`, or forces balance, only the change of the forces of contacts is computed: large forces
        that balance lose what is left of a way in their rounding.
        """
        slope, (free, total) = 0.0, at
        # Below it, forces balance, and the rounding of the factors, of single precision, would be all that is left.
        fine = fine or self._residual(total) < 1e-6 * self._residual(free)
        for attempt in range(3):
            if attempt == 1:
                self.reset()
            if attempt < 2:
                direction = -self._inverse_curvature(total if fine else free)
                if self._contacts is not None and len((rows := self._contacts.rows(direction))[3]):
                    direction += self._compliance.response(rows, direction if fine else None)
            else:  # the model's contacts err: follow the slope itself
                direction = -self.factors.solved(total)
            slope = _inner(direction, total)
            if slope < 0.0:
                break
        return direction, slope

    def _line_search(
        self,
        objective: Objective,
        u: Array,
        value: float,
        direction: Array,
        slope: float,
        length: float,
        there: Array,
    ) -> tuple[Array, float, float] | None:
        """Return the first of ever shorter steps that lowers the objective enough, its value and its length."""
        rounding = 1e-13 * abs(value)  # of an energy: a step may raise it by this much
        for _ in range(12):
            candidate = u + length * direction
            new = self._evaluated(objective, candidate, there)
            if new <= value + 1e-4 * length * slope + rounding:
                return candidate, new, length
            if -length * slope <= rounding:
                break  # what shorter steps promise cannot be told
            length *= 0.5
        return None

    def _inverse_curvature(self, gradient: Array) -> Array:
        """Return the inverse of the curvature times the gradient: the two loops of L-BFGS over remembered steps."""
        q, shares = gradient.copy(), []
        for step, change, curvature in reversed(self.memory):
            shares.append(kernels.two_loop_update(q, change, step, curvature, 0.0))
        q = self.factors.solved(q)
        for (step, change, curvature), share in zip(self.memory, reversed(shares), strict=True):
            kernels.two_loop_update(q, step, change, curvature, share)
        return q

    def _remember(self, step: Array, change: Array) -> None:
        curvature = _inner(step, change)
        if curvature > 1e-12 * _inner(step, step):
            self.memory = (*self.memory[-4:], (step, change, curvature))  # five at most


def _inner(a: Array, b: Array) -> float:
    """Return the inner product of two arrays (n, 3); the sums of BLAS depend on the number of threads."""
    return float(np.einsum("nk,nk", a, b))


class Factors:
    """Factors L D L^T of three symmetric matrices of one pattern, one for each coordinate, side by side.

    Several minimizers may share them. They are kept in single precision: they only guess the direction of a step, and
    solving with them takes as long as reading them from memory.

    Attributes
    ----------
    lower : ndarray of float32, shape (nnz, 3)
        Entries of the three factors L.

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> double = diags_array([2.0, 2.0]).tocsr()
    >>> Factors([double] * 3).solved(np.ones((2, 3))).tolist()
    [[0.5, 0.5, 0.5], [0.5, 0.5, 0.5]]
    """

    def __init__(self, matrices: list[csr_array]) -> None:
        self._inverse = np.empty((matrices[0].shape[0], 3))
        for k, matrix in enumerate(matrices):  # one by one: on fine meshes factors take gigabytes
            self._keep(k, symmetric_factors(matrix.tocsc()))

    def _keep(self, k: int, factor: SuperLU) -> None:
        """Keep what solving for coordinate k needs of its factors."""
        self._inverse[:, k] = 1.0 / factor.U.diagonal()
        lower = factor.L.tocsc()
        lower.sort_indices()
        if k == 0:
            self._pattern = lower.indptr, lower.indices.astype(np.uint32)
            self.lower = np.empty((lower.nnz, 3), np.float32)
            self._order = factor.perm_r, factor.perm_c
        self.lower[:, k] = lower.data

    def solved(self, right: Array) -> Array:
        """Return the solutions (n, 3) for right-hand sides (n, 3)."""
        out, scratch = np.empty_like(right), np.empty_like(right)
        kernels.solve(*self._pattern, self.lower, self._inverse, *self._order, right, scratch, out)
        return out
