"""The first things that a page is told of a face.

sliders that do nothing | their reasons, on faces without eyes, mouth or muscles
handles of muscles      | every muscle that pulls has one, on the skin, apart from the others; left and right mirrored
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from facewrinkle.live.answers import ROOM, pulls_of, without_effect
from facewrinkle.live.document import START
from facewrinkle.live.wishes import as_python, layers_of


def test_sliders_that_do_nothing_say_why(face):
    shut = SimpleNamespace(atlas=face.atlas, muscles=face.muscles, mouth_opens=False, eyelid_openings={})
    off = without_effect(shut)
    assert "mouth" in off["AU26"]
    assert "lids" in off["AU43"]
    assert "AU12" not in off
    assert without_effect(face) == {}
    bare = SimpleNamespace(atlas=face.atlas, muscles={})
    assert set(without_effect(bare).values()) == {"this surface has no muscles"}


def test_each_muscle_that_pulls_has_a_handle_of_its_own(face):
    pulls = pulls_of(face)
    pulling = {name for name, muscle in face.muscles.items() if np.abs(muscle.force(face.points)).max() > 0.0}
    assert set(pulls) == pulling | {"jaw"}
    places = np.array([face.points[each["vertex"]] + each["offset"] for each in pulls.values()])
    seen = places @ face.frame.axes[:2].T
    apart = np.linalg.norm(seen[:, None] - seen, axis=2) + 1e9 * np.eye(len(seen))
    assert apart.min() > 0.5 * ROOM * face.frame.pupil_distance
    assert max(np.linalg.norm(each["offset"]) for each in pulls.values()) < 0.25 * face.frame.pupil_distance
    for name in pulls:
        if name.endswith("_l"):
            left, right = (np.array(pulls[each]["pull"]) for each in (name, f"{name[:-2]}_r"))
            assert np.abs(left * [-1.0, 1.0, 1.0] - right).max() < 0.02


# --- what a document asks of a simulation, and of whoever writes it down --------------------------


def test_a_depth_goes_to_all_layers_and_into_what_is_written_down(face):
    data = {**START, "mixture": {"AU12": 1.0}, "folds": {**START["folds"], "depth": 0.8}}
    assert {layer.depth for layer in layers_of(data, face)} == {0.8}
    assert (
        "layers = fw.simulation.fold_layers.fold_layers(face, 'wave', depth=0.8)" in as_python(data, face).splitlines()
    )
    assert "depth" not in as_python(START, face)
