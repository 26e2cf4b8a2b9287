"""Eyeballs lie where the lids do, turn, and are turned by muscles; an eye that is not open lies behind its skin."""

import numpy as np
import pytest
import pyvista as pv
from eyelids_of_faces import ball_of, filled, margins_of
from synthetic_faces import head_with, ring, skin_with

import facewrinkle as fw
from facewrinkle.anatomy import EyeMuscle, LidMuscle, gaze_of
from facewrinkle.anatomy.eyelid_opening import place_eyeballs
from facewrinkle.appearance.hair import Lashes
from facewrinkle.errors import ParameterError, UnknownNameError


@pytest.mark.parametrize("shift", [(0.0, 0.0, 3.0), (0.0, 0.0, -3.0), (1.0, 0.5, 2.0)])
def test_the_lids_tell_how_deep_an_eye_lies(face, shift):
    marks = dict(face.landmarks)
    for eye, sign in zip(face.eyes, (1.0, -1.0), strict=True):
        marks[f"eye_{eye.side}_centre"] = eye.centre + np.array(shift) * [sign, 1.0, 1.0]
    names = ("eye_l_centre", "eye_r_centre")
    found = place_eyeballs(marks, face.frame, face.points, face.triangles, face.boundary_loops, names)
    given = place_eyeballs(marks, face.frame, face.points, face.triangles, face.boundary_loops)
    for eye, there, kept in zip(face.eyes, found, given, strict=True):
        assert np.linalg.norm(there.centre - eye.centre) < 0.5 * np.linalg.norm(shift)
        assert there.radius == pytest.approx(eye.radius, rel=0.1)
        margin = face.points[np.concatenate(margins_of(face, eye.side))]
        assert np.linalg.norm(margin - there.centre, axis=1).min() > 0.95 * there.radius
        if shift[2] > 0.0:  # what is given is kept, unless the ball would be far from the lids
            np.testing.assert_array_equal(kept.centre, marks[f"eye_{eye.side}_centre"])
        else:
            np.testing.assert_array_equal(kept.centre, there.centre)


@pytest.mark.parametrize("lids", ["thick", "sockets"])
def test_balls_touch_the_back_edges_of_thick_lids(lids):
    face, back = head_with(lids), ring(lids, 1)
    for eye in face.eyes:
        away = np.linalg.norm(face.points[back] - eye.centre, axis=1)
        away = np.sort(away[away < 2.0 * eye.radius])
        room = away[len(away) // 4]  # but for some vertices, as LID_QUANTILE allows
        assert 0.93 * room < eye.radius < away[0]


def test_an_eye_with_no_skin_before_it_stays(face):
    """Of a mask that ends below its eyes."""
    low = face.points[:, 1] < face.landmarks["nose_tip"][1]
    used, numbers = np.unique(face.triangles[low[face.triangles].all(axis=1)], return_inverse=True)
    mask = face.points[used], numbers.reshape(-1, 3)
    for eye in place_eyeballs(face.landmarks, face.frame, *mask, fw.geometry.boundary_loops(mask[1])):
        np.testing.assert_array_equal(eye.centre, face.landmarks[f"eye_{eye.side}_centre"])


@pytest.mark.parametrize("shift", [0.0, 6.0])
def test_balls_lie_behind_lids_that_are_shut(face, shift):
    """Also where the landmarks of their centres are too far in front."""
    marks = dict(face.landmarks)
    for side in "lr":
        marks[f"eye_{side}_centre"] = marks[f"eye_{side}_centre"] + shift * face.frame.axes[2]
    points, triangles = skin_with("shut")
    for eye in place_eyeballs(marks, face.frame, points, triangles, fw.geometry.boundary_loops(triangles)):
        offset = points - eye.centre
        assert np.linalg.norm(offset[offset @ eye.gaze > 0.0], axis=1).min() > eye.radius
        assert eye.centre == pytest.approx(face.landmarks[f"eye_{eye.side}_centre"], abs=1.5)


def test_an_eye_that_is_not_open_lies_behind_its_skin(face):
    points, triangles = filled(face)
    with pytest.warns(fw.FaceWrinkleWarning, match="no opening in front of both eyes"):
        closed = fw.fit_face(pv.PolyData.from_regular_faces(points, triangles), face.landmarks, units="mm")
    assert not any(isinstance(closed.muscles[name], LidMuscle | EyeMuscle) for name in closed.joint_weights)
    assert not any(name.startswith("orbicularis_oculi") for name in closed.joint_weights)
    for eye in closed.eyes:
        assert eye.side not in closed.eyelid_openings
        hits = closed.mesh.ray_trace(eye.centre, eye.centre + 100.0 * eye.gaze)[0]
        assert np.linalg.norm(hits - eye.centre, axis=1).min() >= eye.radius
        assert not Lashes(eye, closed).roots
    with fw.plotting.Scene(closed, fw.plotting.Style(size=(64, 64))) as scene:
        scene.show(closed.mesh)
        assert not scene.drawn_parts["eyes"]
        assert not {"lashes_l", "lashes_r"} & scene.drawn_parts["hair"]


# --- turns ------------------------------------------------------------------------------------------------------------


def test_turns_and_directions_are_inverse(face):
    rng = np.random.default_rng(4)
    for eye in face.eyes:
        for turns in rng.uniform(-0.7, 0.7, (20, 2)):
            direction = eye.turned(*turns)
            assert np.linalg.norm(direction) == pytest.approx(1.0)
            np.testing.assert_allclose(eye.turn_to(3.0 * direction), turns, atol=1e-12)
            turned = eye.looking(direction)
            assert abs(turned.up @ direction) < 1e-12
            pole = ball_of(turned).points[0] - eye.centre
            np.testing.assert_allclose(pole / np.linalg.norm(pole), direction, atol=1e-6)


def test_both_eyes_converge_on_a_point(face):
    target = np.array([40.0, 10.0, 350.0])
    for eye in face.eyes:
        way = np.cross(eye.turned(*gaze_of(eye, at=target)), target - eye.centre)
        assert np.linalg.norm(way) < 1e-9 * np.linalg.norm(target)


def test_yaw_is_to_the_left_of_the_subject(face):
    left, up, _ = face.frame.axes
    for eye in face.eyes:
        assert eye.turned(*gaze_of(eye, yaw=20.0)) @ left == pytest.approx(np.sin(np.radians(20.0)), abs=1e-3)
        assert eye.turned(*gaze_of(eye, pitch=-15.0)) @ up == pytest.approx(-np.sin(np.radians(15.0)), abs=1e-3)


def test_bad_places_to_look_at(face):
    eye = face.eyes[0]
    for what in (
        {"at": (0, 1)},
        {"at": "there"},
        {"at": eye.centre},
        {"yaw": 10.0, "at": (0, 0, 300)},
        {"yaw": "left"},
    ):
        with pytest.raises(ParameterError):
            gaze_of(eye, **what)


def test_muscles_of_the_eye():
    muscle = EyeMuscle("l", "outwards", 0.7)
    assert muscle.rate(0.35, -0.2) == pytest.approx(0.5)
    assert muscle.rate(-0.5, 0.0) == 0.0
    with pytest.raises(ParameterError, match="40.1 degrees at most"):
        muscle.rate(0.8, 0.0)
    with pytest.raises(UnknownNameError):
        EyeMuscle("l", "sideways", 0.7)
    with pytest.raises(ParameterError):
        EyeMuscle("left", "up", 0.7)
