"""Folds hold no net volume: where they lie, and how they are levelled.

what                 checked against
levelled heights     as much above as below where that can be had; the greatest shares where it cannot; the same heights
                     where both sides hold as much
linings              exactly 0 there, on a head with a mouth's bag and sockets
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_faces import head_with

import facewrinkle as fw
from facewrinkle.layers.entries import LEVELLED, RAISED, STEPS, level_shares
from facewrinkle.layers.muscle_wrinkles import outer_skin


@given(st.floats(0.2, 5.0), st.integers(0, 99))
def test_heights_are_levelled_as_far_as_the_bounds_allow(ratio, seed):
    rng = np.random.default_rng(seed)
    areas = rng.uniform(0.5, 2.0, 40)
    height = np.append(rng.uniform(0.1, 0.4, 20), -rng.uniform(0.2, 1.0, 20))
    above, below = (areas * height)[:20].sum(), -(areas * height)[20:].sum()
    height[:20] *= ratio * below / above
    above = ratio * below
    shares = level_shares(height, areas)
    assert np.ptp(shares[:20]) < 1e-9
    assert np.ptp(shares[20:]) < 1e-9
    bulges, furrows = float(shares[0]), float(shares[-1])
    least, most = sorted((bulges, furrows))
    assert least >= LEVELLED - 1e-9
    assert most <= RAISED + 1e-9
    assert most <= 1.0 + 1e-9 or least == pytest.approx(LEVELLED)
    net = bulges * above - furrows * below
    if least > LEVELLED + 1e-9 or most < RAISED - 1e-9:
        assert abs(net) <= max(above, below) / STEPS
    else:
        assert net * np.sign(above - below) > -max(above, below) / STEPS  # the larger side stays so, but for a step
        assert abs(net) < abs(above - below)


def test_balanced_heights_stay():
    height = np.array([0.5, 0.5, -1.0, 0.0])
    assert (level_shares(height, np.ones(4)) == 1.0).all()


def heights(face, layer):
    """Heights at the base vertices in a kiss with raised cheeks."""
    sim = fw.Simulation(face, layers=[layer])
    sim.express({"AU18": 1.0, "AU6": 1.0})
    for _ in range(3):
        frame = sim.step()
    return np.asarray(frame["W"])[: len(face.points)]


def test_folds_of_muscles_lie_on_the_skin_that_is_seen():
    face, skin = head_with("sockets", "bag"), fw.default_face()
    outer, n = outer_skin(face), len(skin.points)
    assert set(np.unique(outer)) == {0.0, 1.0}
    assert (outer[:n] == outer_skin(skin)).mean() > 0.97
    assert outer[n:].mean() < 0.1
    for layer in (fw.MuscleWrinkles(), fw.Creases()):
        found = heights(face, layer)
        assert not found[outer == 0.0].any()
        assert np.ptp(found) > 0.1
