"""Faces of simulations that come to an expression."""

from __future__ import annotations

import pyvista as pv

import facewrinkle as fw


def after(simulation: fw.Simulation, what: str | dict[str, float], frames: int) -> pv.PolyData:
    """The last of some frames that lead to an expression."""
    simulation.express(what)
    *_, last = simulation.run(frames)
    return last


def settled(simulation: fw.Simulation, what: str | dict[str, float]) -> pv.PolyData:
    """The frame in which a face has come to rest under an expression."""
    simulation.express(what)
    return simulation.settle()
