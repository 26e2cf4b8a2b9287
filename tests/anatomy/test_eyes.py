"""Eyeballs that turn, and lids that follow them."""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.anatomy.eyes import gaze_of
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
            pole = turned.surface().points[0] - eye.centre
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
    assert muscle.transformed(np.diag([-1.0, 1.0, 1.0])).side == "r"
    with pytest.raises(UnknownNameError):
        EyeMuscle("l", "sideways", 0.7)
    with pytest.raises(ParameterError):
        EyeMuscle("left", "up", 0.7)


def test_lids_follow_the_gaze_and_closing_takes_its_place(face):
    guides = face.guides
    close, up, down = (guides[f"{m}_l"] for m in ("orbicularis_oculi", "rectus_superior", "rectus_inferior"))
    upper = close.angles > np.radians(20.0)
    lower = close.angles < np.radians(-3.0)
    angle = face.muscles["rectus_inferior_l"].angle
    assert 0.6 * angle < down.angles[upper].max() <= 0.9 * angle + 1e-12
    assert 0.1 * angle < down.angles[lower].max() < 0.5 * down.angles[upper].max()
    assert -0.5 * angle < up.angles[upper].min() < -0.25 * angle
    skin = fw.Skin(face, time_step=0.1)
    states = []
    for rates in ({"orbicularis_oculi_l": 1.0}, {"orbicularis_oculi_l": 1.0, "rectus_inferior_l": 1.0}):
        skin.reset()
        skin.contract(rates)
        for _ in range(20):
            skin.step()
        states.append(skin.displacement.copy())
    np.testing.assert_allclose(*states, atol=1e-5)
