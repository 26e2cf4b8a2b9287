"""The atlas that is printed, edited and given back."""

from __future__ import annotations

import pytest

from facewrinkle.anatomy.atlas import DEFAULT_ATLAS, load_atlas, read_atlas
from facewrinkle.cli import main
from facewrinkle.errors import FaceWrinkleError


def test_the_atlas_is_printed_and_can_be_given_back(tmp_path, capsys):
    assert main(["atlas"]) == 0
    assert capsys.readouterr().out == DEFAULT_ATLAS.read_text(encoding="utf-8")
    assert main(["atlas", "--out", str(tmp_path / "mine.toml")]) == 0
    assert read_atlas(tmp_path / "mine.toml").muscles == load_atlas().muscles
    assert main(["atlas", "--out", str(tmp_path / "mine.txt")]) == 1
    assert "must end in .toml" in capsys.readouterr().err


def test_a_file_with_the_changes_is_enough(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'base = "facewrinkle"\n[muscles.corrugator]\nstrength = 1.5\n[expressions]\nsmirk = { AU12L = 0.5 }\n'
    )
    mine, usual = read_atlas(path), load_atlas()
    assert mine.expressions["smirk"] == {"zygomaticus_major_l": 0.5}
    assert mine.expressions["frowning"] == usual.expressions["frowning"]
    assert mine.muscles["corrugator_l"] == {**usual.muscles["corrugator_l"], "strength": 1.5}
    assert mine.muscles["jaw"] == usual.muscles["jaw"]
    assert mine.tissue == usual.tissue
    for text, message in (
        ('base = "mine"', "unknown base of an atlas 'mine'"),
        ("muscels = {}", "unknown table 'muscels'"),
    ):
        path.write_text(text if "base" in text else f'base = "facewrinkle"\n{text}')
        with pytest.raises(FaceWrinkleError, match=message):
            read_atlas(path)
