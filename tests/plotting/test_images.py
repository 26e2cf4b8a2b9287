"""Pictures as arrays: put together, written and read back, shown pixel by pixel."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import pyvista as pv

from facewrinkle.errors import OutputError, ParameterError
from facewrinkle.plotting import figure, save_picture, side_by_side, stacked


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
    few = save_picture(np.where(image > 127, 255, 0).astype(np.uint8), tmp_path / "b.png", colours=256)
    np.testing.assert_array_equal(pv.read_texture(few).to_array()[..., :3] > 127, image > 127)


def test_pictures_that_cannot_be_written(tmp_path):
    image = np.zeros((4, 4, 3), np.uint8)
    (tmp_path / "file").touch()
    for name in ("x" * 300 + ".png", "file/x.png", "null\0.png"):
        with pytest.raises(OutputError, match="cannot be (written|an output folder)"):
            save_picture(image, tmp_path / name)
    with pytest.raises(OutputError, match=r"must end in \.png, received 'x\.jpg'"):
        save_picture(image, tmp_path / "x.jpg")
    with pytest.raises(ParameterError, match="colours must lie in"):
        save_picture(image, tmp_path / "x.png", colours=257)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_figure_shows_a_picture_pixel_by_pixel():
    image = np.random.default_rng(0).integers(0, 256, (37, 53, 3), np.uint8)
    shown = figure(image)
    try:
        shown.canvas.draw()
        assert np.array_equal(np.asarray(shown.canvas.buffer_rgba())[:, :, :3], image)
    finally:
        plt.close(shown)
