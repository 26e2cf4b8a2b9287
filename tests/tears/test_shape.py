"""The shape of a shed tear, formulas alone.

what             checked against
thickness        its formula written out point by point; itself in another unit
extruded head    the mean weighted by distance, written out
noise of a film  moving least squares over all places, drawn from the same stream of random numbers; its bounds
waves            the convolution with a bell written out
solid            volume of prisms under a piecewise linear roof; each side met once in each direction
"""

import math
from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay
from small_meshes import enclosed_volume

from facewrinkle.geometry.least_squares import moving_least_squares
from facewrinkle.geometry.topology import boundary_loops, euler_characteristic
from facewrinkle.tears.shape import (
    BUMP,
    DRAINED,
    POOLING,
    SOFT,
    TAPER,
    Shape,
    extruded,
    outline,
    raised,
    rough_film,
    smoothed_head,
    solid,
    thickness,
    waves,
)

SHAPE = Shape(1.5, 1.1, 0.8, 0.12)


# --- thickness ----------------------------------------------------------------------------------


def plain_thickness(s, w, front, shape, wobble=0.0, noise=0.0):
    """Half the width, height and height of the bumps at one place."""
    behind = (front - s) / shape.half
    taper = min(max((behind - 1.0) / TAPER, 0.0), 1.0)
    head = (1.0 + math.cos(math.pi * taper)) / 2.0
    drained = DRAINED + (1.0 - DRAINED) * math.exp(-max(behind, 0.0) / 15.0)
    trail = shape.trail * (1.0 + wobble) * drained
    half = head * shape.half + (1.0 - head) * trail
    ends = max(1.0 - behind, 0.0) ** 2 + max(1.0 - s / shape.trail, 0.0) ** 2
    level = max(1.0 - (w / half) ** 2 - ends, 0.0)
    film = shape.film * (1.0 + POOLING * wobble)  # where it is wide, water stays
    height = level * (film + (shape.height - film) * head**1.5)
    return half * math.sqrt(max(1.0 - ends, 0.0)), height, BUMP * noise * film * level * (1.0 - head**1.5)


@pytest.mark.parametrize("front", [2.0, 5.0, 17.0, 60.0])
def test_the_shape_is_its_formula_written_out(front):
    random = np.random.default_rng(3)
    s, w = random.uniform(-3.0, front + 3.0, 800), random.uniform(-2.0, 2.0, 800)
    wobble, noise = random.uniform(-0.4, 0.4, 800), random.uniform(0.0, 1.0, 800)
    found = [
        outline(s, front, SHAPE, wobble), thickness(s, w, front, SHAPE, wobble),
        raised(s, w, front, SHAPE, wobble, noise),
    ]  # fmt: skip
    expected = [plain_thickness(*at[:2], front, SHAPE, *at[2:]) for at in zip(s, w, wobble, noise, strict=True)]
    np.testing.assert_allclose(np.stack(found, axis=1), expected, rtol=1e-9, atol=1e-9)
    assert 20 < (found[1] > 0.0).sum() < 780
    assert (found[2] >= 0.0).all()


def test_an_extruded_head_is_smoothed_by_weights_of_distance():
    """Moving least squares of degree 0 are the weighted mean; here written out for one place."""
    s, w = (grid.ravel() for grid in np.meshgrid(np.arange(0.0, 20.01, 0.5), np.arange(-1.5, 1.6, 0.5), indexing="ij"))
    film = thickness(s, w, 20.0, Shape(1.5, 0.12, 0.8, 0.12))
    block = extruded(s, film, 20.0, SHAPE)
    assert set(np.round(block[(s > 17.0) & (film > 0.0)], 12)) == {SHAPE.height}
    np.testing.assert_array_equal(block[s <= 17.0], film[s <= 17.0])
    smooth = smoothed_head(s, w, block, 20.0, SHAPE)
    near = s > 20.0 - 4.0 * SHAPE.half
    means = []
    for x, y in zip(s[near], w[near], strict=True):
        weight = 1.0 / ((s[near] - x) ** 2 + (w[near] - y) ** 2 + (SOFT * SHAPE.half) ** 2)
        means.append((weight * block[near]).sum() / weight.sum())
    at = (s[near] == 18.0) & (w[near] == 0.5)
    expected = np.array(means)[at] * SHAPE.height / max(means)
    assert smooth[near][at] == pytest.approx(expected, rel=1e-9)
    assert (smooth[film == 0.0] == 0.0).all()
    np.testing.assert_array_equal(smooth[~near], block[~near])


@settings(max_examples=50)
@given(st.floats(0.01, 100.0), st.floats(0.1, 80.0))
def test_a_larger_tear_is_the_same_tear_in_another_unit(factor, front):
    larger = Shape(*(factor * size for size in astuple(SHAPE)))
    s, w = np.linspace(-1.0, front, 60), np.linspace(-1.2, 1.3, 60)
    for one, other in (
        (outline(s, front, SHAPE), outline(factor * s, factor * front, larger)),
        (thickness(s, w, front, SHAPE), thickness(factor * s, factor * w, factor * front, larger)),
    ):
        np.testing.assert_allclose(other, factor * one, rtol=1e-9, atol=1e-9 * factor)


# --- noise --------------------------------------------------------------------------------------


