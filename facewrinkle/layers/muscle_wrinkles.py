"""Wrinkles that contracting muscles fold into the skin over them: W = H A At, summed over the muscles (Eq. 3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..anatomy.muscles import Muscle
from ..errors import ParameterError, check_range, check_whole
from ..geometry.profile import anisotropy, deepest
from ..geometry.refinement import Change
from ..geometry.topology import vertex_rings
from ..geometry.volume import swept_shares
from . import _kernels as kernels
from .activation import Activation
from .base import Array, Displacement, IntArray, SurfacePoints, SurfaceState
from .compression import EdgeWeights, StrainField, along, products

Compression = Literal["gradient", "edges"]
COMPRESSIONS: tuple[Compression, ...] = ("gradient", "edges")


@dataclass(frozen=True, eq=False)
class Folds:
    """What the muscles would do to each vertex: one entry per vertex and muscle whose wrinkling region it lies in.

    Entries of vertex i are ``starts[i] <= p < starts[i + 1]``, in the order of the muscles.

    Attributes
    ----------
    starts : ndarray of int32, shape (n + 1,)
    muscle : ndarray of int32, shape (p,)
    height : ndarray, shape (p,)
        H At at k0 = 1.
    blunt : ndarray, shape (p,)
        The same with blunt H, see `BLUNT`.
    swing : ndarray, shape (p,)
        2^alpha At: from bulge to furrow at k0 = 1.
    steep : ndarray, shape (p,)
        The same, relative to the deepest fold of this wavelength that skin of fixed length allows at epsilon = 1, 1/mm.
    cycle : ndarray, shape (p,)
        Half cycle u as a length.
    coordinates : ndarray, shape (p, 2)
        lambda and gamma (sphincter: r and psi).
    direction : ndarray, shape (p, 3)
        Unit tangent across the folds.
    products : ndarray, shape (p, 6)
        Products of its components over its squared length in the rest metric.
    leading : ndarray of int32, shape (n,)
        The entry of the dominant muscle of each vertex, -1 for none.

    Examples
    --------
    One muscle, a place in its middle, and one beside it that has no entry:

    >>> from facewrinkle.anatomy.muscles import LinearMuscle
    >>> muscle = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=40.0)
    >>> places, up = np.array([[0.0, 20, 0], [30, 20, 0]]), np.tile([0.0, 0, 1], (2, 1))
    >>> sites = SurfacePoints(places, up, np.zeros((2, 3), np.int32), np.full((2, 3), 1 / 3), np.zeros(2, np.int32))
    >>> flat = np.array([[1.0, 1, 0, 0, 0, 0]])
    >>> folds = Folds.at(sites, [muscle], np.array([[True]]), flat, unit=1.0)
    >>> folds.leading.tolist(), folds.coordinates.tolist(), folds.cycle.round(2).tolist()
    ([0, -1], [[0.5, 0.0]], [5.33])
    """

    starts: IntArray
    muscle: IntArray
    height: Array
    blunt: Array
    swing: Array
    steep: Array
    cycle: Array
    coordinates: Array
    direction: Array
    products: Array
    leading: IntArray

    @classmethod
    def at(
        cls, sites: SurfacePoints, muscles: list[Muscle], zones: npt.NDArray[np.bool_], metric: Array, unit: float
    ) -> Self:
        """Evaluate the muscles at some places; `zones` (k, m0) tells the base triangles that each may touch, `unit` the
        millimetres per unit of the places.
        """
        parts = []
        touched, near = np.nonzero(zones[:, sites.host])
        for k in np.unique(touched):
            muscle, inside = muscles[k], near[touched == k]
            envelope = muscle.envelope(sites.points[inside])
            hit = envelope > 0.0
            if not hit.any():
                continue
            where = inside[hit]
            x = sites.points[where]
            parts.append(
                (
                    where,
                    np.full(len(where), k),
                    muscle.height(x) * envelope[hit],
                    muscle.height(x, BLUNT) * envelope[hit],
                    2.0**muscle.wrinkles.alpha * envelope[hit],
                    muscle.half_cycles(x),
                    np.stack(muscle.coordinates(x), axis=1),
                    muscle.fold_direction(x),
                )
            )
        if not parts:
            return cls.none(len(sites.points))
        columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
        order = np.argsort(columns[0], kind="stable")
        where, muscle_of, height, blunt, swing, cycle, coordinates, direction = (c[order] for c in columns)
        normal = sites.normals[where]
        direction = direction - (direction * normal).sum(axis=1, keepdims=True) * normal
        direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-12)
        tensors = np.einsum("pc,pck->pk", sites.barycentric[where], metric[sites.corners[where]])
        squares = products(direction) / np.maximum(along(tensors, direction), 1e-6)[:, None]
        starts = np.searchsorted(where, np.arange(len(sites.points) + 1)).astype(np.int32)
        leading = _leading(starts, np.abs(height), swing)
        steep = swing / deepest(2.0 * unit * cycle, 1.0)
        return cls(
            starts, muscle_of.astype(np.int32), height, blunt, swing, steep, cycle, coordinates, direction, squares,
            leading,
        )  # fmt: skip

    @classmethod
    def none(cls, n: int) -> Self:
        """No entries for n vertices."""
        e, i = np.empty(0), np.empty(0, np.int32)
        starts, leading = np.zeros(n + 1, np.int32), np.full(n, -1, np.int32)
        return cls(starts, i, e, e, e, e, e, np.empty((0, 2)), np.empty((0, 3)), np.empty((0, 6)), leading)

    def followed(self, kept: slice | npt.NDArray[np.int64], new: Folds) -> Folds:
        """The entries of the vertices that live on, then those of the new ones."""
        old = self if isinstance(kept, slice) else self._of(kept)
        if not len(new.leading):
            return old
        shift = old.starts[-1]
        joined = {c: np.concatenate([getattr(old, c), getattr(new, c)]) for c in OF_ENTRIES}
        leading = np.concatenate([old.leading, np.where(new.leading >= 0, new.leading + shift, -1)])
        starts = np.concatenate([old.starts, new.starts[1:] + shift])
        return Folds(starts=starts, leading=leading.astype(np.int32), **joined)

    def _of(self, kept: npt.NDArray[np.int64]) -> Folds:
        counts = np.diff(self.starts)
        alive = np.zeros(len(counts), bool)
        alive[kept] = True
        entries = np.flatnonzero(np.repeat(alive, counts))
        starts = np.concatenate([[0], np.cumsum(counts[kept])]).astype(np.int32)
        offset = self.leading[kept] - self.starts[:-1][kept]
        leading = np.where(self.leading[kept] >= 0, starts[:-1] + offset, -1).astype(np.int32)
        return Folds(starts=starts, leading=leading, **{c: getattr(self, c)[entries] for c in OF_ENTRIES})


OF_ENTRIES = ("muscle", "height", "blunt", "swing", "steep", "cycle", "coordinates", "direction", "products")


class MuscleWrinkles:
    """The layer of muscle-driven wrinkles.

    Parameters
    ----------
    compression : {"gradient", "edges"}
        How epsilon is measured: along the fibre from the deformation gradient, which does not depend on the mesh, or
        by the weighted shortening of edges (Eqs. 8-9, with ``|cos|``), which gives a half to two thirds of it.
    depth : float
        Multiplies the depth of all wrinkles.
    accumulate : int
        0: stateless, ``W = H A At`` of this moment; it is exactly 0 after release. N > 0: as in the paper, 1/N of it
        is added in each of the first N steps of a contraction; it stays behind the compression and
        never relaxes, until the simulation is reset. For comparison only.
    inextensible : bool
        Whether wrinkles stay within what skin of fixed length can fold: 2 L sqrt(epsilon) / pi from bulge to furrow for
        a wavelength L, for all muscles over a place together (:func:`facewrinkle.geometry.profile.deepest`). Without
        it, the amplitude is that of the paper, which knows no bound.
    balance : bool
        Whether the bulges of each muscle hold exactly as much as its furrows lack, on the mesh of the moment. Bulges
        are lowered and furrows deepened by one share for that, by up to a fifth: attenuation, compression that
        is not even, and the triangles take from a volume that H alone keeps (Eq. 7).

    Attributes
    ----------
    rates : ndarray, shape (k,)
        Contraction rates of the last moment. Where the motion has none (a recording), what stands for them, from the
        measured compression: :class:`facewrinkle.layers.activation.Activation`.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), layers=[MuscleWrinkles(depth=0.5)])
    >>> sim.express("frowning")
    >>> [float(frame["W"].max().round(9)) for frame in sim.run(2)][0] >= 0.0
    True
    """

    def __init__(
        self,
        compression: Compression = "gradient",
        depth: float = 1.0,
        accumulate: int = 0,
        inextensible: bool = True,
        balance: bool = False,
    ) -> None:
        if compression not in COMPRESSIONS:
            raise ParameterError(f"compression must be one of {', '.join(COMPRESSIONS)}, received {compression!r}.")
        self.compression = compression
        self.depth = check_range("depth", depth, 0.0, 1e6)
        self.accumulate = check_whole("accumulate", accumulate, 0, 1e9)
        self.inextensible = bool(inextensible)
        self.balance = bool(balance)

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.layers.base.Layer`."""
        self._muscles = [muscle.fold_pattern for muscle in face.muscles.values()]
        self._k0 = self.depth * np.array([m.wrinkles.depth for m in self._muscles])
        self._rest_scale = face.unit
        self._zones = face.zones
        self._corners = [np.unique(face.triangles[z]) for z in self._zones]
        self._folding = np.array([len(corners) > 0 for corners in self._corners], bool)
        self._unseen = np.empty(0, int)
        # The strain at a vertex is that of the triangles around it: those of the zones and their neighbours.
        needed = np.isin(face.triangles, np.concatenate([*self._corners, np.empty(0, int)])).any(axis=1)
        self._strain = StrainField(face.points * face.unit, face.triangles[needed])
        self._activation: Activation | None = None
        self.rates = np.zeros(len(self._muscles))
        self._excess = np.zeros(len(self._muscles))
        self._face = face
        self._folds = Folds.none(0)
        self._height, self._share = np.empty(0), np.empty(0)
        self._steps, self._last = 0, -1.0
        self._edges: EdgeWeights | None = None
        self._labels: dict[str, np.ndarray] = {}
        self._epsilon = np.empty(0)

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """See :class:`facewrinkle.layers.base.Layer`."""
        new = Folds.at(created, self._muscles, self._zones, self._strain.metric, self._rest_scale)
        if not self.inextensible:
            new.steep[:] = 0.0
        self._folds = self._folds.followed(change.kept, new)
        self._epsilon = np.zeros(len(self._folds.muscle))
        self._height = np.concatenate([self._height[change.kept], np.zeros(len(created.points))])
        self._share = np.ones(len(self._height))
        self._edges = None
        self._labels = {}
        n = len(self._height)
        self._folded = np.flatnonzero(np.diff(self._folds.starts)).astype(np.int32)
        self._room = np.zeros(n), np.zeros(n), np.full(n, np.inf), np.zeros((n, 3)), np.zeros(n, bool)
        self._seeded = np.empty(0, int)
        seen = np.zeros(len(self._zones), bool)
        seen[self._folds.muscle] = True
        self._unseen = np.flatnonzero(self._folding & ~seen)

    def displacement(self, state: SurfaceState) -> Displacement:
        """See :class:`facewrinkle.layers.base.Layer`."""
        folds = self._folds
        self._epsilon = self._compressed(state)
        self.rates = state.rates if len(state.rates) else self._activated(state.base)
        k0 = self._k0 * self.rates
        height, shown, spacing, across, active = self._room
        spacing[self._seeded], active[self._seeded] = np.inf, False
        kernels.amplitudes(
            self._folded, folds.starts, folds.muscle, folds.height, folds.blunt, folds.swing, folds.steep, folds.cycle,
            folds.direction, self._epsilon, k0, SMALLEST, height, shown, self._share, spacing, across, active,
        )  # fmt: skip
        self._seed(k0, state.vertices, spacing, across, active)
        prefiltering = shown - height
        if self.balance:
            height = self._balanced(k0, height, state)
        if self.accumulate:
            height = self._accumulated(height, state.time)
        self._height = height
        return Displacement(height, spacing, across, active, None if self.accumulate else prefiltering)

    def _activated(self, base: Array) -> Array:
        """What stands for the rates (k,) of muscles that do not contract: how far the skin over them is compressed."""
        if self._activation is None:
            self._activation = Activation(self._face, self._muscles, self._zones, self._strain)
        return self._activation.of(base)

    def _balanced(self, k0: Array, height: Array, state: SurfaceState) -> Array:
        """Heights with which every muscle's folds sweep no volume; the shares that it takes are kept in `_excess`.

        The volume between the surfaces is a sum over the vertices, in which the weight of each depends a little on the
        heights: a few rounds find them.
        """
        folds, n, k = self._folds, len(height), len(k0)
        owner = np.repeat(np.arange(n), np.diff(folds.starts))
        parts = k0[folds.muscle] * anisotropy(self._epsilon) * self._share[owner] * folds.height
        folded = state.triangles[np.isin(state.triangles, self._folded).any(axis=1)]
        directions = state.directions
        if directions is None:
            raise ParameterError("wrinkles are balanced only in a SurfaceState with directions; it was made without.")
        for _ in range(BALANCING):
            shares = swept_shares(state.bare, height[:, None] * directions, folded)
            volumes = (shares * directions).sum(axis=1)[owner] * parts
            net, displaced = (np.bincount(folds.muscle, v, k) for v in (volumes, np.abs(volumes)))
            self._excess = np.divide(net, displaced, out=np.zeros(k), where=displaced > 0.0)
            lowered = parts - self._excess[folds.muscle] * np.abs(parts)
            height = np.asarray(np.bincount(owner, lowered, n), np.float64)
        return height

    def _seed(
        self, k0: Array, sites: SurfacePoints, spacing: Array, across: Array, active: npt.NDArray[np.bool_]
    ) -> None:
        """Ask for triangles where the wrinkling region of a contracting muscle lies between the vertices."""
        asking = self._unseen[k0[self._unseen] > 0.0]
        self._seeded = np.concatenate([self._corners[k] for k in asking]) if len(asking) else np.empty(0, int)
        for k in asking:
            corners, muscle = self._corners[k], self._muscles[k]
            spacing[corners] = np.minimum(spacing[corners], muscle.half_cycles(sites.points[corners]))
            across[corners] = muscle.fold_direction(sites.points[corners])
            active[corners] = True

    def fields(self) -> dict[str, np.ndarray]:
        """lambda, gamma and epsilon of the dominant muscle, its index, and W."""
        folds, some = self._folds, self._folds.leading >= 0
        lead = folds.leading[some]
        if not self._labels:
            values = (folds.coordinates[lead, 0], folds.coordinates[lead, 1], folds.muscle[lead])
            self._labels = {
                name: _scattered(some, v, fill) for name, v, fill in zip(LABELS, values, (0.0, 0.0, -1), strict=True)
            }
        return {**self._labels, "epsilon": _scattered(some, self._epsilon[lead], 0.0), "W": self._height.copy()}

    def fields_of(self, index: int, rate: float) -> dict[str, np.ndarray]:
        """The same for one muscle: lambda, gamma, epsilon and its part of W where its wrinkling region is, 0
        elsewhere.
        """
        folds = self._folds
        entries = np.flatnonzero(folds.muscle == index)
        where = np.repeat(np.arange(len(folds.leading)), np.diff(folds.starts))[entries]
        share, height = anisotropy(self._epsilon[entries]) * self._share[where], folds.height[entries]
        columns = {
            "lambda": folds.coordinates[entries, 0],
            "gamma": folds.coordinates[entries, 1],
            "epsilon": self._epsilon[entries],
            "W": self._k0[index] * rate * (height - self._excess[index] * np.abs(height)) * share,
        }
        out = {name: np.zeros(len(folds.leading)) for name in columns}
        for name, values in columns.items():
            out[name][where] = values
        return {**out, "region": np.isin(np.arange(len(folds.leading)), where)}

    def _compressed(self, state: SurfaceState) -> Array:
        """epsilon of all entries."""
        folds, sites = self._folds, state.vertices
        if self.compression == "edges":
            if self._edges is None:
                rings = vertex_rings(state.triangles, len(state.bare))
                self._edges = EdgeWeights(sites.points * self._rest_scale, rings, folds.starts, folds.direction)
            return self._edges.epsilon(state.bare)
        strain = self._strain.strain(state.base)
        kernels.strain_epsilon(folds.starts, sites.corners, sites.barycentric, strain, folds.products, self._epsilon)
        return self._epsilon

    def _accumulated(self, height: Array, time: float) -> Array:
        if not self.rates.any():
            self._steps = 0
        elif self._steps < self.accumulate and time != self._last:
            self._steps, self._last = self._steps + 1, time
            return self._height + height / self.accumulate
        return self._height


