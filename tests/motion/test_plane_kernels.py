"""The inner loops of the contact between lips and between lids.

what                      checked against
heights above planes      linear algebra; differences
energies                  half stiffness times depth squared; differences
"""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.motion import _contact_kernels as kernels
from facewrinkle.motion.solids import Samples, Solids

NONE = Solids(np.empty((0, 3)), np.empty((0, 3, 3)), np.empty((0, 2)), np.empty(0))


def pairs(seed, k=40, n=60):
    """Random samples and triangles that share no vertex."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-3.0, 3.0, (n, 3))
    corners = rng.integers(0, n // 2, (k, 3))
    triangles = np.array([rng.choice(np.arange(n // 2, n), 3, replace=False) for _ in range(k)])
    shares = rng.dirichlet(np.ones(3), k)
    return x, Samples(corners, shares, triangles, rng.uniform(0.0, 0.5, k), rng.uniform(1.0, 5.0, k))


def heights(x, samples):
    """Heights (k,) of samples above the planes of their triangles."""
    return kernels.gaps_of(x, samples, NONE)


def rows_of(x, ahead, still, samples, full):
    """The rows of samples that press, or will."""
    k = len(full)
    rows = np.zeros((k, 6), np.int64), np.zeros((k, 6, 3)), np.zeros(k), np.zeros(k)
    m = kernels.sample_rows(x, ahead, still, np.arange(k), samples, NONE, full, rows)
    return rows, m


def energy_of(x, samples, full, grad):
    """The energy of the contacts at x; its gradient is added."""
    return kernels.energy_of(*rows_of(x, np.zeros_like(x), True, samples, full), grad)


def test_heights_are_those_above_the_planes_of_the_triangles():
    x, samples = pairs(0)
    points = np.einsum("kc,kci->ki", samples.shares, x[samples.corners])
    a, b, c = (x[samples.partners[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    expected = ((points - a) * normals).sum(axis=1)
    np.testing.assert_allclose(heights(x, samples), expected, atol=1e-12)
    bary, normal = np.empty(3), np.empty(3)
    for s, point in enumerate(points):
        gap = kernels.plane_gap(point, x, samples.partners, s, normal)
        kernels.foot(point, x, samples.partners, s, bary)
        np.testing.assert_allclose(normal, normals[s], atol=1e-12)
        np.testing.assert_allclose(bary @ x[samples.partners[s]] + gap * normal, point, atol=1e-9)
        assert bary.sum() == pytest.approx(1.0)


def test_a_triangle_without_area_meets_nothing():
    x, samples = pairs(1, k=1)
    samples.partners[0] = samples.partners[0, 0]
    assert heights(x, samples).tolist() == [np.inf]
    grad, full = np.zeros_like(x), np.ones(1)
    assert energy_of(x, samples, full, grad) == 0.0
    assert not grad.any()
    assert rows_of(x, x, False, samples, full)[1] == 0


@pytest.mark.parametrize("area", [0.0, 12.0])
def test_the_gradient_is_the_slope_of_the_energy(area):
    x, samples = pairs(2)
    full = np.full(40, area)
    grad, unused = np.zeros_like(x), np.zeros_like(x)
    energy = energy_of(x, samples, full, grad)
    depth = np.maximum(samples.allowed - heights(x, samples), 0.0)
    assert 5 < (depth > 0.0).sum() < 35
    a, b, c = (x[samples.partners[:, k]] for k in range(3))
    share = np.minimum(np.linalg.norm(np.cross(b - a, c - a), axis=1) / max(area, 1e-9), 1.0)
    assert (share < 1.0).any() == (area > 0.0)
    assert energy == pytest.approx(0.5 * (samples.stiffness * (share * (2.0 - share) * depth) ** 2).sum())
    rng, h = np.random.default_rng(3), 1e-6
    for _ in range(5):
        way = rng.normal(size=x.shape)
        ends = [energy_of(x + sign * h * way, samples, full, unused) for sign in (1.0, -1.0)]
        assert (ends[0] - ends[1]) / (2 * h) == pytest.approx((grad * way).sum(), rel=1e-5)


def test_rows_of_triangles_that_collapse_have_bounded_slopes():
    x, samples = pairs(6)
    full, rng = np.full(40, 12.0), np.random.default_rng(7)
    for flat in (1.0, 1e-3, 1e-9):  # some have two corners in one place
        x[samples.partners[:, 2]] = x[samples.partners[:, 0]] + flat * rng.normal(size=(40, 3))
        rows, m = rows_of(x, np.zeros_like(x), False, samples, full)
        assert m > 5
        assert np.abs(rows[1][:m]).max() < 20.0