def drawn_places(length, half, roughness, seed):
    """Places of bumps and their heights: a grid that covers the film, shaken, with its rows one by one."""
    random = np.random.default_rng(seed)
    apart = 2.5 * half / 4.0
    rows = math.ceil((length + apart) / apart - 1e-9)
    grid = np.array([(i * apart, k * apart) for i in range(rows) for k in (-2, -1, 0, 1, 2)])
    places = grid + 0.35 * apart * (2.0 * random.random(grid.shape) - 1.0)
    raised = np.array([random.random() < 0.5 * roughness for _ in grid])
    return places, np.where(raised, 0.3 + 0.7 * random.random(len(grid)), 0.0), apart


def film(length, half, roughness, degree, seed):
    return rough_film(length, half, roughness, degree, np.random.default_rng(seed))


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize(("length", "half", "roughness"), [(7.0, 1.5, 0.4), (0.9, 0.2, 0.7), (3.0, 4.0, 1.0)])
def test_noise_is_the_least_squares_surface_of_its_bumps(length, half, roughness, degree):
    noise, spacing = film(length, half, roughness, degree, 5)
    assert spacing == half / 4.0
    places, values, apart = drawn_places(length, half, roughness, 5)
    s = spacing * np.arange(len(noise))
    assert s[-2] < length <= s[-1]
    x = np.array([(a, b) for a in s for b in np.linspace(-half, half, 9)])
    expected = moving_least_squares(x, places, values, degree, 0.2 * apart).reshape(-1, 9)
    np.testing.assert_allclose(noise, np.maximum(expected, 0.0), rtol=0, atol=1e-9)
    assert noise.max() > 0.1


def test_on_a_long_film_far_away_bumps_hardly_count():
    noise, spacing = film(70.0, 1.5, 0.4, 1, 6)
    places, values, apart = drawn_places(70.0, 1.5, 0.4, 6)
    assert len(noise) > 5 * 32
    x = np.array([(a, b) for a in spacing * np.arange(len(noise)) for b in np.linspace(-1.5, 1.5, 9)])
    expected = moving_least_squares(x, places, values, 1, 0.2 * apart).reshape(-1, 9)
    difference = np.abs(noise - np.maximum(expected, 0.0))
    assert difference.max() < 0.06
    assert difference.mean() < 0.01


def test_rougher_skin_makes_the_trail_less_even():
    """Some places are thick and some thin: more, and more of them, the rougher the skin is."""
    films = [np.concatenate([film(25.0, 1.0, r, 0, seed)[0] for seed in range(6)]) for r in (0.0, 0.1, 0.25, 0.5, 1.0)]
    mean, contrast = ([float(f(noise)) for noise in films] for f in (np.mean, np.std))
    assert mean == sorted(mean)
    assert contrast == sorted(contrast)
    assert contrast[-1] > 1.4 * contrast[2]
    raised = [float((noise > 0.15).mean()) for noise in films]  # by half of the least bump
    assert raised[1] < 0.1
    assert raised[2] < 0.25  # an eighth of the places is raised, and what is between them and others
    assert raised[-1] < 0.95


@pytest.mark.parametrize("unit", [0.01, 25.4])
def test_noise_does_not_depend_on_the_unit(unit):
    noise, spacing = film(70.0, 1.5, 0.4, 1, 6)
    other, other_spacing = film(70.0 * unit, 1.5 * unit, 0.4, 1, 6)
    assert other_spacing == pytest.approx(unit * spacing, rel=1e-15)
    rows = min(len(noise), len(other))
    np.testing.assert_allclose(other[:rows], noise[:rows], atol=1e-7)


# --- waves --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("n", "scale"), [(200, 5.0), (60, 1.5), (30, 12.0), (1, 2.0)])
def test_waves_are_white_noise_under_a_bell(n, scale):
    found = waves(np.random.default_rng(7), n, scale)
    reach = int(4.0 * scale + 0.5)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / scale) ** 2)
    noise = np.pad(np.random.default_rng(7).normal(size=n), reach, mode="edge")
    smooth = np.convolve(noise, bell / bell.sum(), mode="valid")
    np.testing.assert_allclose(found, smooth / np.abs(smooth).max(), rtol=0, atol=1e-12)
    assert found.shape == (n,)


def test_waves_of_nothing_are_flat():
    class Silent:
        def normal(self, size):
            return np.zeros(size)

    assert not waves(Silent(), 9, 2.0).any()


# --- solid --------------------------------------------------------------------------------------


def roof(n, seed):
    """A disk of random triangles, and heights above it."""
    random = np.random.default_rng(seed)
    plane = random.uniform(-1.0, 1.0, (n, 2))
    triangles = Delaunay(plane).simplices.astype(np.int32)
    return np.c_[plane, random.normal(size=n)], random.uniform(0.1, 2.0, n), triangles


@settings(max_examples=30)
@given(st.integers(3, 40), st.integers(0, 10_000))
def test_a_solid_is_closed_and_holds_what_is_between_base_and_top(n, seed):
    base, height, triangles = roof(n, seed)
    top = base + height[:, None] * [0.0, 0.0, 1.0]
    points, closed = solid(base, top, triangles)
    assert np.array_equal(points, np.concatenate([top, base]))
    assert closed.dtype == np.int32
    (loop,) = boundary_loops(triangles)
    assert closed.shape == (2 * len(triangles) + 2 * len(loop), 3)
    # Each side is met once in each direction: closed and oriented. As a sphere is.
    sides = {(int(t[k]), int(t[k - 2])) for t in closed for k in range(3)}
    assert len(sides) == 3 * len(closed)
    assert sides == {(b, a) for a, b in sides}
    assert euler_characteristic(closed) == 2
    x, y, _ = base[triangles].T
    flat = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
    expected = (0.5 * flat * height[triangles].mean(axis=1)).sum()
    assert enclosed_volume(points, closed) == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert expected > 0.0
