"""Smooth transitions, against what makes them: ends, level ends, symmetry."""

from __future__ import annotations

import numpy as np

from facewrinkle.geometry.smoothstep import smoothstep


def test_it_rises_from_0_to_1_and_is_level_at_both_ends():
    t = np.linspace(-0.5, 1.5, 2001)
    rise = smoothstep(t)
    assert not rise[t <= 0.0].any()
    assert (rise[t >= 1.0] == 1.0).all()
    assert (np.diff(rise[(t >= 0.0) & (t <= 1.0)]) > 0.0).all()
    np.testing.assert_allclose(rise + rise[::-1], 1.0, atol=1e-15)
    slope = np.gradient(rise, t)
    np.testing.assert_allclose(slope[[500, 1500]], 0.0, atol=2e-3)
    np.testing.assert_allclose(slope.max(), 1.5, rtol=1e-5)


def test_single_precision_is_reckoned_in_double():
    single = np.linspace(0.0, 1.0, 40, dtype=np.float32)
    assert np.array_equal(smoothstep(single), smoothstep(single.astype(np.float64)))
    assert smoothstep(single).dtype == np.float64
