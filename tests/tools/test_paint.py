"""The parts of the painter of the built-in head.

what                            checked against
sky that is left open           a ball, which hides none of it, and the bottom of a cylinder, in closed form
averages over neighbors        constants, which stay, and a sum of squares, which falls
noise                           its variance, grains and seeds
"""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.geometry.normals import vertex_normals
from tools.build_head.paint import averaged, noise, openness, shaded


def test_a_ball_sees_the_whole_sky():
    ball = pv.Icosphere(radius=60.0, nsub=5)
    points, triangles = np.asarray(ball.points, dtype=np.float64), ball.regular_faces
    assert openness(points, vertex_normals(points, triangles), points).min() > 0.99


@pytest.mark.parametrize("height", [30.0, 60.0])
def test_the_bottom_of_a_cylinder_sees_the_sky_through_its_top(height):
    """Weighted by slope, a share of sin^2 of the angle between the axis and the edge of the top is open."""
    radius = 30.0
    turn, up = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 400), np.linspace(0.0, height, 100))
    wall = np.stack([radius * np.cos(turn.ravel()), radius * np.sin(turn.ravel()), up.ravel()], axis=1)
    sky = openness(np.zeros((1, 3)), np.array([[0.0, 0, 1]]), wall)[0]
    assert sky == pytest.approx(radius**2 / (radius**2 + height**2), abs=0.1)


def test_averages_keep_constants_and_smooth():
    ball = pv.Icosphere(radius=1.0, nsub=3)
    triangles, values = ball.regular_faces, np.random.default_rng(0).normal(size=ball.n_points)
    np.testing.assert_allclose(averaged(np.ones(ball.n_points), triangles, 3), 1.0, atol=1e-12)
    once, twice = averaged(values, triangles, 1), averaged(values, triangles, 2)
    assert (values**2).sum() > 2.0 * (once**2).sum() > 2.0 * (twice**2).sum()
    np.testing.assert_allclose(averaged(once, triangles, 1), twice, atol=1e-12)


def test_noise_has_grains_of_its_size():
    places = np.random.default_rng(1).uniform(-100.0, 100.0, (4000, 3))
    values = noise(places, 5.0, 1)
    assert values.std() == pytest.approx(1.0, abs=0.25)
    assert np.array_equal(values, noise(places, 5.0, 1))
    assert abs(np.corrcoef(values, noise(places, 5.0, 2))[0, 1]) < 0.1
    near, far = (np.corrcoef(values, noise(places + np.array([d, 0.0, 0.0]), 5.0, 1))[0, 1] for d in (1.0, 20.0))
    assert near > 0.9
    assert abs(far) < 0.1


def test_light_that_is_kept_out_leaves_red():
    skin = np.tile([200.0, 150.0, 130.0], (3, 1))
    lit, half, dark = shaded(skin, np.array([1.0, 0.5, 0.0]))
    assert np.array_equal(lit, skin[0])
    assert (dark < half).all()
    assert dark[0] / dark[2] > lit[0] / lit[2]
