"""Progress of a command on a terminal."""

from __future__ import annotations

import warnings

import pytest

from facewrinkle.commands.options import Report


@pytest.mark.parametrize("terminal, quiet, shown", [(True, False, True), (True, True, False), (False, False, False)])
def test_what_takes_a_while_is_told_where_there_is_a_terminal(capsys, monkeypatch, terminal, quiet, shown):
    monkeypatch.setattr("rich.console.Console.is_terminal", terminal)
    with warnings.catch_warnings(), Report(quiet).waiting("Preparing the skin"):
        pass
    out, err = capsys.readouterr()
    assert ("Preparing the skin" in err) is shown
    assert not out
