"""Triangles that are turned back.

what                                  checked against
the surface at rest, turned, bent     itself: the same object
random moves of single vertices       signed areas, by numpy and by the oracle of the analysis
random moves of all vertices          signed areas; what it says of itself where the rim is free
what is not turned over               its place, bit by bit
triangles without area                left as they are
the given points                      themselves: they do not change
heights                               the radius of a hollow, and area vectors computed plainly
"""

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from small_meshes import area_vectors, arrays, signed_areas

from facewrinkle.geometry import unit, vertex_rings
from facewrinkle.geometry.untangling import LEAST, LEFT, Untangling, unfolded_shares
from tools.trials.orientation import Normals, Orientation

AREA = 0.5
"""Of each triangle of the flat sheet."""


def untangling(points, triangles):
    return Untangling(points, triangles, *vertex_rings(triangles, len(points)))


@pytest.fixture(scope="module")
def flat():
    """A flat sheet of edges 1."""
    points, triangles = arrays(pv.Plane(i_size=12.0, j_size=12.0, i_resolution=12, j_resolution=12).triangulate())
    return points, triangles, untangling(points, triangles)


@pytest.fixture(scope="module")
def ball():
    points, triangles = arrays(pv.Icosphere(radius=8.0, nsub=3))
    return points, triangles, untangling(points, triangles), Orientation(points, triangles)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.5, 3.0])
def test_turned_and_stretched_surfaces_stay_as_they_are(ball, angle):
    points, _, each, _ = ball
    moved = Rotation.from_rotvec([0.0, 0.6 * angle, 0.8 * angle]).apply(points * [1.3, 1.0, 0.8])
    assert each.untangled(moved) is moved


def test_a_rolled_sheet_stays_as_it_is(flat):
    points, _, each = flat
    rolled = np.column_stack([3.0 * np.sin(points[:, 0] / 3.0), points[:, 1], 3.0 - 3.0 * np.cos(points[:, 0] / 3.0)])
    assert each.untangled(rolled) is rolled


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 6), far=st.floats(0.5, 1.4))
def test_no_triangle_of_a_flat_sheet_is_left_turned_over(flat, seed, count, far):
    points, triangles, each = flat
    rng = np.random.default_rng(seed)
    inner = np.flatnonzero((np.abs(points[:, :2]) < 5.5).all(axis=1))
    moved, angle = points.copy(), rng.uniform(0.0, 2.0 * np.pi, count)
    chosen = [inner[rng.integers(len(inner))]]
    for vertex in rng.permutation(inner):  # apart from each other: those around can make room
        if len(chosen) < count and (np.linalg.norm(points[vertex] - points[chosen], axis=1) > 3.5).all():
            chosen.append(vertex)
    moved[chosen, :2] += far * np.column_stack([np.cos(angle), np.sin(angle)])[: len(chosen)]
    given_points = moved.copy()
    after = each.untangled(moved)
    assert np.array_equal(moved, given_points)
    before = signed_areas(moved, triangles)
    assert signed_areas(after, triangles).min() > 0.999 * LEAST * AREA
    stay = np.ones(len(points), bool)
    stay[triangles[before < LEAST * AREA]] = False
    assert np.array_equal(after[stay], moved[stay])
    assert (after is moved) == (before.min() >= LEAST * AREA)


@pytest.mark.parametrize("spread", [0.3, 0.5, 0.8, 1.2])
def test_none_of_a_heap_of_triangles_is_left_turned_over(flat, spread):
    points, triangles, each = flat
    rim = (np.abs(points[:, :2]) > 5.5).any(axis=1)
    for seed in range(12):
        way = np.random.default_rng(seed).normal(scale=spread, size=(len(points), 2))
        for held in (rim, np.zeros_like(rim)):
            moved = points.copy()
            moved[~held, :2] += way[~held]
            after = each.untangled(moved)
            assert not len(each.turned_over(after))
            if held.any():  # else single triangles at the rim may be turned with all that is around them
                assert (signed_areas(moved, triangles) <= 0.0).any()
                assert signed_areas(after, triangles).min() > 0.0


@pytest.mark.parametrize("vertex", [70, 84, 98])
def test_what_is_turned_over_on_a_bent_sheet_is_found_and_mended(flat, vertex):
    points, triangles, each = flat
    pulled = points.copy()
    pulled[vertex] += [1.4, 0.2, 0.0]  # beyond its neighbor, in the plane
    angle = pulled[:, 0] / 20.0
    moved = np.column_stack([20.0 * np.sin(angle), pulled[:, 1], 20.0 * np.cos(angle)])
    np.testing.assert_array_equal(each.turned_over(moved), np.flatnonzero(signed_areas(pulled, triangles) <= 0.0))
    after = each.untangled(moved)
    assert not len(each.turned_over(after))
    changed = np.flatnonzero((after != moved).any(axis=1))
    assert vertex in changed
    assert np.linalg.norm(points[changed] - points[vertex], axis=1).max() < 3.0  # nothing far away


def test_the_oracle_finds_nothing_turned_over_on_a_ball(ball):
    points, triangles, each, oracle = ball
    rng, found = np.random.default_rng(4), 0
    moved = points.copy()
    along = unit(np.cross(points, rng.normal(size=points.shape)))
    chosen = rng.choice(len(points), 12, replace=False)
    moved[chosen] += 1.3 * along[chosen]
    moved = Rotation.from_rotvec([1.0, 2.0, 0.5]).apply(moved)
    found = oracle.turned_over(moved, Normals(moved, triangles))
    assert len(found) > 3
    after = each.untangled(moved)
    assert not len(oracle.turned_over(after, Normals(after, triangles)))
    assert np.linalg.norm(after - moved, axis=1).max() < 1.3


