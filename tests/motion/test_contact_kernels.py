"""The inner loops of contacts.

what                            checked against
distance from solids            closed forms; its linear model, which it never falls below; differences
forces of contacts              scipy's non-negative least squares; the conditions that define them
heights above planes            linear algebra; half stiffness times depth squared; differences
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation
from skins import assert_gradient

from facewrinkle.motion import _contact_kernels as kernels
from facewrinkle.motion.contacts import compacted
from facewrinkle.motion.solids import Samples, Solids

NUMBERS = st.floats(-10.0, 10.0).map(lambda x: round(x, 3))
POINTS = arrays(float, 3, elements=NUMBERS)


def of_solid(point, origin, axes, half):
    normal = np.empty(3)
    return kernels.solid_gap(point, origin[None], axes[None], np.array([half], float), 0, normal), normal


def differences(function, point, h=1e-6):
    """Gradient of a function at a point, by central differences."""
    steps = h * np.eye(len(point))
    return np.array([(function(point + step) - function(point - step)) / (2 * h) for step in steps])


# --- solids -------------------------------------------------------------------------------------


BALL, CYLINDER, ROUND = (-1.0, 4.0), (3.0, 5.0), (4.0, 4.0)


@given(POINTS, POINTS)
def test_a_ball_is_as_far_as_its_centre_less_its_radius(point, centre):
    gap, normal = of_solid(point, centre, np.zeros((3, 3)), BALL)
    away = np.linalg.norm(point - centre)
    assert gap == pytest.approx(away - 4.0, abs=1e-12)
    np.testing.assert_allclose(normal * away, point - centre, atol=1e-12)


@given(POINTS)
def test_half_a_cylinder_is_as_far_as_its_flank_which_rounds_off_beyond_its_end(point):
    """The flank is scaled: straight ahead, and on a round section, the distance is that of space."""
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    x, y, z = point
    axes, receded = turn[:, [0, 2, 1]].T.copy(), max(y, 0.0) ** 2 / (2.0 * kernels.END_RADIUS)
    gap, normal = of_solid(turn @ point, np.zeros(3), axes, CYLINDER)
    assert gap == pytest.approx(5.0 * (np.hypot(x / 3.0, z / 5.0) - 1.0) + receded, abs=1e-9)
    assert normal @ turn[:, 1] == pytest.approx(max(y, 0.0) / kernels.END_RADIUS)
    circle, across = of_solid(turn @ point, np.zeros(3), axes, ROUND)
    assert circle == pytest.approx(np.hypot(x, z) - 4.0 + receded, abs=1e-9)
    ahead, _ = of_solid(turn @ [0.0, y, z], np.zeros(3), axes, CYLINDER)
    assert ahead == pytest.approx(abs(z) - 5.0 + receded, abs=1e-9)
    on_section = across - (across @ turn[:, 1]) * turn[:, 1]
    assert np.hypot(x, z) == 0.0 or np.linalg.norm(on_section) == pytest.approx(1.0)


@pytest.mark.parametrize("half", [BALL, CYLINDER, ROUND])
@given(point=POINTS, other=POINTS)
def test_the_distance_is_never_below_its_linear_model(half, point, other):
    """That is convexity, from which a step that keeps to the model keeps off the solid."""
    origin, axes = np.array([1.0, -2.0, 0.5]), np.eye(3)[[0, 2, 1]]
    gap, normal = of_solid(point, origin, axes, half)
    assert of_solid(other, origin, axes, half)[0] >= gap + normal @ (other - point) - 1e-9


@pytest.mark.parametrize("half", [BALL, CYLINDER])
def test_normals_of_solids_are_slopes_of_the_distance(half):
    rng, axes = np.random.default_rng(3), np.eye(3)[[2, 0, 1]]
    for point in rng.uniform(-8.0, 8.0, (50, 3)):
        slope = differences(lambda p: of_solid(p, np.ones(3), axes, half)[0], point)
        np.testing.assert_allclose(of_solid(point, np.ones(3), axes, half)[1], slope, atol=1e-7)


def balls(rng, k=200, n=90):
    """Samples of random points, a ball near each, and their distances."""
    x = rng.uniform(-5.0, 5.0, (n, 3))
    corners, shares = rng.integers(0, n, (k, 3)), rng.dirichlet(np.ones(3), k)
    points = np.einsum("kc,kci->ki", shares, x[corners])
    halves = np.stack([np.full(k, -1.0), rng.uniform(1.0, 3.0, k)], axis=1)
    origins = points + rng.normal(size=(k, 3)) * rng.uniform(0.2, 6.0, (k, 1))
    met = np.repeat(-1 - np.arange(k)[:, None], 3, axis=1)
    samples = Samples(corners, shares, met, rng.uniform(0.0, 0.5, k), rng.uniform(1.0, 9.0, k))
    solids = Solids(origins, np.zeros((k, 3, 3)), halves, np.zeros(k))
    return x, samples, solids, np.linalg.norm(points - origins, axis=1) - halves[:, 1]


def rows_of(x, ahead, still, samples, solids, full):
    """The rows of samples that press, or will, and how many these are."""
    k = len(full)
    rows = np.zeros((k, 6), np.int64), np.zeros((k, 6, 3)), np.zeros(k), np.zeros(k)
    return rows, kernels.sample_rows(x, ahead, still, np.arange(k), samples, solids, full, rows)


def energy_of(x, samples, solids, full):
    """The energy of the contacts at x, and its gradient."""
    gradient = np.zeros_like(x)
    return kernels.energy_of(*rows_of(x, np.zeros_like(x), True, samples, solids, full), gradient), gradient


def test_the_energy_of_solids_is_half_stiffness_times_depth_squared():
    rng = np.random.default_rng(1)
    x, samples, solids, gaps = balls(rng)
    np.testing.assert_allclose(kernels.gaps_of(x, samples, solids), gaps, atol=1e-12)
    depths, unused = np.maximum(samples.allowed - gaps, 0.0), np.zeros(len(gaps))
    assert 20 < (depths > 0.0).sum() < len(gaps) - 20
    energy, gradient = energy_of(x, samples, solids, unused)
    assert energy == pytest.approx(0.5 * (samples.stiffness * depths**2).sum())
    assert_gradient(lambda x: energy_of(x, samples, solids, unused)[0], x, gradient, rng, rel=1e-6)


# --- forces -------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(st.integers(1, 12), st.integers(0, 10_000), st.sampled_from([10.0, 1e3, 1e9]))
def test_forces_are_those_of_non_negative_least_squares(m, seed, stiffness):
    """f >= 0 with f = k max(d - R f, 0) minimizes f (R + 1 / k) f / 2 - d f over all f >= 0."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(m, 2 * m + 3))
    response, depths = (a @ a.T / (2 * m)).astype(np.float32).astype(float), rng.normal(size=m)
    stiff = stiffness * rng.uniform(0.5, 2.0, m)
    start = rng.random(m) * (rng.random(m) < 0.5)
    vertices, slopes = np.repeat(np.arange(m)[:, None], 6, axis=1), np.zeros((m, 6, 3))
    slopes[:, 0, 0] = 1.0  # a row for each vertex, and no other coordinate
    columns = np.zeros((m, m, 3), np.float32)
    columns[:, :, 0] = response
    rows = compacted(vertices, slopes, np.arange(m), np.arange(m))
    forces = kernels.contact_forces(rows, columns, depths - response @ start, stiff, start, 100, 1e-13)
    left = np.linalg.cholesky(response + np.diag(1.0 / stiff))
    np.testing.assert_allclose(forces, nnls(left.T, np.linalg.solve(left, depths))[0], atol=1e-7)
    assert forces.min() >= 0.0
    np.testing.assert_allclose(forces / stiff, np.maximum(depths - response @ forces, 0.0), atol=1e-8)


