"""Parts that skins of a face share: the same bytes as of parts made anew, and gone with their face."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.motion.kept_parts import forget, kept
from facewrinkle.motion.material import SkinMaterial
from facewrinkle.motion.skin import Skin


def moved(skin):
    skin.contract({"jaw": 0.4, "orbicularis_oris": 0.8, "zygomaticus_major_l": 0.6, "orbicularis_oculi_r": 1.0})
    return np.array([skin.step() for _ in range(4)])


@pytest.mark.parametrize(
    "options", [{}, {"time_step": 0.5}, {"material": SkinMaterial(bending=3.0)}], ids=["same", "steps", "material"]
)
def test_a_skin_of_kept_parts_moves_as_one_of_its_own(face, options):
    before, other = moved(Skin(face)), moved(Skin(face, **options))  # of parts that skins before may have made
    again = moved(Skin(face, **options))
    forget(face)
    np.testing.assert_array_equal(moved(Skin(face, **options)), other)
    np.testing.assert_array_equal(again, other)
    np.testing.assert_array_equal(moved(Skin(face)), before)
    assert not options or not np.array_equal(before, other)


def test_two_skins_at_once_do_not_meet(face):
    alone, (one, other) = moved(Skin(face)), (Skin(face), Skin(face))
    one.contract({"jaw": 1.0})
    one.step()
    np.testing.assert_array_equal(moved(other), alone)


def test_parts_are_made_once_for_a_key_and_leave_with_their_face():
    face, made = fw.default_face(), []
    for key in (1, 1, 2, 2):
        kept(face, "part", key, lambda key=key: made.append(key))
    assert made == [1, 2]
    Skin(face)
    gone = weakref.ref(face)
    del face
    gc.collect()
    assert gone() is None
