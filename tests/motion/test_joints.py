"""Joints that carry the skin along.

what                      checked against
carried points            the turn of the mandible, as a rotation; ways in many parts, and back again
tethers                   points that were carried there from rest
triangles                 normals of the carried triangles
parts of a step           the way of each point in each of them
joints that yield         the rates of the muscles that they yield to
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from small_meshes import area_vectors

from facewrinkle.geometry import unit
from facewrinkle.motion.joints import LONGEST_PART, Joints
from facewrinkle.motion.skin import Skin

RATES = st.floats(0.0, 1.0)


@pytest.fixture(scope="module")
def joints(face):
    return Skin(face).joints


def rates_of(face, **rates):
    return np.array([rates.get(name, 0.0) for name in face.muscles], float)


JAW_RATES = pytest.mark.parametrize("change", [(0.0, 1.0), (1.0, 0.0), (0.2, 0.7), (0.9, 0.3)])


@JAW_RATES
def test_points_ride_exactly_on_the_turn_of_the_mandible(face, joints, change):
    jaw, before, after = joints.mandible, *(rates_of(face, jaw=rate) for rate in change)
    points = face.points + np.random.default_rng(0).normal(size=face.points.shape)
    turns = Rotation.from_rotvec(np.outer((change[1] - change[0]) * jaw.angles, jaw.axis))
    expected = points.copy()
    expected[jaw.vertices] = jaw.centre + turns.apply(points[jaw.vertices] - jaw.centre)
    carried = joints.carried(points, before, after)
    assert np.abs(carried - points).max() > 10.0
    np.testing.assert_allclose(carried, expected, atol=1e-10)
    away = np.setdiff1d(np.arange(len(points)), jaw.vertices)
    assert np.array_equal(carried[away], points[away])


@settings(max_examples=30)
@given(data=st.data())
def test_the_way_in_parts_is_the_way_at_once(face, joints, data):
    name = data.draw(st.sampled_from(sorted(face.joint_weights)))
    start, end, between = (rates_of(face, **{name: data.draw(RATES)}) for _ in range(3))
    at_once = joints.carried(face.points, start, end)
    in_parts = joints.carried(joints.carried(face.points, start, between), between, end)
    np.testing.assert_allclose(in_parts, at_once, atol=1e-10)
    np.testing.assert_allclose(joints.carried(at_once, end, start), face.points, atol=1e-10)


def test_what_does_not_turn_is_not_carried(face, joints):
    rates = np.random.default_rng(1).random(len(face.muscles))
    assert np.array_equal(joints.carried(face.points, rates, rates), face.points)
    others = rates * [name not in face.joint_weights for name in face.muscles]
    assert {other for joint in face.joint_weights.values() for other in joint.yields} <= set(face.muscles)
    assert np.array_equal(joints.carried(face.points, 0.0 * rates, others), face.points)
    assert joints.parts(rates, rates) == joints.parts(0.0 * rates, others) == 1


@pytest.mark.parametrize("rate", [0.3, 1.0])
def test_tethers_go_where_points_ride(face, joints, rate):
    """Plates of lids, which hold by a share, turn by that share."""
    still = rates_of(face)
    for name, joint in face.joint_weights.items():
        now = rates_of(face, **{name: rate})
        shift, share = joints.shift(now), 1.0 - joints.free_share(name)[1]
        np.testing.assert_allclose(shift, joints.carried(face.points, still, now) - face.points, atol=1e-10)
        turns = Rotation.from_rotvec(np.outer(rate * share * joint.angles, joint.axis))
        ride = joint.centre + turns.apply(face.points[joint.vertices] - joint.centre) - face.points[joint.vertices]
        np.testing.assert_allclose(shift[joint.vertices], ride, atol=1e-10)
        assert joint.bone == bool((share == 1.0).all())
        assert share.min() >= 0.0
        assert share.max() > 0.99


def test_triangles_face_as_they_are_carried(face, joints):
    """Where all corners turn by the same angle, the normal does so too; elsewhere nearly."""
    now = rates_of(face, jaw=0.8)
    after = joints.carried(face.points, 0.0 * now, now)
    carried, normals = (unit(area_vectors(points, face.triangles)) for points in (after, face.points))
    facing = joints.facing(normals, now)
    np.testing.assert_allclose(np.linalg.norm(facing, axis=1), 1.0)
    angles = np.zeros(len(face.points))
    angles[joints.mandible.vertices] = joints.mandible.angles
    of_corners = angles[face.triangles]
    same = np.ptp(of_corners, axis=1) < 1e-12
    firm = same & (of_corners.min(axis=1) > 0.0)
    assert firm.sum() > 20
    np.testing.assert_allclose(facing[same], carried[same], atol=1e-9)
    assert np.array_equal(facing[same & ~firm], normals[same & ~firm])
    assert np.abs(facing[firm] - normals[firm]).max() > 0.1


@pytest.mark.parametrize("seed", range(30))
def test_no_part_of_a_step_is_long(face, joints, seed):
    """No point of the surface is carried far in one part, however the rates change, nor where joints yield."""
    rng = np.random.default_rng(seed)
    before, after = (rng.random(len(face.muscles)) * (rng.random(len(face.muscles)) < 0.5) for _ in range(2))
    parts = joints.parts(before, after)
    points, riding = face.points + joints.shift(before), before
    for part in range(1, parts + 1):
        now = before + (after - before) * (part / parts)
        carried = joints.carried(points, riding, now)
        assert np.linalg.norm(carried - points, axis=1).max() <= LONGEST_PART + 1e-6
        points, riding = carried, now


def test_a_jump_of_the_jaw_has_as_many_parts_as_millimeters(face, joints):
    chin = np.linalg.norm(face.points - face.landmarks["menton"], axis=1).argmin()
    still, wide = rates_of(face), rates_of(face, jaw=1.0)
    way = np.linalg.norm(joints.carried(face.points, still, wide)[chin] - face.points[chin])
    assert way > 20.0
    arms = np.linalg.norm(face.points - joints.mandible.centre, axis=1)
    assert way / LONGEST_PART <= joints.parts(still, wide) < 1.0 + arms.max() / LONGEST_PART
    assert joints.parts(wide, still) == joints.parts(still, wide)
    assert joints.parts(still, rates_of(face, jaw=1e-3)) == 1


def test_joints_yield_to_other_muscles(face, joints):
    """A lid that closes does not follow the eye: what the joint's own rate lacks is that of the other muscle."""
    yielding = [(name, other) for name, joint in face.joint_weights.items() for other in joint.yields]
    assert len(yielding) > 4
    order = list(face.joint_weights)
    for name, other in yielding:
        closed = joints.shift(rates_of(face, **{other: 1.0}))
        assert np.array_equal(joints.shift(rates_of(face, **{name: 1.0, other: 1.0})), closed)
        vertices, still = face.joint_weights[name].vertices, rates_of(face)
        half, less = rates_of(face, **{other: 0.5}), rates_of(face, **{name: 0.8 * 0.5})
        both = joints.shift(rates_of(face, **{name: 0.8, other: 0.5}))
        expected = face.points
        for now in (less, half) if order.index(name) < order.index(other) else (half, less):
            expected = joints.carried(expected, still, now)
        expected = expected - face.points
        np.testing.assert_allclose(both, expected, atol=1e-9)
        assert np.abs(expected - joints.shift(half))[vertices].max() > 0.3


def test_the_rate_of_the_mandible(face, joints):
    assert joints.mandible_rate(rates_of(face)) == 0.0
    assert joints.mandible_rate(rates_of(face, jaw=0.4, orbicularis_oculi_l=1.0)) == 0.4


def test_what_a_joint_takes_of_its_muscle(face, joints):
    assert joints.free_share("frontalis_inner_l") is None
    vertices, free = joints.free_share("jaw")
    assert np.array_equal(vertices, face.joint_weights["jaw"].vertices)
    assert not free.any(), "bone takes all of it"


def test_a_face_without_joints_is_never_carried(face):
    class Jointless:
        points_mm, unit, triangles, joint_weights = face.points_mm, face.unit, face.triangles, {}

    joints = Joints(Jointless, tuple(face.muscles), np.ones(len(face.points)), {})
    rates = np.ones(len(face.muscles))
    assert joints.mandible is None
    assert joints.mandible_rate(rates) == 0.0
    assert joints.parts(0.0 * rates, rates) == 1
    assert not joints.shift(rates).any()
    assert np.array_equal(joints.carried(face.points, 0.0 * rates, rates), face.points)
