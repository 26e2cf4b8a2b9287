"""The check at the door of public functions: arguments of other types than the annotations allow."""

from __future__ import annotations

import collections.abc
import functools
import inspect
import os
import reprlib
import types
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from .errors import LARGEST, ParameterError, type_of, unknown_name

F = TypeVar("F", bound=Callable[..., Any])

ORIGINS = (collections.abc.Mapping, collections.abc.Iterable, collections.abc.Iterator, dict, list)
"""Generic types whose kind is checked."""


def checked(function: F) -> F:
    """Check the arguments of a function, or of the making of a class, against the annotations at every call.

    Classes, their unions, None, numbers, text, paths, mappings, iterables and what they hold, and functions with the
    number of their arguments are checked; whatever else an annotation says is let pass: the functions themselves tell
    best which numbers and names they take.

    Raises
    ------
    ParameterError
        For an argument of another type.
    UnknownNameError
        For a keyword that the function does not have.

    Examples
    --------
    >>> @checked
    ... def pictures(count: int = 1, name: str | None = None): ...
    >>> pictures(name=3)
    Traceback (most recent call last):
        ...
    facewrinkle.errors.ParameterError: name must be text or None, received 3. See help(pictures).
    >>> pictures(counts=2)
    Traceback (most recent call last):
        ...
    facewrinkle.errors.UnknownNameError: unknown argument of pictures 'counts'. Did you mean 'count'?
    """
    if isinstance(function, type):
        made = checked(function.__init__)  # type: ignore[misc]
        function.__init__ = made  # type: ignore[misc]
        return function
    signature = inspect.signature(function)
    owner = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]
    hints: dict[str, Any] = {}

    @functools.wraps(function)
    def door(*arguments: Any, **words: Any) -> Any:
        if not hints:
            hints.update(_hints(function))
        try:
            bound = signature.bind(*arguments, **words)
        except TypeError:
            known = [name for name, p in signature.parameters.items() if p.kind is not p.VAR_KEYWORD and name != "self"]
            if any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values()) or set(words) <= set(known):
                raise
            raise unknown_name(f"argument of {owner}", next(w for w in words if w not in known), known) from None
        for name, value in bound.arguments.items():
            hint, parameter = hints.get(name, Any), signature.parameters[name]
            if parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL) or value is parameter.default:
                continue
            if not _fits(value, hint):
                raise ParameterError(f"{name} must be {_words(hint)}, received {_shown(value)}. See help({owner}).")
        return function(*arguments, **words)

    return typing.cast(F, door)


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the annotations of a function; Any where names are imported for type checkers alone."""
    found: dict[str, Any] = {}
    for name, annotation in function.__annotations__.items():
        alone = types.SimpleNamespace(__annotations__={name: annotation})
        try:
            found |= typing.get_type_hints(alone, globalns=function.__globals__)
        except NameError:
            found[name] = Any
    return found


def _fits(value: object, hint: Any) -> bool:
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if hint is Any:
        return True
    if origin in (typing.Union, types.UnionType):
        return any(_fits(value, part) for part in inner)
    if hint is None or hint is type(None):
        return value is None
    if origin is typing.Literal:
        return isinstance(value, tuple({type(choice) for choice in inner}))  # the function suggests the nearest name
    if origin is collections.abc.Callable:
        return callable(value) and _takes(value, inner[0])
    if origin is tuple or np.ndarray in (hint, origin):
        return isinstance(value, tuple | list | np.ndarray)
    if origin is collections.abc.Sequence:
        return True  # rows of numbers may come as anything
    if isinstance(origin, type):
        if not issubclass(origin, ORIGINS):
            return True
        return isinstance(value, origin) and (len(inner) != 1 or _holds(value, inner[0]))
    if hint in (float, int):
        return _is_number(value)
    if hint is bool:
        return isinstance(value, bool) or type(value).__name__ in ("bool", "bool_")
    if hint in (str, Path):
        return isinstance(value, str if hint is str else os.PathLike)
    if getattr(hint, "_is_protocol", False):
        return not isinstance(value, str | bytes | int | float | np.generic)
    return isinstance(value, hint) if isinstance(hint, type) else True


def _takes(function: Callable[..., Any], kinds: Any) -> bool:
    """Return True if a function can be called with so many arguments, as far as it says."""
    if not isinstance(kinds, list):
        return True
    try:
        inspect.signature(function).bind(*kinds)
    except TypeError:
        return False
    except ValueError:  # functions of C may not tell
        pass
    return True


def _holds(things: object, hint: Any) -> bool:
    """Return True if things are of a type, as far as they can be looked at without being used up."""
    if isinstance(things, str | bytes) or (isinstance(things, np.ndarray) and things.ndim == 0):
        return False
    if hint in (float, int) or not isinstance(things, list | tuple | np.ndarray):  # numbers may be many
        return True
    return all(_fits(thing, hint) for thing in things)


def _is_number(value: object) -> bool:
    if isinstance(value, str | bytes) or value is None:
        return False
    try:
        float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return False
    except OverflowError:
        pass
    return True


def _shown(value: object) -> str:
    """Show a plain value, and name the type of any other."""
    plain = value is None or isinstance(value, str | bytes | int | float | list | tuple | dict | set)
    return reprlib.repr(value) if plain else type_of(value)


def _words(hint: Any) -> str:
    """Say what an annotation allows."""
    origin = typing.get_origin(hint)
    if origin in (typing.Union, types.UnionType):
        said = list(dict.fromkeys(_words(part) for part in typing.get_args(hint)))
        return f"{', '.join(said[:-1])} or {said[-1]}" if len(said) > 1 else said[0]
    plain = {float: "a number", int: "a whole number", str: "text", bool: "True or False", Path: "a path"}
    plain |= {type(None): "None"}
    if hint in plain:
        return plain[hint]
    if origin is collections.abc.Callable:
        kinds = typing.get_args(hint)[0]
        return (
            f"a function of {len(kinds)} argument{'s' * (len(kinds) != 1)}" if isinstance(kinds, list) else "a function"
        )
    if origin is typing.Literal:
        return " or ".join(map(repr, typing.get_args(hint)))
    if origin is collections.abc.Mapping:
        return "a dictionary"
    if np.ndarray in (hint, origin):
        return "an array"
    if origin is tuple:
        return "a tuple"
    named = origin if isinstance(origin, type) else hint
    name = getattr(named, "__name__", str(named))
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def finite(name: str, values: object) -> npt.NDArray[np.float64]:
    """Return an array of numbers that are finite and not huge; raise a ParameterError for anything else.

    Examples
    --------
    >>> finite("times", [0, 1])
    array([0., 1.])
    """
    try:
        if np.iscomplexobj(np.asarray(values)):
            raise TypeError
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{name} must be numbers in rows of one length, received {type_of(values)}.") from None
    if not (np.abs(array) < LARGEST).all():
        broken = np.argwhere(~(np.abs(array) < LARGEST))[0].tolist()
        raise ParameterError(f"{name} must be finite; entry {broken} is {array[tuple(broken)]}. Replace it.")
    return array


def plain(values: object) -> bool:
    """Tell whether values are as compiled loops take them: they would be compiled anew for other types, and for views.

    Examples
    --------
    >>> plain(np.zeros((2, 3))), plain(np.zeros((2, 3)).T), plain([0.0])
    (True, False, False)
    """
    return type(values) is np.ndarray and values.dtype == np.float64 and bool(values.flags.c_contiguous)


def plain_and_finite(name: str, values: Any) -> npt.NDArray[np.float64]:
    """Return values as :func:`plain` ones, the very same if they are; raise a ParameterError as :func:`finite` does.

    Examples
    --------
    >>> rows = np.zeros((2, 3))
    >>> plain_and_finite("rows", rows) is rows
    True
    """
    if plain(values) and values.min(initial=0.0) > -LARGEST and values.max(initial=0.0) < LARGEST:
        return np.asarray(values)
    return finite(name, values).copy("C")


def picture(image: object) -> npt.NDArray[np.uint8]:
    """Return a picture as an array (height, width, 3 or 4) of bytes; raise a ParameterError for anything else.

    Examples
    --------
    >>> picture(np.zeros((20, 30, 3), np.uint8)).shape
    (20, 30, 3)
    """
    found = np.asarray(image)
    if found.ndim != 3 or found.shape[2] not in (3, 4) or found.dtype != np.uint8 or not found.size:
        raise ParameterError(
            f"pictures must be uint8 arrays (height, width, 3 or 4), received {found.dtype} of {found.shape}."
        )
    return found
