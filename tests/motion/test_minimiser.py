"""The minimisation of a step.

what                            checked against
quadratic energies              their minimum, in one step with the exact matrix
line search                     an energy that rises where the guess of the curvature leads
factors of a fine mesh          the same motion with the factors of a coarse one
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, diags_array

from facewrinkle.motion import minimiser as module
from facewrinkle.motion.minimiser import Minimiser
from facewrinkle.motion.skin import Skin


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

    minimiser = Minimiser(matrices, np.zeros((n, 3)), np.ones(n), iterations=5)
    found = minimiser.minimised(energy, np.zeros((n, 3)))
    expected = np.stack([np.linalg.solve(m.toarray(), force[:, k]) for k, m in enumerate(matrices)], axis=1)
    np.testing.assert_allclose(found, expected, atol=1e-5)  # factors are of single precision
    assert len(calls) == 2


def test_steps_that_would_raise_the_energy_are_shortened():
    unit = csr_array(diags_array(np.ones(4)))

    def energy(u, gradient):
        gradient[:] = 100.0 * (u - 1.0)
        return float(50.0 * ((u - 1.0) ** 2).sum())

    u, gradient = np.zeros((4, 3)), np.empty((4, 3))
    minimiser = Minimiser([unit] * 3, u, np.ones(4), iterations=1)
    assert energy(minimiser.minimised(energy, u), gradient) < energy(u, gradient)
    assert not u.any()
    twice = Minimiser([unit] * 3, u, np.ones(4), iterations=4).minimised(energy, u)
    np.testing.assert_allclose(twice, 1.0, atol=1e-9)


def test_the_order_of_the_factors_does_not_show(face, monkeypatch):
    rates = {"zygomaticus_major_l": 1.0, "frontalis_inner_r": 0.7, "jaw": 0.5}
    moved = []
    for large in (module.DISSECTED_FROM, 100):
        monkeypatch.setattr(module, "DISSECTED_FROM", large)
        skin = Skin(face)
        skin.contract(rates)
        for _ in range(10):
            last = skin.step()
        moved.append((skin._minimiser.factors.lower.size, last))
    assert moved[0][0] != moved[1][0], "another order has other factors"
    assert np.abs(moved[0][1] - skin.points).max() > 3.0
    np.testing.assert_allclose(moved[1][1], moved[0][1], atol=1e-8)
