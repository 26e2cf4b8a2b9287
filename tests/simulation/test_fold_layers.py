"""Muscles that were changed or added, in each of the three kinds of folds.

what                    checked against
changed muscles         as printed: an error that says how, and the change as it says; as waves: a warning
the paper's numbers     the lines of a muscle as printed: k0 multiplies heights, a start moves them away from the bone
added, taken away       the muscles that the simulation has
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.anatomy.atlas import printed_atlas
from facewrinkle.errors import FaceWrinkleWarning, ParameterError
from facewrinkle.layers.printed_wrinkles import PrintedWrinkles
from facewrinkle.simulation.fold_layers import FOLDS

UNREFINED = fw.Refinement(max_level=0)


def changed(face, name="corrugator_l", **changes):
    return face.with_muscles({name: face.muscles[name].replaced(**changes)})


def heights(face, **options):
    sim = fw.Simulation(face, UNREFINED, **options)
    sim.contract({"corrugator_l": 1.0})
    *_, frame = sim.run(12)
    return np.asarray(frame["W"])


@pytest.fixture(scope="module")
def printed(face):
    return face.with_atlas(printed_atlas())


@pytest.mark.parametrize(("name", "value"), [("depth", 2.0), ("alpha", 0.5), ("count", 8), ("start", 0.4)])
def test_the_papers_numbers_are_seen_as_printed(printed, name, value):
    """Each of k0, alpha, n_w and lambda_w, by the folds of the paper and no others."""
    usual = heights(printed, folds="printed")
    other = heights(changed(printed, **{name: value}), folds="printed")
    muscle = printed.muscles["corrugator_l"]
    assert np.abs(other - usual).max() > 0.1 * np.abs(usual).max()
    if name == "depth":
        np.testing.assert_allclose(other, usual * value / muscle.wrinkles.depth, rtol=1e-12, atol=1e-15)
    if name == "start":
        assert not other[muscle.coordinates(printed.points)[0] < value].any()


@pytest.mark.parametrize("changes", [{"depth": 4.0}, {"strength": 2.0}, {"folds": None, "count": 8}])
def test_a_change_is_never_lost(face, changes):
    """Muscles of the package's atlas are not those as printed: the error says which to change, and that works."""
    mine = changed(face, **changes)
    assert mine.muscles["corrugator_l"].same_as(fw.Simulation(mine, folds="paper").face.muscles["corrugator_l"])
    with pytest.raises(ParameterError, match="corrugator_l was changed") as caught:
        fw.Simulation(mine, folds="printed")
    assert "face.with_atlas(printed_atlas())" in str(caught.value)
    there = changed(face.with_atlas(printed_atlas()), depth=4.0)
    assert fw.Simulation(there, folds="printed").face is there


def test_a_crease_becomes_deeper_in_the_other_kinds(face):
    deeper = changed(face, depth=2.0 * face.muscles["corrugator_l"].wrinkles.depth)
    furrow = heights(face, folds="paper").argmin()  # waves beside it may be deeper
    for folds in ("wave", "paper"):
        assert heights(deeper, folds=folds)[furrow] < 1.5 * heights(face, folds=folds)[furrow] < 0.0


def test_waves_say_that_they_take_nothing_from_a_muscle(face):
    finer = changed(face, "frontalis_inner_l", count=7)
    with pytest.warns(FaceWrinkleWarning, match="frontalis_inner_l were changed, and its lines are drawn as waves"):
        fw.Simulation(finer)
    fw.Simulation(finer, folds="paper")  # no warning
    drawn = changed(finer, "frontalis_inner_l", waves=False)
    sim = fw.Simulation(drawn)
    sim.contract({"frontalis_inner_l": 1.0})
    sim.settle()
    assert np.abs(sim.fields("frontalis_inner_l")["W"]).max() > 0.1


@pytest.mark.parametrize("folds", FOLDS)
def test_added_muscles_stay_and_others_stay_away(face, folds):
    glabella, along = face.landmarks["glabella"], np.array([0.0, 14.0, 2.0])
    added = fw.LinearMuscle(glabella - along, glabella + along, max_angle=0.5, radius=40.0)
    muscles = {name: muscle for name, muscle in face.muscles.items() if not name.startswith("risorius")}
    sim = fw.Simulation(replace(face, muscles={**muscles, "procerus": added}), folds=folds)
    assert sim.face.muscles["procerus"] is added
    assert "risorius_l" not in sim.muscles
    assert "corrugator_l" in sim.muscles


def test_a_surface_keeps_its_own_muscles_as_printed(face):
    muscle = fw.LinearMuscle((0, 0, -5), (0, 20, 0), max_angle=0.5, radius=30.0)
    plain = fw.surface(face.mesh).with_muscles({"mine": muscle})
    sim = fw.Simulation(plain, folds="printed")
    assert sim.muscles == ("mine",)
    assert isinstance(sim.layers[0], PrintedWrinkles)
