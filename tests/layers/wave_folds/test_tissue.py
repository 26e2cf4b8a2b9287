"""Skin under the wave folds.

edges                 the distance to a border, and through a flap to its other side, in closed form
firmness              none along edges, whole away from them; little where skin hangs below the brow
"""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.layers.wave_folds.tissue import EDGE, HANGING, below_brows, edge_distance, firmness


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


def test_a_lowered_brow_hoods_the_lid_and_does_not_crumple_it(face):
    hanging = below_brows(face)
    whole = np.flatnonzero(hanging > 0.99)
    assert (firmness(face)[whole] <= 1.0 - HANGING).all()
    x, y = face.frame.axes[:2] @ face.points[hanging > 0.0].T
    for side in "lr":
        corners = [face.landmarks[f"eye_{side}_{which}"] for which in ("inner", "outer")]
        own = (x > face.frame.axes[0] @ face.frame.origin) == (side == "l")
        assert own.any()
        assert y[own].min() > min(face.frame.axes[1] @ corner for corner in corners)
        assert y[own].max() < face.frame.axes[1] @ face.landmarks[f"brow_{side}_mid"] + 4.0
    sim = fw.Simulation(face)
    sim.express("frowning")
    frame = sim.settle()
    rest, w = np.asarray(frame["rest"]), np.asarray(frame["W"])
    above = np.linalg.norm(rest - face.landmarks["glabella"], axis=1) < 15.0
    below = np.isin(sim.vertices.corners, whole).any(axis=1)
    assert below.sum() > 50
    assert np.ptp(w[below]) < 0.6 * np.ptp(w[above])
