"""Shapes and lines of wave folds in files of faces: as they were found, or found anew where others would be.

a face that is read   | the shapes and the frames of the face that was written; nothing is simulated for them
another atlas, other muscles, another way to find them | nothing is known
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.anatomy.known_folds import STEP, known_folds
from facewrinkle.simulation import fold_shapes


@pytest.fixture(scope="module")
def coarse(face):
    """The built-in head with half its triangles, which no file knows."""
    return fw.fit_face(face.mesh.decimate(0.5), face.landmarks)


def frames(face, fingerprint):
    sim = fw.Simulation(face)
    sim.express("surprise")
    return [fingerprint(frame) for frame in sim.run(5)]


def test_a_face_that_is_read_knows_its_folds(coarse, tmp_path, fingerprint, monkeypatch):
    path = tmp_path / "coarse.face"
    assert known_folds(fw.read_face(fw.write_face(dataclasses.replace(coarse), path))).shapes == {}
    expected = frames(coarse, fingerprint)
    again = fw.read_face(fw.write_face(coarse, path))
    monkeypatch.setattr(fold_shapes, "relaxed_shapes", lambda *_: pytest.fail("they are in the file"))
    ours, theirs = known_folds(coarse), known_folds(again)
    assert list(theirs.shapes) == list(ours.shapes)
    for name, shape in ours.shapes.items():
        np.testing.assert_allclose(theirs.shapes[name], shape, rtol=0.0, atol=0.51 * STEP)
    assert frames(again, fingerprint) == expected


def test_what_would_be_found_otherwise_is_not_read(coarse, tmp_path, monkeypatch):
    fold_shapes.find_folds(coarse)
    path = fw.write_face(coarse, tmp_path / "coarse.face")
    assert known_folds(fw.read_face(path)).shapes
    units = {name: rates for name, rates in coarse.atlas.action_units.items() if name != "AU1"}
    assert not known_folds(fw.read_face(path, dataclasses.replace(coarse.atlas, action_units=units))).shapes
    monkeypatch.setattr("facewrinkle.anatomy.known_folds.VERSION", 0)
    assert not known_folds(fw.read_face(path)).shapes


def test_folds_of_changed_muscles_are_not_written(coarse, tmp_path):
    muscle = coarse.muscles["corrugator_l"]
    changed = coarse.with_muscles({"corrugator_l": dataclasses.replace(muscle, strength=2.0)})
    known_folds(changed).shapes = fold_shapes.find_folds(coarse).shapes
    assert not known_folds(fw.read_face(fw.write_face(changed, tmp_path / "changed.face"))).shapes
