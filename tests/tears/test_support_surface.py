"""Where tears begin, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.tears import lid_point


def test_a_side_that_is_none(face):
    with pytest.raises(UnknownNameError, match="unknown side 'middle'"):
        lid_point(face, "middle")


def test_a_surface_has_no_lids(face):
    with pytest.raises(ParameterError, match="has no eyes"):
        lid_point(fw.surface(face.mesh), "l")


def test_lid_point_is_on_the_lower_lid(face):
    for side in "lr":
        inner, middle, outer = (lid_point(face, side, along) for along in (0.0, 0.5, 1.0))
        assert middle[1] < min(inner[1], outer[1]) < face.landmarks[f"eye_{side}_centre"][1] + 5.0
        _, near = face.mesh.find_closest_cell(middle, return_closest_point=True)
        assert np.linalg.norm(near - middle) < 0.5


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
