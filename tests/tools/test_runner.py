"""Long runs that are stopped and go on: torn files, other code, processes that die or take too long."""

from __future__ import annotations

import os
import time

import pytest

from tools.trials import runner
from tools.trials.runner import DIED, run


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
