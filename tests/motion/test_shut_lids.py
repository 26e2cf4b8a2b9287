"""Eyes before which the skin has no opening: there is nothing to shut, and their lids lie on the ball.

what                      checked against
the muscle that shuts     the skin at rest, bit for bit
skin on the ball          the way of the brow above it
lines on the ball         those of the same lids with an opening
"""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.anatomy.face import Face
from facewrinkle.layers.wave_folds.tissue import ROLLING, firmness
from facewrinkle.mesh import to_polydata
from facewrinkle.motion.skin import Skin
from tests.synthetic_faces import skin_with


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