def test_triangles_without_area_are_left_alone(flat):
    points, triangles, _ = flat
    points, triangles = np.vstack([points, points[:2]]), np.vstack([triangles, [[0, 1, len(points)]]])
    points[-2] = points[0]
    each = untangling(points, triangles)
    assert each.untangled(points) is points
    moved = points.copy()
    moved[84, :2] += 1.2
    assert signed_areas(each.untangled(moved), triangles[:-1]).min() > 0.0


# --- heights over a surface ------------------------------------------------------------------------


def kept(points, displacement, triangles):
    """The share (m,) of each triangle's area that a displacement leaves, seen along the normal at rest."""
    before, after = (area_vectors(x, triangles) for x in (points, points + displacement))
    return (before * after).sum(axis=1) / (before**2).sum(axis=1)


@pytest.fixture(scope="module")
def hollow():
    """The inside of a sphere of radius 2: points, triangles, directions to its centre."""
    ball = pv.Icosphere(radius=2.0, nsub=2)
    points = np.asarray(ball.points, np.float64)
    return points, np.asarray(ball.regular_faces)[:, [0, 2, 1]].astype(np.int32), -points / 2.0


def test_over_a_hollow_heights_stay_below_the_radius_of_curvature(hollow):
    """At height h a triangle keeps the share (1 - h / radius)^2 of its area; beyond the centre it is turned over."""
    points, triangles, directions = hollow
    highest = 2.0 * (1.0 - np.sqrt(LEFT))
    assert unfolded_shares(points, np.full(len(points), highest - 1e-9), directions, triangles) is None
    heights = np.full(len(points), highest + 0.01)
    np.testing.assert_allclose(unfolded_shares(points, heights, directions, triangles) * heights, highest, atol=1e-7)


def test_along_one_direction_no_height_is_too_much():
    sheet = pv.Plane(i_resolution=6, j_resolution=6).triangulate()
    points, triangles = np.asarray(sheet.points, np.float64), np.asarray(sheet.regular_faces, np.int32)
    heights = np.random.default_rng(0).normal(0.0, 1e3, len(points))
    assert unfolded_shares(points, heights, np.tile([0.0, 0.0, 1.0], (len(points), 1)), triangles) is None


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 30.0))
def test_no_triangle_turns_over_and_heights_far_from_those_stay(hollow, seed, size):
    points, triangles, directions = hollow
    rng = np.random.default_rng(seed)
    points, heights = points + rng.normal(0.0, 0.05, points.shape), rng.normal(0.0, size, len(points))
    directions = unit(directions + rng.normal(0.0, 0.3, points.shape))
    before = heights.copy()
    shares = unfolded_shares(points, heights, directions, triangles)
    assert (heights == before).all()
    wanted = kept(points, heights[:, None] * directions, triangles)
    if shares is None:
        assert wanted.min() >= LEFT * (1.0 - 1e-9)
        return
    assert wanted.min() < LEFT
    assert ((shares >= 0.0) & (shares <= 1.0)).all()
    assert kept(points, (shares * heights)[:, None] * directions, triangles).min() > 0.0
    assert (shares[np.unique(triangles[wanted < LEFT])] < 1.0).all()


def test_the_order_of_triangles_and_vertices_does_not_matter(hollow):
    points, triangles, directions = hollow
    rng = np.random.default_rng(1)
    heights, order = rng.normal(0.0, 3.0, len(points)), rng.permutation(len(points))
    shares = unfolded_shares(points, heights, directions, triangles)
    other = np.argsort(order)[triangles][rng.permutation(len(triangles))].astype(np.int32)
    assert shares.min() < 1.0
    found = unfolded_shares(points[order], heights[order], directions[order], other)
    np.testing.assert_allclose(found, shares[order], atol=1e-12)


def test_a_triangle_without_area_cannot_turn_over():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    triangle, up = np.array([[0, 1, 2]], np.int32), np.tile([0.0, 0, 1], (3, 1))
    assert unfolded_shares(points, np.array([0.0, 5.0, -5.0]), up, triangle) is None


def test_what_is_still_turned_over_in_the_end_is_not_displaced(hollow):
    """One crumpled ball in fifty thousand."""
    points, triangles, directions = hollow
    rng = np.random.default_rng(25071)
    points = points + rng.normal(0.0, 0.2, points.shape)
    directions = unit(directions + rng.normal(0.0, 1.0, points.shape))
    heights = rng.normal(0.0, 1e3, len(points))
    shares = unfolded_shares(points, heights, directions, triangles)
    assert (shares == 0.0).any()
    assert kept(points, (shares * heights)[:, None] * directions, triangles).min() >= 0.0


def test_a_triangle_that_rounding_turns_over_ends_the_search():
    """Sides along one direction span no area; with heights of 1e20 mm rounding leaves some."""
    rng, turned = np.random.default_rng(0), 0
    for _ in range(300):
        points, along = rng.normal(size=(3, 3)), rng.normal(size=3)
        directions = np.tile(along / np.linalg.norm(along), (3, 1))
        heights = 1e20 * rng.normal(size=3)
        shares = unfolded_shares(points, heights, directions, np.array([[0, 1, 2]], np.int32))
        turned += shares is not None
        assert shares is None or ((shares >= 0.0) & (shares <= 1.0)).all()
    assert turned > 30
