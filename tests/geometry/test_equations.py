"""The equations of the paper.

what                        checked against
d (closed form of Eq. 7)    the integral of H in 40 digits; series at alpha = -1
H (Eqs. 4, 15)              the formula in 40 digits
s0                          H = 0 there
u, w (Eqs. 5, 6, 16)        furrows counted along the region, zero integral by Gauss quadrature; floor; periodicity
At (Eqs. 11, 13, 17)        1 - (s + s^3)/2 and Hermite's cubic
A (Eq. 10)                  sin(pi epsilon / 2) point by point
gamma (Eq. 19)              the printed quotient of normals, where its denominator is not small
"""

import math
from itertools import pairwise
from typing import get_args

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import fixed_quad

from facewrinkle.errors import FaceWrinkleError, ParameterError
from facewrinkle.geometry import equations, smoothstep

ALPHAS = [0.0, 0.25, 0.5, 1.0, 1.3, 2.0, 3.0, 4.0, 7.5, 12.0, 20.0]
LN2 = math.log(2.0)


def exact_bulge(alpha):
    """Eq. 7 in 40 digits."""
    a = mpmath.mpf(alpha)
    return (mpmath.power(2, a + 1) - 1) / (2 * (a + 1))


# --- d ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("alpha", np.linspace(0.0, 20.0, 81))
def test_bulge_height_makes_the_integral_of_h_vanish(alpha):
    with mpmath.workdps(40):
        d = exact_bulge(alpha)
        # Both halves of a cycle, of length u each: |integral| <= 1e-13 k0 u in exact arithmetic ...
        assert abs(2 * mpmath.quad(lambda s: d - s * (1 + s * s) ** mpmath.mpf(alpha), [0, 1])) < 1e-13
        # ... and the double that is computed is that d.
        assert abs(equations.bulge_height(1.0, float(alpha)) - d) < 4e-16 * d


@pytest.mark.parametrize("alpha", [-1.0, -1.0 + 1e-15, -1.0 + 1e-9, -1.0 + 1e-4, -0.75, -0.5000001, -0.4999999, -0.1])
def test_bulge_height_is_smooth_down_to_minus_one(alpha):
    with mpmath.workdps(40):
        d = exact_bulge(alpha) if alpha > -1.0 else mpmath.log(2) / 2
        assert abs(equations.bulge_height(1.0, alpha) - d) < 1e-15
    assert equations.bulge_height(1.0, -1.0) == pytest.approx(LN2 / 2.0, abs=1e-16)


# --- H ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("alpha", ALPHAS)
@pytest.mark.parametrize(("u", "k0"), [(1.0, 1.0), (2.7, 0.6), (0.031, 1.9)])
def test_shape_is_that_of_the_formula_in_forty_digits(alpha, u, k0):
    w = np.linspace(0.0, 2.0 * u, 41)
    with mpmath.workdps(40):
        s = [abs(mpmath.mpf(x) - mpmath.mpf(u)) / mpmath.mpf(u) for x in w]
        expected = [float(k0 * (exact_bulge(alpha) - x * (1 + x * x) ** mpmath.mpf(alpha))) for x in s]
    np.testing.assert_allclose(equations.shape(w, u, k0, alpha), expected, rtol=0.0, atol=1e-14 * k0 * 2.0**alpha)


# --- s0, u, w -----------------------------------------------------------------------------------


@pytest.mark.parametrize("alpha", ALPHAS)
def test_shape_is_zero_at_the_zero_crossing(alpha):
    s0 = equations.zero_crossing(alpha)
    assert 0.0 < s0 < 1.0
    assert abs(equations.shape([1.0 - s0, 1.0 + s0], 1.0, 1.0, alpha)).max() < 4e-15 * 2.0**alpha * (1.0 + alpha)


