"""What a window shows, read without its background and laid over it, is what it would have shown."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.plotting.images import reduced
from facewrinkle.plotting.window import composed, rendered


@pytest.mark.parametrize("factor", [1, 2, 3])
def test_composed_by_the_formula(factor):
    random = np.random.default_rng(3)
    alpha = random.integers(0, 256, (12 * factor, 7 * factor, 1))
    pixels = np.concatenate([random.integers(0, alpha + 1, (*alpha.shape[:2], 3)), alpha], axis=2).astype(np.uint8)
    bottom, top = np.array([0.1, 0.5, 1.0]), np.array([0.9, 0.5, 0.0])
    up = (11.5 - np.arange(12.0))[:, None, None] / 12.0
    background = 255.0 * (bottom + up * (top - bottom))
    mean = pixels[::-1].reshape(12, factor, 7, factor, 4).mean(axis=(1, 3))
    expected = mean[..., :3] + (1.0 - mean[..., 3:] / 255.0) * background
    found = composed(pixels, tuple(bottom), tuple(top), factor)
    assert found.dtype == np.uint8
    assert np.abs(found - expected).max() <= 0.5 + 1.0 / factor**2  # the share of the background is rounded down


def test_a_closed_plotter_shows_nothing(plotter):
    plotter.close()
    with pytest.raises(RuntimeError, match="closed"):
        rendered(plotter)


@pytest.fixture
def plotter():
    plotter = pv.Plotter(off_screen=True, window_size=(80, 60))
    plotter.disable_anti_aliasing()
    plotter.renderer.SetUseOIT(False)
    plotter.add_mesh(pv.Sphere(), color="orange")
    plotter.add_mesh(pv.Plane(center=(0.3, 0.0, 1.0)), color="white", opacity=0.4)
    plotter.view_xy()
    yield plotter
    plotter.close()


@pytest.mark.parametrize("top", ["black", None])
def test_as_the_window_itself_shows_it(plotter, top):
    plotter.set_background("steelblue", top=top)
    shown = np.array(plotter.screenshot(None, return_img=True))
    found = rendered(plotter)
    assert len(np.unique(shown.reshape(-1, 3), axis=0)) > 100
    assert np.abs(shown.astype(int) - found).max() <= 2  # VTK dithers gradients
    assert np.abs(reduced(shown, 2).astype(int) - rendered(plotter, 2)).max() <= 2
    plotter.render()
    np.testing.assert_array_equal(plotter.screenshot(None, return_img=True), shown)  # the background is as it was
