"""Movements that no muscle makes.

what                       checked against
jaw                        one rigid motion of the chin, read off by Kabsch's method
sealed lips                their distance at rest
puffed cheeks, rolled lips which skin goes where
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.rigging.modelled import PUFFED, Movements


@pytest.fixture(scope="module")
def movements(face):
    return Movements(face)


def at(face, field, mark):
    """A displacement at a landmark, [left, up, forward] in mm."""
    return field[face.mesh.find_closest_point(face.landmarks[mark])] @ face.frame.axes.T * face.unit


@pytest.mark.parametrize("name", ["jaw_forward", "jaw_left", "jaw_right"])
def test_the_chin_goes_rigidly_with_the_mandible(face, movements, name):
    field, matrix = movements.of(name), movements.mandible(name)
    chin = movements.lower > 0.999
    assert chin.sum() > 100
    before, after = face.points[chin], (face.points + field)[chin]
    turn, _ = Rotation.align_vectors(after - after.mean(axis=0), before - before.mean(axis=0))
    np.testing.assert_allclose(turn.as_matrix(), matrix[:3, :3], atol=1e-4)
    assert not field[movements.lower == 0.0].any()


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
    skin = fw.Skin(face, time_step=1.0)
    skin.contract({"jaw": 1.0})
    for _ in range(8):
        skin.step()
    opened = skin.displacement / face.unit
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
