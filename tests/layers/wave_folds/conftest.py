"""A sheet of skin that is pressed together, and the folds on it."""

from __future__ import annotations

import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.motion.base import Undriven

WIDTH, HEIGHT, CELLS = 90.0, 60.0, (45, 30)


class Pressed(Undriven):
    """A sheet that is pressed together, by these shares of its width and height at one time after the other."""

    time_step = 0.02

    def __init__(self, face, shares):
        self.points, self.shares, self.steps = face.points * face.unit, shares, 0

    def reset(self):
        self.steps = 0

    def step(self):
        share = self.shares[min(self.steps, len(self.shares) - 1)]
        self.steps += 1
        return self.points * [1.0 - share[0], 1.0 - share[1], 1.0]


@pytest.fixture(scope="session")
def sheet():
    """A flat surface without anatomy."""
    return fw.surface(pv.Plane(i_size=WIDTH, j_size=HEIGHT, i_resolution=CELLS[0], j_resolution=CELLS[1]).triangulate())


@pytest.fixture(scope="session")
def vertically(sheet):
    """Families of a sheet whose only motion presses it together from above and below."""
    return {"pressed": [sheet.points * [1.0, 0.75, 1.0]]}


@pytest.fixture(scope="session")
def pressed(sheet):
    """Presses the sheet: returns the simulation and its last frame."""

    def press(layer, *shares, level=3):
        sim = fw.Simulation(sheet, fw.Refinement(max_level=level), [layer], motion=Pressed(sheet, shares))
        for _ in range(len(shares) + 8):
            frame = sim.step()
        return sim, frame

    return press
