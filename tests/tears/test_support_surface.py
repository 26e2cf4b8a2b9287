"""Where tears begin, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.tears import lid_point


def test_a_side_that_is_none(face):
    with pytest.raises(UnknownNameError, match="unknown side 'middle'"):
        lid_point(face, "middle")


def test_a_surface_has_no_lids(face):
    with pytest.raises(ParameterError, match="has no eyes"):
        lid_point(fw.surface(face.mesh), "l")


@pytest.mark.parametrize("side", ["l", "r"])
def test_shut_lids_meet_below_the_line_between_the_corners(real_face, side):
    shut = real_face("mediapipe_canonical_face_model")
    inner, outer = (shut.landmarks[f"eye_{side}_{end}"] for end in ("inner", "outer"))
    width, (_, up, ahead) = np.linalg.norm(outer - inner), shut.frame.axes
    corners = np.array([lid_point(shut, side, along) for along in (0.0, 1.0)])
    middle = lid_point(shut, side) - 0.5 * (inner + outer)
    assert (np.abs((corners - [inner, outer]) @ up) < 0.02 * width).all()
    assert -0.2 < middle @ up / width < -0.08
    assert middle @ ahead > 0.0  # lids lie on the ball
    assert shut.mesh.find_closest_cell(lid_point(shut, side), return_closest_point=True)[1] == pytest.approx(
        lid_point(shut, side), abs=1e-3 * width
    )


def test_paint_of_one_height_leads_nowhere():
    flat = pv.Plane(direction=(0, 1, 0), i_size=100, j_size=100, i_resolution=4, j_resolution=4).triangulate()
    with pytest.raises(ParameterError, match="one height; a path leads downwards"):
        fw.SheddingTear(flat, weight=np.ones(flat.n_points), down=(0, -1, 0))
