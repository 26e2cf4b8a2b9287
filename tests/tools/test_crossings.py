"""The analysis of folds that run through each other."""

import numpy as np
import pytest

import facewrinkle as fw
from tools.trials.crossings import AGES, Folded, _near, poses


def test_poses_are_units_and_expressions_alone_and_then_all_pairs(face):
    alone, every = poses(face, alone=True), poses(face)
    assert {len(pose) for pose in alone} == {1}
    assert every[: len(alone)] == alone
    both = [name for (name,) in alone if not (name.startswith("AU") and name[-1] in "LR")]
    assert len(every) - len(alone) == len(both) * (len(both) - 1) // 2
    assert poses(face) == every


def test_places_near_others():
    places, others = np.array([[0.0, 0, 0], [5, 0, 0]]), np.array([[0.5, 0, 0]])
    assert _near(places, others).tolist() == [True, False]
    assert not _near(places, np.empty((0, 3))).any()


@pytest.mark.slow
def test_surprise_turns_nothing_over_and_nothing_runs_through_itself():
    folded = Folded(fw.default_face())
    folded.pose(("paper_surprise",))
    for age in AGES:
        found = folded.measured(age)
        assert found["deep"] > 0.5
        assert found["turned"] == found["crossing"] == 0
        assert abs(found["net"]) < 0.01
