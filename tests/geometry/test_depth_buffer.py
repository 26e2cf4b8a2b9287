"""Depth buffers.

what                            checked against
triangles over a grid           planes and a sphere in closed form, both windings
what lies in front or behind    left out where a span says so
samples of pixels               the largest of each, by a loop

Shadows and openness, where closed forms tell them.
"""

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.geometry.depth_buffer import DIRECTIONS, Lamp, depth_buffer, openness, sampled_depth_buffer

LOW, STEP, SHAPE = (-1.5, -1.5), 0.05, (61, 61)
Y, X = (low + STEP * np.arange(n) for low, n in zip(LOW[::-1], SHAPE, strict=True))


def test_planes_are_exact():
    corners = np.array([[-5.0, -5, 0], [5, -5, 0], [0, 9, 0]])
    corners[:, 2] = 0.3 * corners[:, 0] - 0.7 * corners[:, 1] + 0.2
    depth = depth_buffer(corners, np.array([[0, 1, 2]]), LOW, STEP, SHAPE)
    np.testing.assert_allclose(depth, 0.3 * X[None, :] - 0.7 * Y[:, None] + 0.2, atol=1e-12)
    assert np.array_equal(depth, depth_buffer(corners, np.array([[0, 1, 2]], np.int32), LOW, STEP, SHAPE))


def test_the_foremost_half_of_a_sphere_is_seen():
    ball = pv.Icosphere(radius=1.0, nsub=5)
    points, triangles = np.asarray(ball.points, dtype=np.float64), ball.regular_faces
    square = X[None, :] ** 2 + Y[:, None] ** 2
    depth = depth_buffer(points, triangles, LOW, STEP, SHAPE)
    np.testing.assert_allclose(depth[square < 0.8], np.sqrt(1.0 - square[square < 0.8]), atol=2e-3)
    assert np.isneginf(depth[square > 1.0]).all()
    np.testing.assert_allclose(depth_buffer(points, triangles[:, ::-1], LOW, STEP, SHAPE), depth, atol=1e-12)
    behind = depth_buffer(points, triangles, LOW, STEP, SHAPE, span=(-np.inf, 0.0))
    np.testing.assert_allclose(behind[square < 0.8], -depth[square < 0.8], atol=2e-3)


def test_triangles_seen_edge_on_or_beside_the_grid_are_not_there():
    points = np.array([[0.0, 0, 0], [0, 1, 1], [0, 1, -1], [9, 9, 0], [9, 8, 0], [8, 9, 0]])
    assert np.isneginf(depth_buffer(points, np.array([[0, 1, 2], [3, 4, 5]]), LOW, STEP, SHAPE)).all()


def test_samples_of_pixels():
    rng = np.random.default_rng(0)
    pixels, heights = rng.integers(0, [7, 5], (60, 2)), rng.normal(size=60)
    expected = np.full((7, 5), -np.inf)
    for (i, j), height in zip(pixels, heights, strict=True):
        expected[i, j] = max(expected[i, j], height)
    assert np.array_equal(sampled_depth_buffer(pixels, heights, (7, 5)), expected)


GROUND = 20.0 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
SQUARE = np.array([[0, 1, 2], [0, 2, 3]])


def scene(roof_at=4.0):
    """A ground, and a roof of 4 x 4 above its middle."""
    return np.concatenate([GROUND, 0.1 * GROUND + [0, 0, roof_at]]), np.concatenate([SQUARE, SQUARE + 4])


def on_ground(x):
    points = np.column_stack([x, np.zeros((len(x), 2))])
    return points, np.tile([0.0, 0.0, 1.0], (len(x), 1))


@pytest.mark.parametrize("tilt", [0.0, 0.5])
def test_a_shadow_lies_where_the_lamp_is_hidden_and_its_border_is_soft(tilt):
    x = np.linspace(-8.0, 8.0, 65)
    hidden = Lamp(scene(), np.array([tilt, 0.0, 1.0]), 0.1).hidden(*on_ground(x), soft=0.5, rays=64)
    away = np.abs(x + 4.0 * tilt) - 2.0  # from the border, negative in the shadow
    assert hidden[away < -0.9].min() > 0.99
    assert hidden[away > 0.9].max() < 0.01
    np.testing.assert_allclose(hidden[np.abs(away) < 0.01], 0.5, atol=0.15)


def test_nothing_hides_a_lamp_from_a_ball_on_its_side():
    mesh = pv.Icosphere(radius=10.0, nsub=4)
    points = np.asarray(mesh.points, np.float64)
    towards = np.array([0.3, 0.2, 1.0])
    lamp = Lamp((points, np.asarray(mesh.regular_faces)), towards, 0.5)
    facing = points @ towards / 10.0 / np.linalg.norm(towards)
    for soft in (1.0, 3.0):
        assert lamp.hidden(points, points / 10.0, soft=soft, rays=16)[facing > 0.0].max() == 0.0
    assert lamp.hidden(points, points / 10.0, soft=1.0, rays=16)[facing < -0.6].min() > 0.99
    assert (lamp.hidden(points, points / 10.0, soft=1.0, rays=16, least=0.5)[facing < 0.49] == 1.0).all()


@pytest.mark.parametrize("away", [1.5, 30.0, 60.0])
def test_openness_before_a_long_wall_is_that_of_the_sky_above_it(away):
    """A wall of elevation e takes (1 - cos e) / 2 of what a level place gets."""
    wall = 90.0 * np.array([[0.0, -9, 0], [0, 9, 0], [0, 9, 1], [0, -9, 1]])
    mesh = np.concatenate([4.0 * GROUND, wall]), np.concatenate([SQUARE, SQUARE + 4])
    (found,) = openness(*on_ground(np.array([away])), mesh, step=0.5)
    assert found == pytest.approx(0.5 + 0.5 * away / np.hypot(away, 90.0), abs=2.0 / DIRECTIONS)  # a direction above


def test_a_convex_body_is_open():
    mesh = pv.Icosphere(radius=10.0, nsub=4)
    points = np.asarray(mesh.points, np.float64)
    assert openness(points, points / 10.0, (points, np.asarray(mesh.regular_faces)), step=0.5).min() > 0.97
