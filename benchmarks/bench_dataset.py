"""Samples of data sets against quick drawings of the same frames.

A sample of the default specification has its tenth of a person, an expression that comes to rest, a picture with all
lamps, all labels and its files; persons are not alike, so that means are compared. The drawing: one lamp, no shader of
the skin, no anti-aliasing; in a scene of its own, as one draws a single picture, and in one for all. Goal: a sample
takes at most twice as long. It is missed: a picture with all lamps alone takes most of that.
"""

from __future__ import annotations

import statistics

import pytest

from facewrinkle.dataset import SampleMaker, Spec
from facewrinkle.dataset.plan import plan_of
from facewrinkle.dataset.sample import place
from facewrinkle.plotting import Scene, Style

PEOPLE = 2


@pytest.fixture(scope="module")
def drawn():
    """A face, and frames of it with the plans that they are of."""
    spec, found = Spec.of({"shard": 10}), []  # samples of a person follow each other
    with SampleMaker(spec) as maker:
        for plan in (plan_of(spec, index) for index in range(spec.per_person)):
            _, simulation = maker.simulation_of(plan.person)
            found.append((next(maker.frames(simulation, plan)), plan))
    return simulation.face, found


@pytest.mark.parametrize("own", [True, False], ids=["own", "shared"])
def test_sample(versus, drawn, own):
    """Twenty samples with two persons that are new, against as many drawings."""
    spec, (face, frames) = Spec.of({"shard": 10}), drawn
    style, count = Style(spec.size, quick=True), PEOPLE * spec.per_person
    numbers, content = iter(range(spec.per_person, 10 * count)), iter(frames * 10)
    with SampleMaker(spec) as maker, Scene(face, style) as shared:

        def sample():
            for picture in maker.pictures(next(numbers)):
                picture.files()

        def draw():
            frame, plan = next(content)
            if own:
                with Scene(face, style) as scene:
                    place(scene, plan, spec)
                    scene.picture(frame)
                return
            place(shared, plan, spec)
            shared.picture(frame)

        where = "in a scene of its own" if own else "all in one scene"
        versus(f"sample of a data set, quick drawing {where}", sample, draw, 0.5, count, 0, statistics.fmean)
