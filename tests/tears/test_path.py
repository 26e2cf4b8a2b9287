"""Paths: steepest descent against the meridians of a sphere, and given paths."""

import numpy as np
import pytest
from spheres import meridian

from facewrinkle.tears import path as paths
from facewrinkle.tears.support_surface import support_surface


@pytest.mark.parametrize("azimuth", [0.1, 2.0, 4.5])
def test_water_runs_down_the_meridian_of_a_sphere(sphere, azimuth):
    start = meridian(azimuth)[0]
    way = paths.descent(support_surface(sphere), start, 0.5, 500.0)
    angle = np.arctan2(way[:, 2], way[:, 0])
    turned = np.remainder(angle - azimuth + np.pi, 2.0 * np.pi) - np.pi
    assert np.abs(turned)[: len(way) * 9 // 10].max() < 0.05
    assert (np.diff(way[:, 1]) < 0.0).all()
    assert way[-1, 1] < -49.5  # to where it is level
    assert paths.lengths(way)[-1] == pytest.approx(50.0 * (np.pi - 0.3), rel=0.04)


def test_descent_stays_on_the_surface_and_ends_with_it(face):
    support = support_surface(face)
    for side in "lr":
        way = paths.descent(support, support.start(side, 1.0), 0.3, 300.0)
        _, near = support.nearest(way)
        assert np.linalg.norm(near - way, axis=1).max() < 1e-9
        assert (np.diff(way @ support.down) > 0.0).all()
        assert len(way) * 0.3 < 300.0  # it comes to an end


def test_path_through_points(face):
    marks = [face.landmarks[name] for name in ("malar_l", "mouth_l", "pogonion")]
    way = paths.through(support_surface(face), marks, 2.0)
    for mark in marks:
        assert np.linalg.norm(way - mark, axis=1).min() < 1.0


def test_paths_that_stay_apart_are_not_merged():
    path, other = (np.stack([np.full(9, x), -np.arange(9.0), np.zeros(9)], axis=1) for x in (0.0, 5.0))
    np.testing.assert_array_equal(paths.merged(path, other, 4.0), path)
    joined = paths.merged(path, other - [2.0, 0.0, 0.0], 4.0)
    np.testing.assert_array_equal(joined, other - [2.0, 0.0, 0.0])
