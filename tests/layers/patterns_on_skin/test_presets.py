"""Presets: on the right place and side of all faces, mirrored, with changes, and refused where they cannot be."""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.layers.patterns_on_skin import presets


@pytest.mark.parametrize("stem", [None, "ict_face_narrow", "makehuman_head_male"])
def test_all_presets_on_all_faces(request, stem):
    face = request.getfixturevalue("face") if stem is None else request.getfixturevalue("real_face")(stem)
    size, axes = face.frame.pupil_distance, face.frame.axes
    for name in presets.names():
        layer = fw.PatternLayer.preset(name, face)
        laid = layer.laid(face)
        at = (laid.center.point - face.frame.origin) @ axes.T / size
        assert laid.center.distance < 0.2 * size
        window = laid.base_window
        assert 5 < (window > 0).sum() < 0.2 * len(window)
        side = ((face.points - face.frame.origin) @ axes[0])[window > 0.3]
        if name.endswith("_l"):
            assert at[0] > 0.2
            assert (side > 0).all()
        elif name.endswith("_r"):
            assert at[0] < -0.2
            assert (side < 0).all()
        else:
            assert abs(at[0]) < 0.05
        assert laid.chart[window > 0][:, 1] @ ((face.points - laid.center.point) @ axes[1])[window > 0] > 0  # upright
        assert 0 <= layer.level_needed(face) <= 5


@pytest.mark.filterwarnings("ignore:the mesh is too coarse to carry the pattern")
def test_left_and_right_are_mirror_images(face):
    level = fw.Refinement(max_level=0)
    layers = fw.PatternLayer.presets("eye_corner", face, sharpness=0.0, variation=0.0)
    frame = fw.Simulation(face, level, layers=layers, motion=fw.Still(face)).step()
    left, right = frame["pattern_eye_corner_l"], frame["pattern_eye_corner_r"]
    assert np.abs(left).max() > 0.1
    np.testing.assert_allclose(np.sort(left), np.sort(right), atol=2e-3)


def test_a_preset_takes_changes(face):
    layer = fw.PatternLayer.preset("forehead", face, depth=2.5, number=6, size=(1.0, 0.4), border=0.3)
    assert layer.depth == 2.5
    assert layer.patterns[0].number == 6
    assert layer.region.border == 0.3
    np.testing.assert_allclose(layer.region.size, np.array([1.0, 0.4]) * face.frame.pupil_distance)
    assert fw.PatternLayer.preset("frown", face).name == "frown"
