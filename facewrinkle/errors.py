"""The exceptions and warnings of facewrinkle.

Every message says what is wrong, what is allowed, what was received, and how to mend it.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterable
from difflib import get_close_matches

LARGEST = 1e50
"""Coordinates have to be smaller: products of six of them must not overflow."""


class FaceWrinkleError(ValueError):
    """Input that facewrinkle cannot work with. The base of all its exceptions."""


class MeshError(FaceWrinkleError):
    """A mesh that cannot carry a face: empty, not finite, degenerate, non-manifold."""


class LandmarkError(FaceWrinkleError):
    """Landmarks that are missing, off the mesh, or swapped left for right."""


class UnknownNameError(FaceWrinkleError):
    """A muscle, action unit, expression or option that does not exist."""


class ParameterError(FaceWrinkleError):
    """A parameter outside the range in which its formula holds."""


class OutputError(FaceWrinkleError):
    """A file or folder that cannot be written."""


class MissingPackageError(FaceWrinkleError):
    """An optional package that is needed for what was asked and is not installed."""


class FaceWrinkleWarning(UserWarning):
    """Input that was mended, or a result that is an estimate."""


class FitWarning(FaceWrinkleWarning):
    """Points that do not determine the polynomial asked for; a simpler one was fitted."""


LISTED = 48
"""An error lists so many known names at most."""


def unknown_name(kind: str, name: object, known: Iterable[str]) -> UnknownNameError:
    """The error for `name`, with the nearest known names as a suggestion."""
    known = list(dict.fromkeys(known))
    close = get_close_matches(str(name), known, n=3, cutoff=0.5)
    if not known:
        return UnknownNameError(f"unknown {kind} {name!r}. There is none here.")
    rest = f" and {len(known) - LISTED} more" if len(known) > LISTED else ""
    hint = f"Did you mean {' or '.join(repr(c) for c in close)}?"
    if not close:
        hint = f"Known are: {', '.join(known[:LISTED])}{rest}."
    return UnknownNameError(f"unknown {kind} {name!r}. {hint}")


def check_range(name: str, value: float, low: float, high: float, remedy: str = "") -> float:
    """`value` as a float if it lies in [low, high]; a ParameterError otherwise (also for NaN)."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = None
    if number is None or isinstance(value, str | bytes):
        raise ParameterError(f"{name} must be a number, received {reprlib.repr(value)}.")
    if not low <= number <= high:
        allowed = f"lie in [{low:g}, {high:g}]" if high < float("inf") else f"be at least {low:g}"
        raise ParameterError(f"{name} must {allowed}, received {number:g}. {remedy}".rstrip())
    return number


def check_positive(name: str, value: float, remedy: str = "") -> float:
    """`value` as a float if it is finite and greater than 0; a ParameterError otherwise."""
    number = check_range(name, value, -float("inf"), float("inf"), remedy) if value == value else float("nan")
    if not 0.0 < number < float("inf"):
        raise ParameterError(f"{name} must be a finite number greater than 0, received {number:g}. {remedy}".rstrip())
    return number


def check_whole(name: str, value: float, low: float, high: float, remedy: str = "") -> int:
    """`value` as an int if it is a whole number in [low, high]; a ParameterError otherwise."""
    number = check_range(name, value, low, high, remedy)
    if number != int(number):
        raise ParameterError(f"{name} must be a whole number, received {number:g}.")
    return int(number)
