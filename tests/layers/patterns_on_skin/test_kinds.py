"""Kinds of patterns: their heights, phases and parameters, without a surface.

what                 checked against
no strength          exactly nothing
dimple               its depth, border and formula
wave vectors         differences of the heights of plain sines
sharpness            integral over a cycle; extremes; curvature of furrow and bulge
even wrinkles        the paper's formulas
crease, splay        their defining properties
"""

import dataclasses

import numpy as np
import pytest

from facewrinkle.layers import patterns
from facewrinkle.layers.patterns_on_skin.kinds import Cheek, Dimple, EyeCorner, EyePouch, Forehead, Frown


def test_at_no_strength_there_is_nothing(kind):
    x, y = kind.plane(np.random.default_rng(1).uniform(-1, 1, (300, 2)), 0.7)
    np.testing.assert_array_equal(kind.relief(x, y, 0.0, 5.0, 0.7), 0.0)


def test_a_dimple_is_as_deep_as_its_strength_and_ends_at_its_border():
    kind, r = Dimple(sharpest=0.03), np.linspace(0.0, 3.0, 400)
    for strength in (0.1, 0.5, 1.0):
        w = kind.relief(r, 0.0 * r, strength, 0.0, 1.0)
        assert w[0] == pytest.approx(-strength, abs=1e-14)
        assert (np.diff(w) >= 0.0).all()
        assert not w[r >= 1.0].any()
    expected = (patterns.dimple(r, 0.0, 0.03) - np.log(1.03)) / (np.log(1.03) - np.log(0.03))
    np.testing.assert_allclose(w, np.minimum(expected, 0.0), atol=1e-14)


def test_flesh_hangs_into_a_dimple_from_above():
    """The upper wall is the gentler one; neither has a second bottom."""
    v = np.linspace(0.0, 1.0, 200)
    above, below = (Dimple().relief(0.0 * v, way * v, 1.0, 0.0, 1.0) for way in (1.0, -1.0))
    assert (np.diff(above) >= 0.0).all()
    assert (np.diff(below) >= 0.0).all()
    assert (above < below)[1:-1].all()
    assert np.interp(-0.5, above, v) > 1.4 * np.interp(-0.5, below, v)


def test_wave_vectors_by_differences(wrinkles):
    """The slope of a plain sine (sharpness 0) is the wave vector times its cosine."""
    plain = dataclasses.replace(wrinkles, sharpness=0.0, variation=0.0)
    x, y = plain.plane(np.random.default_rng(2).uniform(-0.9, 0.9, (200, 2)), 0.7)
    t, h = plain.time(0.0) + 0.3, 1e-6
    wx, wy = plain.wave_vector(x, y, t, 0.7)
    middle = plain.relief(x, y, 1.0, t, 0.7)
    dx = (plain.relief(x + h, y, 1.0, t, 0.7) - plain.relief(x - h, y, 1.0, t, 0.7)) / (2 * h)
    dy = (plain.relief(x, y + h, 1.0, t, 0.7) - plain.relief(x, y - h, 1.0, t, 0.7)) / (2 * h)
    size = 1.0
    if isinstance(plain, EyeCorner):
        size = np.exp(-0.5 * plain.decay * (np.hypot(x, y) - 2.0 * plain.radius))
        along = -0.5 * plain.decay * middle / np.hypot(x, y)
        dx, dy = dx - along * x, dy - along * y
    cosine = np.sqrt(np.maximum(1.0 - (2.0 * middle / size) ** 2, 0.0))
    np.testing.assert_allclose(np.hypot(dx, dy), np.hypot(wx, wy) * 0.5 * size * cosine, atol=2e-5)


