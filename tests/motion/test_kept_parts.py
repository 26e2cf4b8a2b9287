"""Parts that skins of a face share: the same bytes as of parts made anew, and gone with their face."""

from __future__ import annotations

import copy
import dataclasses
import gc
import weakref

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.motion import kept_parts
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


def muscle_stronger(face):
    old = face.muscles["zygomaticus_major_l"]
    face.muscles["zygomaticus_major_l"] = dataclasses.replace(old, strength=3.0 * old.strength)


def muscle_removed(face):
    face.muscles.pop("frontalis_inner_l")


def muscles_swapped(face):
    face.muscles["zygomaticus_major_l"] = face.muscles.pop("zygomaticus_major_l")  # now the last


def points_moved(face):
    face.mesh.points[face.mesh.find_closest_point(face.landmarks["malar_l"])] += [0.0, 0.0, 2.0]


def bone_softer(face):
    face.tissue.stiffness[:] *= 0.5


@pytest.mark.parametrize("change", [muscle_stronger, muscle_removed, muscles_swapped, points_moved, bone_softer])
def test_a_face_that_is_changed_in_place_is_that_of_its_next_skin(change):
    face = fw.default_face()
    before = moved(Skin(face))
    change(face)
    after = moved(Skin(face))
    np.testing.assert_array_equal(after, moved(Skin(copy.copy(face))))
    same = change in (muscle_removed, muscles_swapped)  # which were not contracted, and are the same muscles
    assert (np.abs(after - before).max() > 1e-3) != same


def test_muscles_of_lids_and_jaw_are_not_taken_out_in_place():
    face = fw.default_face()
    Skin(face)
    face.muscles.pop("jaw")
    with pytest.raises(fw.errors.ParameterError, match=r"has lost 'jaw'.*dataclasses\.replace"):
        Skin(face)
    assert "jaw" not in Skin(dataclasses.replace(face, muscles=face.muscles)).names


def test_the_mesh_of_a_fine_face_is_made_anew_once_it_has_changed():
    face = fw.default_face()
    one, other = (Skin(face, vertices=600) for _ in range(2))
    assert one.mesh is other.mesh is not Skin(face, vertices=650).mesh
    points_moved(face)
    after = Skin(face, vertices=600)
    assert after.mesh is not one.mesh
    np.testing.assert_array_equal(moved(after), moved(Skin(copy.copy(face), vertices=600)))


def arrays(thing, seen):
    """All arrays within a thing, however deep."""
    if isinstance(thing, np.ndarray):
        yield thing
    elif id(thing) not in seen and not isinstance(thing, str | int | float):
        seen.add(id(thing))
        for each in thing if isinstance(thing, list | tuple) else vars(thing).values():
            yield from arrays(each, seen)


def test_what_skins_share_cannot_be_written(face):
    skin = Skin(face)
    contacts = skin.contacts
    shared = [skin._bending, skin._pull, skin._minimiser.factors]
    shared += [contacts.solids, contacts.lips, contacts.lids, contacts.flesh]
    found = list(arrays(shared, set()))
    assert len(found) > 30
    assert not any(array.flags.writeable for array in found)
    with pytest.raises(ValueError, match="read-only"):
        skin._bending.data[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        contacts.solids.stiffness[:] = 0.0


def test_large_parts_are_not_kept(face, monkeypatch):
    monkeypatch.setattr(kept_parts, "LARGEST", 80)
    for count, times in ((10, 1), (11, 2)):
        made = []
        for _ in range(2):
            part = kept(face, f"part {count}", 1, lambda count=count, made=made: made.append(1) or np.zeros(count))
            assert part.shape == (count,)
        assert len(made) == times


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
