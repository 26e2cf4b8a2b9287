"""Words of the command line as values."""

from __future__ import annotations

import pytest

from facewrinkle.anatomy.atlas import load_atlas
from facewrinkle.commands.options import parse_mixture, whole_number
from facewrinkle.errors import ParameterError, UnknownNameError


def test_mixtures():
    atlas = load_atlas()
    assert parse_mixture("AU1=0.7,AU4", atlas) == {"AU1": 0.7, "AU4": 1.0}
    assert parse_mixture("corrugator", atlas) == {"corrugator": 1.0}
    for name in [*atlas.expressions, *atlas.action_units, *atlas.muscles]:
        assert parse_mixture(name, atlas) == {name: 1.0}
    with pytest.raises(UnknownNameError, match="'' *"):
        parse_mixture("AU1,", atlas)


@pytest.mark.parametrize(("name", "meant"), [("au1", "AU1"), ("SURPRISE", "surprise"), ("Jaw", "jaw")])
def test_the_case_of_a_name_does_not_hide_it(name, meant):
    with pytest.raises(UnknownNameError, match=f"unknown .* '{name}'. Did you mean .*'{meant}'"):
        parse_mixture(name, load_atlas())


def test_a_name_that_comes_twice():
    with pytest.raises(ParameterError, match="AU1 is named twice in 'AU1=0.5,AU1=0'. Give one number"):
        parse_mixture("AU1=0.5,AU1=0", load_atlas())


@pytest.mark.parametrize("text", ["2.5", "nan", "inf", "x", "1e400", ""])
def test_fractions_are_no_whole_numbers(text):
    with pytest.raises(ValueError, match="a whole number is needed, received"):
        whole_number(int, [text])
