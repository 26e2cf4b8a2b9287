"""The patterns in an artist's words, by name: how many wrinkles, how sharp, in which style, on a region of any size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from ...errors import ParameterError, unknown_name
from ..patterns import Function
from .base import Pattern
from .bumps import Custom, Dimple, EyePouch
from .waves import Cheek, EyeCorner, Forehead, Frown

KINDS: Mapping[str, type[Pattern]] = {
    "forehead": Forehead,
    "eye_corner": EyeCorner,
    "cheek": Cheek,
    "frown": Frown,
    "dimple": Dimple,
    "eye_pouch": EyePouch,
}
"""The paper's patterns by name."""


def pattern_of(what: str | Pattern | Function, words: Mapping[str, Any], seed: int | None = None) -> Pattern:
    """A pattern by name with its words, a pattern as it is, or a function of x, y and t.

    `seed` is taken by those that have one.

    Raises
    ------
    UnknownNameError
        For an unknown pattern or word.

    Examples
    --------
    >>> pattern_of("forehead", {"number": 3, "style": "m"}).beta
    4.5
    """
    if isinstance(what, Pattern):
        if words:
            raise ParameterError(f"a pattern that is ready takes no more words, received {', '.join(words)}.")
        return what
    if callable(what):
        kind: type[Pattern] = Custom
        words = {"function": what, **words}
    elif isinstance(what, str) and what in KINDS:
        kind = KINDS[what]
    else:
        raise unknown_name("pattern", what, KINDS)
    known = [field.name for field in fields(kind)]
    for word in words:
        if word not in known:
            raise unknown_name(f"word of {kind.__name__}", word, known)
    if seed is not None and "seed" in known:
        words = {"seed": seed, **words}
    return kind(**words)
