"""Triangles that are turned back.

what                                  checked against
the surface at rest, turned, bent     itself: the same object
random moves of single vertices       signed areas, by numpy and by the oracle of the analysis
random moves of all vertices          signed areas; what it says of itself where the rim is free
what is not turned over               its place, bit by bit
triangles without area                left as they are
the given points                      themselves: they do not change
"""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from facewrinkle.geometry.topology import vertex_rings
from facewrinkle.geometry.untangling import LEAST, Untangling
from tools.trials.orientation import Normals, Orientation

AREA = 0.5
"""Of each triangle of the flat sheet."""


def untangling(points, triangles):
    return Untangling(points, triangles, *vertex_rings(triangles, len(points)))


@pytest.fixture(scope="module")
def flat():
    """A flat sheet of edges 1."""
    mesh = pv.Plane(i_size=12.0, j_size=12.0, i_resolution=12, j_resolution=12).triangulate()
    points, triangles = mesh.points.astype(float), mesh.regular_faces.astype(np.int32)
    return points, triangles, untangling(points, triangles)


@pytest.fixture(scope="module")
def ball():
    mesh = pv.Icosphere(radius=8.0, nsub=3)
    points, triangles = mesh.points.astype(float), mesh.regular_faces.astype(np.int32)
    return points, triangles, untangling(points, triangles), Orientation(points, triangles)


def areas(points, triangles):
    return 0.5 * np.cross(*(points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2)))[:, 2]


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
    before = areas(moved, triangles)
    assert areas(after, triangles).min() > 0.999 * LEAST * AREA
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
                assert (areas(moved, triangles) <= 0.0).any()
                assert areas(after, triangles).min() > 0.0


@pytest.mark.parametrize("vertex", [70, 84, 98])
def test_what_is_turned_over_on_a_bent_sheet_is_found_and_mended(flat, vertex):
    points, triangles, each = flat
    pulled = points.copy()
    pulled[vertex] += [1.4, 0.2, 0.0]  # beyond its neighbour, in the plane
    angle = pulled[:, 0] / 20.0
    moved = np.column_stack([20.0 * np.sin(angle), pulled[:, 1], 20.0 * np.cos(angle)])
    np.testing.assert_array_equal(each.turned_over(moved), np.flatnonzero(areas(pulled, triangles) <= 0.0))
    after = each.untangled(moved)
    assert not len(each.turned_over(after))
    changed = np.flatnonzero((after != moved).any(axis=1))
    assert vertex in changed
    assert np.linalg.norm(points[changed] - points[vertex], axis=1).max() < 3.0  # nothing far away


def test_the_oracle_finds_nothing_turned_over_on_a_ball(ball):
    points, triangles, each, oracle = ball
    rng, found = np.random.default_rng(4), 0
    moved = points.copy()
    along = np.cross(points, rng.normal(size=points.shape))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    chosen = rng.choice(len(points), 12, replace=False)
    moved[chosen] += 1.3 * along[chosen]
    turn = Rotation.from_rotvec([1.0, 2.0, 0.5])
    moved = turn.apply(moved)
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
    after = each.untangled(moved)
    assert areas(after, triangles[:-1]).min() > 0.0
