"""Gradients against differences."""

import pytest


def assert_gradient(energy, x, gradient, rng, h=1e-6, rel=1e-5, ways=5):
    """A gradient is the slope of an energy at x along random ways, by central differences."""
    for way in rng.normal(size=(ways, *x.shape)):
        slope = (energy(x + h * way) - energy(x - h * way)) / (2 * h)
        assert slope == pytest.approx(float((gradient * way).sum()), rel=rel)
