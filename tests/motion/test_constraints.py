"""The tip of the nose and the gums.

what                    checked against
tip of the nose         its base, which it goes along with, and the same skin without cartilage
other skin              nothing is different there
lining on the gums      that which muscles pull as they do other skin
"""

import copy

import numpy as np
import pytest
from skins import settled
from synthetic_faces import head_with, ring

from facewrinkle.motion.constraints import on_gums, tip_of_nose


def at(face, name):
    return int(np.linalg.norm(face.points - face.landmarks[name], axis=1).argmin())


def test_the_tip_of_the_nose_rises_with_its_base(face):
    tip, base = at(face, "nose_tip"), at(face, "subnasale")
    moved, without = settled(face, "AU9"), settled(face, "AU9", cartilage=0.0)
    assert moved[base, 1] > 3.3, "captured 3.8 mm"
    assert moved[tip, 1] > 0.6 * moved[base, 1], "captured noses rise as a whole"
    shortened, soft = (rise[base, 1] - rise[tip, 1] for rise in (moved, without))
    assert shortened < 0.85 * soft


def test_a_smile_leaves_the_tip_of_the_nose(face):
    assert np.linalg.norm(settled(face, "AU12")[at(face, "nose_tip")]) < 1.0


def test_skin_away_from_the_nose_is_as_it_was(face):
    firm, free = tip_of_nose(face)
    far = np.linalg.norm(face.points - face.landmarks["nose_tip"], axis=1) > 90.0
    assert far.any()
    assert max(firm[far].max(), np.abs(free[far]).max()) < 1e-8
    assert firm.max() <= 1.0
    assert free.max() < 1.0, "no vertex is without tethers"


def test_the_base_of_the_nose_sits_on_bone_and_its_tip_is_loose(face):
    """Captured: noses that are wrinkled rise by 3.8 mm at their base, lips that are raised take it up by 2.7 mm."""
    _, free = tip_of_nose(face)
    assert free[at(face, "nose_tip")] > 0.5
    assert free[at(face, "subnasale")] < -1.0
    wrinkled, raised = (settled(face, unit)[at(face, "subnasale"), 1] for unit in ("AU9", "AU10"))
    assert raised < wrinkled < 5.7


@pytest.mark.parametrize("stem", [None, pytest.param("makehuman_head_male", marks=pytest.mark.slow)])
def test_lining_holds_to_the_gums(real_face, stem, monkeypatch):
    """A laugh must not draw the lining behind the upper lip up with it: that bared a wall of gum."""
    face = head_with("bag") if stem is None else real_face(stem)
    gums = on_gums(face)
    above = np.flatnonzero((gums > 0.9) & ((face.points - face.landmarks["mouth_l"]) @ face.frame.axes[1] > 0.0))
    assert len(above) >= 10
    moved = settled(face, "laughter")
    monkeypatch.setattr("facewrinkle.motion.skin.on_gums", lambda face: np.zeros(len(face.points)))
    assert moved[above, 1].mean() < 0.75 * settled(copy.copy(face), "laughter")[above, 1].mean()
    assert moved[at(face, "upper_lip_mid"), 1] > 2.0, "it laughs nevertheless"


def test_gums_are_behind_the_lips_and_nowhere_else(face):
    gums = on_gums(head_with("bag"))
    assert not gums[: face.mesh.n_points].any()
    assert gums[ring("bag", 3)].max() > 0.95  # the walls behind the lips, off the line between these
    assert gums[ring("bag", 1)].max() < 0.05
    assert not on_gums(face).any()
