"""Atlases as files: what was written is read again."""

from __future__ import annotations

import dataclasses
import tomllib

import pytest

from facewrinkle.anatomy.atlas import load_atlas, read_atlas
from facewrinkle.anatomy.atlas_file import atlas_text, write_atlas
from facewrinkle.errors import OutputError, ParameterError

FIELDS = ("muscles", "action_units", "action_unit_names", "expressions", "tissue", "mixtures")


def test_the_atlas_of_the_package_is_read_again_as_it_is(tmp_path):
    atlas = load_atlas()
    again = read_atlas(write_atlas(atlas, tmp_path / "own.toml"))
    for name in FIELDS:
        assert getattr(again, name) == getattr(atlas, name), name


def test_expressions_keep_the_units_that_they_are_written_in(tmp_path):
    atlas = load_atlas()
    grim = {"happiness": 0.5, "AU4": 1.0}
    own = {**atlas.expressions, "grim": atlas.contractions(grim), "doubt": atlas.contractions("AU15")}
    changed = dataclasses.replace(atlas, expressions=own, mixtures={**atlas.mixtures, "grim": grim})
    again = read_atlas(write_atlas(changed, tmp_path / "own.toml"))
    assert again.expressions == changed.expressions
    for name in own:
        assert again.units_of({name: 1.0}) == changed.units_of({name: 1.0}), name
    assert again.units_of({"grim": 1.0}) == {"AU6": 0.5, "AU12": 0.5, "AU4": 1.0}
    assert again.units_of({"doubt": 1.0}) == {"AU15": 1.0}
    first = {"grim": own.pop("grim"), **own}  # before the expression that it is written in: by its muscles then
    changed = dataclasses.replace(changed, expressions=first)
    assert read_atlas(write_atlas(changed, tmp_path / "own.toml")).expressions == first


def test_pairs_are_stated_once(tmp_path):
    content = tomllib.loads(atlas_text(load_atlas()))
    assert "corrugator" in content["muscles"]
    assert not any(name.endswith(("_l", "_r")) for name in content["muscles"])
    assert content["expressions"]["frowning"] == {"corrugator": 1.0}
    assert content["expressions"]["closing_eye"].keys() == {"orbicularis_oculi_l", "orbicularis_oculi_orbital_l"}


@pytest.mark.parametrize("name", ["smirk", "a smile", 'the "wry" one', "back\\slash", "tab\there", "ж", "a.b"])
def test_names_of_any_letters_are_kept(tmp_path, name):
    atlas = load_atlas()
    own = {**atlas.expressions, name: {"zygomaticus_major_l": 0.25, "corrugator_l": 1.0, "corrugator_r": 0.5}}
    again = read_atlas(write_atlas(dataclasses.replace(atlas, expressions=own), tmp_path / "own.toml"))
    assert again.expressions[name] == own[name]


def test_sides_that_differ_have_no_file(tmp_path):
    atlas = load_atlas()
    muscles = {**atlas.muscles, "corrugator_l": {**atlas.muscles["corrugator_l"], "strength": 2.0}}
    with pytest.raises(ParameterError, match="two sides of the muscle corrugator differ"):
        atlas_text(dataclasses.replace(atlas, muscles=muscles))
    one = {name: entry for name, entry in atlas.muscles.items() if name != "corrugator_l"}
    with pytest.raises(ParameterError, match="corrugator_r without its other side"):
        atlas_text(dataclasses.replace(atlas, muscles=one))
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="own.toml"):
        write_atlas(atlas, tmp_path / "file" / "own.toml")
