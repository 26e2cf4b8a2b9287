"""Rows that are appended to arrays without copying what is there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

AnyArray = npt.NDArray[Any]

SPARE = 4
"""Tables are made with one row to spare for so many in use."""


class Room:
    """Tables with room for more rows than are in use.

    Meshes that are refined step by step get a few vertices at a time; all that is known of the others stays where it
    is. Arrays that were returned before keep their values: they are the first rows of the same tables.

    Examples
    --------
    >>> room, ones = Room(), np.ones(3)
    >>> (first,) = room.appended([ones], [np.zeros(1)])
    >>> (second,) = room.appended([first], [np.full(1, 2.0)])
    >>> first.tolist(), second.tolist(), second.base is first.base
    ([1.0, 1.0, 1.0, 0.0], [1.0, 1.0, 1.0, 0.0, 2.0], True)
    """

    def __init__(self) -> None:
        self._tables: list[AnyArray] = []
        self._used = -1

    def appended(self, old: Sequence[AnyArray], new: Sequence[AnyArray]) -> list[AnyArray]:
        """Return arrays with the rows of the old ones and then those of the new ones.

        The old ones are copied unless they are what was returned last, and there is room behind them.
        """
        n, total = len(old[0]), len(old[0]) + len(new[0])
        if not self._holds(old) or total > len(self._tables[0]):
            self._tables = [np.empty((total + total // SPARE, *each.shape[1:]), each.dtype) for each in old]
            for table, each in zip(self._tables, old, strict=True):
                table[:n] = each
        for table, each in zip(self._tables, new, strict=True):
            table[n:total] = each
        self._used = total
        return [table[:total] for table in self._tables]

    def _holds(self, arrays: Sequence[AnyArray]) -> bool:
        """Tell whether arrays are all rows in use of these tables."""
        return self._used == len(arrays[0]) and all(
            each.base is table for each, table in zip(arrays, self._tables, strict=True)
        )
