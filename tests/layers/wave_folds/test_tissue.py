"""Skin under the wave folds.

edges                 the distance to a border, and through a flap to its other side, in closed form
firmness              none along edges, whole away from them
"""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.layers.wave_folds.tissue import EDGE, edge_distance, firmness


@pytest.mark.parametrize("thick", [1.5, 2.5])
def test_a_flap_is_as_thin_as_it_is(thick):
    plate = pv.Box((-30, 30, -30, 30, 0, thick), level=60).triangulate().clean()
    face = fw.surface(plate)
    inside = (np.abs(face.points[:, :2]) < 20.0).all(axis=1)
    np.testing.assert_allclose(edge_distance(face)[inside], thick, rtol=1e-6)


def test_borders_are_edges_and_a_thick_block_has_none():
    sheet = fw.surface(pv.Plane(i_size=40, j_size=40, i_resolution=20, j_resolution=20).triangulate())
    away = 20.0 - np.abs(sheet.points[:, :2]).max(axis=1)
    found = edge_distance(sheet)
    near = away < EDGE[1] - 1e-9
    np.testing.assert_allclose(found[near], away[near], atol=1e-5)
    assert np.isinf(found[away > EDGE[1] + 1e-6]).all()
    block = fw.surface(pv.Box((-30, 30, -30, 30, 0, 30), level=20).triangulate().clean())
    middle = (np.abs(block.points[:, :2]) < 20.0).all(axis=1)
    assert np.isinf(edge_distance(block)[middle]).all()


def test_skin_along_the_lids_does_not_fold(face):
    apart, firm = edge_distance(face), firmness(face)
    assert not firm[apart <= EDGE[0]].any()
    forehead = np.linalg.norm(face.points - face.landmarks["forehead_mid"], axis=1).argmin()
    assert firm[forehead] > 0.8
