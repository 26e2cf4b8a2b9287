"""Factors of the depth of folds by places: what they are there, far from there, and in between."""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.errors import UnknownNameError
from facewrinkle.layers.wave_folds.layer import REGIONS, amounts


def nearest(face, *names):
    return [np.linalg.norm(face.points - face.landmarks[name], axis=1).argmin() for name in names]


def test_landmarks_and_regions_take_amounts(face):
    amount = {"glabella": 0.0, fw.Region(face.landmarks["forehead_mid"], size=(80, 30)): 3.0}
    assert amounts(amount, face)[nearest(face, "glabella", "forehead_mid")] == pytest.approx([0.0, 3.0], abs=0.05)


@pytest.mark.parametrize("region", REGIONS)
def test_a_region_lies_around_its_landmarks(face, region):
    found = amounts({region: 3.0}, face)
    assert found[nearest(face, *REGIONS[region])] == pytest.approx(3.0, abs=0.2)
    away = [np.linalg.norm(face.points - face.landmarks[name], axis=1) for name in REGIONS[region]]
    assert (found[np.min(away, axis=0) > 0.4 * face.frame.pupil_distance] == 1.0).all()
    assert found.max() <= 3.0 + 1e-12, "where landmarks are near each other, too"


def test_sides_blend_in_the_middle_and_both_make_one_factor(face):
    x = face.points[:, 0]
    one, both = amounts({"left": 3.0}, face), amounts({"left": 0.5, "right": 0.5}, face)
    assert (one[x > 15.0] == 3.0).all()
    assert (one[x < -15.0] == 1.0).all()
    assert one[np.abs(x).argmin()] == pytest.approx(2.0, abs=0.05)
    assert (both == 0.5).all()
    together = amounts({"left": 3.0, "right": 0.0, "chin": 2.0}, face)
    np.testing.assert_allclose(together, amounts({"left": 3.0, "right": 0.0}, face) * amounts({"chin": 2.0}, face))


def test_an_unknown_place_is_refused(face):
    with pytest.raises(UnknownNameError, match="unknown landmark or region of folds 'chinn'. Did you mean 'chin'"):
        amounts({"chinn": 2.0}, face)
