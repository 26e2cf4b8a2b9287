"""Creases of old skin: there at rest, once each, deeper in motion, and gone where the skin is stretched."""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.errors import ParameterError


def settled(face, age, what=None):
    sim = fw.Simulation(face, layers=[fw.Creases(age=age)])
    if what is not None:
        sim.express(what)
    return sim.settle()


def depth_near(frame, face, place, reach=12.0):
    """Depth of the deepest furrow, mm, near a place of the face at rest."""
    near = np.linalg.norm(np.asarray(frame["rest"]) - place, axis=1) * face.unit < reach
    return -float(np.asarray(frame["W"])[near].min())


@pytest.fixture(scope="module")
def places(face):
    marks = face.landmarks
    return {
        "nasolabial": 0.5 * (marks["ala_l"] + marks["mouth_l"]) + [6.0, 0.0, 0.0],
        "glabella": marks["glabella"],
        "below the corner": marks["mouth_l"] + [0.0, -9.0, 0.0],
    }


def test_young_skin_is_smooth_at_rest(face):
    assert (np.asarray(settled(face, 0.0)["W"]) == 0.0).all()


def test_creases_of_old_skin_are_as_deep_as_on_people(face, places):
    """Nasolabial folds of the last grade of Lemperle et al. (2001) are .8 mm deep; all grow with age, in proportion."""
    old, middle = settled(face, 1.0), settled(face, 0.5)
    depths = {name: depth_near(old, face, place) for name, place in places.items()}
    assert 0.7 < depths["nasolabial"] < 1.2
    assert 0.2 < depths["below the corner"] < depths["glabella"] < depths["nasolabial"]
    half = {name: depth_near(middle, face, place) for name, place in places.items()}
    assert half["nasolabial"] == pytest.approx(0.5 * depths["nasolabial"], rel=0.2)
    assert all(0.0 < half[name] < depths[name] for name in places)


def test_a_smile_deepens_an_old_fold(face, places):
    young, old = (depth_near(settled(face, age, "AU12"), face, places["nasolabial"]) for age in (0.0, 1.0))
    assert old > young + 0.3


def test_stretched_skin_loses_its_creases(face, places):
    """Captured puckers smooth the skin beside the mouth."""
    at_rest, puckered = (depth_near(settled(face, 1.0, what), face, places["nasolabial"]) for what in (None, "AU18"))
    assert puckered < 0.8 * at_rest


def test_the_age_is_that_of_the_face_unless_another_is_given():
    aged = fw.default_face({"age": 0.8})
    assert (settled(aged, None)["W"] == settled(aged, 0.8)["W"]).all()
    with pytest.raises(ParameterError, match=r"0 has no lines at rest"):
        fw.Creases(age=2.0)
