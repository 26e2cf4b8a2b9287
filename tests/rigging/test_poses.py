"""Poses: muscles and modelled movements together, and ways of lids that clear the eyes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from facewrinkle.rigging.poses import Posing, _closest, _lifts, share_of_side
from facewrinkle.rigging.shapes import ARKIT
from tools.trials.oracle import DEEPEST, Oracle

FINITE = st.floats(-3.0, 3.0, allow_nan=False, width=32)


@pytest.fixture(scope="module")
def posing(face):
    return Posing(face)


@pytest.fixture(scope="module")
def oracle(face):
    return Oracle(face)


@given(arrays.arrays(float, (8, 3), elements=FINITE), arrays.arrays(float, (8, 3), elements=FINITE))
def test_the_least_distance_of_a_way_is_that_of_many_points_on_it(start, end):
    t = np.linspace(0.0, 1.0, 2001)[:, None, None]
    sampled = np.linalg.norm(start + t * (end - start), axis=2).min(axis=0)
    step = np.linalg.norm(end - start, axis=1) / 2000.0
    found = _closest(start, end)
    assert (found <= sampled + 1e-9).all()
    assert (found >= sampled - step - 1e-9).all()


def test_lifted_ways_touch_the_floor():
    angle = np.deg2rad([30.0, 50.0, 65.0])
    start = np.stack([np.zeros(3), np.zeros(3), np.ones(3)], axis=1) * 12.2
    end = 12.2 * np.stack([np.zeros(3), -np.sin(angle), np.cos(angle)], axis=1)
    floor = np.full(3, 12.0)
    lifts = _lifts(start, end, floor)
    assert (np.diff(lifts) > 0.0).all()
    np.testing.assert_allclose(_closest(start, end * (1.0 + lifts[:, None])), floor, atol=1e-9)


@pytest.mark.parametrize("name", ["eyeBlinkLeft", "eyeLookDownLeft", "eyeSquintLeft", "eyeLookInLeft"])
def test_lids_clear_the_balls_at_all_weights(face, posing, name):
    pose = posing.at({name: (ARKIT[name], 1.0)})
    for eye in face.eyes:
        centre, radius = eye.centre * face.unit, eye.radius * face.unit
        rest = np.linalg.norm(posing.rest - centre, axis=1)
        outside = rest >= radius
        for weight in (0.25, 0.5, 0.75, 1.0):
            moved = (1.0 - weight) * posing.rest + weight * pose.base
            assert (np.linalg.norm(moved - centre, axis=1)[outside] > radius - 0.1).all()


def test_a_shape_of_one_side_asks_for_the_muscles_of_that_side(face, posing):
    pose = posing.at({"mouthSmileLeft": (ARKIT["mouthSmileLeft"], 0.5)})
    named = dict(zip(face.muscles, pose.rates, strict=True))
    assert named["zygomaticus_major_l"] == 0.5
    assert named["zygomaticus_major_r"] == 0.0
    np.testing.assert_array_equal(pose.mandible, np.eye(4))


def test_shares_of_both_sides_add_up_to_one(face):
    left, right = (share_of_side(face, face.points, side) for side in "lr")
    np.testing.assert_allclose(left + right, 1.0, atol=1e-15)
    assert set(np.unique(left[np.abs(face.frame.local(face.points)[:, 0]) > 0.15])) == {0.0, 1.0}
    assert (share_of_side(face, face.points, None) == 1.0).all()


@pytest.mark.parametrize(
    "name", ["cheekPuff", "jawLeft", "mouthClose", "mouthLeft", "mouthRollLower", "mouthRollUpper"]
)
def test_modelled_movements_clear_teeth_and_lips_at_all_weights(face, posing, oracle, name):
    pose = posing.at({name: (ARKIT[name], 1.0)})
    full = face.jaw_angle(dict(zip(face.muscles, pose.rates, strict=True)))
    for weight in (0.25, 0.5, 0.75, 1.0):
        moved = posing.rest + weight * (pose.base - posing.rest)
        found = oracle.findings(moved, weight * full)
        assert max(found.lips, found.teeth, found.eyes) < DEEPEST
        assert found.inverted == 0
