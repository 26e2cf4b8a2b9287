"""Distributions as they are written in a specification: fixed values, choices, ranges and normal distributions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ParameterError, unknown_name

KEYS = {
    "uniform": {"uniform"},
    "normal": {"normal", "within"},
    "choice": {"choice", "weights"},
}
"""Keys of the table of each distribution."""


@dataclass(frozen=True)
class Distribution:
    """Something to draw values from.

    Attributes
    ----------
    values : tuple
        What is chosen from; for numbers, the least and the greatest.
    kind : {"fixed", "choice", "uniform", "normal"}
    weights : tuple of float
        Probabilities of a choice; mean and standard deviation of a normal distribution.
    """

    values: tuple[Any, ...]
    kind: str = "fixed"
    weights: tuple[float, ...] = ()

    @classmethod
    def of(cls, written: Any, name: str, low: float = -np.inf, high: float = np.inf) -> Distribution:
        """Return a distribution of numbers from what is written in a specification.

        Parameters
        ----------
        written : number, list or dict
            A number is fixed; from a list, each is as likely; ``{uniform = [low, high]}``;
            ``{normal = [mean, deviation], within = [low, high]}``; ``{choice = [...], weights = [...]}``.
        name : str
            For errors.
        low, high : float
            What is allowed.

        Raises
        ------
        UnknownNameError
            For an unknown distribution or key.
        ParameterError
            For a range that is upside down or not allowed, or a distribution that hardly ever meets its range.

        Examples
        --------
        >>> ages = Distribution.of({"uniform": [-1, 1]}, "age", -1, 1)
        >>> -1.0 <= ages.draw(np.random.default_rng(0)) <= 1.0
        True
        >>> Distribution.of([0.25, 0.75], "age").draw(np.random.default_rng(0))
        0.75
        """
        found = _distribution(written, name)
        numbers = [*found.values, *(found.weights[:1] if found.kind == "normal" else ())]
        for value in numbers:
            if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
                raise ParameterError(f"{name} must lie in [{low:g}, {high:g}], received {value!r}.")
        return found

    @classmethod
    def of_words(cls, written: Any, name: str, allowed: tuple[str, ...] | None = None) -> Distribution:
        """Return a distribution of words; of any, or of allowed ones.

        Examples
        --------
        >>> Distribution.of_words("l", "side", ("l", "r")).draw(np.random.default_rng(0))
        'l'
        """
        found = _distribution(written, name)
        for word in found.values:
            if not isinstance(word, str):
                raise ParameterError(f"{name} must be words, received {word!r}.")
            if allowed is not None and word not in allowed:
                raise unknown_name(name, word, allowed)
        return found

    def draw(self, random: np.random.Generator) -> Any:
        """Return a value."""
        if self.kind == "fixed":
            return self.values[0]
        if self.kind == "uniform":
            return float(random.uniform(*self.values))
        if self.kind == "normal":
            low, high = self.values
            while not low <= (value := float(random.normal(self.weights[0], self.weights[1]))) <= high:
                pass
            return value
        return self.values[int(random.choice(len(self.values), p=self.weights))]


def _distribution(written: Any, name: str) -> Distribution:
    if isinstance(written, list):
        written = {"choice": written}
    if not isinstance(written, Mapping):
        return Distribution((float(written) if type(written) is int else written,))
    kind = next((key for key in KEYS if key in written), None)
    if kind is None:
        raise unknown_name(f"distribution of {name}", next(iter(written), ""), KEYS)
    for key in written:
        if key not in KEYS[kind]:
            raise unknown_name(f"key of the distribution of {name}", key, KEYS[kind])
    if kind == "choice":
        return _choice(written, name)
    if kind == "uniform":
        return Distribution(_pair(written["uniform"], f"uniform of {name}", rising=True), "uniform")
    mean, deviation = _pair(written["normal"], f"normal of {name}")
    low, high = _pair(written.get("within", (-np.inf, np.inf)), f"within of {name}", rising=True)
    if deviation <= 0.0 or not low <= mean <= high or high - low < 0.05 * deviation:
        raise ParameterError(
            f"the normal distribution of {name} needs a positive deviation, and its mean within a range that is not "
            f"much narrower than that, received {dict(written)!r}."
        )
    return Distribution((low, high), "normal", (mean, deviation))


def _choice(written: Mapping[str, Any], name: str) -> Distribution:
    values = written["choice"]
    if not isinstance(values, list) or not values:
        raise ParameterError(f"choice of {name} must be a list with at least one value, received {values!r}.")
    weights = written.get("weights", [1.0] * len(values))
    if not isinstance(weights, list) or len(weights) != len(values):
        raise ParameterError(f"weights of {name} must be one for each of {len(values)} values, received {weights!r}.")
    if any(not isinstance(w, int | float) or not w >= 0.0 for w in weights) or not sum(weights) > 0.0:
        raise ParameterError(f"weights of {name} must not be negative, and one must be above 0, received {weights!r}.")
    values = tuple(float(v) if type(v) is int else v for v in values)
    return Distribution(values, "choice", tuple(w / sum(weights) for w in weights))


def _pair(written: Any, name: str, rising: bool = False) -> tuple[float, float]:
    numbers = list(written) if isinstance(written, list | tuple) else []
    if len(numbers) != 2 or any(isinstance(n, bool) or not isinstance(n, int | float) for n in numbers):
        raise ParameterError(f"{name} must be two numbers, received {written!r}.")
    if np.isnan(numbers).any() or (rising and not numbers[0] <= numbers[1]):
        raise ParameterError(f"{name} must be two numbers in rising order, received {written!r}.")
    return float(numbers[0]), float(numbers[1])