# --- planes of the other lip or lid --------------------------------------------------------------


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


def test_heights_are_those_above_the_planes_of_the_triangles():
    x, samples = pairs(0)
    points = np.einsum("kc,kci->ki", samples.shares, x[samples.corners])
    a, b, c = (x[samples.partners[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(heights(x, samples), ((points - a) * normals).sum(axis=1), atol=1e-12)
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
    energy, gradient = energy_of(x, samples, NONE, np.ones(1))
    assert energy == 0.0
    assert not gradient.any()
    assert rows_of(x, x, False, samples, NONE, np.ones(1))[1] == 0


@pytest.mark.parametrize("area", [0.0, 12.0])
def test_the_gradient_is_the_slope_of_the_energy(area):
    x, samples = pairs(2)
    full = np.full(40, area)
    energy, gradient = energy_of(x, samples, NONE, full)
    depth = np.maximum(samples.allowed - heights(x, samples), 0.0)
    assert 5 < (depth > 0.0).sum() < 35
    a, b, c = (x[samples.partners[:, k]] for k in range(3))
    share = np.minimum(np.linalg.norm(np.cross(b - a, c - a), axis=1) / max(area, 1e-9), 1.0)
    assert (share < 1.0).any() == (area > 0.0)
    assert energy == pytest.approx(0.5 * (samples.stiffness * (share * (2.0 - share) * depth) ** 2).sum())
    assert_gradient(lambda x: energy_of(x, samples, NONE, full)[0], x, gradient, np.random.default_rng(3))


def test_rows_of_triangles_that_collapse_have_bounded_slopes():
    x, samples = pairs(6)
    full, rng = np.full(40, 12.0), np.random.default_rng(7)
    for flat in (1.0, 1e-3, 1e-9):  # some have two corners in one place
        x[samples.partners[:, 2]] = x[samples.partners[:, 0]] + flat * rng.normal(size=(40, 3))
        rows, m = rows_of(x, np.zeros_like(x), False, samples, NONE, full)
        assert m > 5
        assert np.abs(rows[1][:m]).max() < 20.0
