"""Faces of simulations that come to an expression."""

import pytest
import pyvista as pv

import facewrinkle as fw

PAPER = [
    *("paper_surprise", "frowning", "stretching_mouth"),
    *(pytest.param(name, marks=pytest.mark.slow) for name in ("closing_eye", "paper_fear")),
]
"""The expressions of the paper, as parameters."""


def after(simulation: fw.Simulation, what: str | dict[str, float], frames: int) -> pv.PolyData:
    """The last of some frames that lead to an expression."""
    simulation.express(what)
    *_, last = simulation.run(frames)
    return last


def settled(simulation: fw.Simulation, what: str | dict[str, float]) -> pv.PolyData:
    """The frame in which a face has come to rest under an expression."""
    simulation.express(what)
    return simulation.settle()
