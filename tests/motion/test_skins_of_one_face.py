"""What skins of one face share: the same bytes as made anew, and gone with the face."""

from __future__ import annotations

import copy
import dataclasses
import gc
import weakref

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.motion.skin import Skin, SkinMaterial


def moved(skin):
    skin.contract({"jaw": 0.4, "orbicularis_oris": 0.8, "zygomaticus_major_l": 0.6, "orbicularis_oculi_r": 1.0})
    return np.array([skin.step() for _ in range(4)])


@pytest.mark.parametrize(
    "options", [{}, {"time_step": 0.5}, {"material": SkinMaterial(bending=3.0)}], ids=["same", "steps", "material"]
)
def test_a_skin_of_shared_parts_moves_as_one_of_its_own(face, options):
    before, other = moved(Skin(face)), moved(Skin(face, **options))  # of parts that skins before may have made
    again = moved(Skin(face, **options))
    np.testing.assert_array_equal(again, other)
    np.testing.assert_array_equal(moved(Skin(copy.copy(face), **options)), other)
    np.testing.assert_array_equal(moved(Skin(copy.copy(face))), before)
    assert not options or not np.array_equal(before, other)


def test_skins_of_a_fine_face_share_its_mesh():
    face = fw.default_face()
    one, other = (Skin(face, vertices=600) for _ in range(2))
    assert one.mesh is other.mesh is not Skin(face, vertices=650).mesh
    np.testing.assert_array_equal(moved(other), moved(Skin(copy.copy(face), vertices=600)))


def test_two_skins_at_once_do_not_meet(face):
    alone, (one, other) = moved(Skin(face)), (Skin(face), Skin(face))
    one.contract({"jaw": 1.0})
    one.step()
    np.testing.assert_array_equal(moved(other), alone)


def test_a_face_with_other_muscles_has_skins_of_its_own(face):
    before = moved(Skin(face))
    stronger = dataclasses.replace(face.muscles["zygomaticus_major_l"], strength=3.0)
    other = moved(Skin(face.with_muscles({"zygomaticus_major_l": stronger})))
    assert np.abs(other - before).max() > 1e-3
    np.testing.assert_array_equal(moved(Skin(face)), before)
    without = dataclasses.replace(face, muscles={name: m for name, m in face.muscles.items() if name != "jaw"})
    assert "jaw" not in Skin(without).names


def test_what_skins_share_leaves_with_their_face():
    face = fw.default_face()
    Skin(face)
    gone = weakref.ref(face)
    del face
    gc.collect()
    assert gone() is None
