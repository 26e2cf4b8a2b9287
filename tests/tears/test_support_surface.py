"""Where tears begin, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from synthetic_faces import head_with, skin_with

import facewrinkle as fw
from facewrinkle.anatomy.face import Face
from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.mesh import to_polydata
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
@pytest.mark.parametrize("stem", [None, "mediapipe_canonical_face_model"])
def test_shut_lids_meet_below_the_line_between_the_corners(real_face, stem, side):
    shut = head_with("shut") if stem is None else real_face(stem)
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


def test_tears_come_out_on_shut_lids(face):
    """On the skin before the eye, not on a ball that is in one mesh with it."""
    points, triangles = skin_with("shut")
    balls = [pv.Sphere(radius=11.5, center=eye.centre) for eye in face.eyes]
    for ball in balls:
        triangles = np.vstack([triangles, len(points) + ball.regular_faces])
        points = np.vstack([points, ball.points])
    shut = Face.from_landmarks(to_polydata(points, triangles.astype(np.int32)), face.landmarks, 1.0)
    for eye, ball in zip(face.eyes, balls, strict=True):
        inner, outer = (face.landmarks[f"eye_{eye.side}_{end}"] for end in ("inner", "outer"))
        before = 0
        for place in np.linspace(0.2, 0.8, 7):
            point = lid_point(shut, eye.side, place)
            before += len(ball.ray_trace(point, point - 30.0 * eye.gaze)[0]) > 0
            assert not len(shut.mesh.ray_trace(point + 0.01 * eye.gaze, point + 50.0 * eye.gaze)[0])
            way = (point - inner) @ (outer - inner) / ((outer - inner) @ (outer - inner))
            assert way == pytest.approx(place, abs=0.1)
        assert before > 3


def test_where_no_skin_is_before_an_eye_the_nearest_is_taken(face):
    """Of a mask with a hole about each eye that is too wide for lids."""
    points, triangles = skin_with("shut")
    away = np.min([np.linalg.norm(points[triangles].mean(axis=1) - eye.centre, axis=1) for eye in face.eyes], axis=0)
    used, numbers = np.unique(triangles[away > 24.0], return_inverse=True)
    holed = Face.from_landmarks(to_polydata(points[used], numbers.reshape(-1, 3)), face.landmarks, 1.0)
    assert not holed.eyelid_openings
    for eye in holed.eyes:
        point = lid_point(holed, eye.side)
        _, nearest = holed.mesh.find_closest_cell(point, return_closest_point=True)
        assert np.linalg.norm(nearest - point) < 1e-3
        assert np.linalg.norm(point - eye.centre) < 40.0
