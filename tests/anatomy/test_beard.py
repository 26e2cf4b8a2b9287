"""Beards: where they grow, how long, and what becomes of them in a person."""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw


def hairs_of(face):
    """Points of the hairs of the beard of a face at rest."""
    return face.bound_hair["beard"].polylines(face.points, face.triangles, face.normals)


@pytest.mark.parametrize("identity", [{}, {"sex": 0.9, "lips": 0.9, "mouth": 0.9}, {"philtrum": -1.0, "lips": -1.0}])
def test_they_grow_around_the_mouth_but_not_on_lips_and_cheeks(identity):
    face = fw.default_face(identity | {"beard": 0.6})
    roots, marks = hairs_of(face)[:, 0], face.landmarks
    assert roots[:, 1].max() < marks["eye_l_centre"][1]
    assert np.percentile(roots[:, 2], 1) > marks["gonion_l"][2] - 20.0
    middle = np.abs(roots[:, 0]) < 0.5 * marks["mouth_l"][0]
    lips = (roots[:, 1] < marks["upper_lip_mid"][1] - 1.0) & (roots[:, 1] > marks["lower_lip_mid"][1] + 1.0)
    assert not (middle & lips).any()
    moustache = (roots[:, 1] > marks["upper_lip_mid"][1]) & (roots[:, 1] < marks["subnasale"][1])
    assert (middle & moustache).sum() > 50


def test_stubble_is_short_and_full_beards_are_long_and_hang_down():
    reach = []
    for fullness in (0.1, 0.5, 1.0):
        hairs = hairs_of(fw.default_face({"beard": fullness}))
        reach.append(np.median(np.linalg.norm(hairs[:, -1] - hairs[:, 0], axis=1)))
    assert reach[0] < 1.0 < reach[1] < reach[2]
    assert 5.0 < reach[2] < 12.0
    assert (hairs[:, -1, 1] < hairs[:, 0, 1]).mean() > 0.9


def test_they_have_the_color_of_the_hair(face):
    bearded = fw.default_face({"beard": 0.8, "hair": -0.6})
    np.testing.assert_array_equal(bearded.bound_hair["beard"].color, bearded.bound_hair["cropped_hair"].color)
    assert bearded.bound_hair["beard"].color.mean() > face.bound_hair["cropped_hair"].color.mean()
    assert "beard" not in fw.default_face({"beard": -0.5}).bound_hair
