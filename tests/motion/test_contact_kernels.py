"""The inner loops of contacts.

what                            checked against
distance from solids            closed forms; its linear model, which it never falls below; differences
turns                           scipy's rotations
closest point of a triangle     the condition that defines it: no corner lies beyond the plane through it
signed distance from a surface  VTK's, over all triangles; differences
triangles near samples          the distances of all of them
forces of contacts              scipy's non-negative least squares; the conditions that define them
area of triangles               cross products; differences
"""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from facewrinkle.motion import _contact_kernels as kernels

COMPILING = settings(deadline=None)
NUMBERS = st.floats(-10.0, 10.0).map(lambda x: round(x, 3))
POINTS = arrays(float, 3, elements=NUMBERS)


def of_solid(point, origin, axes, half):
    normal = np.empty(3)
    return kernels.solid_gap(point, origin, axes, np.asarray(half, float), normal), normal


def differences(function, point, h=1e-6):
    """Gradient of a function at a point, by central differences."""
    steps = h * np.eye(len(point))
    return np.array([(function(point + step) - function(point - step)) / (2 * h) for step in steps])


# --- solids -------------------------------------------------------------------------------------


BALL, CYLINDER, ROUND = (-1.0, 4.0), (3.0, 5.0), (4.0, 4.0)


@COMPILING
@given(POINTS, POINTS)
def test_a_ball_is_as_far_as_its_centre_less_its_radius(point, centre):
    gap, normal = of_solid(point, centre, np.zeros((3, 3)), BALL)
    away = np.linalg.norm(point - centre)
    assert gap == pytest.approx(away - 4.0, abs=1e-12)
    np.testing.assert_allclose(normal * away, point - centre, atol=1e-12)


@COMPILING
@given(POINTS)
def test_half_a_cylinder_is_as_far_as_its_flank_or_its_end(point):
    """The flank is scaled: straight ahead, and on a round section, the distance is that of space."""
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    x, y, z = point
    axes = turn[:, [0, 2, 1]].T.copy()
    gap, normal = of_solid(turn @ point, np.zeros(3), axes, CYLINDER)
    flank = 5.0 * (np.hypot(x / 3.0, z / 5.0) - 1.0)
    assert gap == pytest.approx(max(flank, y), abs=1e-9)
    assert abs(normal @ turn[:, 1]) == pytest.approx(0.0 if flank > y else 1.0) or abs(flank - y) < 1e-9
    circle, across = of_solid(turn @ point, np.zeros(3), axes, ROUND)
    assert circle == pytest.approx(max(np.hypot(x, z) - 4.0, y), abs=1e-9)
    ahead, _ = of_solid(turn @ [0.0, y, z], np.zeros(3), axes, CYLINDER)
    assert ahead == pytest.approx(max(abs(z) - 5.0, y), abs=1e-9)
    assert np.hypot(x, z) == 0.0 or np.linalg.norm(across) == pytest.approx(1.0)


@pytest.mark.parametrize("half", [BALL, CYLINDER, ROUND])
@COMPILING
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
    """Samples of random points, balls near them, and what the loops over solids want of them."""
    x = rng.uniform(-5.0, 5.0, (n, 3))
    corners, shares = rng.integers(0, n, (k, 3)), rng.dirichlet(np.ones(3), k)
    samples = np.einsum("kc,kci->ki", shares, x[corners])
    halves = np.stack([np.full(k, -1.0), rng.uniform(1.0, 3.0, k)], axis=1)
    origins = samples + rng.normal(size=(k, 3)) * rng.uniform(0.2, 6.0, (k, 1))
    placed = corners, shares, origins, np.zeros((k, 3, 3)), halves, rng.uniform(0.0, 0.5, k)
    return x, placed, np.linalg.norm(samples - origins, axis=1) - halves[:, 1]


def test_the_samples_near_solids_are_all_that_are_near():
    x, placed, gaps = balls(np.random.default_rng(1))
    near = kernels.near_solids(x, *placed, 0.7)
    assert near.tolist() == np.flatnonzero(gaps < placed[-1] + 0.7).tolist()
    assert 20 < len(near) < len(gaps) - 20


