"""Pattern functions: formulas.

what             checked against
values           the formulas in 40 digits (mpmath) at random places
numbers          one for each point
angle            its limits on the axes; the same on both sides of the origin
seams            odd gamma: the jump that it would make, refused; even gamma: none
dimple           depth in proportion to the strength, its t inverted
"""

import mpmath
import numpy as np
import pytest

from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.layers import patterns as p

X, Y = np.array([1, 1, 2, 3, 0.3, -1]), np.array([0, 0.5, 1, -1, 0.4, 0.5])


def exact(name, x, y):
    """The formulas as they stand in the paper, in 40 digits."""
    m, x, y = mpmath, mpmath.mpf(x), mpmath.mpf(y)
    th, r = m.atan(y / x), m.sqrt(x * x + y * y)
    return {
        "forehead": lambda: m.exp(m.mpf("0.7") * m.sin(r**2 - (m.mpf("1.3") * m.sin(th) - m.sin(5 * th)) ** 2)),
        "eye_corner": lambda: 2 * m.exp(-r / 2 - m.mpf("0.9") * m.sin(6 * th)),
        "cheek": lambda: 3 * m.sin(4 * r + m.mpf("0.25")),
        "frown": lambda: 2 * m.sin(x / m.mpf("0.5") * (y + 3)),
        "fan": lambda: 2 * m.sin(x / (m.mpf("0.5") * (y + 6))),
        "dimple": lambda: m.log(r**2 + m.mpf("0.02")),
        "eye_pouch": lambda: (m.cos(x + 2 * m.mpf("0.4")) + m.cos(y + 3 * m.mpf("0.4"))) ** 4 / m.mpf("0.4"),
    }[name]()


@pytest.mark.parametrize(
    ("name", "formula"),
    [
        ("forehead", lambda x, y: p.forehead(x, y, 1.3, alpha=0.7, beta=5)),
        ("eye_corner", lambda x, y: p.eye_corner(x, y, 0.9, alpha=2, beta=-0.5, gamma=6)),
        ("cheek", lambda x, y: p.cheek(x, y, 0.25, alpha=3, beta=4)),
        ("frown", lambda x, y: p.frown(x, y, 3, alpha=2, beta=0.5)),
        ("fan", lambda x, y: p.frown(x, y, 6, alpha=2, beta=0.5, variant="fan")),
        ("dimple", lambda x, y: p.dimple(x, y, 0.02)),
        ("eye_pouch", lambda x, y: p.eye_pouch(x, y, 0.4, alpha=2, beta=3, gamma=4)),
    ],
)
def test_formulas_in_forty_digits(name, formula):
    x, y = np.random.default_rng(5).uniform(-3, 3, (2, 40))
    with mpmath.workdps(40):
        expected = [float(exact(name, a, b)) for a, b in zip(x, y, strict=True)]
    np.testing.assert_allclose(formula(x, y), expected, rtol=1e-12, atol=1e-12)


def test_a_number_for_each_point():
    x, y, gamma = np.random.default_rng(3).uniform(0.5, 2.0, (3, 50))
    each = [p.eye_corner(*point, 0.8, 2.0, -0.7, g) for *point, g in zip(x, y, gamma, strict=True)]
    np.testing.assert_allclose(p.eye_corner(x, y, 0.8, 2.0, -0.7, gamma), each, atol=1e-14)


def test_angle_is_the_arctangent_of_the_quotient():
    x, y = np.random.default_rng(2).normal(size=(2, 300))
    np.testing.assert_allclose(p.angle(x, y), np.arctan(y / x), atol=1e-15)
    assert p.angle(0.0, 1.0) == np.pi / 2
    assert p.angle(0.0, -1.0) == -np.pi / 2
    # From the left, y / x has the other sign.
    assert p.angle([-0.0, -0.0, -0.0], [1.0, 2.0, -3.0]).tolist() == [-np.pi / 2, -np.pi / 2, np.pi / 2]
    assert p.angle([0.0, -0.0, -2.0], [0.0, 0.0, 0.0]).tolist() == [0.0, 0.0, 0.0]


