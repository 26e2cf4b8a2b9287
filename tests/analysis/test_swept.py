"""The volume between a mesh and the same mesh displaced, against spheres, closed meshes, and any order of things."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from analysis.swept import swept_areas, swept_volumes


@pytest.fixture(scope="module")
def ball():
    mesh = pv.Icosphere(radius=1.0, nsub=3)
    return np.asarray(mesh.points, np.float64), np.asarray(mesh.regular_faces)


def enclosed(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float((np.cross(a, b) * c).sum() / 6.0)


def test_between_two_closed_surfaces_lies_the_difference_of_their_volumes(ball):
    points, triangles = ball
    displacement = np.random.default_rng(0).normal(0.0, 0.1, points.shape)
    between = enclosed(points + displacement, triangles) - enclosed(points, triangles)
    assert swept_volumes(points, displacement, triangles).sum() == pytest.approx(between, abs=1e-13)


def test_a_prism_is_its_area_times_its_height():
    flat, triangles = np.array([[0.0, 0, 0], [3, 0, 0], [0, 2, 0]]), np.array([[0, 1, 2]])
    up = np.array([[0.0, 0, 1.0], [0, 0, 2.0], [0, 0, 6.0]])
    assert swept_volumes(flat, up, triangles) == pytest.approx([9.0])
    assert swept_volumes(flat, -up, triangles) == pytest.approx([-9.0])
    assert swept_volumes(flat, up, triangles[:, ::-1]) == pytest.approx([-9.0])
    np.testing.assert_allclose(swept_areas(flat, up - up[0], triangles)[0, 2], 3.0)


def test_sliding_within_the_plane_sweeps_nothing():
    flat, triangles = np.array([[0.0, 0, 0], [3, 0, 0], [0, 2, 0], [3, 2, 0]]), np.array([[0, 1, 2], [2, 1, 3]])
    slide = np.array([[1.0, 0.3, 0], [0.2, -1, 0], [0, 0, 0], [0.5, 0.5, 0]])
    assert swept_volumes(flat, slide, triangles) == pytest.approx([0.0, 0.0], abs=1e-15)


def test_turning_and_scaling_it_all(ball):
    points, triangles = ball
    displacement = np.random.default_rng(1).normal(0.0, 0.1, points.shape)
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    before = swept_volumes(points, displacement, triangles)
    np.testing.assert_allclose(
        swept_volumes(2.0 * points @ turn.T + 5.0, 2.0 * displacement @ turn.T, triangles), 8.0 * before, atol=1e-12
    )
