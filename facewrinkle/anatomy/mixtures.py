"""Mixtures as text: names with numbers, such as "AU1=0.7+AU4", in Python, in commands and for rigs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ..errors import ParameterError

Mixture = str | Sequence[str] | Mapping[str, float]
"""What makes an expression: a text, a list of names, or weights by name."""


def split_names(text: str) -> list[str]:
    """Return what is joined by + or by commas; a sign before a number joins nothing.

    Examples
    --------
    >>> split_names("AU1=+.7 + AU4, AU12")
    ['AU1=+.7', 'AU4', 'AU12']
    """
    return [part.strip() for part in re.split(r",|\+(?=\s*[^\W\d])", text)]


def parse_weights(text: str, usual: float | None = 1.0) -> dict[str, float]:
    """Return numbers by name, from "mouthSmile=0.8+jawOpen" or "mouthSmile=0.8,jawOpen"; `usual` where none is given.

    Raises
    ------
    ParameterError
        For what is no number, for none where there is no usual one, and for a name that comes twice.

    Examples
    --------
    >>> parse_weights("mouthSmile=0.8 + jawOpen"), parse_weights("jaw=0.5, age=1", usual=None)
    ({'mouthSmile': 0.8, 'jawOpen': 1.0}, {'jaw': 0.5, 'age': 1.0})
    """
    found: dict[str, float] = {}
    for part in split_names(text):
        name, equals, number = (piece.strip() for piece in part.partition("="))
        if name in found:
            raise ParameterError(f"{name} is named twice in {text!r}. Give one number for each name.")
        try:
            found[name] = float(number) if equals or usual is None else usual
        except ValueError:
            example = "jaw=0.5,age=1" if usual is None else "AU1=0.7+AU4"
            raise ParameterError(f"names with numbers are needed, such as {example}; received {part!r}.") from None
    return found
