"""Tables with some rows for each vertex of a mesh that is refined, none, one or several; and what these make of it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from ..array_types import Array, BoolArray, IntArray


@dataclass(frozen=True, eq=False)
class Entries:
    """What there is at n vertices: none, one or several entries for each, p in all. Subclasses add columns, (p, ...).

    Attributes
    ----------
    starts : ndarray of int32, shape (n + 1,)
        Entries of vertex i are ``starts[i] <= p < starts[i + 1]``.

    Examples
    --------
    Two entries at the first vertex, none at the second, one at the third:

    >>> @dataclass(frozen=True, eq=False)
    ... class Heights(Entries):
    ...     height: np.ndarray
    >>> table = Heights(*sorted_by_vertex(np.array([2, 0, 0]), np.array([0.3, 0.1, 0.2]), n=3))
    >>> table.starts.tolist(), table.vertices.tolist(), table.height.tolist()
    ([0, 2, 2, 3], [0, 0, 2], [0.1, 0.2, 0.3])
    >>> both = table.followed(np.array([1, 2]), table)
    >>> both.starts.tolist(), both.height.tolist()
    ([0, 0, 1, 3, 3, 4], [0.3, 0.1, 0.2, 0.3])
    """

    starts: IntArray

    @cached_property
    def vertices(self) -> IntArray:
        """The vertex (p,) of each entry."""
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))

    @property
    def columns(self) -> list[np.ndarray]:
        """The columns, without the starts."""
        return [getattr(self, each.name) for each in fields(self)[1:]]

    def taken(self, vertices: npt.NDArray[np.int64]) -> Self:
        """Return the entries of some vertices (numbers, in any order)."""
        counts = np.diff(self.starts)[vertices]
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        entries = np.repeat(self.starts[:-1][vertices] - starts[:-1], counts) + np.arange(starts[-1])
        return type(self)(starts, *(column[entries] for column in self.columns))

    def followed(self, kept: slice | npt.NDArray[np.int64], new: Self) -> Self:
        """Return the entries of the vertices that live on, then those of the new ones."""
        old = self if isinstance(kept, slice) else self.taken(kept)
        if len(new.starts) == 1:
            return old
        starts = np.concatenate([old.starts, new.starts[1:] + old.starts[-1]])
        return type(self)(starts, *map(np.concatenate, zip(old.columns, new.columns, strict=True)))


def sorted_by_vertex(vertices: IntArray, *columns: np.ndarray, n: int) -> tuple[np.ndarray, ...]:
    """Return the starts (n + 1,), and then the columns, of entries in any order; those of a vertex keep theirs.

    Parameters
    ----------
    vertices : ndarray of int, shape (p,)
        The vertex of each entry.
    *columns : ndarray, shape (p, ...)
    n : int
        Number of vertices.

    Examples
    --------
    >>> starts, height = sorted_by_vertex(np.array([2, 0]), np.array([0.3, 0.1]), n=3)
    >>> starts.tolist(), height.tolist()
    ([0, 1, 1, 2], [0.1, 0.3])
    """
    order = np.argsort(vertices, kind="stable")
    starts = np.searchsorted(vertices[order], np.arange(n + 1)).astype(np.int32)
    return starts, *(column[order] for column in columns)


def scattered(where: BoolArray, values: np.ndarray, none: float) -> np.ndarray:
    """Return an array with `values` where `where` (n,) is True, and `none` elsewhere.

    Examples
    --------
    >>> scattered(np.array([True, False]), np.array([0.5]), -1.0).tolist()
    [0.5, -1.0]
    """
    out = np.full(len(where), none, values.dtype)
    out[where] = values
    return out


BLUNT = 0.18
"""Half the width over which heights are averaged for the shading normals, in half cycles: about the distance of the
vertices. Some vertices lie at the very bottom of a sharp furrow and others beside it; normals of the heights themselves
would vary along the furrow, and its line would look serrated.
"""

LEAST = 0.15
"""Folds less deep than this, mm, ask for no triangles."""

TAUT = 0.15
"""Stretch that smooths out the lines of old skin."""


class Relief(NamedTuple):
    """What all folds of a layer together make of n vertices in a frame.

    Attributes
    ----------
    height, shown, spacing : ndarray, shape (n,)
        Height, mm; height with blunt furrows, mm; and spacing of the vertices that this needs, infinite for none.
    across : ndarray, shape (n, 3)
        Unit direction across the finest folds.
    active : ndarray of bool, shape (n,)
    share : ndarray, shape (n,)
        What the length of the skin leaves of all depths.
    """

    height: Array
    shown: Array
    spacing: Array
    across: Array
    active: BoolArray
    share: Array

    @classmethod
    def flat(cls, n: int) -> Self:
        """Return the relief of n vertices without folds.

        Examples
        --------
        >>> Relief.flat(2).spacing
        array([inf, inf])
        """
        flat, across = np.zeros((2, n)), np.zeros((n, 3))
        return cls(flat[0], flat[1], np.full(n, np.inf), across, np.zeros(n, bool), np.ones(n))

    def leveled(self, areas: Array) -> Self:
        """Return the relief with heights that hold no net volume over areas (n,)."""
        shares = level_shares(self.height, areas)
        return self._replace(height=shares * self.height, shown=shares * self.shown)


LEVELLED = 0.8
"""Bulges and furrows are lowered to this share of their heights at most, so that they hold the same volume."""

RAISED = 1.07
"""The other side becomes this much higher at most: a furrow is up to three times as deep as its crest is high, so that
from bulge to furrow no fold becomes deeper than it was.
"""

STEPS = 512
"""Shares are multiples of 1 / 512: the order of the triangles, in which volumes are added up, does not change them."""


def level_shares(height: Array, areas: Array) -> Array:
    """Return the shares (n,) of heights (n,) that leave bulges and furrows as much volume over areas (n,).

    The side that holds more becomes lower; where a fifth is not enough, the other side grows a little.

    Examples
    --------
    >>> level_shares(np.array([0.4, -0.1, -0.25]), np.ones(3)).tolist()
    [0.875, 1.0, 1.0]
    """
    volumes = areas * height
    above, below = float(np.maximum(volumes, 0.0).sum()), -float(np.minimum(volumes, 0.0).sum())
    more, less = max(above, below), min(above, below)
    lowered = max(round(less / more * STEPS) / STEPS, LEVELLED) if more > 0.0 else 1.0
    raised = min(round(lowered * more / less * STEPS) / STEPS, RAISED) if less > 0.0 and lowered == LEVELLED else 1.0
    bulges, furrows = (lowered, raised) if above > below else (raised, lowered)
    return np.where(height > 0.0, bulges, furrows)
