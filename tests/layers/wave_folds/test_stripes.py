"""Lines on the vertices of the split skin.

what                  checked against
waves between them    a plane wave in closed form, with vectors of either sign, at any level
smoothing             the decay of a cosine, in closed form
"""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.geometry.refinement import RedGreenForest
from facewrinkle.layers.base import SurfacePoints
from facewrinkle.layers.wave_folds.stripes import Ground, Smoothing, Stripes

K = np.array([0.3, 0.8, 0.0])


@pytest.fixture(scope="module")
def sheet():
    return fw.surface(pv.Plane(i_size=20, j_size=16, i_resolution=20, j_resolution=16).triangulate())


def everywhere(face):
    return np.ones(len(face.triangles), bool)


@pytest.mark.parametrize("level", [0, 1, 3])
def test_between_the_vertices_a_plane_wave_goes_on(sheet, level):
    ground = Ground(sheet, everywhere(sheet), level)
    places = ground.points
    sign = np.where(np.random.default_rng(3).random(len(places)) < 0.5, -1.0, 1.0)
    waves = sign[:, None] * K
    stripes = Stripes(ground, waves, (waves * places).sum(axis=1), np.ones(len(places)), np.ones(len(sheet.points)))
    forest = RedGreenForest(sheet.triangles)
    for _ in range(4):
        forest.split(np.arange(0, len(forest.triangles), 3))
    points = SurfacePoints.of_forest(forest, sheet.points, np.tile([0.0, 0.0, 1.0], (len(sheet.points), 1)))
    theta, strength, wave = stripes.at(points, np.arange(len(points.points)))
    same = np.sign(wave @ K)
    np.testing.assert_allclose(np.exp(1j * theta * same), np.exp(1j * (points.points @ K)), atol=1e-9)
    np.testing.assert_allclose(strength, 1.0, atol=1e-12)
    np.testing.assert_allclose(same[:, None] * wave, np.tile(K, (len(wave), 1)), atol=1e-12)


def test_a_cosine_decays_as_diffusion_says(sheet):
    ground = Ground(sheet, everywhere(sheet), 2)
    spread = np.broadcast_to(np.diag([4.0, 0.5, 1.0]), (len(ground.triangles), 3, 3))
    smooth = Smoothing(ground).over(spread)
    for axis, length, variance in ((0, 20.0, 4.0), (1, 16.0, 0.5)):
        k = 2.0 * np.pi / length  # level at the borders, where nothing flows
        mode = np.cos(k * (ground.points[:, axis] + 0.5 * length))
        np.testing.assert_allclose(smooth(mode), mode / (1.0 + variance * k**2), atol=5e-3)
    np.testing.assert_allclose(smooth(np.ones(len(mode))), 1.0, rtol=1e-12)
