"""Flat options are sorted into the groups that they belong to."""

import pytest

from facewrinkle.errors import ParameterError
from facewrinkle.tears import Film, Flow
from facewrinkle.tears.options import grouped


def test_a_group_given_keeps_its_other_fields():
    given = {"flow": Flow(c=10.0, hold=5.0), "c": 20.0, "unknown": 1}
    assert grouped(given, film=Film, flow=Flow) == {"flow": Flow(c=20.0, hold=5.0), "unknown": 1}
    assert given["c"] == 20.0


def test_numbers_are_checked():
    with pytest.raises(ParameterError, match="roughness"):
        grouped({"roughness": 3.0}, film=Film)