def test_an_odd_gamma_is_taken_on_one_side_and_refused_from_the_axis_on():
    for x in ([0.5, 2.0], [1e-9, 1.0], [-3.0, -1e-9], [0.0, 0.0], []):
        y = np.ones(len(x))
        expected = np.exp(-np.hypot(x, y) - np.sin(3.0 * p.angle(x, y)))
        np.testing.assert_allclose(p.eye_corner(x, y, 1.0, 1.0, -1.0, 3), expected, atol=1e-15)
    for x in ([0.0, 1.0], [-1.0, 0.0], [-0.1, 3.0]):
        with pytest.raises(ParameterError, match="even number"):
            p.eye_corner(x, [1.0, 1.0], 1.0, 1.0, -1.0, 3)


@pytest.mark.parametrize("gamma", [2, 4, 8])
def test_even_gamma_leaves_no_seam(gamma):
    y = np.concatenate([np.linspace(-2, -0.5, 50), np.linspace(0.5, 2, 50)])
    step = 1e-7
    values = [p.eye_corner(np.full(100, k * step), y, 0.5, 1.0, -1.0, gamma) for k in (-2, -1, 0, 1, 2)]
    jumps = np.diff(values, axis=0)
    assert np.abs(jumps).max() < 20 * gamma * step
    np.testing.assert_allclose(jumps[0], jumps[3], atol=1e-10)  # nor a kink


def test_frown_variants():
    y = np.linspace(0.0, 2.0, 5)
    crest = {"paper": np.pi / 2 * 0.4 / (y + 3.0), "fan": np.pi / 2 * 0.4 * (y + 3.0)}
    for variant, x in crest.items():
        np.testing.assert_allclose(p.frown(x, y, 3.0, 1.0, 0.4, variant), 1.0, atol=1e-14)
    assert p.frown_phase(1.0, [-0.5, 0.0], 0.75, 2.0, "fan").tolist() == [2.0, 1 / 1.5]  # y + t from 0.25
    with pytest.raises(ParameterError, match="y . t must be above 0"):
        p.frown([1.0, 1.0], [-0.75, 0.0], 0.75, 1.0, 2.0, "fan")


@pytest.mark.parametrize("strength", [0.1, 0.5, 1.0])
def test_depth_of_a_dimple_is_its_strength(strength):
    full = p.dimple(1.0, 0.0, 0.03) - p.dimple(0.0, 0.0, 0.03)
    t = p.dimple_time(strength, 0.03)
    assert p.dimple(1.0, 0.0, t) - p.dimple(0.0, 0.0, t) == pytest.approx(strength * full, abs=1e-13)


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda: p.dimple(X, Y, 0.0), ParameterError, "greater than 0"),
        (lambda: p.dimple(X, Y, np.nan), ParameterError, "t must be a finite number greater than 0"),
        (lambda: p.dimple_time(1.0, -1.0), ParameterError, "t must be a finite number greater than 0"),
        (lambda: p.eye_pouch(X, Y, 0.0, 1, 1, 2), ParameterError, "t must be at least 0.01"),
        (lambda: p.eye_pouch(X, Y, 1.0, 1, 1, 2.5), ParameterError, "whole number"),
        (lambda: p.forehead([np.nan], [0.0], 1.0, 1.0, 1.0), ParameterError, "finite"),
        (lambda: p.frown(X, Y, 0.5, 1.0, 1.0, "fan"), ParameterError, "larger t"),
        (lambda: p.frown(X, Y, 0.5, 1.0, 0.0), ParameterError, "beta must not be 0"),
        (lambda: p.frown(X, Y, 2.0, 1.0, 1.0, "fen"), UnknownNameError, "'fan'"),
    ],
)
def test_errors(call, error, says):
    with pytest.raises(error, match=says):
        call()
