"""The way of a tear: where it begins, steepest descent against the meridians of a sphere, and given paths."""

import numpy as np
import pytest
import pyvista as pv
from small_meshes import meridian
from synthetic_faces import head_with, skin_with

import facewrinkle as fw
from facewrinkle.tears import lid_point
from facewrinkle.tears import path as paths
from facewrinkle.tears.support_surface import support_surface


@pytest.mark.parametrize("azimuth", [0.1, 2.0, 4.5])
def test_water_runs_down_the_meridian_of_a_sphere(sphere, azimuth):
    way = paths.descent(support_surface(sphere), meridian(azimuth)[0], 0.5, 500.0)
    angle = np.arctan2(way[:, 2], way[:, 0])
    turned = np.remainder(angle - azimuth + np.pi, 2.0 * np.pi) - np.pi
    assert np.abs(turned)[: len(way) * 9 // 10].max() < 0.05
    assert (np.diff(way[:, 1]) < 0.0).all()
    assert way[-1, 1] < -49.5  # to where it is level
    assert paths.lengths(way)[-1] == pytest.approx(50.0 * (np.pi - 0.3), rel=0.04)


@pytest.mark.parametrize("side", ["l", "r"])
def test_descent_stays_on_the_surface_and_ends_with_it(face, side):
    support = support_surface(face)
    way = paths.descent(support, support.start(side, 1.0), 0.3, 300.0)
    _, near = support.nearest(way)
    assert np.linalg.norm(near - way, axis=1).max() < 1e-9
    assert (np.diff(way @ support.down) > 0.0).all()
    assert len(way) * 0.3 < 300.0  # it comes to an end


def test_path_through_points(face):
    marks = [face.landmarks[name] for name in ("malar_l", "mouth_l", "pogonion")]
    way = paths.through(support_surface(face), marks, 2.0)
    for mark in marks:
        assert np.linalg.norm(way - mark, axis=1).min() < 1.0


def test_paths_that_stay_apart_are_not_merged():
    path, other = (np.stack([np.full(9, x), -np.arange(9.0), np.zeros(9)], axis=1) for x in (0.0, 5.0))
    np.testing.assert_array_equal(paths.merged(path, other, 4.0), path)
    joined = paths.merged(path, other - [2.0, 0.0, 0.0], 4.0)
    np.testing.assert_array_equal(joined, other - [2.0, 0.0, 0.0])


# --- where it begins --------------------------------------------------------------------------------


def test_a_surface_has_no_lids(face):
    with pytest.raises(fw.errors.ParameterError, match="has no eyes"):
        lid_point(fw.surface(face.mesh), "l")


@pytest.mark.parametrize("side", ["l", "r"])
def test_lid_point_is_on_the_lower_lid(face, side):
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
    shut = fw.Face.from_landmarks(fw.mesh.to_polydata(points, triangles.astype(np.int32)), face.landmarks, 1.0)
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
    holed = fw.Face.from_landmarks(fw.mesh.to_polydata(points[used], numbers.reshape(-1, 3)), face.landmarks, 1.0)
    assert not holed.eyelid_openings
    for eye in holed.eyes:
        point = lid_point(holed, eye.side)
        _, nearest = holed.mesh.find_closest_cell(point, return_closest_point=True)
        assert np.linalg.norm(nearest - point) < 1e-3
        assert np.linalg.norm(point - eye.centre) < 40.0
