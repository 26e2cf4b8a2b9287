"""A frame of the model (skin, refinement, amplitudes, normals, PolyData) against the cheapest drawing of that frame.

The drawing: 800 x 800 off screen, one headlight, one plain color, no anti-aliasing, the frame's own normals, nothing
read back. Goal: the model takes less than half of it, so that with it two in three milliseconds go into the picture.
"""

from __future__ import annotations

import statistics

import pytest

import facewrinkle as fw

FRAMES, RAMP = 100, 60
EXPRESSIONS = ("paper_surprise", "frowning", "closing_eye", "stretching_mouth", "paper_fear")


@pytest.fixture(scope="module")
def sim():
    return fw.Simulation(fw.default_face())


class Played:
    """The frames of a simulation, one by one, and where their time goes."""

    def __init__(self, sim, frames):
        self.sim, self.frames, self.triangles = sim, frames, []
        self.frame = sim.face.mesh.compute_normals(split_vertices=False)
        sim.seconds.update(dict.fromkeys(sim.seconds, 0.0))

    def next(self):
        self.frame = next(self.frames)
        self.triangles.append(self.frame.n_cells)

    def __str__(self):
        spent = (f"{what} {1e3 * s / len(self.triangles):.2f}" for what, s in self.sim.seconds.items() if s)
        return f"{', '.join(spent)} ms a frame; {self.triangles[0]} to {self.triangles[-1]} triangles"


def played(sim, expression):
    sim.reset()
    sim.express(expression)
    return Played(sim, sim.run(FRAMES + RAMP, ramp=RAMP / (FRAMES + RAMP)))


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_ramp(versus, sim, draw, notes, expression):
    """All frames until the expression is at its strongest, those that refine with them."""
    warm_up = played(sim, expression)
    for _ in range(RAMP):
        warm_up.next()
        draw(warm_up.frame)
    show = played(sim, expression)
    goal = 2.0 if expression == "paper_surprise" else None
    versus(f"{expression}, ramp: frame, drawing", show.next, lambda: draw(show.frame), goal, RAMP, 0, statistics.fmean)
    assert warm_up.triangles[-1] > warm_up.triangles[0]
    notes[f"{expression}, ramp"] = str(show)


def test_steady(versus, sim, draw, notes):
    """The expression held, its skin at rest."""
    warm_up = played(sim, "paper_surprise")
    for _ in range(FRAMES + RAMP):
        warm_up.next()
    show = Played(sim, iter(sim.step, None))
    versus("surprise, held: frame, drawing", show.next, lambda: draw(show.frame), 20.0, 60)
    assert show.triangles[0] == show.triangles[-1]
    notes["surprise, held"] = str(show)
