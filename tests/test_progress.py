"""What a log says of long work."""

from __future__ import annotations

import pytest

from facewrinkle import progress


@pytest.mark.parametrize(
    ("seconds", "total", "said"),
    [
        (1.0, 100, [f"Making {k}/100" for k in range(10, 100, 10)]),
        (0.01, 100, []),
        (0.01, 10000, [f"Making {k}/10000" for k in range(1000, 10000, 1000)]),
        (30.0, 5, [f"Making {k}/5" for k in range(1, 5)]),
        (1.0, 1000, [f"Making {k}/1000" for k in range(60, 1000, 60)]),
    ],
)
def test_a_log_has_a_line_each_tenth_or_minute(seconds, total, said, monkeypatch, capsys):
    monkeypatch.delenv("FACEWRINKLE_PROGRESS", raising=False)
    clock = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    for _ in progress.bar_or_lines(range(total), "Making", total):
        clock[0] += seconds
    assert capsys.readouterr().err.splitlines() == said


def test_from_python_nothing_is_said_without_a_terminal(monkeypatch, capsys):
    monkeypatch.delenv("FACEWRINKLE_PROGRESS", raising=False)
    assert list(progress.bar(range(3), "Making", 3)) == [0, 1, 2]
    assert capsys.readouterr().err == ""
