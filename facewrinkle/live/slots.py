"""Lasting places in arrays for things that come and go, so that little of an array changes from frame to frame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import IntArray
from . import _slot_kernels as kernels
from ._slot_kernels import FREE

Keys = npt.NDArray[np.uint64]


def keys_of(rows: np.ndarray) -> Keys:
    """Return a number (n,) for each row (n, k): the same for the same values, and a different one for each repetition.

    Examples
    --------
    >>> keys = keys_of(np.array([[1.0, 2.0], [3.0, 4.0], [1.0, 2.0]]))
    >>> bool(keys[0] == keys_of(np.array([[1.0, 2.0]]))[0]), len(set(keys.tolist()))
    (True, 3)
    """
    bits = np.ascontiguousarray(rows + 0.0, np.float64).view(np.uint64)  # -0.0 becomes 0.0
    keys = np.empty(len(rows), np.uint64)
    kernels.distinct_keys(bits, keys)
    return keys


def placed(before: Keys, keys: Keys, compact: bool = False) -> tuple[IntArray, Keys]:
    """Return places for things: those that had one keep it, and the others take free ones.

    Parameters
    ----------
    before : ndarray of uint64, shape (k,)
        The key of the thing at each place; `FREE` at free ones.
    keys : ndarray of uint64, shape (n,)
        Of the things that there are now, all different.
    compact : bool
        Leave no place free: what lies behind the first n moves.

    Returns
    -------
    places : ndarray of int, shape (n,)
    after : ndarray of uint64
        As `before`, now.

    Examples
    --------
    >>> places, after = placed(np.array([7, 8, 9], np.uint64), np.array([9, 5], np.uint64))
    >>> places.tolist(), after.tolist()
    ([2, 0], [5, 0, 9])
    >>> placed(np.array([7, 8, 9], np.uint64), np.array([9, 5], np.uint64), compact=True)[0].tolist()
    [0, 1]
    """
    places = np.empty(len(keys), np.int64)
    kernels.known_places(before, keys, places)
    if compact:
        places[places >= len(keys)] = -1
    taken = np.zeros(max(len(before), len(keys)), bool)
    taken[places[places >= 0]] = True
    new = np.flatnonzero(places < 0)
    free = np.flatnonzero(~taken)
    places[new] = np.append(free, len(taken) + np.arange(max(len(new) - len(free), 0)))[: len(new)]
    after = np.full(int(places.max(initial=-1)) + 1, FREE)
    after[places] = keys
    return places, after
