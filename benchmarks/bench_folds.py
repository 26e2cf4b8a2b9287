"""Folds as waves beside the papers' folds, in one run and at about as many triangles.

Goals: a held step takes at most 1.6 times as long, a frame of the ramp at most twice; lines are found in less than a
second.
"""

from __future__ import annotations

import statistics
import time

import pytest

import facewrinkle as fw
from facewrinkle.layers.wave_folds.field import WaveField
from facewrinkle.layers.wave_folds.stripes import Style
from facewrinkle.simulation.fold_layers import fold_shapes

FRAMES, RAMP = 80, 40
BENT = 0.012
"""Threshold of the split criterion with which the papers' folds get as many triangles as the waves."""


@pytest.fixture(scope="module")
def sims():
    face = fw.default_face()
    paper = fw.Simulation(face, fw.Refinement(gamma_c=BENT, max_level=3), folds="paper")
    return {"wave": fw.Simulation(face, folds="wave"), "paper": paper}


def started(sim, expression):
    sim.reset()
    sim.express(expression)
    return sim.run(FRAMES, ramp=RAMP / FRAMES)


@pytest.fixture
def steps(sims, notes):
    """Plays an expression with both kinds of folds, up to a frame, and returns what makes the next frames."""

    def play(expression, frames):
        for sim in sims.values():  # compiled
            for _ in started(sim, expression):
                pass
        triangles = {folds: len(sim.forest.triangles) for folds, sim in sims.items()}
        notes[f"{expression}, triangles"] = ", ".join(f"{folds} {count}" for folds, count in triangles.items())
        assert min(triangles.values()) > 0.4 * max(triangles.values())
        runs = {folds: started(sim, expression) for folds, sim in sims.items()}
        for run in runs.values():
            for _ in range(frames):
                next(run)
        return [lambda run=runs[folds]: next(run) for folds in ("wave", "paper")]

    return play


@pytest.mark.parametrize("expression", ["surprise", "happiness"])
def test_ramp(versus, steps, expression):
    """All frames until the expression is at its strongest, those that refine with them."""
    versus(f"{expression}, ramp: waves, papers' folds", *steps(expression, 0), 0.5, RAMP, 0, statistics.fmean)


@pytest.mark.parametrize("expression", ["surprise", "happiness"])
def test_hold(versus, steps, expression):
    """Frames that hold the expression."""
    versus(f"{expression}, held: waves, papers' folds", *steps(expression, RAMP + 5), 0.625, FRAMES - RAMP - 8)


def test_lines_are_found_once_per_face(notes):
    face = fw.default_face()
    skin = fw.Skin(face)
    begin = time.perf_counter()
    shapes = fold_shapes(face, skin)
    between = time.perf_counter()
    field = WaveField(face, shapes, 1.0, Style(seed=7))
    end = time.perf_counter()
    waves = sum(len(own.phase) for own in field.lines.values())
    notes["lines of a face"] = f"shapes {between - begin:.2f} s, {waves} waves {end - between:.2f} s (goal: 1 s)"
    assert waves > 1000
