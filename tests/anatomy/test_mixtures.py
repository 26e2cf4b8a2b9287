"""Names with numbers, as text."""

from __future__ import annotations

import pytest

from facewrinkle.anatomy.atlas import parse_weights, split_names
from facewrinkle.errors import ParameterError


@pytest.mark.parametrize("text", ["AU1=0.7+AU4", "AU1=.7,AU4", " AU1 = 7e-1 +AU4=+1 ", "AU1=70e-2, AU4=1e+0"])
def test_plus_and_comma_are_one(text):
    assert parse_weights(text) == {"AU1": 0.7, "AU4": 1.0}


def test_names_keep_what_joins_nothing():
    assert split_names("visème_ä+été, jawOpen+") == ["visème_ä", "été", "jawOpen+"]


@pytest.mark.parametrize(
    ("text", "message"),
    [("AU1=+AU4", r"such as AU1=0.7\+AU4; received 'AU1='"), ("AU1+AU1", "named twice"), ("AU1=a", "received 'AU1=a'")],
)
def test_what_is_no_mixture_is_refused(text, message):
    with pytest.raises(ParameterError, match=message):
        parse_weights(text)
    with pytest.raises(ParameterError, match=r"jaw=0.5,age=1; received 'jaw'"):
        parse_weights("jaw", usual=None)
