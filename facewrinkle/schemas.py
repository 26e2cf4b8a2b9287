"""Values from outside, as those of files and of pages, checked against types that say what is allowed.

The types are those of annotations: numbers, texts, lists, tables and dataclasses, annotated with :class:`Limits`.
"""

from __future__ import annotations

import json
import reprlib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from .errors import ParameterError, check_name, type_of

WORDS = {
    float: "a number", int: "a whole number", str: "a text", bool: "true or false", list: "a list", tuple: "a list",
    dict: "a table",
}  # fmt: skip
"""What everybody calls the types of plain data."""


@dataclass(frozen=True)
class Limits:
    """What is allowed of a number, or of the length of a text, a list or a table.

    Examples
    --------
    >>> conforming(2, Annotated[float, Limits(0.0, 1.0)], "depth")
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: depth must be at most 1, received 2.0.
    """

    least: float | None = None
    most: float | None = None

    def refusal(self, value: Any) -> str:
        """Return what is wrong with a value, with a verb; nothing if it is allowed."""
        sized = isinstance(value, str | list | dict)
        number, verb, things = (len(value), "have", " entries") if sized else (value, "be", "")
        if isinstance(value, str):
            things = " characters"
        if self.least is not None and not number >= self.least:
            empty = sized and self.least == 1
            return "must not be empty" if empty else f"must {verb} at least {self.least:g}{things}"
        if self.most is not None and not number <= self.most:
            return f"must {verb} at most {self.most:g}{things}"
        return ""


Share = Annotated[float, Limits(0.0, 1.0)]
"""A number from 0 to 1."""


def conforming(value: Any, kind: Any, where: str) -> Any:
    """Return plain data as a type: a dataclass, a list, a table, or what is annotated with limits.

    Parameters
    ----------
    value : object
        Numbers, texts, lists and dictionaries; NumPy's are taken, too.
    kind : type
    where : str
        A name for errors; may be empty for a dataclass.

    Raises
    ------
    UnknownNameError
        For an entry that a dataclass does not have; the nearest one is named.
    ParameterError
        For anything else that the type does not allow, as numbers that are not finite where there are limits.

    Examples
    --------
    >>> conforming({"AU12": 1}, dict[str, Share], "mixture")
    {'AU12': 1.0}
    >>> conforming({"AU12": 2}, dict[str, Share], "mixture")
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: mixture.AU12 must be at most 1, received 2.0.
    """
    try:
        return _conforming(plain(value), kind, where)
    except (TypeError, RecursionError):
        raise ParameterError(
            f"{where or 'this'} must be made of numbers, texts, lists and tables, received {reprlib.repr(value)}."
        ) from None


