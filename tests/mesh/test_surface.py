"""Surfaces as arrays, and what of them goes along with a PolyData.

what                                  checked against
what a file tells                     the same after PyVista has turned the mesh, or taken some of its cells
numbers of pieces that make no sense  the mesh without them
"""

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.mesh import Piece, Surface, surface_in
from facewrinkle.mesh.surface import PIECES

TOLD = (Piece(4, "nose/skin", "größe.png"), Piece(7, "lips"))


@pytest.fixture
def told():
    sheet = pv.Plane(i_resolution=4, j_resolution=2).triangulate()
    sheet.point_data["mine"], sheet.field_data["who"] = np.arange(sheet.n_points), ["me"]
    shapes = np.random.default_rng(5).normal(size=(1, sheet.n_points, 3))
    return replace(Surface.of(sheet), pieces=TOLD, piece=np.arange(16) // 3 % 2, shapes=shapes)


def test_what_a_file_tells_survives_filters(told):
    turned = surface_in(told.to_polydata().rotate_x(30.0, inplace=False))
    np.testing.assert_allclose(turned.points, told.mesh.rotate_x(30.0, inplace=False).points, atol=1e-12)
    for name in ("triangles", "texture", "piece", "shapes"):
        np.testing.assert_array_equal(getattr(turned, name), getattr(told, name))
    np.testing.assert_array_equal(turned.point_data["mine"], np.arange(len(told.points)))
    assert (turned.pieces, list(turned.field_data), turned.active[0]) == (TOLD, ["who"], "TextureCoordinates")
    some = surface_in(told.to_polydata().extract_cells([3, 9]).extract_surface(algorithm=None))
    assert [some.pieces[number] for number in some.piece] == [TOLD[1], TOLD[1]]
    np.testing.assert_array_equal(some.shapes, told.only([3, 9]).shapes)
    assert set(told.mesh.array_names) == {"mine", "TextureCoordinates", "who"}


@pytest.mark.parametrize("wrong", [np.full(16, 2), np.full(16, np.nan), np.zeros((16, 2), int), np.array(["a"] * 16)])
def test_numbers_that_make_no_sense_are_left_out(told, wrong):
    mesh = told.to_polydata()
    mesh.cell_data[PIECES] = wrong
    found = surface_in(mesh)
    assert (found.pieces, found.piece.tolist()) == ((Piece(),), [0] * 16)
