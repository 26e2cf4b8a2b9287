"""Values from outside, as those of files and of pages, checked against types that say what is allowed."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Literal, get_args, get_origin

import msgspec

from .errors import ParameterError, type_of, unknown_name

Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
"""A number from 0 to 1."""

TYPES = {
    "float": "a number", "int": "a whole number", "str": "a text", "bool": "true or false",
    "array": "a list", "object": "a table", "null": "nothing",
}  # fmt: skip
"""What msgspec calls the types of plain data, and what everybody does."""

SENTENCES = (
    (r"Expected `[^`]+` <= (\S+)", "must be at most {0}"),
    (r"Expected `[^`]+` >= (\S+)", "must be at least {0}"),
    (r"Expected `[^`]+` of length >= 1\b.*", "must not be empty"),
    (r"Expected `str[^`]*` of length <= (\d+).*", "must have at most {0} characters"),
    (r"Expected `[^`]+` of length >= (\d+).*", "must have at least {0} entries"),
    (r"Expected `[^`]+` of length <= (\d+).*", "must have at most {0} entries"),
    (r"Expected `[^`]+` of length (\d+).*", "must be a list of {0} entries"),
    (r"Object missing required field `(\w+)`", "must have an entry {0}"),
    (r"Expected `([\w| ]+)`, got .*", "must be {0}"),
)
"""What msgspec says of a value that it refuses, and what is said instead."""


def conforming(value: Any, kind: Any, where: str) -> Any:
    """Return plain data as a type of msgspec: a Struct, a table, or what is annotated with limits.

    Parameters
    ----------
    value : object
        Numbers, texts, lists and dictionaries; NumPy's are taken, too.
    kind : type
    where : str
        A name for errors; may be empty for a Struct.

    Raises
    ------
    UnknownNameError
        For an entry that a Struct does not have; the nearest one is named.
    ParameterError
        For anything else that the type does not allow, as numbers that are not finite where there are limits.

    Examples
    --------
    >>> from msgspec import Meta
    >>> conforming({"AU12": 1}, dict[str, Annotated[float, Meta(ge=0, le=1)]], "mixture")
    {'AU12': 1.0}
    >>> conforming({"AU12": 2}, dict[str, Annotated[float, Meta(ge=0, le=1)]], "mixture")
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: mixture.AU12 must be at most 1, received 2.
    """
    try:
        plain = msgspec.to_builtins(value, enc_hook=_of_numpy, str_keys=True)
    except (TypeError, RecursionError):
        raise ParameterError(
            f"{where or 'this'} must be made of numbers, texts, lists and tables, received {reprlib.repr(value)}."
        ) from None
    return _conforming(plain, kind, where)


def _of_numpy(value: Any) -> Any:
    if not hasattr(value, "tolist"):
        raise TypeError(type_of(value))
    return value.tolist()


@cache  # as msgspec reads the annotations anew each time
def _kinds(struct: type[msgspec.Struct]) -> dict[str, Any]:
    return {field.name: field.type for field in msgspec.structs.fields(struct)}


def _conforming(value: Any, kind: Any, where: str) -> Any:
    """Go down into tables, so that an error names the entry; msgspec itself says only that there is one."""
    plain = get_args(kind)[0] if get_origin(kind) is Annotated else kind
    if isinstance(value, Mapping) and isinstance(plain, type) and issubclass(plain, msgspec.Struct):
        kinds = _kinds(plain)
        for name in value:
            if name not in kinds:
                raise unknown_name(f"entry of {where}".removesuffix(" of "), name, kinds)
        value = {name: _conforming(each, kinds[name], f"{where}.{name}".lstrip(".")) for name, each in value.items()}
    elif isinstance(value, Mapping) and get_origin(plain) is dict:
        value = {name: _conforming(each, get_args(plain)[1], f"{where}.{name}") for name, each in value.items()}
    elif get_origin(plain) is Literal and isinstance(value, str) and value not in get_args(plain):
        allowed = ", ".join(map(repr, get_args(plain)))
        raise ParameterError(f"{where} must be one of {allowed}, received {value!r}.")
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as problem:
        what, _, place = str(problem).partition(" - at ")
        place = place.replace("`", "").replace("$", where).lstrip(".") or where or "this"
        place = place.replace("key in", "a name in")
        raise ParameterError(f"{place} {_sentence(what)}, received {reprlib.repr(value)}.") from None


def _sentence(what: str) -> str:
    """Say what is allowed, in everybody's words."""
    for pattern, sentence in SENTENCES:
        if found := re.fullmatch(pattern, what):
            told = found.groups()[0].removesuffix(".0") if found.groups() else ""
            return sentence.format(" or ".join(TYPES.get(word, word) for word in told.split(" | ")))
    return "is not allowed"
