"""Machine code for lasting places: tables of keys with open addresses."""

from __future__ import annotations

import numpy as np

from ..geometry.compilation import njit

MIX = np.uint64(0x9E3779B97F4A7C15)
"""An odd number that spreads keys over 64 bits, 2^64 divided by the golden ratio."""

FREE = np.uint64(0)
"""The key of a place that nothing has."""


@njit(cache=True)
def table_size(count):
    """Places of a table, a power of two: twice as many as keys, at least."""
    size = 4
    while size < 2 * count:
        size *= 2
    return size


@njit(cache=True)
def distinct_keys(bits, out):
    """A key for each row of 64-bit numbers (n, k): the same for the same row, but for the second of two equal rows."""
    size = table_size(len(bits))
    held, mask, shift = np.zeros(size, np.uint64), np.uint64(size - 1), np.uint64(29)
    for i in range(len(bits)):
        key = MIX
        for j in range(bits.shape[1]):
            key = (key ^ bits[i, j]) * MIX
            key ^= key >> shift
        while True:
            if key == FREE:
                key = MIX
            at = (key >> shift) & mask
            while held[at] != FREE and held[at] != key:
                at = (at + np.uint64(1)) & mask
            if held[at] == FREE:
                break
            key += MIX
        held[at] = key
        out[i] = key


@njit(cache=True)
def known_places(before, keys, out):
    """The place (n,) of each key in `before`, and -1 for those that are not there."""
    size = table_size(len(before))
    place, mask, shift = np.full(size, -1, np.int64), np.uint64(size - 1), np.uint64(29)
    for p in range(len(before)):
        if before[p] != FREE:
            at = (before[p] >> shift) & mask
            while place[at] >= 0:
                at = (at + np.uint64(1)) & mask
            place[at] = p
    for i in range(len(keys)):
        at = (keys[i] >> shift) & mask
        while place[at] >= 0 and before[place[at]] != keys[i]:
            at = (at + np.uint64(1)) & mask
        out[i] = place[at]
