"""Wave packets: the lines of a family, found once on the surface at rest.

A packet is a short train of waves on the skin: place, direction across the lines, wavelength, phase and strength. Their
phases are aligned by lowering the stripe energy of Knoeppel et al., "Stripe Patterns on Surfaces" (ACM Trans. Graph.
34, 2015), on the graph of packets; waves at a point are the weighted sum of the packets around it (phasor noise:
Tricard et al., ACM Trans. Graph. 38, 2019). Lines branch and end where the phases of neighbours cannot agree.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from ...anatomy.face import Face
from ...array_types import Array, BoolArray, IntArray
from ...geometry.normals import vertex_normals
from ...geometry.smoothstep import smoothstep
from ..compression import along, orthonormal_tangents, principal
from . import _kernels as kernels
from .families import window_of
from .tissue import OTHERS, OWN

APART = 0.45
"""Distance of packets, in wavelengths."""

SWEEPS = 40
"""Gauss-Seidel sweeps in which phases are aligned."""

ALIGNED = (0.55, 1.3)
"""Standard deviations across and along the lines of the weights with which packets align, in wavelengths."""

SUMMED = (0.42, 1.3)
"""The same of the weights with which packets add up."""

STRIATED = (0.40, 2.6)
"""The same of the weights with which the strengths of packets are averaged, so that each line has its own."""

REACH, SUPPORT = 2.9, 1.7
"""Distances within which packets align, and add up, in wavelengths."""

EVEN = 1.0
"""Standard deviation of the weights with which directions and random numbers are averaged, in wavelengths."""

WANDER, UNEVEN = 0.06, 0.3
"""At irregularity 1: standard deviations of the angle by which lines leave the direction of the compression, radians,
and of the logarithm of the wavelength.
"""

UNDIRECTED, DIRECTED = 0.05, 0.35
"""Difference of the principal values of a family's tensor over their sum, below which skin that is compressed in all
directions has no lines, and from which it has all.
"""

SWIRLING, ORDERED = 0.45, 0.75
"""Order of the directions within a wavelength (1 where all are parallel, 0 where they turn round) below which there are
no lines, and from which there are all.
"""

FAINTEST = 0.42
"""Strength of the weakest lines, relative to the strongest."""

ALIKE = 1.1
"""Weight of the other side of the face at symmetry 1, relative to that of the own side, in the alignment."""

FINEST = 64
"""Places of packets are whole multiples of this share of a triangle's sides: 1 / 64."""

KEPT = ("zone", "window", "x", "n", "d", "k", "phase", "share")
"""Arrays that packets consist of."""

AHEAD = np.array([0.3779, 0.8137, 0.4416])
"""Directions across the lines point this way, which is along no axis of a face: their signs, on which the phases that
are drawn depend, are no matter of rounding on the median plane.
"""


@dataclass(frozen=True)
class Style:
    """Choices that the lines of a face depend on.

    Attributes
    ----------
    seed : int
    irregularity : float
        0: lines as parallel and alike as the compression lets them; 1: as on faces.
    symmetry : float
        0: left and right are drawn independently of each other; 1: nearly mirrored.
    length : float
        Multiplies the distance along the lines within which they are as strong. Where they lie does not change.
    """

    seed: int = 0
    irregularity: float = 1.0
    symmetry: float = 0.5
    length: float = 1.0


def pairs(own: Array, others: Array, reach: float | Array) -> tuple[IntArray, IntArray, IntArray]:
    """Return the pairs of points (m, 3) and others (n, 3) that are less than a reach, or one each (m,), apart.

    As rows of CSR: the first pair of each point (m + 1,), and of each pair the other point; and, likewise, the point.

    Examples
    --------
    >>> first, second, _ = pairs(np.array([[0.0, 0, 0], [9, 0, 0]]), np.array([[1.0, 0, 0], [0, 1, 0]]), 2.0)
    >>> first.tolist(), sorted(second.tolist())
    ([0, 2, 2], [0, 1])
    """
    order = np.argsort(others[:, 0], kind="stable")
    owner, second = kernels.pairs(own, others, order, others[order, 0], np.broadcast_to(reach, len(own)).copy())
    return np.searchsorted(owner, np.arange(len(own) + 1)), second, owner


