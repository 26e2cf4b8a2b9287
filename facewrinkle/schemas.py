"""Values from outside, as those of files and of pages, checked against types that say what is allowed."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from typing import Annotated, Any, get_args, get_origin

import msgspec

from .errors import ParameterError, type_of, unknown_name

Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
"""A number from 0 to 1."""


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
    facewrinkle.errors.ParameterError: mixture.AU12: expected `float` <= 1.0, received 2.
    """
    try:
        plain = msgspec.to_builtins(value, enc_hook=_of_numpy, str_keys=True)
    except (TypeError, RecursionError):
        raise ParameterError(f"{where}: expected plain data, received {reprlib.repr(value)}.") from None
    return _conforming(plain, kind, where)


def _of_numpy(value: Any) -> Any:
    if not hasattr(value, "tolist"):
        raise TypeError(type_of(value))
    return value.tolist()


def _conforming(value: Any, kind: Any, where: str) -> Any:
    """Go down into tables, so that an error names the entry; msgspec itself says only that there is one."""
    plain = get_args(kind)[0] if get_origin(kind) is Annotated else kind
    if isinstance(value, Mapping) and isinstance(plain, type) and issubclass(plain, msgspec.Struct):
        kinds = {field.name: field.type for field in msgspec.structs.fields(plain)}
        for name in value:
            if name not in kinds:
                raise unknown_name(f"entry of {where}".removesuffix(" of "), name, kinds)
        value = {name: _conforming(each, kinds[name], f"{where}.{name}".lstrip(".")) for name, each in value.items()}
    elif isinstance(value, Mapping) and get_origin(plain) is dict:
        value = {name: _conforming(each, get_args(plain)[1], f"{where}.{name}") for name, each in value.items()}
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as problem:
        what, _, place = str(problem).partition(" - at ")
        place = place.replace("`", "").replace("$", where).lstrip(".") or where
        text = f"{place}: {what[:1].lower()}{what[1:]}, received {reprlib.repr(value)}."
        raise ParameterError(text) from None
