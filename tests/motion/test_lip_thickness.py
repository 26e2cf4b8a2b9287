"""The flesh of the lips.

what                                   checked against
pairs of vertices and triangles        each lies behind the other at rest, by dot products
rest                                   nothing presses
a lining drawn through the skin        it is pushed back, towards where it was
lips that are rolled in                the oracle: not in each other
violent mixtures on the built-in head  the oracle: lips in each other, triangles turned over
"""

from __future__ import annotations

import numpy as np
import pytest
from skins import held

import facewrinkle as fw
from facewrinkle.motion._contact_kernels import gaps_of
from facewrinkle.motion.self_contact import THINNEST, behind_lips
from facewrinkle.motion.solids import met_solids
from tools.trials.oracle import DEEPEST, Oracle
from tools.trials.sequences import sequence


@pytest.fixture(scope="module")
def face():
    return fw.default_face()


@pytest.fixture(scope="module")
def skin(face):
    return fw.Skin(face)


def test_vertices_lie_behind_the_skin_that_they_are_kept_behind(face):
    flesh = behind_lips(face, np.ones(len(face.points)))
    a, b, c = (face.points[flesh.partners[:, k]] for k in range(3))
    inwards = np.cross(b - a, c - a)
    place = face.points[flesh.corners[:, 0]]
    height = ((place - a) * inwards).sum(axis=1) / np.linalg.norm(inwards, axis=1)
    assert (height > flesh.allowed).all()
    assert (flesh.allowed <= THINNEST * height + 1e-12).all()
    share = np.linalg.norm(place - (a + b + c) / 3.0, axis=1)
    assert (height > 0.49 * share).all(), "straight through the flesh"


def test_vertices_of_the_red_have_a_partner_straight_across(face):
    flesh = behind_lips(face, np.ones(len(face.points)))
    vertices, count = np.unique(flesh.corners[:, 0], return_counts=True)
    assert count.max() == 2
    assert (count == 2).mean() > 0.5
    height = gaps_of(face.points, flesh, met_solids(face, np.ones(len(face.points)))[0])
    for vertex in vertices[count == 2]:
        first, second = np.flatnonzero(flesh.corners[:, 0] == vertex)
        middles = face.points[flesh.partners[[first, second]]].mean(axis=1)
        far = np.linalg.norm(middles - face.points[vertex], axis=1)
        assert far[0] <= far[1] + 1e-9
        assert flesh.allowed[second] <= 0.1 * height[second] + 1e-12


def test_lips_that_are_rolled_in_stay_out_of_each_other(face, skin):
    skin.reset()
    moved = skin.points + held(skin, face.atlas.contractions("AU28", 1.0), 40)
    found = Oracle(face).findings(moved)
    assert np.linalg.norm(moved - face.points, axis=1).max() > 5.0
    assert found.lips < 0.01
    assert not found.inverted


def test_lining_in_front_of_the_skin_is_pushed_back(face, skin):
    contacts, samples, u = skin.contacts, skin.contacts.samples, np.zeros_like(face.points)
    flesh = contacts.kinds == "flesh"
    lining = np.unique(samples.corners[flesh & face.lining.vertices[samples.corners[:, 0]], 0])
    assert len(lining) > 20
    u[lining] += 12.0 * face.frame.axes[2]
    centres = [[eye.centre] for eye in face.eyes]
    gaps = gaps_of(np.concatenate([face.points + u, *centres]), samples, contacts.solids)
    deep = flesh & (gaps < samples.allowed)
    assert deep.sum() > 20
    a, b, c = (face.points[samples.partners[deep, k]] for k in range(3))
    out = -np.cross(b - a, c - a) @ face.frame.axes[2]
    gradient = np.zeros_like(u)
    assert contacts.energy(u, gradient) > 0.0
    pushed = samples.corners[deep, 0][out > 0.0]
    assert np.median(gradient[pushed] @ face.frame.axes[2]) > 0.0, "the force points backwards"


@pytest.mark.parametrize(("index", "frames"), [(2, 32), (5, 34)])
def test_mixtures_turn_no_lip_inside_out(face, skin, index, frames):
    """All muscles about the mouth at once, in jumps: lips came .6 mm through each other, and triangles turned over."""
    oracle = Oracle(face)
    skin.reset()
    for rates in sequence(face, 0, "head-0", index).rates[:frames]:
        skin.set_rates(rates)
        found = oracle.findings(skin.step())
        assert found.lips < DEEPEST
        assert not found.inverted
    skin.reset()