BLUNT = 0.18
"""Half the width over which the heights are averaged that normals are taken of, in half cycles: as far as vertices are
apart. Of a furrow's sharp bottom some vertices lie at the very bottom and others beside it; normals of these heights
would vary along the furrow, and its line would look serrated.
"""

BALANCING = 6
"""Rounds of balancing; each is some hundred times closer than the one before."""

SMALLEST = 0.5
"""A wrinkle of less than this from bulge to furrow, mm, asks for no triangles."""


LABELS = ("lambda", "gamma", "muscle")


def _scattered(where: npt.NDArray[np.bool_], values: np.ndarray, fill: float) -> np.ndarray:
    """`values` where it is told, `fill` elsewhere."""
    out = np.full(len(where), fill, values.dtype)
    out[where] = values
    return out


def _leading(starts: IntArray, size: Array, swing: Array) -> IntArray:
    """Per vertex the entry of the largest |H At|; At decides where H crosses zero."""
    n = len(starts) - 1
    owner = np.repeat(np.arange(n), np.diff(starts))
    order = np.lexsort((swing, size, owner))
    last = np.flatnonzero(np.append(owner[1:] != owner[:-1], True)) if len(owner) else np.empty(0, int)
    leading = np.full(n, -1, np.int32)
    leading[owner[last]] = order[last]
    return leading
