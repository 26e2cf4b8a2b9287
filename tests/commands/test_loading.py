"""The first sign of life of a command, on a terminal only, and gone before anything else is printed."""

from __future__ import annotations

import io
import sys

import pytest

from facewrinkle.cli import main
from facewrinkle.commands import loading


class Terminal(io.StringIO):
    def isatty(self):
        return True


def on_terminal(monkeypatch):
    """Put a terminal in place of stderr; from within a test, as pytest has its own before."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    return terminal


def wiped(text):
    """What is left on a line after carriage returns."""
    line = ""
    for part in text.split("\r"):
        line = part + line[len(part) :]
    return line


def test_a_command_shows_that_it_loads_before_it_fails(monkeypatch):
    terminal = on_terminal(monkeypatch)
    assert main(["info", "nothing.obj"]) == 1
    shown = terminal.getvalue()
    assert shown.startswith(loading.MESSAGE + "\r")
    assert shown.count(loading.MESSAGE) == 1
    assert wiped(shown).startswith("facewrinkle: there is no file")


@pytest.mark.parametrize(
    "arguments", [["--version"], ["info", "--help"], ["express", "AU1", "--quiet", "--frames", "0"]]
)
def test_nothing_is_shown_where_nothing_is_asked_for(monkeypatch, arguments):
    terminal = on_terminal(monkeypatch)
    main(arguments)
    assert loading.MESSAGE not in terminal.getvalue()


@pytest.mark.parametrize("arguments", [["atlas"], ["completion", "bash"]])
def test_it_is_gone_before_text_is_printed(monkeypatch, arguments):
    terminal = on_terminal(monkeypatch)
    monkeypatch.setattr(sys, "stdout", terminal)
    assert main(arguments) == 0
    before = f"{loading.MESSAGE}\r{' ' * len(loading.MESSAGE)}\r"
    shown = terminal.getvalue()
    assert shown.startswith(before)
    assert len(shown) > len(before)
    assert "\r" not in shown[len(before) :]


def test_files_get_none_of_it(capsys):
    main(["info", "nothing.obj"])
    assert loading.MESSAGE not in capsys.readouterr().err


def test_begin_and_end_go_together(monkeypatch):
    terminal = on_terminal(monkeypatch)
    loading.end()
    assert terminal.getvalue() == ""
    loading.begin()
    loading.begin()
    loading.end()
    loading.end()
    assert terminal.getvalue() == f"{loading.MESSAGE}\r{' ' * len(loading.MESSAGE)}\r"
