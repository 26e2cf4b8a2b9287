"""Contacts of the skin.

what                    checked against
force of a contact      differences of its energy; zero, soft, linear and constant parts
eyes, lips, teeth       differences of their energies; their geometry written out
pairs of lips           every vertex with every triangle
lips                    rays from each lip to the other at rest; parted lips are left alone
teeth                   the ellipse of the arches; what goes with the jaw meets the lower teeth
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import lips_middle
from facewrinkle.anatomy.teeth import teeth_of
from facewrinkle.motion import _skin_kernels as kernels
from facewrinkle.motion.contacts import _seen
from facewrinkle.motion.skin import Skin


@pytest.fixture(scope="module")
def skin(face):
    return Skin(face)


def held(skin, rates, steps=30):
    skin.reset()
    skin.contract(rates)
    for _ in range(steps):
        x = skin.step()
    return x


def test_the_force_of_a_contact_is_the_slope_of_its_energy():
    h = 1e-6
    for depth in (0.01, 0.05, kernels.SOFT, 0.2, kernels.DEEP, 1.0, 5.0):
        rise = (kernels.contact(depth + h)[1] - kernels.contact(depth - h)[1]) / (2 * h)
        assert rise == pytest.approx(kernels.contact(depth)[0], rel=1e-4)
    force = [kernels.contact(d)[0] for d in (1e-9, 0.15, 0.25, kernels.DEEP, 7.0)]
    assert force[0] < 1e-12
    assert force[2] - force[1] == pytest.approx(0.1)  # stiffness 1
    assert force[3] == force[4]


def test_contacts_push_along_the_slope_of_their_energy(skin):
    rng, contacts = np.random.default_rng(2), skin.contacts
    shift = rng.normal(size=skin.points.shape)
    u = 3.0 * rng.normal(size=skin.points.shape)
    gradient = np.zeros_like(u)
    assert contacts.energy(u, shift, gradient) > 0.0
    h = 1e-6
    for _ in range(5):
        way = rng.normal(size=u.shape)
        ends = [contacts.energy(u + sign * h * way, shift, np.zeros_like(u)) for sign in (1.0, -1.0)]
        assert (ends[0] - ends[1]) / (2 * h) == pytest.approx(float((gradient * way).sum()), rel=1e-5)


def test_at_rest_nothing_touches(skin):
    gradient = np.zeros_like(skin.points)
    assert skin.contacts.energy(np.zeros_like(gradient), np.zeros_like(gradient), gradient) == 0.0
    assert not gradient.any()


def test_lips_face_each_other_along_the_height(face, skin):
    p, up = skin.contacts.lips, face.frame.axes[1]
    assert len(p.vertices) > 20
    other = np.einsum("kc,kcj->kj", p.shares, skin.points[p.corners])
    np.testing.assert_allclose(skin.points[p.vertices] - other, p.gap[:, None] * p.away, atol=1e-9)
    sides = p.away @ up
    np.testing.assert_allclose(np.abs(sides), 1.0)
    middle = face.landmarks["upper_lip_mid"] + face.landmarks["lower_lip_mid"]
    assert (skin.points[p.vertices[sides > 0]] @ up > 0.5 * middle @ up - 2.0).all()  # upper lip
    assert not set(p.vertices[sides > 0]) & set(p.vertices[sides < 0])


def lip_gap(skin, x):
    p = skin.contacts.lips
    return ((x[p.vertices] - np.einsum("kc,kcj->kj", p.shares, x[p.corners])) * p.away).sum(axis=1)


def test_lips_that_are_pressed_together_stop_each_other(face):
    """The chin pushes the lower lip up: free, it would pass far through the upper one."""
    free, stopped = Skin(face), Skin(face)
    p = free.contacts.lips
    p.weight[:] = 0.0
    rates = dict.fromkeys(("mentalis_l", "mentalis_r", "depressor_anguli_oris_l", "depressor_anguli_oris_r"), 1.0)
    assert lip_gap(free, held(free, rates)).min() < -1.0
    x = held(stopped, rates)
    assert lip_gap(stopped, x).min() > -0.1
    assert lip_gap(stopped, x).min() < 0.2  # they do touch


def test_lips_stay_before_the_teeth(face):
    skin = Skin(face)
    t = skin.contacts.teeth
    upper, _ = teeth_of(face.landmarks, face.frame)
    # The arch that is drawn lies within the wall, but for the bulge of its crowns.
    lips = lips_middle(face.landmarks)
    middle = lips + ((skin.points[t.vertices[0]] - lips) @ t.axes.T - t.local[0]) @ t.axes
    radius = np.hypot(*(((upper.points - middle) @ t.axes.T) / t.half).T)
    assert 0.95 < radius.max() < 1.05
    for rates in ({"risorius_l": 1.0, "risorius_r": 1.0}, {"risorius_l": 1.0, "risorius_r": 1.0, "jaw": 0.5}):
        held(skin, rates)
        carried = t.local + (skin.displacement - skin._shift)[t.vertices] @ t.axes.T
        depth = (np.minimum(np.hypot(*(t.local / t.half).T), 1.0) - np.hypot(*(carried / t.half).T)) * t.half[1]
        assert depth.max() < 0.3


def test_parted_lips_do_not_feel_each_other(face):
    skin = Skin(face)
    x = held(skin, fw.ACTION_UNITS["AU27"])
    touching = lip_gap(skin, x) < skin.contacts.lips.allowed
    assert touching.mean() < 0.1


def lowest_under(local, i, triangles, sign, far):
    """The triangle that vertex i sees, by looking at all of them: its gap and its number."""
    seen = []
    for t, corners in enumerate(triangles):
        if i in corners:
            continue
        flat = np.vstack([local[corners][:, [0, 2]].T, np.ones(3)])
        if abs(np.linalg.det(flat)) < 1e-12:
            continue
        share = np.linalg.solve(flat, [*local[i, [0, 2]], 1.0])
        gap = sign * (local[i, 1] - share @ local[corners, 1])
        if share.min() >= 0.0 and 0.0 <= gap < far:
            seen.append((gap, t))
    return min(seen, default=None)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_nearest_triangle_is_found_among_large_and_small_ones(sign):
    rng = np.random.default_rng(11)
    large, small = rng.uniform(-1.0, 1.0, (12, 3, 3)), rng.uniform(-1.0, 1.0, (60, 1, 3))
    corners = np.concatenate([large, small + rng.uniform(-0.05, 0.05, (60, 3, 3))])
    local = np.concatenate([corners.reshape(-1, 3), rng.uniform(-1.0, 1.0, (80, 3))])
    triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    own = np.arange(100, len(local))
    vertices, found, shares, gaps, signs = _seen(local, own, triangles, sign, 0.6)
    expected = {i: hit for i in own if (hit := lowest_under(local, i, triangles, sign, 0.6))}
    assert 20 < len(expected) < len(own)
    assert {t < 12 for _, t in expected.values()} == {True, False}
    assert vertices.tolist() == list(expected)
    assert found.tolist() == [triangles[t].tolist() for _, t in expected.values()]
    np.testing.assert_allclose(gaps, [gap for gap, _ in expected.values()], atol=1e-9)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-12)
    assert set(signs) == {sign}


def test_nothing_is_seen_where_there_is_nothing():
    nothing, triangle = np.empty(0, int), np.array([[0, 1, 2]], np.int32)
    for own, triangles in ((nothing, triangle), (np.arange(3), triangle[:0]), (np.arange(3), triangle)):
        assert all(len(part) == 0 for part in _seen(np.eye(3), own, triangles, 1.0, 9.0))


# --- lips ---------------------------------------------------------------------------------------


def test_the_pressure_of_the_lips_on_each_other_moves_nothing_as_a_whole(face):
    skin = fw.Skin(face)
    forces, pairs = skin.contacts.closing(), skin.contacts.lips
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-9)
    parting = (forces[pairs.vertices] * pairs.away).sum(axis=1)
    assert (parting < 0.0).all()


@pytest.mark.parametrize("stem", [None, "ict_face_narrow", "makehuman_head_male"])
def test_pursed_lips_come_forward_and_stay_together(face, real_face, stem):
    face = face if stem is None else real_face(stem)
    skin = fw.Skin(face, time_step=1.0)
    skin.contract({"orbicularis_oris": 1.0})
    for _ in range(15):
        skin.step()
    local = skin.displacement @ face.frame.axes.T
    lips = cKDTree(face.points).query([face.landmarks[f"{lip}_lip_mid"] for lip in ("upper", "lower")])[1]
    assert (local[lips, 2] > 5.0).all()
    corners = cKDTree(face.points).query([face.landmarks["mouth_l"], face.landmarks["mouth_r"]])[1]
    assert local[corners[0], 0] < -3.0
    assert local[corners[1], 0] > 3.0
    pairs, moved = skin.contacts.lips, skin.displacement[skin.mesh.vertices]
    opposite = np.einsum("kc,kcj->kj", pairs.shares, moved[pairs.corners])
    parted = ((moved[pairs.vertices] - opposite) * pairs.away).sum(axis=1)
    assert parted.max() < 0.5  # without the pressure they part by millimetres
