"""Lasting places in arrays for things that come and go, so that little of an array changes from frame to frame."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Keys = npt.NDArray[np.uint64]
IntArray = npt.NDArray[Any]

FREE = np.uint64(0)
"""The key of a place that nothing has."""

MIX = np.uint64(0x9E3779B97F4A7C15)
"""An odd number that spreads keys over 64 bits, 2^64 divided by the golden ratio."""


def keys_of(rows: np.ndarray) -> Keys:
    """Return a number (n,) for each row (n, k): the same for the same values, and a different one for each repetition.

    Examples
    --------
    >>> keys = keys_of(np.array([[1.0, 2.0], [3.0, 4.0], [1.0, 2.0]]))
    >>> bool(keys[0] == keys_of(np.array([[1.0, 2.0]]))[0]), len(set(keys.tolist()))
    (True, 3)
    """
    if not len(rows):
        return np.empty(0, np.uint64)
    bits = np.ascontiguousarray(rows + 0.0, np.float64).view(np.uint64)  # -0.0 becomes 0.0
    keys = np.full(len(rows), MIX)
    for column in bits.T:
        keys = (keys ^ column) * MIX
        keys ^= keys >> np.uint64(29)
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    first = np.append(True, ordered[1:] != ordered[:-1])
    starts = np.maximum.accumulate(np.where(first, np.arange(len(keys)), 0))
    keys[order] = ordered + (np.arange(len(keys)) - starts).astype(np.uint64) * MIX
    return np.where(keys == FREE, MIX, keys)


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
    places = np.full(len(keys), -1, np.int64)
    if len(before):
        order = np.argsort(before, kind="stable")
        at = np.minimum(np.searchsorted(before[order], keys), len(before) - 1)
        known = before[order[at]] == keys
        places[known] = order[at[known]]
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
