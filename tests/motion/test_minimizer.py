"""The minimization of a step.

what                            checked against
quadratic energies              their minimum, in one step with the exact matrix
line search                     an energy that rises where the guess of the curvature leads
energies that are not convex    their values at the start
contacts                        springs on a stiff floor, written out
forces at single vertices        columns of the inverse
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array, diags_array

from facewrinkle.motion.minimizer import Factors, Minimizer


def test_a_quadratic_energy_is_at_its_minimum_after_a_step():
    rng, n = np.random.default_rng(0), 40
    matrices = []
    for _ in range(3):
        edges = diags_array([rng.uniform(0.1, 1.0, n - 1)], offsets=[1], shape=(n, n))
        laplacian = edges + edges.T
        matrices.append(csr_array(diags_array(laplacian.sum(axis=1) + 0.5) - laplacian))
    force, calls = rng.normal(size=(n, 3)), []

    def energy(u, gradient):
        calls.append(1)
        product = np.stack([matrix @ u[:, k] for k, matrix in enumerate(matrices)], axis=1)
        gradient[:] = product - force
        return float((u * (0.5 * product - force)).sum())

    end = Minimizer(Factors(matrices), np.ones(n), iterations=5).minimized(energy, np.zeros((n, 3)))
    expected = np.stack([np.linalg.solve(m.toarray(), force[:, k]) for k, m in enumerate(matrices)], axis=1)
    np.testing.assert_allclose(end.u, expected, rtol=0.0, atol=1e-5)  # factors are of single precision
    assert end.before == 0.0
    assert end.value == pytest.approx(-0.5 * float((force * expected).sum()))
    assert end.converged
    assert end.iterations == 1
    assert len(calls) == 2


def test_steps_that_would_raise_the_energy_are_shortened():
    unit = csr_array(diags_array(np.ones(4)))

    def energy(u, gradient):
        gradient[:] = 100.0 * (u - 1.0)
        return float(50.0 * ((u - 1.0) ** 2).sum())

    u, gradient = np.zeros((4, 3)), np.empty((4, 3))
    minimizer = Minimizer(Factors([unit] * 3), np.ones(4), iterations=1)
    once = minimizer.minimized(energy, u)
    assert once.value == energy(once.u, gradient) < once.before == energy(u, gradient)
    assert not once.converged
    assert once.iterations == 1
    assert not u.any()
    # A minimization leaves a share of the residual to the next one.
    minimizer, end = Minimizer(Factors([unit] * 3), np.ones(4), iterations=12), once
    for _ in range(12):
        before, end = end.value, minimizer.minimized(energy, end.u)
        assert end.converged
        assert end.value <= max(0.05 * before, 1e-20)
    np.testing.assert_allclose(end.u, 1.0, rtol=0.0, atol=1e-9)


def test_nothing_is_done_where_the_energy_is_least():
    start = np.zeros((4, 3))
    factors = Factors([csr_array(diags_array(np.ones(4)))] * 3)

    def energy(u, gradient):
        gradient[:] = u
        return float(0.5 * (u**2).sum())

    end = Minimizer(factors, np.ones(4), iterations=9).minimized(energy, start)
    assert (end.before, end.value, end.converged, end.iterations) == (0.0, 0.0, True, 0)
    assert np.array_equal(end.u, start)
    assert end.u is start  # whoever steps sees that nothing has moved


@settings(max_examples=50)
@given(seed=st.integers(0, 10_000), iterations=st.integers(1, 40))
def test_no_minimization_ends_higher_than_it_began(seed, iterations):
    """Of energies that are not convex, with guesses of the curvature that are far off."""
    rng, n = np.random.default_rng(seed), 12
    waves, sizes = rng.uniform(0.3, 3.0) * rng.normal(size=(n, 3)), rng.uniform(0.1, 10.0, (n, 3))

    def energy(u, gradient):
        gradient[:] = 0.2 * u - sizes * waves * np.sin(waves * u + 1.0)
        return float(0.1 * (u**2).sum() + (sizes * np.cos(waves * u + 1.0)).sum())

    guess = [csr_array(diags_array(rng.uniform(0.05, 5.0, n))) for _ in range(3)]
    start, gradient = rng.normal(size=(n, 3)), np.empty((n, 3))
    end = Minimizer(Factors(guess), np.ones(n), iterations).minimized(energy, start)
    assert end.before == energy(start, gradient)
    steepest = (gradient**2).sum()
    assert end.value == energy(end.u, gradient) < end.before
    assert end.iterations <= iterations
    if iterations == 40:
        assert (gradient**2).sum() < steepest


@pytest.mark.parametrize("stiffness", [1e2, 1e6])
def test_stiff_contacts_are_met_in_few_iterations(stiffness):
    """Points that are pulled below a floor stop on it, as deep as the floor's stiffness says, in one or two steps."""
    n, unit = 5, csr_array(diags_array(np.ones(5)))
    pull = np.array([3.0, 2.0, 1.0, 0.0, -1.0])

    class Floor:
        def energy(self, u, gradient):
            self.depth = -1.0 - u[:, 2]
            force = stiffness * np.maximum(self.depth, 0.0)
            gradient[:, 2] -= force
            return float(0.5 * (force * np.maximum(self.depth, 0.0)).sum())

        def longest(self, ahead):
            return 1.0

        def rows(self, ahead):
            slopes = np.zeros((n, 6, 3))
            slopes[:, 0, 2] = 1.0
            return np.repeat(np.arange(n)[:, None], 6, 1), slopes, self.depth - ahead[:, 2], np.full(n, stiffness)

    def energy(u, gradient):
        gradient[:] = u
        gradient[:, 2] += pull
        return float(0.5 * (u**2).sum() + (pull * u[:, 2]).sum())

    end = Minimizer(Factors([unit] * 3), np.ones(n), 9, Floor()).minimized(energy, np.zeros((n, 3)))
    expected = np.where(pull > 1.0, -(pull + stiffness) / (1.0 + stiffness), -pull)
    assert end.converged
    assert end.iterations <= 2
    np.testing.assert_allclose(end.u[:, 2], expected, rtol=0.0, atol=1e-6)
    assert not end.u[:, :2].any()


@settings(max_examples=30)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 40), data=st.data())
def test_forces_at_single_vertices_move_all_that_is_tied_to_them(seed, n, data):
    rng, matrices, pattern = np.random.default_rng(seed), [], None
    for _ in range(3):
        a = rng.normal(size=(n, n))
        pattern = rng.random((n, n)) < 0.1 if pattern is None else pattern
        matrices.append(csr_array((a * pattern) @ (a * pattern).T + np.eye(n)))
    factors = Factors([csr_array(np.where(pattern @ pattern.T + np.eye(n) > 0, m.toarray(), 0.0)) for m in matrices])
    vertex, unit = data.draw(st.integers(0, n - 1)), np.zeros((n, 3))
    unit[vertex] = 1.0
    expected = np.stack([np.linalg.inv(matrix.toarray())[:, vertex] for matrix in matrices], axis=1)
    np.testing.assert_allclose(factors.solved(unit), expected, rtol=0.0, atol=1e-4)
