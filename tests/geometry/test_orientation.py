"""Heights that turn no triangle over: against the radius of a hollow, and area vectors computed plainly."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st

from facewrinkle.geometry.untangling import LEFT, unfolded_shares


def kept(points, displacement, triangles):
    """The share (m,) of each triangle's area that a displacement leaves, seen along the normal at rest."""
    before, after = (
        np.cross(x[triangles[:, 1]] - x[triangles[:, 0]], x[triangles[:, 2]] - x[triangles[:, 0]])
        for x in (points, points + displacement)
    )
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
    directions = directions + rng.normal(0.0, 0.3, points.shape)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
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
    place = np.argsort(order)
    shares = unfolded_shares(points, heights, directions, triangles)
    other = place[triangles][rng.permutation(len(triangles))].astype(np.int32)
    assert shares.min() < 1.0
    found = unfolded_shares(points[order], heights[order], directions[order], other)
    np.testing.assert_allclose(found, shares[order], atol=1e-12)


def test_a_triangle_without_area_cannot_turn_over():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    triangle, up = np.array([[0, 1, 2]], np.int32), np.tile([0.0, 0, 1], (3, 1))
    assert unfolded_shares(points, np.array([0.0, 5.0, -5.0]), up, triangle) is None


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