@pytest.mark.parametrize("alpha", [0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("count", [1, 2, 3, 5, 16])
@pytest.mark.parametrize(("length", "start"), [(40.0, 0.25), (57.3, 0.0), (1.4, 0.61)])
def test_continuous_ends_vanish_and_all_furrows_remain(alpha, count, length, start):
    u = equations.half_cycle(length, start, count)
    l = np.linspace(start * length, length, 400 * count + 1)
    height = equations.shape(equations.phase(l, start * length, u, alpha), u, 1.0, alpha)
    tiny = 1e-12 * 2.0**alpha * (1 + alpha)
    assert abs(height[[0, -1]]).max() < tiny
    # From zero it falls into a furrow or climbs onto a bulge; each furrow lies between two samples at most.
    deep = height < 0.9 * equations.shape(0.0, u, 1.0, alpha)
    runs = int(deep[0]) + int((np.diff(deep.astype(int)) == 1).sum())
    assert runs == count
    assert gauss_of_region(l[0], l[-1], u, alpha) == pytest.approx(0.0, abs=1e-12 * length * 2.0**alpha)


def gauss_of_region(start, end, u, alpha):
    """The integral of H over a region, split at its furrows and bulges."""
    shift = u * (1.0 - equations.zero_crossing(alpha))
    count = round((end - start) / (2 * u))
    kinks = start - shift + u * np.arange(1, 2 * count + 2)
    bounds = np.concatenate([[start], kinks[(kinks > start) & (kinks < end)], [end]])
    return sum(
        fixed_quad(lambda l: equations.shape(equations.phase(l, start, u, alpha), u, 1.0, alpha), a, b, n=40)[0]
        for a, b in pairwise(bounds)
    )


@pytest.mark.parametrize("alpha", [0.0, 1.0, 2.0])
def test_ends_of_the_paper_jump_to_the_bottom_of_a_furrow(alpha):
    u = equations.half_cycle(40.0, 0.25, 3)
    w = equations.phase([10.0, 40.0 - 1e-12], 10.0, u, alpha, ends="paper")
    bottom = equations.shape(0.0, u, 1.0, alpha)
    np.testing.assert_allclose(equations.shape(w, u, 1.0, alpha), bottom, rtol=1e-10)


def test_half_cycle_is_eq_5():
    assert equations.half_cycle(40.0, 0.25, 3) == (1 - 0.25) * 40.0 / (2 * 3)
    assert equations.half_cycle(0.7 + 0.9, 0.0, 4) == pytest.approx(1.6 / 8.0, rel=1e-15)


@given(
    st.floats(-500.0, 500.0), st.floats(0.05, 30.0), st.sampled_from(ALPHAS), st.sampled_from(get_args(equations.Ends))
)
def test_phase_is_floored_and_periodic(l, u, alpha, ends):
    shift = u * (1.0 - equations.zero_crossing(alpha)) if ends == "continuous" else 0.0
    w = float(equations.phase(l, 3.0, u, alpha, ends))
    assert 0.0 <= w <= 2.0 * u
    turns = (l - 3.0 + shift - w) / (2.0 * u)
    assert turns == pytest.approx(round(turns), abs=1e-9)
    again = equations.shape(equations.phase([l, l + 6.0 * u], 3.0, u, alpha, ends), u, 1.0, 1.0)
    assert again[0] == pytest.approx(again[1], abs=1e-9)


# --- At, A --------------------------------------------------------------------------------------


def test_attenuation_of_the_paper():
    s = np.linspace(0.0, 1.0, 101)
    np.testing.assert_allclose(equations.attenuation(s), 1 - (s + s**3) / 2, rtol=0, atol=1e-15)
    assert equations.attenuation([-3.0, 0.0, 1.0, 7.0]).tolist() == [1.0, 1.0, 0.0, 0.0]


def test_smoothstep_is_the_cubic_with_flat_ends():
    s = np.linspace(0.0, 1.0, 101)
    hermite = np.polynomial.Polynomial([1.0, 0.0, -3.0, 2.0])
    values = equations.attenuation(s, "smoothstep")
    np.testing.assert_allclose(values, hermite(s), rtol=0, atol=1e-15)
    assert hermite.deriv()(0.0) == hermite.deriv()(1.0) == 0.0
    assert equations.attenuation([-1.0, 0.0, 1.0, 2.0], "smoothstep").tolist() == [1.0, 1.0, 0.0, 0.0]
    assert (np.diff(values) < 0.0).all()


def test_band_is_linear_between_its_borders_in_both_directions():
    x = np.linspace(-1.0, 5.0, 61)
    np.testing.assert_allclose(equations.band(x, 2.0, 3.0), x - 2.0, atol=1e-15)
    np.testing.assert_allclose(equations.band(-x, -2.0, -1.0), 2.0 - x, atol=1e-15)


def test_a_band_of_zero_width_is_a_hard_edge():
    fade = equations.attenuation(equations.band([1.9, 2.0, np.nextafter(2.0, 3.0), 2.1], 2.0, 2.0))
    assert fade.tolist() == [1.0, 1.0, 0.0, 0.0]
    assert equations.band([1.9, 2.0, 2.1], 2.0, 2.0).tolist() == [0.0, 0.0, 1.0]


@given(st.floats(-3.0, 3.0))
def test_anisotropy_is_eq_10(epsilon):
    expected = 0.0 if epsilon <= 0.0 else math.sin(math.pi * min(epsilon, 1.0) / 2.0)
    value = float(equations.anisotropy(epsilon))
    assert value == pytest.approx(expected, abs=1e-15)
    assert value == 0.0 or epsilon > 0.0


# --- errors -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "call",
    [
        lambda: equations.bulge_height(1.0, -1.0001),
        lambda: equations.bulge_height(1.0, math.nan),
        lambda: equations.bulge_height(1.0, math.inf),
        lambda: equations.shape(0.0, 1.0, 1.0, -1e-9),
        lambda: equations.shape(0.0, 0.0),
        lambda: equations.shape(0.0, -1.0),
        lambda: equations.shape(0.0, math.nan),
        lambda: equations.zero_crossing(-0.5),
        lambda: equations.half_cycle(40.0, 0.2, 0),
        lambda: equations.half_cycle(40.0, 0.2, -2),
        lambda: equations.half_cycle(40.0, 0.2, 2.5),
        lambda: equations.half_cycle(40.0, 0.2, math.nan),
        lambda: equations.half_cycle(40.0, 0.2, math.inf),
        lambda: equations.half_cycle(40.0, 1.0, 2),
        lambda: equations.half_cycle(40.0, -0.1, 2),
        lambda: equations.half_cycle(40.0, math.nan, 2),
        lambda: equations.phase(0.0, 0.0, 1.0, 2.0, ends="open"),
        lambda: equations.phase(0.0, 0.0, 1.0, -1.0),
        lambda: equations.attenuation(0.0, falloff="linear"),
    ],
)
def test_parameters_out_of_range_are_refused(call):
    with pytest.raises(ParameterError) as caught:
        call()
    assert isinstance(caught.value, FaceWrinkleError)
    assert "received" in str(caught.value)


@pytest.mark.parametrize(("wavelength", "epsilon"), [(10.0, 0.01), (4.0, 0.04), (63.0, 0.002)])
def test_the_deepest_wave_is_as_long_as_the_skin(wavelength, epsilon):
    """The arc of a sine of that depth over the compressed wavelength, by quadrature."""
    half = 0.5 * float(equations.deepest(wavelength, epsilon))
    x = np.linspace(0.0, wavelength * (1.0 - epsilon), 20001)
    wave = half * np.sin(2.0 * np.pi * x / x[-1])
    arc = np.hypot(np.diff(x), np.diff(wave)).sum()
    # Of second order in the slope: the gap is of the order of epsilon^2.
    assert abs(arc / wavelength - 1.0) < 2.0 * epsilon**2


def test_stretched_skin_does_not_fold():
    assert equations.deepest(10.0, [-0.3, 0.0]).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    "formula",
    [
        lambda x: equations.shape(x, 0.7),
        lambda x: equations.phase(x, 0.1, 0.3, 2.0),
        lambda x: equations.attenuation(x),
        lambda x: equations.attenuation(x, "smoothstep"),
        lambda x: equations.band(x, 0.2, 0.7),
        lambda x: equations.anisotropy(x),
        smoothstep,
    ],
)
def test_single_precision_is_reckoned_in_double(formula):
    single = np.random.default_rng(0).uniform(0.0, 1.0, 50).astype(np.float32)
    assert formula(single).dtype == np.float64
    assert np.array_equal(formula(single), formula(single.astype(np.float64)))


@pytest.mark.parametrize("alpha", [0.0, 1.3, 2.0])
@pytest.mark.parametrize("blunt", [0.05, 0.2, 0.7])
def test_blunt_height_is_the_mean_of_the_heights_around(alpha, blunt):
    u, w = 3.0, np.linspace(0.0, 6.0, 41)
    offset = blunt * u * (2.0 * (np.arange(20_000) + 0.5) / 20_000 - 1.0)
    mean = equations.shape(np.mod(w[:, None] + offset, 2.0 * u), u, 1.5, alpha).mean(axis=1)
    np.testing.assert_allclose(equations.shape(w, u, 1.5, alpha, blunt), mean, atol=1e-6)


@given(st.floats(0.11, 1.0), st.floats(-1.0, 1.0))
def test_the_split_criterion_is_the_printed_quotient_unless_normals_stand_upright(rest, now):
    assert equations.split_criterion(rest, now) == pytest.approx((rest - now) / rest, abs=1e-15)
    assert equations.split_criterion(0.0, -now) == pytest.approx(now / equations.LEAST_COSINE, abs=1e-15)
