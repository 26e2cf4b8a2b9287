"""Flush: gathered skin reddens, stretched skin pales, by the blood in it."""

from __future__ import annotations

import numpy as np
import pytest
from drawing import held

from facewrinkle.appearance.flush import ABSORBANCE, flush
from facewrinkle.plotting import Style, picture


def redness(face, points, name):
    """Red relative to green at a landmark, 1 at rest."""
    red, green, _ = flush(face, points)[face.mesh.find_closest_point(face.landmarks[name])]
    return red / green


@pytest.mark.parametrize("area", [0.8, 1.05])
def test_blood_absorbs_by_the_law_of_beer_and_lambert(face, area):
    """All skin alike: nothing spreads, and far from the lids the closed form holds."""
    factors = flush(face, np.sqrt(area) * face.points)
    expected = np.exp(-(1.0 / area - 1.0) * ABSORBANCE)
    far = face.mesh.find_closest_point(face.landmarks["menton"])
    np.testing.assert_allclose(factors[far], expected / max(expected.max(), 1.0), rtol=2e-3)


def test_skin_at_rest_has_its_own_color_and_no_color_is_brighter(face):
    np.testing.assert_array_equal(flush(face, face.points), 1.0)
    assert flush(face, np.asarray(held("happiness").points)[: len(face.points)]).max() <= 1.0


def test_laughter_reddens_the_cheeks_and_surprise_the_forehead_while_the_chin_pales(face):
    laughing, surprised, shut = (
        np.asarray(held(name).points)[: len(face.points)] for name in ("happiness", "surprise", "AU45")
    )
    assert redness(face, laughing, "malar_l") > 1.03
    assert redness(face, laughing, "pogonion") < 0.995
    assert redness(face, surprised, "forehead_mid") > 1.02
    lid = face.eyelid_openings["l"].upper
    assert np.abs(flush(face, shut)[lid] - 1.0).max() < 0.05  # it unrolls


def test_pictures_show_it_and_clay_does_not(face):
    for clay in (False, True):
        style = Style((200, 240), "left_three_quarter", clay=clay)
        cheek = [
            picture(frame, face, style)[130:150, 90:120].mean(axis=(0, 1)) for frame in (held("happiness"), face.mesh)
        ]
        laughing, resting = (red / green for red, green, _ in cheek)
        assert (laughing > 1.01 * resting) != clay
