"""``facewrinkle demo``: all expressions of the paper on sheets, which the README shows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from command_files import picture_shape
from PIL import Image

from facewrinkle.cli import main
from facewrinkle.commands import demo as demo_module
from facewrinkle.commands.options import FoldOptions, Report
from facewrinkle.commands.recorder import Scenes

IMAGES = Path(__file__).parents[2] / "docs" / "images"


@pytest.mark.slow
def test_demo(tmp_path, monkeypatch, capsys):
    for name, value in (("SIZE", 48), ("FRAMES", 3), ("TILE", 32), ("SHEET", 32)):
        monkeypatch.setattr(demo_module, name, value)
    assert main(["demo", "--out", str(tmp_path), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    sheets = {"printed.png", "wave.png", "contact_sheet.png"}
    assert {path.name for path in tmp_path.iterdir()} == {"printed", "wave"} | sheets
    for folds in ("printed", "wave"):
        for name in demo_module.EXPRESSIONS:
            files = {path.name for path in (tmp_path / folds / name).iterdir()}
            assert files == {f"{name}.png", f"{name}_closeup.png", f"{name}.mp4"}
        assert picture_shape(tmp_path / f"{folds}.png") == (3 * 32 + 2 * 4, 5 * 32 + 4 * 4)
    assert picture_shape(tmp_path / "contact_sheet.png") == (6 * 32 + 5 * 4, 3 * 32 + 2 * 4)


@pytest.mark.pictures
@pytest.mark.parametrize("folds", ["printed", pytest.param("wave", marks=pytest.mark.slow)])
def test_the_readme_shows_what_is_drawn_today(folds, face, tmp_path):
    """One column of its picture, whose palette costs one step of brightness in the mean; wrinkles change more."""
    renderer = pv.GPUInfo().renderer
    if "llvmpipe" not in renderer:
        pytest.skip(f"the picture is one of Mesa's llvmpipe; {renderer} draws other pixels")
    options = FoldOptions(folds)
    with Scenes(options.face(face)) as scenes:
        peak = demo_module.perform("closing_eye", options, scenes, tmp_path, Report(quiet=True), movie=False)
    plain = replace(peak, closeup=[peak.closeup[1]] * 4)
    drawn, bare = (demo_module.column(each).astype(float) for each in (peak, plain))
    with Image.open(IMAGES / f"expressions_{folds}.png") as image:
        sheet = np.asarray(image.convert("RGB"), float)
    side = demo_module.TILE
    start = demo_module.EXPRESSIONS.index("closing_eye") * (side + 4)
    shown = sheet[:, start : start + side]
    for tile in (slice(0, side), slice(side + 4, 2 * side + 4), slice(2 * side + 8, None)):
        assert abs(shown[tile] - drawn[tile]).mean() < 1.5
    assert abs(shown - bare)[side + 4 : 2 * side + 4].mean() > 1.5
