"""Measurements of folds, on heights whose directions and spacings are known."""

from __future__ import annotations

import numpy as np
import pytest
from expressions import after

import facewrinkle as fw
from analysis.folds import measured, spacings

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def raised(face):
    """A simulation that holds the brows up, without layers, and its frame."""
    sim = fw.Simulation(face, layers=[])
    frame = after(sim, "surprise", 20)
    return sim, frame


@pytest.mark.parametrize(("axis", "low", "high"), [(1, 0.0, 25.0), (0, 60.0, 90.0)])
def test_the_angle_is_that_between_lines_and_compression(face, raised, axis, low, high):
    """The forehead is compressed upwards: level lines lie across that, upright ones along."""
    sim, frame = raised
    place = np.asarray(frame["rest"])
    above = place[:, 1] > face.landmarks["glabella"][1] + 12.0
    front = place[:, 2] > face.landmarks["forehead_mid"][2] - 25.0
    frame = {"W": np.where(above & front, 0.3 * np.cos(place[:, axis] * 2.0 * np.pi / 30.0), 0.0)}
    assert low <= measured(sim, frame).angle <= high


def test_spacings_are_those_of_the_furrows(face):
    """On a forehead whose triangles are fine enough."""
    sim = fw.Simulation(face)
    after(sim, "surprise", 20)
    up = face.frame.local(sim.vertices.points)[:, 1] * face.frame.pupil_distance
    gaps = np.concatenate(spacings(sim, {"W": np.cos(up * 2.0 * np.pi / 16.0)}))
    assert len(gaps) > 5
    assert np.median(gaps) == pytest.approx(16.0, abs=1.0)
