"""Checks of arrays that users give: numbers, vectors, and pictures. Those of single numbers stand in `errors`."""

from __future__ import annotations

import reprlib
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import LARGEST, ParameterError, type_of


def finite(name: str, values: object) -> npt.NDArray[np.float64]:
    """Return an array of numbers that are finite and not huge; raise a ParameterError for anything else.

    Examples
    --------
    >>> finite("times", [0, 1])
    array([0., 1.])
    """
    try:
        if np.asarray(values).dtype.kind in "cUS":  # numpy would make numbers of text
            raise TypeError
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{name} must be numbers in rows of one length, received {type_of(values)}.") from None
    if not (np.abs(array) < LARGEST).all():
        broken = np.argwhere(~(np.abs(array) < LARGEST))[0].tolist()
        raise ParameterError(f"{name} must be finite; entry {broken} is {array[tuple(broken)]}. Replace it.")
    return array


def vector(name: str, value: object) -> npt.NDArray[np.float64]:
    """Return three finite numbers (3,), read-only; raise a ParameterError for anything else.

    Examples
    --------
    >>> vector("center", (0, 1, 2))
    array([0., 1., 2.])
    """
    try:
        array = finite(name, value)
    except ParameterError:
        array = np.empty(0)
    if array.shape != (3,):
        raise ParameterError(f"{name} must be three finite numbers, received {reprlib.repr(value)}.")
    array.setflags(write=False)
    return array


def vectors(name: str, values: object) -> npt.NDArray[np.float64]:
    """Return one or more points or directions (n, 3); raise a ParameterError for anything else.

    Examples
    --------
    >>> vectors("path", (0, 1, 2))
    array([[0., 1., 2.]])
    """
    try:
        array = np.atleast_2d(finite(name, values))
    except ParameterError:
        array = np.empty(0)
    if array.ndim != 2 or array.shape[1] != 3 or not len(array):
        raise ParameterError(f"{name} must be rows of three finite numbers, received {reprlib.repr(values)}.")
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
