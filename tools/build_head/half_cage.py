"""The left half of the cage's limit surface, and what lies between its rings around eye and mouth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from facewrinkle.anatomy.head import both_sides, seated

from .cage import subdivided

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

LEVELS = 3
"""Subdivisions of the cage."""

LID_STRIPS = {("eye_ring2", "eye_ring3")}
LIP_STRIPS = {(f"mouth_ring{k}", f"mouth_ring{k + 1}") for k in (1, 2, 3)}
LINING_STRIPS = {("mouth_ring3", "mouth_ring4")}
FROZEN_STRIPS = LID_STRIPS | LIP_STRIPS | {("eye_ring1", "eye_ring2")}
"""Pairs of rings of the cage between which the lids, the lips and the linings of the lips lie, and all pairs between
which the sampling is kept.
"""

CORNER = 4.0
"""Number of the points of a ring around the mouth that lie at its corner: the upper lip's come before, from the middle
outwards, then the lower one's, back to the middle.
"""


@dataclass
class HalfCage:
    """The left half of the limit surface.

    Attributes
    ----------
    names : list of str
        Names of the cage's vertices.
    quads : ndarray of int, shape (m, 4)
        Quads of the cage.
    points : ndarray, shape (n, 3)
        The fine points, with the lids seated on the eyeball.
    grids : ndarray of int, shape (m, 2^k + 1, 2^k + 1)
        Fine vertices over each quad of the cage.
    limit : sparse array, shape (n, c)
        Maps the c cage points, the left half's and then the mirrored ones, to the points before the lids are seated.
    """

    names: list[str]
    quads: IntArray
    points: Array
    grids: IntArray
    limit: sparse.csr_array

    def of(self, name: str) -> int:
        """Return the fine vertex over a cage vertex."""
        row, corner = np.argwhere(self.quads == self.names.index(name))[0]
        i, j = ((0, 0), (-1, 0), (-1, -1), (0, -1))[corner]
        return int(self.grids[row, i, j])

    def side(self, first: str, second: str) -> IntArray:
        """Return the fine vertices from one cage vertex to the next, without the first."""
        ends = [self.names.index(first), self.names.index(second)]
        row = int(np.flatnonzero(np.isin(self.quads, ends).sum(axis=1) == 2)[0])
        g = self.grids[row]
        lines = [
            line for line in (g[:, 0], g[-1], g[:, -1], g[0]) if {self.of(first), self.of(second)} <= set(line.tolist())
        ]
        return lines[0][1:] if lines[0][0] == self.of(first) else lines[0][-2::-1]

    def strip(self, pairs: set[tuple[str, str]]) -> IntArray:
        """Return the rows of the quads between rings, which are given as pairs of name stems."""
        stems = [{self.names[v].split(".")[0] for v in quad} for quad in self.quads]
        return np.array([q for q, stem in enumerate(stems) if any(stem == set(pair) for pair in pairs)], dtype=np.int64)

    def fine_triangles(self) -> IntArray:
        """Return the triangles of the fine mesh."""
        g = self.grids
        quads = np.stack([g[:, :-1, :-1], g[:, 1:, :-1], g[:, 1:, 1:], g[:, :-1, 1:]], axis=-1).reshape(-1, 4)
        return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def half_surface(data: dict[str, Any]) -> HalfCage:
    """Subdivide the mirrored cage, keep the half with x >= 0, and seat the lids on the eyeball."""
    names = list(data["points"])
    points = np.array([data["points"][name] for name in names])
    quads = np.array([[names.index(name) for name in quad] for quad in data["quads"]])
    on_middle = points[:, 0] == 0.0
    partner = np.arange(len(points))
    partner[~on_middle] = len(points) + np.arange(np.count_nonzero(~on_middle))
    whole = subdivided(np.vstack([quads, partner[quads][:, ::-1]]), LEVELS)
    grids = whole.grids[: len(quads)]
    used, flat = np.unique(grids, return_inverse=True)
    limit = whole.limit[used]
    half = HalfCage(names, quads, limit @ both_sides(points), flat.reshape(grids.shape), limit)
    half.points[np.abs(half.points[:, 0]) < 1e-9, 0] = 0.0
    eye = data["eye"]
    half.points[:] = seated(half.points, ring_share(half, LID_STRIPS), np.array(eye["centre"]), eye["radius"])
    return half


def ring_share(half: HalfCage, pairs: set[tuple[str, str]]) -> Array:
    """Return shares (n,) that rise from 0 on the first ring of a pair to 1 on the second; 0 elsewhere."""
    share = np.zeros(len(half.points))
    blend = _corner_weights(half)
    second = {pair[1] for pair in pairs}
    for q in half.strip(pairs):
        inner = [half.names[v].split(".")[0] in second for v in half.quads[q]]
        share[half.grids[q]] = blend[inner].sum(axis=0)
    return share


def _corner_weights(half: HalfCage) -> Array:
    """Bilinear weights (4, s, s) of the corners of a quad of the cage at the fine points over it."""
    i, j = np.meshgrid(*(np.linspace(0, 1, half.grids.shape[1]),) * 2, indexing="ij")
    return np.stack([(1 - i) * (1 - j), i * (1 - j), i * j, (1 - i) * j])


def between(half: HalfCage, first: str, second: str, last: int) -> tuple[BoolArray, Array]:
    """Return True for fine points (n,) between two rings, up to cage point `last`, and shares (n,) of the way."""
    rows = half.strip({(first, second)})
    numbers = np.array([[int(half.names[v].split(".")[1]) for v in quad] for quad in half.quads[rows]])
    inside = np.zeros(len(half.points), dtype=bool)
    inside[half.grids[rows[(numbers <= last).all(axis=1)]]] = True
    return inside, ring_share(half, {(first, second)})


def lining_places(half: HalfCage) -> Array:
    """Return number along the ring and share of the way inwards (n, 2) of the lips' linings; NaN elsewhere."""
    places = np.full((len(half.points), 2), np.nan)
    depth = ring_share(half, LINING_STRIPS)
    for q in half.strip(LINING_STRIPS):
        numbers = np.array([float(half.names[v].split(".")[1]) for v in half.quads[q]])
        grid = half.grids[q]
        places[grid] = np.stack([np.tensordot(numbers, _corner_weights(half), 1), depth[grid]], axis=-1)
    return places


def opposite_on_lips(places: Array) -> NDArray[np.int32]:
    """Return the `lips` (m, 4) of :class:`facewrinkle.anatomy.head.Mold` for places (k, 2) on the linings.

    Examples
    --------
    An upper lip of two places that follow each other inwards, and a lower one that has places on both sides of that
    opposite the inner one:

    >>> opposite_on_lips(np.array([[3.5, 0.0], [3.5, 1.0], [4.0, 1.0], [5.0, 1.0], [4.5, 0.0]]))
    array([[1, 1, 2, 3],
           [0, 1, 4, 4]], dtype=int32)
    """
    number, depth = places.T
    rows = []
    for v in sorted(np.flatnonzero(number < CORNER).tolist(), key=lambda v: -depth[v]):
        behind = np.flatnonzero((number == number[v]) & (depth >= depth[v]) & (np.arange(len(places)) != v))
        inwards = behind[depth[behind].argmin()] if len(behind) else v
        level = np.flatnonzero((number >= CORNER) & (depth == depth[v]))
        off = number[level] - (2.0 * CORNER - number[v])
        before, after = np.where(off <= 0.0, off, -np.inf), np.where(off >= 0.0, off, np.inf)
        rows.append([v, inwards, level[before.argmax()], level[after.argmin()]])
    return np.array(rows, dtype=np.int32)
