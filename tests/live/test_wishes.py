"""What a document asks of a simulation, and of whoever writes it down."""

from __future__ import annotations

from facewrinkle.live.document import START
from facewrinkle.live.wishes import as_python, layers_of


def test_a_pinch_goes_to_both_layers_and_into_what_is_written_down(face):
    data = {**START, "mixture": {"AU12": 1.0}, "folds": {**START["folds"], "pinch": 0.8}}
    assert [layer.pinch for layer in layers_of(data, face)] == [0.8, 0.8]
    assert "layers = fold_layers(face, 'wave', pinch=0.8)" in as_python(data, face).splitlines()
    assert "pinch" not in as_python(START, face)
