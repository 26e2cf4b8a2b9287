"""``facewrinkle table1``: the measured table beside the paper's."""

from __future__ import annotations

import json

import pytest

import facewrinkle as fw
from facewrinkle.cli import main
from facewrinkle.commands.table1 import PAPER, as_text, measure
from facewrinkle.errors import ParameterError


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
