"""Children's proportions, and the faint folds that go with them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import frame_of
from facewrinkle.anatomy.youth import CHILDS_FOLDS, YOUNG_FOLDS, childlike, fold_depth

BABY = fw.Identity(width=0.4, length=-1.0, jaw=-1.0, chin=-1.0, nose_length=-1.0, brow=-1.0, cheeks=1.0, age=-1.0)


def test_adults_of_all_proportions_are_no_children(face):
    assert childlike(face.landmarks, face.frame) == 0.0
    for seed in range(1, 9):
        person = fw.default_face(fw.Identity.random(seed))
        assert childlike(person.landmarks, person.frame) < 0.1
    baby = fw.default_face(BABY)
    assert childlike(baby.landmarks, baby.frame) > 0.7


def test_proportions_count_in_any_unit_and_pose(face):
    turn, baby = Rotation.from_euler("xyz", [40.0, 10.0, -70.0], degrees=True), fw.default_face(BABY)
    marks = {name: 0.001 * turn.apply(place) for name, place in baby.landmarks.items()}
    assert childlike(marks, frame_of(marks)) == pytest.approx(childlike(baby.landmarks, baby.frame), abs=1e-6)


def test_a_child_s_folds_are_faint(face):
    """At the corners of smiling eyes; the creases that all people have, beside the nose, stay."""
    baby, heights = fw.default_face(BABY), {}
    assert baby.fold_depth < 1.2 * CHILDS_FOLDS * YOUNG_FOLDS + 0.1
    assert fold_depth(face.landmarks, face.frame, -0.5) == pytest.approx(0.5 * (1.0 + YOUNG_FOLDS))
    for name, who in (("adult", face), ("baby", baby)):
        simulation = fw.Simulation(who)
        simulation.express("happiness")
        *_, frame = simulation.run(12)
        points, w = np.asarray(frame.point_data["rest"]), np.abs(frame["W"])
        marks, size = who.landmarks, who.frame.pupil_distance
        crows = np.linalg.norm(points - marks["eye_l_outer"] - 0.2 * size * who.frame.axes[0], axis=1) < 0.12 * size
        beside = np.linalg.norm(points - 0.5 * (marks["ala_l"] + marks["mouth_l"]), axis=1) < 0.25 * size
        heights[name] = w[crows].max(), w[beside].max()
    assert heights["baby"][0] < 0.5 * heights["adult"][0]
    assert heights["baby"][1] > 0.5 * heights["adult"][1]
