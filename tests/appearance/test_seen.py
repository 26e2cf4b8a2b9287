"""What is seen of a face is made once, and worked out once for each frame."""

from __future__ import annotations

import gc
import pickle
import weakref

import numpy as np
from drawing import held

import facewrinkle as fw
from facewrinkle.appearance.seen import Appearance, companion_meshes


def test_the_same_frame_is_worked_out_once(face):
    frame = held("surprise")
    appearance = Appearance.of(face)
    seen = appearance.at(frame)
    assert Appearance.of(face) is appearance
    assert appearance.at(frame) is seen
    assert seen.brows is appearance.at(frame).brows
    assert appearance.at(face.mesh) is not seen


def test_a_frame_that_was_modified_is_worked_out_again(face):
    frame = held("surprise").copy()
    before = Appearance.of(face).at(frame).eyes["l"]["paint"].copy()
    shut = np.asarray(held("AU43").points)[: face.mesh.n_points]
    frame.points[: face.mesh.n_points] = shut
    after = Appearance.of(face).at(frame).eyes["l"]["paint"]
    assert np.abs(after.astype(int) - before).max() > 20  # the shadow of the lid has come down


def test_what_is_written_may_be_changed(face):
    """Files get copies: what pictures show stays."""
    frame = held("happiness")
    seen = Appearance.of(face).at(frame)
    points = np.array(seen.eyes["l"].points)
    companion_meshes(face, frame)["eye_l"].points += 1.0
    np.testing.assert_array_equal(seen.eyes["l"].points, points)


def test_it_is_one_with_its_face():
    """It goes with the face, and does not keep it; other faces have their own."""
    face = fw.default_face()
    appearance = Appearance.of(face)
    appearance.at(face.mesh)
    other = face.with_muscles({})
    assert Appearance.of(other).face is other
    again = pickle.loads(pickle.dumps(face))
    assert again.mesh.n_cells == face.mesh.n_cells
    gone = weakref.ref(face)
    del face, appearance
    gc.collect()
    assert gone() is None
