"""Distributions as written in a specification."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facewrinkle.dataset.spec import Distribution
from facewrinkle.errors import ParameterError, UnknownNameError

NUMBER = st.floats(-5.0, 5.0)


@given(st.tuples(NUMBER, NUMBER).map(sorted), st.integers(0, 2**32))
def test_uniform_values_lie_in_their_range(ends, seed):
    value = Distribution.of({"uniform": ends}, "x").draw(np.random.default_rng(seed))
    assert ends[0] <= value <= ends[1]


@given(NUMBER, st.floats(0.01, 2.0), st.floats(0.1, 3.0), st.floats(0.1, 3.0), st.integers(0, 2**32))
def test_normal_values_lie_within_their_limits(mean, deviation, below, above, seed):
    limits = [mean - below, mean + above]
    value = Distribution.of({"normal": [mean, deviation], "within": limits}, "x").draw(np.random.default_rng(seed))
    assert limits[0] <= value <= limits[1]


def test_choices_are_as_frequent_as_their_weights():
    drawn = Distribution.of({"choice": [1, 2, 3], "weights": [1, 0, 3]}, "x")
    random = np.random.default_rng(5)
    values = np.array([drawn.draw(random) for _ in range(4000)])
    assert not (values == 2.0).any()
    assert abs((values == 3.0).mean() - 0.75) < 4.0 * np.sqrt(0.75 * 0.25 / 4000)


def test_a_number_is_fixed_and_a_list_is_a_choice():
    random = np.random.default_rng(1)
    assert {Distribution.of(3, "x").draw(random) for _ in range(5)} == {3.0}
    assert {Distribution.of([1, 2], "x").draw(random) for _ in range(50)} == {1.0, 2.0}


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ({"uniform": [2, 1]}, "rising order"),
        ({"uniform": [0, 9]}, r"x\[1\] must be at most 5, received 9.0"),
        ({"uniform": [0, 1], "within": [0, 1]}, "must have uniform, normal, .* received uniform, within"),
        ({"uniform": "wide"}, "x.uniform must be a list"),
        ({"uniform": [float("nan"), 1]}, r"x.uniform\[0\] must be at least"),
        ({"normal": [1, float("inf")]}, r"x.normal\[1\] must be at most"),
        ({"normal": [1, 0]}, "positive deviation"),
        ({"normal": [1, 1], "within": [3, 4]}, "mean within"),
        ({"choice": []}, "x.choice must not be empty"),
        ({"choice": [1, 2], "weights": [1]}, "one for each"),
        ({"choice": [1, 2], "weights": [0, 0]}, "above 0"),
        ("often", "received 'often'"),
        (True, "received True"),
        (7, "received 7"),
    ],
)
def test_wrong_distributions_of_numbers(written, message):
    with pytest.raises(ParameterError, match=message):
        Distribution.of(written, "x", 0.0, 5.0)


def test_unknown_words():
    with pytest.raises(UnknownNameError, match="uniform"):
        Distribution.of({"unifrom": [0, 1]}, "x")
    with pytest.raises(UnknownNameError, match="within"):
        Distribution.of({"normal": [0, 1], "witin": [0, 1]}, "x")
    with pytest.raises(UnknownNameError, match="happiness"):
        Distribution.of_words(["hapiness"], "names", ("happiness", "anger"))
    with pytest.raises(ParameterError, match=r"names\[0\] must be a text"):
        Distribution.of_words([3], "names", ("happiness",))