@pytest.mark.parametrize(("strength", "t"), [(1.0, 0.4), (0.35, 2.0)])
def test_without_variation_they_are_the_papers_formulas(strength, t):
    """With sharp ridges, as printed: the reliefs of `patterns`, to 1e-12."""
    uv, aspect = np.random.default_rng(5).uniform(-1, 1, (400, 2)), 0.8
    k, size = 1.2, 0.5 / np.sinh(1.2)

    def heights(kind, at=t):
        x, y = kind.plane(uv, aspect)
        return x, y, kind.relief(x, y, strength, at, aspect)

    x, y, w = heights(Forehead(furrows="paper", sharpness=k))
    expected = strength * size * (patterns.forehead(x, y, t, k, 4.5) - 1.0)
    np.testing.assert_allclose(w, expected, rtol=0, atol=1e-12)
    kind = EyeCorner(furrows="paper", sharpness=k, number=1.5, decay=0.9, radius=0.2)
    x, y, w = heights(kind)
    gamma = 1.5 * np.pi / np.arctan(aspect / 1.4)
    wave, level = (patterns.eye_corner(x, y, now, np.exp(0.9 * 0.2), -0.45, gamma) for now in (strength * k, 0.0))
    np.testing.assert_allclose(w, size * (wave - level), rtol=0, atol=1e-12)
    x, y, w = heights(Cheek(sharpness=0.0, radius=0.0))
    np.testing.assert_allclose(w, patterns.cheek(x, y, t, 0.5 * strength, 3 * np.pi), rtol=0, atol=1e-12)
    kind = Frown(sharpness=0.0, variant="paper")
    x, y, w = heights(kind)
    np.testing.assert_allclose(w, patterns.frown(x, y, t, 0.5 * strength, kind.beta), rtol=0, atol=1e-12)
    x, y, w = heights(EyePouch(trembling=1.0))
    expected = strength * patterns.eye_pouch(x, y, t, 1.0, 0.0, 2) * t / 4.0
    np.testing.assert_allclose(w, expected, rtol=0, atol=1e-12)


def test_the_crease_of_a_pouch_is_its_lowest_place():
    kind = EyePouch(crease=0.4, crease_at=0.3, trembling=0.0)
    v = np.linspace(-1.0, 1.0, 4001)
    x, y = kind.plane(np.stack([0 * v, v], axis=1), 0.5)
    w = kind.relief(x, y, 1.0, 0.0, 0.5)
    soft = EyePouch(trembling=0.0).relief(x, y, 1.0, 0.0, 0.5)
    assert v[w.argmin()] == pytest.approx(-0.3, abs=0.02)
    assert w.min() == pytest.approx(-0.4, abs=0.02)
    assert -0.1 < w[v < -0.95].min() < w[v < -0.95].max() < 0.0
    assert (np.diff(w[(v > -0.28) & (v < 0.0)]) > 0.0).all()
    assert np.gradient(w, v).max() > 3.0 * np.gradient(soft, v).max()  # steep above it
    np.testing.assert_allclose(w[v > 0.7], soft[v > 0.7], atol=0.03)  # and the rest of the pouch as before


def test_wrinkles_that_splay_curve_apart():
    """A furrow is where the phase is the same: at the far border its angle has grown by 1 / (1 - splay)."""
    kind, straight = EyeCorner(splay=0.4, radius=0.3), EyeCorner(radius=0.3)
    near, far = 2 * kind.radius, 2 * kind.radius + 2.0
    for angle in (-0.4, 0.1, 0.3):
        begin = kind.phase(np.array([near]), np.array([near * np.tan(angle)]), 0.0, 1.0)
        end = kind.phase(np.array([far]), np.array([far * np.tan(angle / 0.6)]), 0.0, 1.0)
        np.testing.assert_allclose(begin, straight.phase(np.array([1.0]), np.array([np.tan(angle)]), 0.0, 1.0))
        np.testing.assert_allclose(end, begin, rtol=1e-12)
    assert not np.isclose(straight.phase(np.array([far]), np.array([far * np.tan(0.5)]), 0.0, 1.0), begin).all()


@pytest.mark.parametrize("k", [0.0, 1e-7, 0.5, 2.0, 6.0])
def test_sharpened_waves_keep_their_volume(k):
    wave = Cheek(sharpness=k).of_sine
    h = wave(np.sin(2 * np.pi * (np.arange(4000) + 0.5) / 4000))
    assert abs(h.mean()) < 1e-12
    assert wave(1.0) - wave(-1.0) == pytest.approx(1.0, abs=1e-12)
    assert (np.diff(wave(np.linspace(-1, 1, 99))) > 0).all()
    if k >= 0.5:  # narrow furrows, wide bulges: below the middle for less than half of the cycle
        assert (h < wave(np.array([-1.0, 1.0])).mean()).mean() < 0.5
