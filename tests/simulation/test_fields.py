"""The fields of muscles in frames, in each kind of folds.

what                    checked against
lambda, gamma, muscle   the muscle's own formula at the rest place of the vertex; only muscles that contract
the forehead            of a surprise: most of what is folded there lies over a muscle that contracts
fields(muscle)          the muscle's own formula, of every muscle, also at rest; as printed, the heights of all make W
the table of fields     docs/howto/fields.rst against the arrays of frames
"""

import re
from pathlib import Path

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.simulation.fold_layers import FOLDS

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "fields.rst"


def simulated(face, folds):
    sim = fw.Simulation(face, folds=folds)
    sim.express("surprise" if folds == "printed" else "paper_surprise")
    *_, frame = sim.run(20)
    return sim, frame


@pytest.fixture(scope="module", params=FOLDS)
def surprise(request, face):
    return simulated(face, request.param)


def pattern_of(sim, name):
    """The region of a muscle: as printed, muscles have no other folds than their own."""
    return sim.face.muscles[name].fold_pattern


def test_places_are_those_of_the_muscle_that_folds_them(surprise):
    sim, frame = surprise
    rates = dict(zip(sim.muscles, sim.skin.rates, strict=True))
    muscle, x = frame["muscle"], np.asarray(frame["rest"])
    assert len(np.unique(muscle)) > 4
    for k in np.unique(muscle[muscle >= 0]).tolist():
        name, mine = sim.muscles[k], muscle == k
        assert rates[name] > 0.0
        assert pattern_of(sim, name).wrinkling_region(x[mine]).all()
        first, second = pattern_of(sim, name).coordinates(x[mine])
        np.testing.assert_allclose(frame["lambda"][mine], first, rtol=0, atol=1e-10)
        np.testing.assert_allclose(frame["gamma"][mine], second, rtol=0, atol=1e-10)
    assert not frame["lambda"][muscle == -1].any()
    assert not frame["gamma"][muscle == -1].any()


def test_what_is_folded_on_the_forehead_lies_over_a_muscle(surprise):
    sim, frame = surprise
    x = np.asarray(frame["rest"])
    regions = [pattern_of(sim, n).wrinkling_region(x) for n in sim.muscles if n.startswith("frontalis")]
    folded = np.any(regions, axis=0) & (np.abs(frame["W"]) > 0.05)
    assert folded.sum() > 300
    assert (frame["muscle"][folded] >= 0).mean() > 0.9


def test_every_muscle_tells_its_fields(surprise):
    sim, frame = surprise
    x, total = np.asarray(frame["rest"]), np.zeros(frame.n_points)
    for name in sim.muscles:
        fields, pattern = sim.fields(name), pattern_of(sim, name)
        total += fields["W"]
        inside, where = pattern.wrinkling_region(x), fields["region"]
        assert not (where & ~inside).any() or isinstance(pattern, fw.Crease)  # one of a person is shifted
        if not isinstance(pattern, fw.Crease):
            for array, values in zip(("lambda", "gamma"), pattern.coordinates(x), strict=True):
                np.testing.assert_allclose(fields[array][where], values[where], rtol=0, atol=1e-10)
        assert not any(fields[array][~where].any() for array in ("lambda", "gamma", "epsilon", "W"))
    assert sim.fields("frontalis_inner_l")["region"].sum() > 100
    assert sim.fields("frontalis_inner_l")["epsilon"].max() > 0.05
    if type(sim.layers[0]).__name__ == "PrintedWrinkles":
        np.testing.assert_allclose(total, frame["W"], rtol=0, atol=1e-12)


def test_the_compression_over_waves_is_that_of_the_formula(face):
    """Of a muscle whose lines are waves: the same as where its lines are drawn."""
    told = []
    for folds in ("wave", "paper"):
        sim, _ = simulated(face, folds)
        told.append(sim.fields("frontalis_inner_l")["epsilon"][: face.mesh.n_points])
    np.testing.assert_allclose(*told, rtol=0, atol=1e-9)


def test_what_no_layer_knows_says_what_to_add(face):
    sim = fw.Simulation(face, layers=[fw.WaveFolds()])
    with pytest.raises(fw.errors.ParameterError, match=r"Add MuscleWrinkles\(\) to its layers, or Creases\(\)"):
        sim.fields("corrugator_l")


def test_the_page_lists_every_array_of_a_frame(face):
    """In the first column of its tables; a name that ends in dots is the beginning of others."""
    lists = re.findall(r"``([^`]+)``", "\n".join(re.findall(r"^   \* - (``.*)$", PAGE.read_text("utf-8"), re.M)))
    starts = tuple(name.removesuffix("...") for name in lists if name.endswith("..."))
    dimple = fw.PatternLayer.preset("dimple_l", face)
    sim = fw.Simulation(face, layers=[fw.MuscleWrinkles(waves=False), fw.Creases(), fw.WaveFolds(), dimple])
    sim.express({"AU27": 0.5, "AU19": 0.5})
    sim.look(yaw=10)
    frame = sim.step()
    found = {*frame.point_data, *frame.cell_data, *frame.field_data}
    unknown = {name for name in found if name not in lists and not name.startswith(starts)}
    assert not unknown
    of_recordings = {"pose", "mandible", "part_...", "images", "object names"}
    missing = {name for name in lists if name.removesuffix("...") not in found}
    missing = {name for name in missing if not (name.endswith("...") and any(n.startswith(name[:-3]) for n in found))}
    assert missing <= of_recordings | {"Colors", "Texture Corners", "image", "object name", "part"}
