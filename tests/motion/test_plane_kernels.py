"""The inner loops of the contact between lips and between lids.

what                      checked against
heights above planes      linear algebra; differences
energies                  half stiffness times depth squared; differences
rows                      the gradient of the energy where they start; what comes near ahead
"""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.motion import _contact_kernels as kernels
from facewrinkle.motion.lip_surfaces import FacingSkin


def pairs(seed, k=40, n=60):
    """Random samples and triangles that share no vertex."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-3.0, 3.0, (n, 3))
    corners = rng.integers(0, n // 2, (k, 3))
    triangles = np.array([rng.choice(np.arange(n // 2, n), 3, replace=False) for _ in range(k)])
    shares = rng.dirichlet(np.ones(3), k)
    return x, corners, shares, triangles, rng.uniform(0.0, 0.5, k), rng.uniform(1.0, 5.0, k)


def heights(x, corners, shares, triangles):
    """Heights (k,) of samples above the planes of their triangles."""
    none = np.zeros(len(corners))
    return FacingSkin(corners, shares, none, none, triangles).gaps(x)


def energy_of(x, corners, shares, triangles, full, allowed, stiffness, grad):
    """The energy of the contacts at x; its gradient is added."""
    k = len(corners)
    rows = np.zeros((k, 6), np.int64), np.zeros((k, 6, 3)), np.zeros(k), np.zeros(k)
    m = kernels.plane_rows(x, np.zeros_like(x), True, corners, shares, allowed, stiffness, triangles, full, rows, 0)
    return kernels.energy_of(rows, m, grad)


def test_heights_are_those_above_the_planes_of_the_triangles():
    x, corners, shares, triangles, _, _ = pairs(0)
    samples = np.einsum("kc,kci->ki", shares, x[corners])
    a, b, c = (x[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    expected = ((samples - a) * normals).sum(axis=1)
    np.testing.assert_allclose(heights(x, corners, shares, triangles), expected, atol=1e-12)
    bary, normal = np.empty(3), np.empty(3)
    for s, sample in enumerate(samples):
        gap = kernels.plane_gap(x, corners[s], shares[s], triangles[s], bary, normal)
        np.testing.assert_allclose(normal, normals[s], atol=1e-12)
        np.testing.assert_allclose(bary @ x[triangles[s]] + gap * normal, sample, atol=1e-9)
        assert bary.sum() == pytest.approx(1.0)


def test_a_triangle_without_area_meets_nothing():
    x, corners, shares, triangles, allowed, stiffness = pairs(1, k=1)
    triangles[0] = triangles[0, 0]
    assert heights(x, corners, shares, triangles).tolist() == [np.inf]
    grad, full = np.zeros_like(x), np.ones(1)
    assert energy_of(x, corners, shares, triangles, full, allowed, stiffness, grad) == 0.0
    assert not grad.any()
    rows = np.zeros((1, 6), np.int64), np.zeros((1, 6, 3)), np.zeros(1), np.zeros(1)
    assert kernels.plane_rows(x, x, False, corners, shares, allowed, stiffness, triangles, full, rows, 0) == 0


@pytest.mark.parametrize("area", [0.0, 12.0])
def test_the_gradient_is_the_slope_of_the_energy(area):
    x, corners, shares, triangles, allowed, stiffness = pairs(2)
    full = np.full(40, area)
    grad, unused = np.zeros_like(x), np.zeros_like(x)
    energy = energy_of(x, corners, shares, triangles, full, allowed, stiffness, grad)
    depth = np.maximum(allowed - heights(x, corners, shares, triangles), 0.0)
    assert 5 < (depth > 0.0).sum() < 35
    a, b, c = (x[triangles[:, k]] for k in range(3))
    share = np.minimum(np.linalg.norm(np.cross(b - a, c - a), axis=1) / max(area, 1e-9), 1.0)
    assert (share < 1.0).any() == (area > 0.0)
    assert energy == pytest.approx(0.5 * (stiffness * (share * (2.0 - share) * depth) ** 2).sum())
    rng, h = np.random.default_rng(3), 1e-6
    for _ in range(5):
        way = rng.normal(size=x.shape)
        ends = [
            energy_of(x + sign * h * way, corners, shares, triangles, full, allowed, stiffness, unused)
            for sign in (1.0, -1.0)
        ]
        assert (ends[0] - ends[1]) / (2 * h) == pytest.approx((grad * way).sum(), rel=1e-5)


def test_rows_know_all_that_is_near_or_comes_near():
    x, corners, shares, triangles, allowed, stiffness = pairs(4)
    full = np.zeros(40)
    grad = np.zeros_like(x)
    energy_of(x, corners, shares, triangles, full, allowed, stiffness, grad)
    ahead = 1e-6 * np.random.default_rng(5).normal(size=x.shape)
    rows = np.zeros((41, 6), np.int64), np.zeros((41, 6, 3)), np.zeros(41), np.zeros(41)
    m = kernels.plane_rows(x, ahead, False, corners, shares, allowed, stiffness, triangles, full, rows, 1)
    here, there = (heights(place, corners, shares, triangles) for place in (x, x + ahead))
    near = (here < allowed) | (there < allowed)
    assert m == 1 + near.sum()
    np.testing.assert_allclose(rows[2][1:m], (allowed - there)[near], atol=1e-9)
    pushed = np.zeros_like(x)
    force = rows[3][1:m] * np.maximum(rows[2][1:m], 0.0)
    np.subtract.at(pushed, rows[0][1:m], force[:, None, None] * rows[1][1:m])
    np.testing.assert_allclose(pushed, grad, atol=1e-4 * np.abs(grad).max())


def test_rows_of_triangles_that_collapse_have_bounded_slopes():
    x, corners, shares, triangles, allowed, stiffness = pairs(6)
    full, rng = np.full(40, 12.0), np.random.default_rng(7)
    for flat in (1.0, 1e-3, 1e-9):
        x[triangles[:, 2]] = x[triangles[:, 0]] + flat * rng.normal(size=(40, 3))  # some have two corners in one place
        rows = np.zeros((40, 6), np.int64), np.zeros((40, 6, 3)), np.zeros(40), np.zeros(40)
        still = np.zeros_like(x)
        m = kernels.plane_rows(x, still, False, corners, shares, allowed, stiffness, triangles, full, rows, 0)
        assert m > 5
        assert np.abs(rows[1][:m]).max() < 20.0
