"""Poses: muscles and movements that no muscle makes together, and ways of lids that clear the eyes.

what                       checked against
ways                       many points on them; balls; the oracle of the trials
jaw                        one rigid motion of the chin, read off by Kabsch's method
sealed lips                their distance at rest
puffed cheeks, rolled lips which skin goes where
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from skins import held

import facewrinkle as fw
from facewrinkle.rigging.modeled import PUFFED, Movements
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
        outside = np.linalg.norm(posing.rest - centre, axis=1) >= radius
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
def test_modeled_movements_clear_teeth_and_lips_at_all_weights(face, posing, oracle, name):
    pose = posing.at({name: (ARKIT[name], 1.0)})
    full = face.jaw_angle(dict(zip(face.muscles, pose.rates, strict=True)))
    for weight in (0.25, 0.5, 0.75, 1.0):
        found = oracle.findings(posing.rest + weight * (pose.base - posing.rest), weight * full)
        assert max(found.lips, found.teeth, found.eyes) < DEEPEST
        assert found.inverted == 0


# --- movements that no muscle makes ----------------------------------------------------------------


@pytest.fixture(scope="module")
def movements(face):
    return Movements(face)


def at(face, field, mark):
    """A displacement at a landmark, [left, up, forward] in mm."""
    return field[face.mesh.find_closest_point(face.landmarks[mark])] @ face.frame.axes.T * face.unit


@pytest.mark.parametrize("name", ["jaw_forward", "jaw_left", "jaw_right"])
def test_the_chin_goes_rigidly_with_the_mandible(face, movements, name):
    field, matrix = movements.of(name), movements.mandible(name)
    chin = face.mandible_share > 0.999
    assert chin.sum() > 100
    before, after = face.points[chin], (face.points + field)[chin]
    turn, _ = Rotation.align_vectors(after - after.mean(axis=0), before - before.mean(axis=0))
    np.testing.assert_allclose(turn.as_matrix(), matrix[:3, :3], atol=1e-4)
    assert not field[face.mandible_share == 0.0].any()


def test_jaws_go_where_they_are_told_and_mirror_each_other(face, movements):
    ahead = at(face, movements.of("jaw_forward"), "pogonion")
    assert abs(ahead[0]) < 1e-9
    assert 4.0 < ahead[2] < 7.0
    left, right = (at(face, movements.of(f"jaw_{side}"), "pogonion") for side in ("left", "right"))
    assert 5.0 < left[0] < 9.0
    np.testing.assert_allclose(left * [-1, 1, 1], right, atol=1e-6)


def test_a_mouth_goes_aside_and_the_eyes_do_not(face, movements):
    field = movements.of("mouth_left")
    assert at(face, field, "upper_lip_mid")[0] > 8.0
    assert at(face, field, "lower_lip_mid")[0] > 8.0
    for mark in ("eye_l_inner", "eye_r_outer", "brow_l_mid", "menton"):
        assert np.linalg.norm(at(face, field, mark)) < 2.5


def test_an_open_jaw_with_sealed_lips_is_closed(face, movements):
    opened = held(fw.Skin(face, time_step=1.0), {"jaw": 1.0}, 8) / face.unit
    upper, lower = movements.pairs
    assert len(upper) > 10
    gap = np.linalg.norm((opened[upper] - opened[lower]), axis=1) * face.unit
    assert np.median(gap) > 10.0  # the jaw parts them
    sealed = opened + movements.seal(opened)
    assert np.abs((sealed[upper] - sealed[lower]) * face.unit).max() < 0.3
    back, way = (np.linalg.norm(at(face, field, "menton")) for field in (sealed - opened, opened))
    assert back < 0.5 * way  # the bone stays open


def test_cheeks_are_blown_outwards(face, movements):
    field = movements.of("puff")
    lateral = {side: at(face, field, f"mouth_{side}") for side in "lr"}
    assert min(lateral[side][2] for side in "lr") > 3.0
    np.testing.assert_allclose(lateral["l"] * [-1, 1, 1], lateral["r"], atol=0.3)
    assert 0.12 < np.linalg.norm(field, axis=1).max() / face.frame.pupil_distance < PUFFED
    for mark in ("eye_l_outer", "glabella", "nose_tip"):
        assert np.linalg.norm(at(face, field, mark)) < 3.0


def test_lips_roll_in_one_by_one(face, movements):
    upper, lower = movements.of("roll_upper"), movements.of("roll_lower")
    assert at(face, upper, "upper_lip_mid")[1] < -3.0  # the skin comes down, and the margin goes back
    assert at(face, lower, "lower_lip_mid")[1] > 3.0
    for field, margin in zip((upper, lower), movements.pairs, strict=True):
        back = -(field[margin] @ face.frame.axes[2]) * face.unit
        assert np.median(back) > 3.0
    np.testing.assert_allclose(at(face, upper, "lower_lip_mid"), 0.0, atol=0.1)
    np.testing.assert_allclose(at(face, lower, "upper_lip_mid"), 0.0, atol=0.1)
    assert at(face, movements.of("lift_upper"), "upper_lip_mid")[1] > 3.0


def test_lids_follow_the_eyes_a_little_and_keep_their_distance_from_the_balls(face, movements):
    inwards, outwards = movements.of("lids_in"), movements.of("lids_out")
    for eye, sign in zip(face.eyes, (1.0, -1.0), strict=True):
        near = cKDTree(face.points).query_ball_point(eye.centre, 1.7 * eye.radius)
        assert sign * (inwards[near] @ face.frame.axes[0]).mean() < -0.1
        assert sign * (outwards[near] @ face.frame.axes[0]).mean() > 0.1
        for field in (inwards, outwards):
            before, after = (
                np.linalg.norm(points[near] - eye.centre, axis=1) for points in (face.points, face.points + field)
            )
            np.testing.assert_allclose(after, before, rtol=1e-9)
