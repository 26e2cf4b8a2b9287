"""Change of curvature against closed forms.

what                              checked against
mean curvature                    that of a sphere
smoothed change of a bump         a Gaussian convolved with a Gaussian, whose Laplacian is known
correlation and size              fields of known correlation
"""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from analysis.motion import captured
from analysis.relief import SMOOTHED, change_of_curvature, correlation, mean_curvature


def test_a_sphere_has_the_curvature_of_its_radius():
    ball = pv.Icosphere(radius=40.0, nsub=4)
    curvature = mean_curvature(np.asarray(ball.points, float), ball.regular_faces.astype(np.int32))
    assert curvature.mean() == pytest.approx(1.0 / 40.0, rel=1e-3)
    np.testing.assert_allclose(curvature[12:], 1.0 / 40.0, rtol=0.02)  # the first twelve have five neighbors


def test_a_flat_bump_has_the_smoothed_laplacian_of_a_gaussian():
    """h exp(-r^2 / 2 s^2), smoothed: h s^2 / v exp(-r^2 / 2 v), v the sum of variances; curvature: -1/2 its Laplacian.

    The Gaussian that smooths ends at 2.5 of its width: its variance is less by the closed form for a disc.
    """
    sheet = pv.Plane(i_size=60.0, j_size=60.0, i_resolution=80, j_resolution=80).triangulate()
    points, triangles = np.asarray(sheet.points, float), sheet.regular_faces.astype(np.int32)
    square = (points[:, :2] ** 2).sum(axis=1)
    end = 0.5 * 2.5**2
    height, s, v = 0.05, 6.0, 6.0**2 + SMOOTHED**2 * (1.0 - end / (np.exp(end) - 1.0))
    bump = np.zeros_like(points)
    bump[:, 2] = height * np.exp(-0.5 * square / s**2)
    exact = height * s**2 / v**2 * (1.0 - 0.5 * square / v) * np.exp(-0.5 * square / v)
    inner = square < 20.0**2
    found = change_of_curvature(points, triangles)(bump)
    np.testing.assert_allclose(found[inner], exact[inner], atol=0.02 * exact.max())


def test_fields_of_known_correlation():
    rng = np.random.default_rng(0)
    a, b = np.linalg.qr(rng.normal(size=(200, 3)) * [0, 1, 1] + [1, 0, 0])[0][:, 1:].T  # square to each other and to 1
    assert correlation(3.0 * (0.6 * a + 0.8 * b) + 5.0, a, np.ones(200)) == pytest.approx((0.6, 3.0))
    doubled = np.concatenate([a, a[:50]]), np.concatenate([b, b[:50]])
    weight = np.ones(200) + (np.arange(200) < 50)
    assert correlation(a, b, weight) == pytest.approx(correlation(*doubled, np.ones(250)))


def test_without_captured_faces_nothing_is_done(tmp_path, capsys):
    assert captured(tmp_path / "no.obj", shapes=tmp_path / "no.npz") is None
    assert "no.obj" in capsys.readouterr().out
