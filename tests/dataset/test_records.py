"""What is told of pictures: the same entries with the same types for all, whoever is seen."""

from __future__ import annotations

import json

import facewrinkle as fw
from facewrinkle.dataset import SampleMaker, Spec
from facewrinkle.dataset.records import mixture_text


def shape_of(value):
    """The names and types in JSON, but not its numbers; lists by their first entry."""
    if isinstance(value, dict):
        return {name: shape_of(each) for name, each in value.items()}
    if isinstance(value, list):
        return [shape_of(value[0])]
    return type(value).__name__


def test_a_scan_and_the_head_have_the_same_entries(tmp_path):
    fw.write_face(fw.default_face(), tmp_path / "anna.face")
    scans = [{"path": str(tmp_path / "anna.face"), "weight": 1.0, "licence": "CC0"}]
    shapes, names = [], []
    for built_in, crying in ((0.0, 0.0), (1.0, 1.0)):
        faces = {"built_in": built_in, "scans": [] if built_in else scans}
        spec = Spec.of({"size": [48, 48], "quick": True, "faces": faces, "tears": {"share": crying}})
        with SampleMaker(spec) as maker:
            record = json.loads(maker.sample(0).files()["json"])
        shapes.append(shape_of(record))
        names.append((record["person"]["scan"], record["person"]["monk"] > 0, record["plan"]["tears"] >= 0.0))
    assert shapes[0] == shapes[1]
    assert "NoneType" not in str(shapes[0])
    assert names == [("anna.face", False, False), ("", True, True)]


def test_mixtures_are_texts_that_expressions_take():
    mixture = {"AU9": 0.25, "happiness": 0.5}
    atlas = fw.default_face().atlas
    assert atlas.contractions(mixture_text(mixture)) == atlas.contractions(mixture)
