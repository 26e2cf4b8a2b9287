"""``facewrinkle demo``: all expressions of the paper on sheets, which the README shows."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from command_files import picture_shape
from PIL import Image

import facewrinkle as fw
from facewrinkle.cli import main
from facewrinkle.commands import demo as demo_module
from facewrinkle.commands.options import FoldOptions, Report
from facewrinkle.commands.recorder import Scenes
from facewrinkle.commands.table1 import PAPER, as_text, measure
from facewrinkle.errors import ParameterError

IMAGES = Path(__file__).parents[2] / "docs" / "images"


@pytest.mark.slow
def test_demo(tmp_path, monkeypatch, capsys):
    for name, value in (("SIZE", 48), ("FRAMES", 3), ("TILE", 32), ("ITERATIONS", 3), ("DRAWINGS", 1), ("SHEET", 32)):
        monkeypatch.setattr(demo_module, name, value)
    assert main(["demo", "--out", str(tmp_path), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    sheets = {"printed.png", "wave.png", "contact_sheet.png"}
    assert {path.name for path in tmp_path.iterdir()} == {"printed", "wave", "table1.txt", "table1.json"} | sheets
    for folds in ("printed", "wave"):
        for name in (row.expression for row in PAPER):
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
    start = [row.expression for row in PAPER].index("closing_eye") * (side + 4)
    shown = sheet[:, start : start + side]
    for tile in (slice(0, side), slice(side + 4, 2 * side + 4), slice(2 * side + 8, None)):
        assert abs(shown[tile] - drawn[tile]).mean() < 1.5
    assert abs(shown - bare)[side + 4 : 2 * side + 4].mean() > 1.5


# --- Table 1 --------------------------------------------------------------------------------------


@pytest.mark.slow
def test_table1_measures_and_writes(tmp_path, capsys):
    options = ["--iterations", "8", "--drawings", "2", "--out", str(tmp_path)]
    assert main(["table1", *options]) == 0
    out = capsys.readouterr().out
    text = (tmp_path / "table1.txt").read_text(encoding="utf-8")
    assert out.strip() == text.strip()
    content = json.loads((tmp_path / "table1.json").read_text(encoding="utf-8"))
    assert content["iterations"] == 8
    assert [row["expression"] for row in content["here"]] == [row.expression for row in PAPER]
    for row in content["here"]:
        parts = [row[name] for name in ("Te", "Ta", "Tw", "Tr")]
        assert all(part > 0.0 for part in (row["Tp"], *parts))
        assert row["fps"] == pytest.approx(8 / sum(parts))
        assert (row["before"], row["expression"] in text) == (4517, True)


def test_table1_prints_the_paper_beside_it():
    lines = as_text(list(PAPER), 250, "a machine").splitlines()
    for row, line in zip(PAPER, lines[2:7], strict=True):
        twice = [f"{value:.2f}" for value in (row.Tp, row.Te, row.Ta, row.Tw, row.Tr) for _ in range(2)]
        triangles = [str(row.before), "->", str(row.after)] * 2
        assert line.split() == [row.expression, *triangles, *twice, *[f"{row.fps:.1f}"] * 2]
    assert len({len(line) for line in lines[:7]}) == 1


def test_table1_refuses_nonsense():
    for iterations, drawings in ((0, 1), (1, 0)):
        with pytest.raises(ParameterError):
            next(measure(fw.default_face(), iterations, drawings))
