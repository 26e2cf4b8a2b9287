"""Depth buffers.

what                            checked against
triangles over a grid           planes and a sphere in closed form, both windings
what lies in front or behind    left out where a span says so
samples of pixels               the largest of each, by a loop
"""

from __future__ import annotations

import numpy as np
import pyvista as pv

from facewrinkle.geometry.depth_buffer import depth_buffer, sampled_depth_buffer

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
    depth = depth_buffer(points, np.array([[0, 1, 2], [3, 4, 5]]), LOW, STEP, SHAPE)
    assert np.isneginf(depth).all()


def test_samples_of_pixels():
    rng = np.random.default_rng(0)
    pixels, heights = rng.integers(0, [7, 5], (60, 2)), rng.normal(size=60)
    expected = np.full((7, 5), -np.inf)
    for (i, j), height in zip(pixels, heights, strict=True):
        expected[i, j] = max(expected[i, j], height)
    assert np.array_equal(sampled_depth_buffer(pixels, heights, (7, 5)), expected)
