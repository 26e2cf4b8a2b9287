"""Skins that hold contraction rates, and gradients against differences, for tests."""

import numpy as np
import pytest

import facewrinkle as fw


def held(skin, rates, steps):
    """Hold contraction rates by muscle for some steps; returns the displacements (n, 3) at their end, mm."""
    skin.contract(rates)
    for _ in range(steps):
        skin.step()
    return skin.displacement.copy()


def settled(face, what, **material):
    """Displacements (n, 3) of skin at rest under an expression: to the subject's left, up and forward, mm."""
    skin = fw.Skin(face, time_step=1.0, material=fw.SkinMaterial(**material))
    return held(skin, face.atlas.contractions(what), 15) @ face.frame.axes.T


# --- gradients -------------------------------------------------------------------------------------


def assert_gradient(energy, x, gradient, rng, h=1e-6, rel=1e-5, ways=5):
    """A gradient is the slope of an energy at x along random ways, by central differences.

    Along ways that happen to cross the gradient the slope is near 0, and differences are rounded.
    """
    rounding = 1e-8 * float(np.linalg.norm(gradient))
    for way in rng.normal(size=(ways, *x.shape)):
        slope = (energy(x + h * way) - energy(x - h * way)) / (2 * h)
        assert slope == pytest.approx(float((gradient * way).sum()), rel=rel, abs=rounding)
