"""Faces by the options that choose one."""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.anatomy.atlas import DEFAULT_ATLAS
from facewrinkle.commands.options import FaceOptions


def test_a_face_with_another_atlas(tmp_path):
    other = tmp_path / "other.toml"
    text = DEFAULT_ATLAS.read_text(encoding="utf-8")
    other.write_text(text.replace("[expressions]", "[expressions]\nscowl = { corrugator = 0.5 }"), encoding="utf-8")
    face = FaceOptions(atlas=other).load()
    assert face.atlas.contractions("scowl") == {"corrugator_l": 0.5, "corrugator_r": 0.5}
    assert face.texture is not None
    assert face.brows is not None


def test_a_face_of_somebody(tmp_path):
    face = FaceOptions(identity="jaw=0.5, age=1").load()
    expected = fw.default_face(fw.Identity(jaw=0.5, age=1.0))
    assert np.array_equal(face.points, expected.points)
    assert not np.array_equal(face.points, fw.default_face().points)
    with pytest.raises(fw.FaceWrinkleError, match="built-in head"):
        FaceOptions(identity="jaw=1", face=tmp_path / "mesh.obj").load()
