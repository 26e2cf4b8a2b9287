"""Kinds of patterns by name, with an artist's parameters: number, sharpness and style of wrinkles on any region."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from ...errors import ParameterError, unknown_name
from ..patterns import PatternFunction
from .base import Pattern
from .bumps import Custom, Dimple, EyePouch
from .wrinkles import Cheek, EyeCorner, Forehead, Frown

KINDS: Mapping[str, type[Pattern]] = {
    "forehead": Forehead,
    "eye_corner": EyeCorner,
    "cheek": Cheek,
    "frown": Frown,
    "dimple": Dimple,
    "eye_pouch": EyePouch,
}
"""The paper's patterns by name."""


def pattern_of(
    what: str | Pattern | PatternFunction, parameters: Mapping[str, Any], seed: int | None = None
) -> Pattern:
    """Return a pattern by name with its parameters, a pattern as it is, or that of a function of x, y and t.

    `seed` is passed to patterns that have one.

    Raises
    ------
    UnknownNameError
        For an unknown pattern or parameter.

    Examples
    --------
    >>> pattern_of("forehead", {"number": 3, "style": "m"}).beta
    4.5
    """
    if isinstance(what, Pattern):
        if parameters:
            raise ParameterError(f"a Pattern takes no more parameters, received {', '.join(parameters)}.")
        return what
    if callable(what):
        kind: type[Pattern] = Custom
        parameters = {"function": what, **parameters}
    elif isinstance(what, str) and what in KINDS:
        kind = KINDS[what]
    else:
        raise unknown_name("pattern", what, KINDS)
    known = [field.name for field in fields(kind)]
    for name in parameters:
        if name not in known:
            raise unknown_name(f"parameter of {kind.__name__}", name, known)
    if seed is not None and "seed" in known:
        parameters = {"seed": seed, **parameters}
    return kind(**parameters)
