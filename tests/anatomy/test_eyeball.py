"""Eyeballs that turn, and the muscles that turn them."""

from __future__ import annotations

import numpy as np
import pytest
from eyelids_of_faces import ball_of

from facewrinkle.anatomy.eyeball import gaze_of
from facewrinkle.anatomy.muscles import EyeMuscle
from facewrinkle.errors import ParameterError, UnknownNameError


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
