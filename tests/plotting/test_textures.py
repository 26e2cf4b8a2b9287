"""Textures are reduced to what a picture shows, and no further."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.plotting.images import texels_per_pixel, texture


@pytest.mark.parametrize(
    "texels, side", [(0.1, 256), (1.0, 256), (1.4, 256), (1.5, 128), (2.0, 128), (7.9, 32), (1e9, 1)]
)
def test_a_texel_becomes_about_as_wide_as_a_pixel(texels, side):
    assert texture(np.zeros((256, 256, 3), np.uint8), texels).dimensions == (side, side)


def test_reduction_takes_means():
    image = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    seen = texture(image, 4.0).to_array()
    expected = image.reshape(16, 4, 16, 4, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(seen, expected, rtol=0.0, atol=0.5)


def test_texels_are_counted_on_most_of_the_surface():
    """A plane 2 by 1, the texture over it stretched by 2 on a narrow strip: the rest decides."""
    sheet = pv.Plane(i_size=2.0, j_size=1.0, i_resolution=20).triangulate()
    place = np.asarray(sheet.points)[:, :2] + [1.0, 0.5]
    place[:, 0] = np.where(place[:, 0] < 0.2, 2.0 * place[:, 0], place[:, 0] + 0.2) / 2.2
    corners = place[sheet.regular_faces]
    found = texels_per_pixel(sheet, corners, np.zeros((500, 1100, 3)), pixel=0.01)
    assert found == pytest.approx(5.0)  # 1100 texels over 2.2, 500 over 1


def test_a_surface_without_area_takes_any_texture():
    flat = pv.PolyData.from_regular_faces(np.zeros((3, 3)), [[0, 1, 2]])
    assert texels_per_pixel(flat, np.zeros((1, 3, 2)), np.zeros((8, 8, 3)), pixel=1.0) == 1.0
