"""Pictures as arrays: put together, written and read back, shown pixel by pixel."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import pyvista as pv

from facewrinkle.errors import OutputError
from facewrinkle.plotting import figure, save_picture, side_by_side, stacked
from facewrinkle.plotting.images import composed, reduced, rendered


def test_pictures_side_by_side_and_stacked():
    tall, wide = (np.full(shape, value, np.uint8) for shape, value in (((4, 2, 3), 10), ((4, 6, 3), 20)))
    row = side_by_side([tall, wide], gap=3)
    assert row.shape == (4, 11, 3)
    assert (row[:, :2] == 10).all()
    assert (row[:, 2:5] == 255).all()
    assert (row[:, 5:] == 20).all()
    column = stacked([tall, tall], gap=1)
    assert column.shape == (9, 2, 3)
    assert (column[4] == 255).all()


def test_saved_pictures_are_read_back(tmp_path):
    image = np.random.default_rng(3).integers(0, 256, (20, 30, 3)).astype(np.uint8)
    np.testing.assert_array_equal(pv.read_texture(save_picture(image, tmp_path / "a.png")).to_array(), image)
    smooth = np.add.outer(np.arange(40), np.arange(60))[..., None] + np.array([0, 60, 120])
    small = pv.read_texture(save_picture(smooth.astype(np.uint8), tmp_path / "b.JPG")).to_array()
    assert np.abs(small - smooth).max() <= 3


def test_pictures_that_cannot_be_written(tmp_path):
    image = np.zeros((4, 4, 3), np.uint8)
    (tmp_path / "file").touch()
    for name in ("x" * 300 + ".png", "file/x.png", "null\0.png"):
        with pytest.raises(OutputError, match="cannot be (written|an output folder)"):
            save_picture(image, tmp_path / name)
    with pytest.raises(OutputError, match=r"must end in \.png or \.jpg or \.jpeg, received 'x\.bmp'"):
        save_picture(image, tmp_path / "x.bmp")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_figure_shows_a_picture_pixel_by_pixel():
    image = np.random.default_rng(0).integers(0, 256, (37, 53, 3), np.uint8)
    shown = figure(image)
    try:
        shown.canvas.draw()
        assert np.array_equal(np.asarray(shown.canvas.buffer_rgba())[:, :, :3], image)
    finally:
        plt.close(shown)


def test_titles_stand_below_the_columns_of_a_figure():
    shown = figure(np.zeros((40, 300, 3), np.uint8), ["a", "b", "c"])
    try:
        shown.canvas.draw()
        pixels = np.asarray(shown.canvas.buffer_rgba())[:, :, :3]
        assert pixels[:40].max() == 0  # the picture keeps its pixels
        dark = np.nonzero((pixels[40:] < 128).any(axis=(0, 2)))[0]
        assert sorted({int(column) // 100 for column in dark}) == [0, 1, 2]
        assert [np.mean(dark[dark // 100 == k]) for k in range(3)] == pytest.approx([50, 150, 250], abs=3)
    finally:
        plt.close(shown)


# --- what a window shows --------------------------------------------------------------------------


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
