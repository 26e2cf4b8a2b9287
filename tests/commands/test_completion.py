"""What shells complete."""

from __future__ import annotations

import pytest

from facewrinkle.cli import main


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_commands_and_options_are_completed(shell, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    for word in ("express", "pattern", "intensity", "landmarks"):
        assert word in script
