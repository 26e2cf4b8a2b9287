"""Words of the command line as values."""

from __future__ import annotations

import pytest

from facewrinkle.anatomy.atlas import load_atlas
from facewrinkle.commands.parsing import parse_mixture
from facewrinkle.errors import UnknownNameError


def test_mixtures():
    atlas = load_atlas()
    assert parse_mixture("AU1=0.7,AU4", atlas) == {"AU1": 0.7, "AU4": 1.0}
    assert parse_mixture("corrugator", atlas) == {"corrugator": 1.0}
    for name in [*atlas.expressions, *atlas.action_units, *atlas.muscles]:
        assert parse_mixture(name, atlas) == {name: 1.0}
    with pytest.raises(UnknownNameError, match="'' *"):
        parse_mixture("AU1,", atlas)