def drawn(host: IntArray, code: IntArray, key: int) -> Array:
    """Return random numbers (p,) in [0, 1) that depend on a triangle, a place in it and a key alone.

    Examples
    --------
    >>> some = drawn(np.arange(10000), np.zeros(10000, int), key=7)
    >>> bool(abs(some.mean() - 0.5) < 0.01), bool((some == drawn(np.arange(10000), np.zeros(10000, int), 7)).all())
    (True, True)
    """
    mixed = host.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15) + code.astype(np.uint64)
    mixed = mixed * np.uint64(0xD1B54A32D192ED03) + np.uint64(key & 0xFFFFFFFFFFFFFFFF)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):  # the finaliser of SplitMix64
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    mixed ^= mixed >> np.uint64(31)
    return np.asarray((mixed >> np.uint64(11)).astype(np.float64) / 2.0**53)


def lattice(
    points: Array, triangles: npt.NDArray[np.int32], chosen: IntArray, reach: Array
) -> tuple[IntArray, Array, IntArray, IntArray]:
    """Place a lattice on each of the chosen triangles, no coarser than `reach` (n,) there.

    A side has 1, 2, 4, ... intervals, so that a finer lattice holds the places of a coarser one: on another face with
    the same triangles most places stay.

    Returns
    -------
    host : ndarray of int, shape (p,)
        The triangle of each place.
    weights : ndarray, shape (p, 3)
    level, code : ndarray of int, shape (p,)
        How fine a lattice must be to hold the place, and its number in its triangle whatever the lattice.

    Examples
    --------
    >>> triangle, corners = np.array([[0, 1, 2]]), np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> host, weights, level, _ = lattice(corners, triangle, np.array([0]), np.ones(3))
    >>> len(host), level.tolist()
    (6, [0, 1, 0, 1, 1, 0])
    """
    corners = triangles[chosen]
    longest = np.linalg.norm(points[corners] - points[np.roll(corners, -1, axis=1)], axis=2).max(axis=1)
    needed = np.maximum(longest / reach[corners].min(axis=1), 1.0)
    parts = np.minimum(2.0 ** np.ceil(np.log2(needed)), FINEST).astype(np.int64)
    columns = [(np.empty(0, np.int64), np.empty((0, 3)), np.empty(0, np.int64), np.empty(0, np.int64))]
    for m in np.unique(parts).tolist():
        i, j = (steps[np.tri(m + 1, dtype=bool)[::-1]] for steps in np.indices((m + 1, m + 1)))
        u, v, alike = i * (FINEST // m), j * (FINEST // m), chosen[parts == m]
        level = np.log2(FINEST // np.gcd(np.gcd(u, v), FINEST)).astype(np.int64)
        weights, k = np.stack([i, j, m - i - j], axis=1) / m, len(alike)
        columns.append((
            np.repeat(alike, len(i)), np.tile(weights, (k, 1)), np.tile(level, k), np.tile(u * (FINEST + 1) + v, k)
        ))  # fmt: skip
    host, weights, level, code = (np.concatenate(column) for column in zip(*columns, strict=True))
    order = np.argsort(host, kind="stable")
    return host[order], weights[order], level[order], code[order]


class Packets:
    """The wave packets of one family on a face.

    Parameters
    ----------
    face : Face
    name : str
        Name of the family, on which its random numbers depend.
    tensor : ndarray, shape (n0, 6)
        See :func:`facewrinkle.layers.wave_folds.families.tensors_of`.
    length : ndarray, shape (n0,)
        Wavelength at the base vertices, mm.
    style : Style
    grain, anatomical : ndarray, shape (n0, 6)
        See :func:`facewrinkle.layers.wave_folds.tissue.grain` and ``anatomical`` there.

    Attributes
    ----------
    zone : ndarray of bool, shape (m0,)
        Base triangles on which the family has lines.
    window : ndarray, shape (n0,)
    x, n, d : ndarray, shape (p, 3)
        Places, mm; normals; unit directions across the lines.
    k, phase, share : ndarray, shape (p,)
        Wave number, 1/mm; phase; strength in [0, 1].
    """

    def __init__(
        self, face: Face, name: str, tensor: Array, length: Array, style: Style, grain: Array, anatomical: Array
    ) -> None:
        points, triangles = np.ascontiguousarray(face.points * face.unit), face.triangles
        self.window = window_of(tensor)
        self.zone: BoolArray = np.asarray((self.window > 0.0)[triangles].any(axis=1))
        self._key = zlib.crc32(f"{name} {style.seed}".encode())
        self._style = style
        corners, weights = self._place(points, triangles, length)
        upright = vertex_normals(face.points, triangles)

        def at(values: Array) -> Array:
            return np.asarray(np.einsum("pc,pc...->p...", weights, values[corners]))

        self.x, self.n = at(points), at(upright)
        self.n /= np.linalg.norm(self.n, axis=1, keepdims=True)
        local = at(length)
        self._find_neighbours(face, REACH * local)
        self._turn(at(tensor), local)
        self._share *= self._along_grain(at(grain)) * self._beside(at(anatomical))
        self.k = 2.0 * np.pi / local
        uneven = self._along_lines(np.sqrt(12.0) * (self._draw(2) - 0.5))
        self.k *= np.exp(-UNEVEN * style.irregularity * uneven)
        self._align()
        self.share = self._share * self._strengths()
        del self._rows, self._gaussian, self._face, self._local, self._host, self._code
        self._sort()

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> Self:
        """Return packets that were found before, from the arrays of :data:`KEPT`."""
        packets = cls.__new__(cls)
        for name in KEPT:
            setattr(packets, name, arrays[name])
        packets._sort()
        return packets

    def _sort(self) -> None:
        """Prepare the sums at places."""
        lengths = 2.0 * np.pi / self.k
        self._sigma = np.outer(lengths, SUMMED)
        self._support = SUPPORT * float(lengths.mean()) if len(self.x) else 1.0

    def at(self, places: Array, normals: Array) -> tuple[Array, Array, Array]:
        """Return phase (n,), strength (n,) and wave vector (n, 3) of the family at places (n, 3), mm."""
        theta, strength, wave = np.zeros(len(places)), np.zeros(len(places)), np.zeros((len(places), 3))
        first, second, _ = pairs(places, self.x, self._support)
        kernels.waves_at(
            places, normals, self.x, self.n, self.d, self.k, self.share, self._sigma, self.phase, self._support,
            first, second, theta, strength, wave,
        )  # fmt: skip
        return theta, strength, wave

    # --- places ----------------------------------------------------------------------------------

    def _place(self, points: Array, triangles: npt.NDArray[np.int32], length: Array) -> tuple[IntArray, Array]:
        """Choose places on points (n0, 3); return the corners (p, 3) of their triangles and their weights (p, 3)."""
        chosen = np.flatnonzero(self.zone)
        host, weights, level, code = lattice(points, triangles, chosen, APART * length)
        corners = triangles[host]
        where = np.einsum("pc,pck->pk", weights, points[corners])
        radius = APART * (weights * length[corners]).sum(axis=1)
        # Coarse places first: where a lattice is finer on another face, what it adds only fills gaps.
        order = np.lexsort((drawn(host, level * (FINEST + 1) ** 2 + code, self._key + 1), level))
        taken = kernels.thinned(*pairs(where, where, radius)[:2], order)
        self._host, self._code = host[taken], code[taken]
        return corners[taken].astype(np.int64), weights[taken]

    def _draw(self, number: int) -> Array:
        return drawn(self._host, self._code, self._key + number)

    def _find_neighbours(self, face: Face, reach: Array) -> None:
        """Find the packets around each, and those around the mirror image of each."""
        self._rows: list[tuple[IntArray, IntArray, Array]] = []
        self._gaussian: dict[int, tuple[csr_array, Array]] = {}
        for mirrored in (False, True) if face.landmarks and self._style.symmetry else (False,):
            x, n = (self._mirrored(v, face, v is self.x) for v in (self.x, self.n)) if mirrored else (self.x, self.n)
            _, second, owner = pairs(self.x, x, reach)
            alike = (self.n[owner] * n[second]).sum(axis=1) > kernels.FACING
            alike &= mirrored | (owner != second)
            self._rows.append((owner[alike], second[alike], x))
        self._face = face

    def _mirrored(self, vectors: Array, face: Face, places: bool) -> Array:
        """Vectors (p, 3), or places in mm, mirrored at the median plane of the face."""
        across = face.frame.axes[0]
        origin = face.frame.origin * face.unit if places else np.zeros(3)
        return np.ascontiguousarray(vectors - 2.0 * np.outer((vectors - origin) @ across, across))

    # --- directions and random numbers -----------------------------------------------------------

    def _averaged(self, values: Array, sign: float = 1.0, mirrored: bool = True) -> tuple[Array, Array]:
        """Gaussian sums of values (p, d) over the neighbours, and the root of the sum of the squared weights."""
        total, squares = values.copy(), np.ones(len(values))
        for side in range(min(len(self._rows), 2 if mirrored else 1)):
            factor = sign * self._style.symmetry if side else 1.0
            weights, square = self._weights(side)
            total = total + factor * (weights @ values)
            squares = squares + factor**2 * square
        return total, np.sqrt(squares)

    def _weights(self, side: int) -> tuple[csr_array, Array]:
        """Gaussian weights of the neighbours, or of those mirrored, and the sums of their squares; made once."""
        if side not in self._gaussian:
            owner, second, x = self._rows[side]
            away = ((self.x[owner] - x[second]) ** 2).sum(axis=1) / (EVEN * self._local[owner]) ** 2
            weights = csr_array((np.exp(-0.5 * away), (owner, second)), shape=(len(self.x),) * 2)
            self._gaussian[side] = weights, weights.power(2).sum(axis=1)
        return self._gaussian[side]

    def _noise(self, number: int, sign: float = 1.0) -> Array:
        """Return random numbers (p,) that vary smoothly, of mean 0 and deviation 1, `sign` times those mirrored."""
        total, size = self._averaged(np.sqrt(12.0) * (self._draw(number)[:, None] - 0.5), sign)
        return np.clip(total[:, 0] / np.maximum(size, 1e-9), -2.0, 2.0)

    def _turn(self, tensor: Array, local: Array) -> None:
        """Find the directions across the lines, and how strong these can be."""
        self._local = local
        even, _ = self._averaged(tensor, mirrored=False)
        across = _principal(even, self.n)
        values = across[1]
        single = smoothstep(((values[:, 1] - values[:, 0]) / np.maximum(values.sum(axis=1), 1e-30) - UNDIRECTED)
                            / (DIRECTED - UNDIRECTED))  # fmt: skip
        d = across[0]
        squares = np.stack([d[:, a] * d[:, b] for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))], axis=1)
        order = _principal(self._averaged(squares, mirrored=False)[0], self.n)[1]
        order = (order[:, 1] - order[:, 0]) / np.maximum(order.sum(axis=1), 1e-30)
        self._share = single * smoothstep((order - SWIRLING) / (ORDERED - SWIRLING))
        turn = WANDER * self._style.irregularity * self._noise(1, -1.0)[:, None]
        self.d = np.ascontiguousarray(np.cos(turn) * d + np.sin(turn) * np.cross(self.n, d))

    def _along_grain(self, grain: Array) -> Array:
        """Return the share (p,) of the lines that muscles under the skin let be: all of those across their fibres."""
        even, _ = self._averaged(np.column_stack([grain, np.ones(len(grain))]), mirrored=False)
        even = even[:, :6] / even[:, 6:]
        across = along(even, self.d)
        return np.asarray((1.0 - even[:, :3].sum(axis=1) + across) ** 2)

    def _beside(self, anatomical: Array) -> Array:
        """Return the share (p,) of the lines that anatomical folds leave, which are drawn once."""
        taken = OTHERS * anatomical[:, :3].sum(axis=1) + (OWN - OTHERS) * along(anatomical, self.d)
        return np.asarray(1.0 - np.clip(taken, 0.0, 1.0))

    # --- phases and strengths --------------------------------------------------------------------

    def _edges(self, spread: tuple[float, float]) -> tuple[Any, ...]:
        """Neighbours of all packets on both sides as rows of CSR: first, second, weights, turns, flips."""
        across, along = np.outer(spread, 2.0 * np.pi / self.k)
        columns = []
        for side, (owner, second, x) in enumerate(self._rows):
            directions = self._mirrored(self.d, self._face, False) if side else self.d
            way = self.x[owner] - x[second]
            ours, theirs = (way * self.d[owner]).sum(axis=1), (way * directions[second]).sum(axis=1)
            # A wave is conjugated where the directions of the two point away from each other.
            flip = np.where((self.d[owner] * directions[second]).sum(axis=1) >= 0.0, 1.0, -1.0)
            turn = 0.5 * (self.k[second] * theirs + flip * self.k[owner] * ours)
            beside = np.maximum((way**2).sum(axis=1) - ours**2, 0.0)
            weight = np.exp(-0.5 * ((ours / across[owner]) ** 2 + beside / along[owner] ** 2))
            weight *= ALIKE * self._style.symmetry if side else 1.0
            columns.append((owner, second, weight, turn, flip))
        joined = [np.concatenate(column) for column in zip(*columns, strict=True)]
        some = joined[2] > 0.01
        order = np.argsort(joined[0][some], kind="stable")
        owner, second, weight, turn, flip = (column[some][order] for column in joined)
        first = np.searchsorted(owner, np.arange(len(self.x) + 1))
        return first, second, weight, turn, flip

    def _align(self) -> None:
        self.phase = 2.0 * np.pi * self._draw(3)
        first, second, weight, turn, flip = self._edges(ALIGNED)
        kernels.align(self.phase, first, second, weight, turn, flip, SWEEPS)

    def _along_lines(self, values: Array, length: float = 1.0) -> Array:
        """Return random numbers (p,) of mean 0, averaged along the lines twice and brought to the deviation 1."""
        m = len(self.x)
        first, second, weight, *_ = self._edges((STRIATED[0], STRIATED[1] * length))
        weights = csr_array((weight, second, first), shape=(m, m))
        total = 1.0 + weights.sum(axis=1)
        for _ in range(2):
            values = (values + weights @ values) / total
        return np.clip(values / max(float(values.std()), 1e-9), -2.0, 2.0)

    def _strengths(self) -> Array:
        """Return the strength (p,) of each line."""
        length = self._style.length
        values = self._along_lines(self._draw(4) - 0.5, length)
        rank = np.argsort(np.argsort(values, kind="stable")) / max(len(values) - 1, 1)
        lowest = 1.0 + (FAINTEST - 1.0) * min(self._style.irregularity, 1.0)
        lowest = lowest * (2.0 * length - 1.0) if length < 1.0 else 1.0 - (1.0 - lowest) / length
        return np.asarray(lowest + (1.0 - lowest) * rank**0.8)


def _principal(tensors: Array, normals: Array) -> tuple[Array, Array]:
    """Return the tangents (p, 3) of the largest principal value of tensors (p, 6), and both values (p, 2)."""
    flat = np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], (len(normals), 1))
    values, _, tangents = principal(tensors, *orthonormal_tangents(flat, normals))
    tangents *= np.where(tangents @ AHEAD < 0.0, -1.0, 1.0)[:, None]
    return tangents, values
