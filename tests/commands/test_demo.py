"""``facewrinkle demo``: all expressions of the paper on two sheets."""

from __future__ import annotations

import pytest
from command_files import picture_shape

from facewrinkle.cli import main
from facewrinkle.commands import demo as demo_module
from facewrinkle.commands.table1 import PAPER


@pytest.mark.slow
def test_demo(tmp_path, monkeypatch, capsys):
    for name, value in (("SIZE", 48), ("FRAMES", 3), ("TILE", 32), ("ITERATIONS", 3), ("DRAWINGS", 1), ("SHEET", 32)):
        monkeypatch.setattr(demo_module, name, value)
    assert main(["demo", "--out", str(tmp_path), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    names = {row.expression for row in PAPER}
    others = {"contact.png", "contact_sheet.png", "table1.txt", "table1.json"}
    assert {path.name for path in tmp_path.iterdir()} == names | others
    for name in names:
        files = {path.name for path in (tmp_path / name).iterdir()}
        assert files == {f"{name}.png", f"{name}_closeup.png", f"{name}.mp4"}
    assert picture_shape(tmp_path / "contact.png") == (3 * 32 + 2 * 4, 5 * 32 + 4 * 4)
    assert picture_shape(tmp_path / "contact_sheet.png") == (6 * 32 + 5 * 4, 3 * 32 + 2 * 4)
