"""Words of the command line as values: units, weights, mixtures, sizes and lists of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

from cyclopts import Parameter

from ..anatomy.atlas import Atlas
from ..errors import ParameterError, UnknownNameError, unknown_name


def parse_units(text: str | None) -> str | float | None:
    """Return the name of a unit, or the number of millimetres in it.

    Examples
    --------
    >>> parse_units("cm"), parse_units("10")
    ('cm', 10.0)
    """
    try:
        return text if text is None else float(text)
    except ValueError:
        return text


def parse_weights(text: str, usual: float | None = 1.0) -> dict[str, float]:
    """Return numbers by name, from "mouthSmile=0.8, jawOpen"; `usual` where none is given.

    Raises
    ------
    ParameterError
        For what is no number, for none where there is no usual one, and for a name that comes twice.

    Examples
    --------
    >>> parse_weights("mouthSmile=0.8, jawOpen"), parse_weights("jaw=0.5, age=1", usual=None)
    ({'mouthSmile': 0.8, 'jawOpen': 1.0}, {'jaw': 0.5, 'age': 1.0})
    """
    found: dict[str, float] = {}
    for part in text.split(","):
        name, equals, number = (piece.strip() for piece in part.partition("="))
        if name in found:
            raise ParameterError(f"{name} is named twice in {text!r}. Give one number for each name.")
        try:
            found[name] = float(number) if equals or usual is None else usual
        except ValueError:
            raise ParameterError(
                f"names with numbers are needed, such as jaw=0.5,age=1; received {part.strip()!r}."
            ) from None
    return found


def parse_mixture(text: str, atlas: Atlas) -> dict[str, float]:
    """Return weights by name, from "surprise", "AU12" or "AU1=0.7,AU4"; see :func:`parse_weights`.

    Raises
    ------
    UnknownNameError
        For a name that is no expression, action unit, muscle or pair of muscles.

    Examples
    --------
    >>> from facewrinkle.anatomy.atlas import load_atlas
    >>> parse_mixture("AU1=0.7, AU4", load_atlas())
    {'AU1': 0.7, 'AU4': 1.0}
    """
    weights = parse_weights(text)
    for name in weights:
        try:
            atlas.resolve(name)
        except UnknownNameError:
            pairs = dict.fromkeys(muscle.removesuffix("_l").removesuffix("_r") for muscle in atlas.muscles)
            known = [*atlas.expressions, *atlas.action_units, *pairs, *atlas.muscles]
            problem = unknown_name("expression, action unit or muscle", name, known)
            raise UnknownNameError(f"{problem} All of them: facewrinkle info.") from None
    return weights


def whole_number(kind: Any, tokens: Sequence[Any]) -> int:
    """Return a whole number; 2.5 is refused, and not rounded.

    Examples
    --------
    >>> whole_number(int, ["100"]), whole_number(int, ["1e3"])
    (100, 1000)
    """
    text = str(getattr(tokens[0], "value", tokens[0]))
    try:
        number = float(text)
        if number == int(number):
            return int(text) if text.lstrip("+-").isdigit() else int(number)
    except (ValueError, OverflowError):
        pass
    raise ValueError(f"a whole number is needed, received {text!r}.")


Vector = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
"""Numbers with commas between, of which the first may be negative."""

WHOLE = Parameter(converter=whole_number)
Whole = Annotated[int, WHOLE]
WholeOrNone = Annotated[int | None, WHOLE]


def parse_size(text: str) -> tuple[int, int]:
    """Return width and height, from "800" or "800x600".

    Examples
    --------
    >>> parse_size("640"), parse_size("800x600")
    ((640, 640), (800, 600))
    """
    try:
        numbers = [int(number) for number in text.lower().split("x")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        raise ParameterError(f"the size must be pixels such as 800 or 800x600, received {text!r}.")
    return numbers[0], numbers[-1]


def parse_numbers(name: str, text: str | None, counts: tuple[int, ...]) -> tuple[float, ...] | None:
    """Return numbers from "1,2,3", of which there must be one of `counts`; one number stands for (1, 2) of them.

    Examples
    --------
    >>> parse_numbers("centre", "10,0,45", (3,)), parse_numbers("extent", "60", (1, 2))
    ((10.0, 0.0, 45.0), (60.0, 60.0))
    """
    if text is None:
        return None
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in counts:
        raise ParameterError(f"--{name} must be {counts[-1]} numbers with commas between, received {text!r}.")
    return numbers * 2 if counts == (1, 2) and len(numbers) == 1 else numbers