def plain(value: Any) -> Any:
    """Return numbers, texts, lists and tables as JSON has them, also of dataclasses and of NumPy's arrays.

    Examples
    --------
    >>> plain({"limits": Limits(0, 1), "kind": ("a", "b")})
    {'limits': {'least': 0, 'most': 1}, 'kind': ['a', 'b']}
    """
    if value is None or isinstance(value, bool | int | float | str):
        return getattr(value, "item", lambda: value)()  # NumPy's floats are Python's, too
    if isinstance(value, Mapping):
        return {str(name): plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if not hasattr(value, "tolist"):
        raise TypeError(type_of(value))
    return value.tolist()


def table_of(text: str | bytes) -> dict[str, Any]:
    """Return the table that a JSON text is.

    Raises
    ------
    ValueError
        If it is none.

    Examples
    --------
    >>> table_of('{"do": "undo"}')
    {'do': 'undo'}
    """
    try:
        found = json.loads(text, parse_constant=_no_number)
        json.dumps(found, ensure_ascii=False).encode()
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except UnicodeEncodeError:
        raise ValueError("it has half a character") from None
    if not isinstance(found, dict):
        raise ValueError("it must be a table in braces")
    return found


def _no_number(word: str) -> None:
    raise ValueError(f"{word} is no number of JSON")


@cache
def kinds_of(table: type) -> dict[str, Any]:
    """Return the types of the entries of a dataclass.

    Examples
    --------
    >>> list(kinds_of(Limits))
    ['least', 'most']
    """
    hints = get_type_hints(table, include_extras=True)
    return {field.name: hints[field.name] for field in fields(table)}


def _conforming(value: Any, kind: Any, where: str) -> Any:
    kind, *limits = get_args(kind) if get_origin(kind) is Annotated else (kind,)
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if origin in (Union, UnionType):
        return _one_of(value, inner, where)
    if origin is Literal:
        if value not in inner:
            _refuse(where, f"must be one of {', '.join(map(repr, inner))}", value)
        return value
    if is_dataclass(origin):
        return _filled(value, origin, where)
    if origin is not Any:
        value = _typed(value, origin, where)
    for limit in limits:
        if refusal := limit.refusal(value):
            _refuse(where, refusal, value)
    if origin is dict and inner:
        for name in value:
            _conforming(name, inner[0], f"a name in {where}")
        return {name: _conforming(each, inner[1], f"{where}.{name}") for name, each in value.items()}
    if origin is tuple and inner[-1] is not Ellipsis:
        if len(value) != len(inner):
            _refuse(where, f"must be a list of {len(inner)} entries", value)
        return tuple(_conforming(each, inner[k], f"{where}[{k}]") for k, each in enumerate(value))
    if origin in (list, tuple) and inner:
        return origin(_conforming(each, inner[0], f"{where}[{k}]") for k, each in enumerate(value))
    return value


def _one_of(value: Any, kinds: tuple[Any, ...], where: str) -> Any:
    """Return a value as the one of several types that its own type stands for."""
    if value is None and NoneType in kinds:
        return None
    others = [kind for kind in kinds if kind is not NoneType]
    asked = dict if isinstance(value, Mapping) else list if isinstance(value, list) else type(value)
    fitting = [kind for kind in others if asked in _taken(kind)]
    if not fitting:
        words = [WORDS[_taken(kind)[0]] for kind in others] + ["nothing"] * (NoneType in kinds)
        _refuse(where, f"must be {' or '.join(words)}", value)
    return _conforming(value, fitting[0], where)


def _taken(kind: Any) -> tuple[type, ...]:
    """Return the types of plain data that a type takes."""
    bare = get_args(kind)[0] if get_origin(kind) is Annotated else kind
    bare = get_origin(bare) or bare
    return {float: (float, int), tuple: (list,)}.get(bare, (dict,) if is_dataclass(bare) else (bare,))


def _filled(value: Any, table: Any, where: str) -> Any:
    """Return a table as a dataclass."""
    if not isinstance(value, Mapping):
        _refuse(where, f"must be {WORDS[dict]}", value)
    kinds = kinds_of(table)
    for name in value:
        check_name(f"entry of {where}".removesuffix(" of "), name, kinds)
    for field in fields(table):
        if field.name not in value and field.default is MISSING and field.default_factory is MISSING:
            _refuse(where, f"must have an entry {field.name}", value)
    return table(
        **{name: _conforming(each, kinds[name], f"{where}.{name}".lstrip(".")) for name, each in value.items()}
    )


def _typed(value: Any, kind: Any, where: str) -> Any:
    """Return a value of a type of plain data; whole numbers are numbers, too, and 2.0 is a whole number."""
    if kind is float and type(value) is int and abs(value) < 1e300:
        return float(value)
    if kind is int and type(value) is float and value.is_integer():
        return int(value)
    if type(value) is not {tuple: list}.get(kind, kind):
        _refuse(where, f"must be {WORDS[kind]}", value)
    return value


def _refuse(where: str, why: str, value: Any) -> None:
    raise ParameterError(f"{where or 'this'} {why}, received {reprlib.repr(value)}.")
