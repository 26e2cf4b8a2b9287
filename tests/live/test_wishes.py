"""What a document asks of a simulation, and of whoever writes it down."""

from __future__ import annotations

from facewrinkle.live.document import START
from facewrinkle.live.wishes import as_python, layers_of


def test_a_depth_goes_to_all_layers_and_into_what_is_written_down(face):
    data = {**START, "mixture": {"AU12": 1.0}, "folds": {**START["folds"], "depth": 0.8}}
    assert {layer.depth for layer in layers_of(data, face)} == {0.8}
    assert (
        "layers = fw.simulation.fold_layers.fold_layers(face, 'wave', depth=0.8)" in as_python(data, face).splitlines()
    )
    assert "depth" not in as_python(START, face)
