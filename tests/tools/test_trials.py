"""Folds that run through each other; long runs that are stopped and go on, whatever becomes of their processes."""

import os
import time

import numpy as np
import pytest

import facewrinkle as fw
from tools.trials import runner
from tools.trials.crossings import AGES, Folded, _near, poses
from tools.trials.runner import DIED, run


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


# --- long runs that are stopped and go on ----------------------------------------------------------


def test_a_run_goes_on_where_it_was(tmp_path, monkeypatch):
    path = tmp_path / "some" / "run.jsonl"
    cases = [(7, 2), (9, 4), (5, 5)]
    first = run(path, divmod, cases[:2])
    assert first == {(7, 2): [3, 1], (9, 4): [2, 1]}
    lines = path.read_text().splitlines(keepends=True)
    path.write_text(lines[0].replace("[3, 1]", '"kept"') + lines[1][:30])  # killed as it wrote
    assert run(path, divmod, cases, workers=2) == {(7, 2): "kept", (9, 4): [2, 1], (5, 5): [1, 0]}
    assert run(path, divmod, [(9, 4), (1, 1)], minutes=0) == {(9, 4): [2, 1]}
    monkeypatch.setattr(runner, "code", lambda: "other")
    assert run(path, divmod, cases[:1]) == {(7, 2): [3, 1]}


@pytest.mark.slow
@pytest.mark.parametrize(("play", "case"), [(os._exit, 3), (time.sleep, 60)])
def test_what_a_process_does_not_come_back_from_is_an_outcome(tmp_path, play, case):
    path = tmp_path / "run.jsonl"
    assert run(path, play, [(case,)], seconds=1) == {(case,): DIED}
    assert path.read_text().count(DIED) == 1