def test_the_energy_of_solids_is_half_stiffness_times_depth_squared():
    rng = np.random.default_rng(1)
    x, placed, gaps = balls(rng)
    stiffness, gradient = rng.uniform(1.0, 9.0, len(gaps)), np.zeros_like(x)
    near = np.arange(len(gaps))
    depths = np.maximum(placed[-1] - gaps, 0.0)
    energy = kernels.solid_energy(x, near, *placed, stiffness, gradient)
    assert energy == pytest.approx(0.5 * (stiffness * depths**2).sum())
    for way in rng.normal(size=(5, *x.shape)):
        ends = [kernels.solid_energy(x + h * way, near, *placed, stiffness, np.zeros_like(x)) for h in (1e-6, -1e-6)]
        assert (ends[0] - ends[1]) / 2e-6 == pytest.approx((gradient * way).sum(), rel=1e-6)


@COMPILING
@given(POINTS, POINTS, POINTS, st.floats(-3.0, 3.0))
def test_turns_are_rotations(vector, centre, axis, angle):
    assume(np.linalg.norm(axis) > 0.1)
    axis = axis / np.linalg.norm(axis)
    turned = vector[None].copy()
    kernels.turn(turned, centre, axis, np.array([angle]))
    expected = centre + Rotation.from_rotvec(angle * axis).apply(vector - centre)
    np.testing.assert_allclose(turned[0], expected, atol=1e-9)


# --- triangles ----------------------------------------------------------------------------------


@settings(max_examples=400, deadline=None)
@given(POINTS, arrays(float, (3, 3), elements=NUMBERS))
def test_the_closest_point_of_a_triangle_has_no_corner_beyond_it(p, corners):
    a, b, c = corners
    assume(np.linalg.norm(np.cross(b - a, c - a)) > 1e-3)
    bary = np.empty(3)
    square = kernels.closest_on_triangle(p, corners, 0, 1, 2, bary)
    assert bary.sum() == pytest.approx(1.0)
    assert bary.min() >= -1e-9
    closest = bary @ corners
    assert square == pytest.approx(((p - closest) ** 2).sum(), abs=1e-9)
    assert ((corners - closest) @ (p - closest)).max() < 1e-5


def test_no_point_of_a_triangle_is_closer():
    rng, bary = np.random.default_rng(5), np.empty(3)
    shares = rng.dirichlet(np.ones(3), 4000)
    shares = np.vstack([shares, np.eye(3), rng.dirichlet(np.ones(2), 900) @ np.array([[1.0, 0, 0], [0, 1, 0]])])
    for _ in range(100):
        corners, p = rng.uniform(-2.0, 2.0, (3, 3)), rng.uniform(-4.0, 4.0, 3)
        found = np.sqrt(kernels.closest_on_triangle(p, corners, 0, 1, 2, bary))
        sampled = np.linalg.norm(shares @ corners - p, axis=1).min()
        assert sampled - 0.25 < found <= sampled + 1e-12


def bumpy(rng, n=17):
    """A bumpy square of 8 mm that looks up, and the bits of its open edges."""
    grid = np.linspace(-4.0, 4.0, n)
    x, y = (part.ravel() for part in np.meshgrid(grid, grid, indexing="ij"))
    points = np.stack([x, y, 0.3 * np.sin(1.7 * x) * np.cos(1.3 * y)], axis=1)
    points += 0.05 * rng.normal(size=points.shape)
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    triangles = np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    triangles = rng.permutation(triangles)
    sides = [tuple(sorted(side)) for t in triangles.tolist() for side in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))]
    open_edges = np.array([sides.count(side) == 1 for side in sides]).reshape(-1, 3) @ np.array([1, 2, 4])
    assert (open_edges > 0).sum() > 4 * (n - 2)
    return points, triangles, open_edges


def vtk_distance(points, triangles, places):
    surface = pv.PolyData.from_regular_faces(points, triangles)
    return np.array(pv.PolyData(places).compute_implicit_distance(surface)["implicit_distance"])


@pytest.fixture(scope="module")
def lip():
    return bumpy(np.random.default_rng(4))


