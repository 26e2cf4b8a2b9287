"""Values over time.

what                       checked against
linear, step, cubic        lines, steps and cubics in closed form; SciPy's Hermite spline
times outside, one key     the first and the last value, bit for bit
bad input                  the errors that name what is wrong
"""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from facewrinkle.animation.recorded import Track
from facewrinkle.errors import ParameterError, UnknownNameError

RNG = np.random.default_rng(11)


def test_tracks_go_through_their_values_and_hold_the_ends():
    times, values = np.array([0.5, 1.0, 3.0]), RNG.normal(size=(3, 4, 2))
    slopes = RNG.normal(size=(2, 3, 4, 2))
    for track in (Track(times, values), Track(times, values, "step"), Track(times, values, "cubic", slopes)):
        for time, value in zip(times, values, strict=True):
            assert np.array_equal(track.at(time), value)
        assert np.array_equal(track.at(-7.0), values[0])
        assert np.array_equal(track.at(9.0), values[-1])


def test_tracks_between_their_times():
    times, values = np.array([0.0, 2.0, 3.0]), RNG.normal(size=(3, 5))
    slopes = RNG.normal(size=(3, 5))
    spline = CubicHermiteSpline(times, values, slopes)
    cubic = Track(times, values, "cubic", np.stack([slopes, slopes]))
    linear, step = Track(times, values), Track(times, values, "step")
    for time in RNG.uniform(0.0, 3.0, 40):
        np.testing.assert_allclose(cubic.at(time), spline(time), atol=1e-12)
        expected = [np.interp(time, times, column) for column in values.T]
        np.testing.assert_allclose(linear.at(time), expected, atol=1e-12)
        assert np.array_equal(step.at(time), values[np.flatnonzero(times <= time)[-1]])


def test_slopes_before_and_after_a_time_may_differ():
    times, values = np.array([0.0, 1.0, 2.0]), np.zeros((3, 1))
    slopes = np.zeros((2, 3, 1))
    slopes[0, 1], slopes[1, 1] = 1.0, -5.0  # arrives rising, leaves falling
    track = Track(times, values, "cubic", slopes)
    # s^3 - s^2 of the arriving slope and s^3 - 2 s^2 + s of the leaving one, at one half.
    assert track.at(0.5) == pytest.approx([-0.125])
    assert track.at(1.5) == pytest.approx([-0.625])


def test_equal_neighbors_are_kept_to_the_last_bit():
    value = RNG.normal(size=7)
    track = Track(np.array([0.0, 0.3]), np.array([value, value]))
    assert all(np.array_equal(track.at(t), value) for t in RNG.uniform(0.0, 0.3, 50))


@pytest.mark.parametrize(
    "times, values, how, error, message",
    [
        ([0.0, 0.0], [1.0, 2.0], (), ParameterError, "increasing"),
        ([1.0, 0.0], [1.0, 2.0], (), ParameterError, "increasing"),
        ([], [], (), ParameterError, "increasing"),
        ([[0.0]], [[1.0]], (), ParameterError, "increasing"),
        ([0.0, 1.0], [1.0], (), ParameterError, "2 times"),
        ([0.0, np.nan], [1.0, 2.0], (), ParameterError, r"times must be finite; entry \[1\]"),
        ([0.0, 1.0], [[1.0, 2.0], [3.0, np.inf]], (), ParameterError, r"values must be finite; entry \[1, 1\]"),
        ([0.0, 1.0], [[1.0, 2.0], [3.0]], (), ParameterError, "rows of one length"),
        (["x"], [1.0], (), ParameterError, "times must be numbers"),
        ([0.0], [1.0], ("linaer",), UnknownNameError, "linear"),
        ([0.0, 1.0], [1.0, 2.0], ("cubic",), ParameterError, "slopes"),
        ([0.0, 1.0], [1.0, 2.0], ("cubic", np.zeros((2, 3))), ParameterError, "slopes"),
    ],
)
def test_broken_tracks_are_refused(times, values, how, error, message):
    with pytest.raises(error, match=message):
        Track(times, values, *how)


@pytest.mark.parametrize("kind", ["linear", "step", "cubic"])
def test_a_track_of_one_key_has_its_value_at_all_times(kind):
    track = Track([1.0], [[2.0, 3.0]], kind, np.ones((2, 1, 2)) if kind == "cubic" else None)
    for time in (-5.0, 0.999, 1.0, 7.0):
        assert track.at(time).tolist() == [2.0, 3.0]
