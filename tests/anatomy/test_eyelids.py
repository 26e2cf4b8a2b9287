"""Lids that close, and follow the eye."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from eyelids_of_faces import filled, margins_of
from synthetic_faces import head_with

import facewrinkle as fw
from facewrinkle.anatomy.eyelid_opening import eyelid_opening, place_eyeballs
from facewrinkle.anatomy.eyelids import OVERLAP, lid_weights
from facewrinkle.anatomy.face import Face
from facewrinkle.geometry.topology import boundary_loops
from facewrinkle.layers.wave_folds.tissue import ROLLING, firmness
from facewrinkle.mesh import to_polydata
from facewrinkle.motion.skin import Skin
from tests.synthetic_faces import skin_with


def test_lids_follow_the_gaze_and_closing_takes_its_place(face):
    weights = face.joint_weights
    close, up, down = (weights[f"{m}_l"] for m in ("orbicularis_oculi", "rectus_superior", "rectus_inferior"))
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
        for _ in range(100):  # lids that meet come to rest more slowly
            skin.step()
        states.append(skin.displacement.copy())
    np.testing.assert_allclose(*states, atol=1e-5)


def test_lids_before_a_socket_are_those_before_a_hole(face):
    points, triangles = filled(face, (1.6, 2.0), (1.8, 8.0), (0.9, 16.0))
    eyes = place_eyeballs(face.landmarks, face.frame, points, triangles)
    for eye, other in zip(face.eyes, eyes, strict=True):
        assert other.radius == pytest.approx(eye.radius, rel=0.03)
        first = lid_weights(face.eyelid_openings[eye.side], face.points, face.triangles)
        opening = eyelid_opening(other, points, triangles, boundary_loops(triangles), face.landmarks)
        second = lid_weights(opening, points, triangles)
        turns = np.zeros((2, len(points)))
        for angles, lids in zip(turns, (first, second), strict=True):
            angles[lids.close.vertices] = lids.close.angles
        margins = margins_of(face, eye.side)
        upper, lower = (chain[3:-3] for chain in margins)  # it is not seen where margins before a socket end
        turns[0, upper] -= OVERLAP  # which only skin that ends at the margin needs
        np.testing.assert_allclose(*turns[:, np.append(upper, lower)], atol=np.radians(2.0))


@pytest.mark.parametrize("stem", [None, "makehuman_head_male"])
def test_deep_sockets_have_lids(real_face, stem):
    """The eyes lie where the lids are, and closing lids meet."""
    face = head_with("sockets", "bag") if stem is None else real_face(stem)
    moved = fw.Skin(face, time_step=0.1)
    moved.contract({"orbicularis_oculi_l": 1.0, "orbicularis_oculi_r": 1.0})
    for _ in range(15):
        moved.step()
    now = (moved.points + moved.displacement) / face.unit
    for eye in face.eyes:
        upper, lower = margins_of(face, eye.side)
        along = face.points[np.concatenate([upper, lower])] @ face.frame.axes[0]
        middle = np.quantile(along, [0.35, 0.65])
        heights = []
        for points in (face.points, now):
            chains = [points[chain][:, :3] @ face.frame.axes.T * face.unit for chain in (upper, lower)]
            place = np.linspace(*(middle * face.unit), 9)
            high, low = (np.interp(place, *chain[np.argsort(chain[:, 0])][:, :2].T) for chain in chains)
            heights.append(high - low)
        assert heights[0].min() > 4.0
        assert heights[1].max() < 1.0


def test_a_brow_that_is_near_stays_as_the_eye_closes(face):
    """As over the large eyes of drawn figures, where a share of the eye's own size would reach beyond the brow."""
    opening = face.eyelid_openings["l"]
    usual = lid_weights(opening, face.points, face.triangles).close
    brow = opening.brow.copy()
    brow[1] = opening.lines(brow[0])[0] + np.radians(8.0)
    near = lid_weights(dataclasses.replace(opening, brow=brow), face.points, face.triangles).close
    along, elevation, _ = opening.polar(face.points)
    above = elevation - opening.lines(along)[0]
    for weights, moves in ((usual, True), (near, False)):
        turns = np.zeros(len(face.points))
        turns[weights.vertices] = weights.angles
        at_brow = (above > np.radians(6.0)) & (above < np.radians(18.0)) & (np.abs(along - 0.5) < 0.4)
        assert at_brow.sum() == 3
        assert (turns[at_brow] > 0.02).any() == moves
        assert turns[opening.upper].max() == pytest.approx(usual.angles.max(), rel=1e-6)


# --- eyes before which the skin has no opening ----------------------------------------------------


@pytest.fixture(scope="module")
def shut(face):
    shut = Face.from_landmarks(to_polydata(*skin_with("shut")), face.landmarks, 1.0)
    assert {eye.side for eye in shut.eyes} - set(shut.eyelid_openings) == {"l", "r"}
    return shut


@pytest.fixture(scope="module")
def skin(shut):
    return Skin(shut)


def test_there_is_nothing_to_shut(shut, skin):
    skin.reset()
    skin.contract({"orbicularis_oculi_l": 1.0, "orbicularis_oculi_r": 1.0})
    for _ in range(5):
        skin.step()
    assert np.array_equal(skin.displacement, np.zeros_like(shut.points))


def test_lids_stay_where_brow_and_cheek_move(shut, skin):
    skin.reset()
    skin.contract(shut.atlas.contractions({"AU2": 1.0, "AU6": 1.0, "AU12": 1.0}))
    for _ in range(20):
        skin.step()
    way = np.linalg.norm(skin.displacement, axis=1)
    brow = np.linalg.norm(shut.points - shut.landmarks["brow_l_mid"], axis=1).argmin()
    assert way[brow] > 5.0
    assert way[shut.shut_lids > 0.9].max() < 0.02 * way[brow]


def test_lines_end_where_the_lids_begin(face, shut):
    lid = np.flatnonzero(shut.shut_lids > 0.99)
    assert len(lid)
    soft = firmness(shut)
    assert (soft[lid] <= (1.0 - ROLLING) * 1.01).all()
    assert not face.shut_lids.any()
    brow = np.linalg.norm(shut.points - shut.landmarks["forehead_mid"], axis=1).argmin()
    assert soft[brow] > 0.8