def gap_of(lip, p, facing=True, points=None):
    points, (_, triangles, open_edges) = lip[0] if points is None else points, lip
    bary, normal = np.empty(3), np.empty(3)
    each = np.full(len(triangles), facing)
    gap, t = kernels.lip_gap(points, p, triangles, open_edges, each, np.arange(len(triangles)), bary, normal)
    return gap, t, bary.copy(), normal.copy()


def test_the_signed_distance_is_that_of_all_triangles(lip):
    points, triangles, _ = lip
    places = np.random.default_rng(6).uniform([-3.6, -3.6, -0.9], [3.6, 3.6, 0.9], (600, 3))
    expected = vtk_distance(points, triangles, places)
    places, expected = places[expected > -kernels.DEEPEST], expected[expected > -kernels.DEEPEST]
    assert len(places) > 550
    found = [gap_of(lip, p) for p in places]
    assert (expected > 0.2).mean() > 0.2 < (expected < -0.2).mean()
    np.testing.assert_allclose([gap for gap, *_ in found], expected, atol=1e-6)
    for p, (gap, t, bary, normal) in zip(places, found, strict=True):
        np.testing.assert_allclose(bary @ points[triangles[t]] + gap * normal, p, atol=1e-9)


def test_beside_the_surface_is_outside(lip):
    """Its border has no inside, whatever the side of the plane on which a point lies; nor has anything deeper."""
    places = np.random.default_rng(7).uniform([4.4, -6.0, -0.8], [5.5, 6.0, 0.8], (100, 3))
    assert min(gap_of(lip, p)[0] for p in places) > 0.2
    for z, inside in ((-0.9 * kernels.DEEPEST, True), (-1.6 * kernels.DEEPEST, False)):
        assert (gap_of(lip, np.array([0.0, 0.0, z]))[0] < 0.0) == inside
    assert gap_of(lip, np.array([0.0, 0.0, -0.5]), facing=False)[0] > 0.0, "skin that does not face it cannot enter it"


def test_nothing_is_far_from_no_surface(lip):
    points, triangles, open_edges = lip
    none, facing = np.empty(0, np.int64), np.ones(len(triangles), bool)
    gap, t = kernels.lip_gap(points, np.zeros(3), triangles, open_edges, facing, none, np.empty(3), np.empty(3))
    assert (gap, t) == (np.inf, -1)


def test_the_gradient_of_the_signed_distance(lip):
    """By the sample, and by the corners of the triangle, against differences."""
    places = np.random.default_rng(8).uniform([-3.0, -3.0, -0.7], [3.0, 3.0, 0.7], (60, 3))
    for p in places:
        gap, t, bary, normal = gap_of(lip, p)
        if abs(gap) < 0.02:
            continue
        np.testing.assert_allclose(normal, differences(lambda q: gap_of(lip, q)[0], p), atol=1e-4)
        if bary.min() < 0.05:
            continue
        for c, corner in enumerate(lip[1][t]):

            def moved(q, corner=corner, p=p):
                points = lip[0].copy()
                points[corner] = q
                return gap_of(lip, p, points=points)[0]

            np.testing.assert_allclose(-bary[c] * normal, differences(moved, lip[0][corner]), atol=1e-4)


@pytest.mark.parametrize("reach", [0.05, 0.6, 3.0])
def test_no_near_triangle_is_lost(lip, reach):
    points, triangles, open_edges = lip
    rng = np.random.default_rng(9)
    x = np.vstack([points, rng.uniform([-6.0, -6.0, -3.0], [6.0, 6.0, 3.0], (300, 3))])
    corners = len(points) + rng.integers(0, 300, (250, 3))
    shares = np.vstack([np.tile([1.0, 0, 0], (120, 1)), rng.dirichlet(np.ones(3), 130)])
    facing = np.ones((250, len(triangles)), bool)
    least = x[triangles, 0].min(axis=1)
    order = np.argsort(least, kind="stable")
    offsets, found, gaps = kernels.near_triangles(
        x, corners, shares, triangles, open_edges, facing, order, least[order], reach
    )
    bary = np.empty(3)
    samples = np.einsum("kc,kci->ki", shares, x[corners])
    many = 0
    for s, p in enumerate(samples):
        away = np.sqrt([kernels.closest_on_triangle(p, x, *corner, bary) for corner in triangles])
        these = found[offsets[s] : offsets[s + 1]]
        assert sorted(these) == np.flatnonzero(away <= reach).tolist()
        assert abs(gaps[s]) == pytest.approx(away.min() if len(these) else np.inf)
        many += len(these) > 8
    assert offsets[-1] == len(found)
    assert (many > 20) == (reach > 0.5), "more than fit in the first place that was set aside for them"
    again = kernels.lip_gaps(x, corners, shares, triangles, open_edges, facing, (offsets, found))
    assert np.array_equal(gaps, again)


def test_shares_of_area_are_those_of_cross_products():
    rng = np.random.default_rng(2)
    rest, x = rng.normal(size=(2, 60, 3))
    triangles = np.arange(60).reshape(20, 3)

    def cross(p):
        a, b, c = (p[triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    double = np.linalg.norm(cross(rest), axis=1)
    normals, shares = cross(rest) / double[:, None], np.empty(20)
    kernels.shares_of_area(x, triangles, normals, double, shares)
    np.testing.assert_allclose(shares, (cross(x) * normals).sum(axis=1) / double, rtol=1e-10)
    kernels.shares_of_area(rest, triangles, normals, double, shares)
    np.testing.assert_allclose(shares, 1.0, rtol=1e-12)
    slope, normal = np.empty((3, 3)), normals[0]
    kernels.slopes_of_area(x, 0, 1, 2, normal, 2.5, slope)

    def area(flat):
        a, b, c = flat.reshape(3, 3)
        return 2.5 * np.cross(b - a, c - a) @ normal

    np.testing.assert_allclose(slope.ravel(), differences(area, x[:3].ravel()), atol=1e-7)


# --- forces -------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 12), st.integers(0, 10_000), st.sampled_from([10.0, 1e3, 1e9]))
def test_forces_are_those_of_non_negative_least_squares(m, seed, stiffness):
    """f >= 0 with f = k max(d - R f, 0) minimises f (R + 1 / k) f / 2 - d f over all f >= 0."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(m, 2 * m + 3))
    response, depths = a @ a.T / (2 * m), rng.normal(size=m)
    stiff = stiffness * rng.uniform(0.5, 2.0, m)
    forces = kernels.contact_forces(response, depths, stiff, 20_000, 1e-13)
    left = np.linalg.cholesky(response + np.diag(1.0 / stiff))
    np.testing.assert_allclose(forces, nnls(left.T, np.linalg.solve(left, depths))[0], atol=1e-7)
    assert forces.min() >= 0.0
    np.testing.assert_allclose(forces / stiff, np.maximum(depths - response @ forces, 0.0), atol=1e-8)


def test_the_change_of_gaps_is_what_forces_at_vertices_do():
    rng, n, m = np.random.default_rng(0), 9, 14
    vertices, slopes = np.zeros((m, 6), np.int64), rng.normal(size=(m, 6, 3))
    for r in range(m):
        used = rng.integers(1, 7)
        vertices[r, :used] = rng.choice(n, used, replace=False)
        vertices[r, used:], slopes[r, used:] = vertices[r, 0], 0.0
    a = rng.normal(size=(3 * n, 3 * n))
    whole = (a @ a.T).reshape(n, 3, n, 3)  # displacements [j, k] by unit forces [i, l], not of one coordinate alone
    diagonal = np.einsum("iljk,lk->ilj", whole, np.eye(3))  # the skin's matrices do not mix coordinates
    slots, columns = rng.permutation(n), np.empty((n, n, 3))
    columns[slots] = diagonal.transpose(0, 2, 1)
    rows = np.zeros((m, n, 3))
    for r in range(m):
        np.add.at(rows[r], vertices[r], slopes[r])
    expected = np.einsum("rik,ikj,qjk->rq", rows, diagonal, rows)
    found = kernels.compliance(vertices, slopes, np.unique(vertices), slots, columns.astype(np.float32))
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())
    forces, out = rng.uniform(size=m), np.zeros((n, 3))
    kernels.add_forces(vertices, slopes, forces, out)
    np.testing.assert_allclose(out, np.einsum("r,rik->ik", forces, rows), atol=1e-12)
