"""Folds: the wrinkles that each muscle can make at each vertex, as far as they do not depend on its contraction."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from ..anatomy.muscles import Muscle
from ..array_types import Array, BoolArray, IntArray
from ..geometry.profile import deepest
from ..geometry.refinement import Room
from .base import SurfacePoints
from .compression import along, products

BLUNT = 0.18
"""Half the width over which heights are averaged for the shading normals, in half cycles: about the distance of the
vertices. Some vertices lie at the very bottom of a sharp furrow and others beside it; normals of the heights themselves
would vary along the furrow, and its line would look serrated.
"""

OF_ENTRIES = ("muscle", "height", "blunt", "swing", "lean", "steep", "cycle", "coordinates", "direction", "products")
"""Attributes of :class:`Folds` with one row per entry."""


OF_MUSCLES = ("wrinkles", "strength", "normal_share", "swell", "closing", "folds", "sliding", "protrusion")
"""Attributes of a muscle that its folds do not depend on, and its wrinkles."""


@dataclass(frozen=True, eq=False)
class Folds:
    """Folds of all muscles, with one entry per vertex and muscle whose wrinkling region it lies in.

    Entries of vertex i are ``starts[i] <= p < starts[i + 1]``, in the order of the muscles.

    Attributes
    ----------
    starts : ndarray of int32, shape (n + 1,)
    muscle : ndarray of int32, shape (p,)
    height : ndarray, shape (p,)
        H At at k0 = 1.
    blunt : ndarray, shape (p,)
        The same with H averaged for the shading normals, see `BLUNT`.
    swing : ndarray, shape (p,)
        2^alpha At: from bulge to furrow at k0 = 1.
    lean : ndarray, shape (p,)
        Slide towards the furrow, relative to the depth from bulge to furrow.
    steep : ndarray, shape (p,)
        `swing` relative to the deepest fold of this wavelength that skin of fixed length allows at epsilon = 1, 1/mm.
    cycle : ndarray, shape (p,)
        Half cycle u as a length.
    coordinates : ndarray, shape (p, 2)
        lambda and gamma (sphincter: r and psi).
    direction : ndarray, shape (p, 3)
        Unit tangent across the folds.
    products : ndarray, shape (p, 6)
        Products of the direction's components over its squared length in the rest metric.
    leading : ndarray of int32, shape (n,)
        The entry of the dominant muscle of each vertex, -1 for none.

    Examples
    --------
    One muscle, a point in its middle, and one beside it that has no entry:

    >>> from facewrinkle.anatomy.muscles import LinearMuscle
    >>> muscle = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=40.0)
    >>> points, up = np.array([[0.0, 20, 0], [30, 20, 0]]), np.tile([0.0, 0, 1], (2, 1))
    >>> vertices = SurfacePoints(points, up, np.zeros((2, 3), np.int32), np.full((2, 3), 1 / 3), np.zeros(2, np.int32))
    >>> flat = np.array([[1.0, 1, 0, 0, 0, 0]])
    >>> folds = Folds.at(vertices, [muscle], np.array([[True]]), flat, unit=1.0)
    >>> folds.leading.tolist(), folds.coordinates.tolist(), folds.cycle.round(2).tolist()
    ([0, -1], [[0.5, 0.0]], [5.33])
    """

    starts: IntArray
    muscle: IntArray
    height: Array
    blunt: Array
    swing: Array
    lean: Array
    steep: Array
    cycle: Array
    coordinates: Array
    direction: Array
    products: Array
    leading: IntArray
    _room: Room = field(default_factory=Room, init=False, repr=False)

    @classmethod
    def at(
        cls,
        vertices: SurfacePoints,
        muscles: list[Muscle],
        zones: BoolArray,
        metric: Array,
        unit: float,
        alike: Sequence[int] | None = None,
        shares: Array | None = None,
    ) -> Self:
        """Evaluate the muscles at vertices.

        Parameters
        ----------
        vertices : SurfacePoints
        muscles : list of Muscle
            Fold patterns of the face's muscles.
        zones : ndarray of bool, shape (k, m0)
            Base triangles that each muscle may touch.
        metric : ndarray, shape (n0, 6)
            Rest metric at the base vertices.
        unit : float
            Millimetres per unit of the vertices.
        alike : sequence of int, optional
            See :func:`alike`: of muscles that share their folds, one is evaluated.
        shares : ndarray, shape (n0,), optional
            Share of their depth that folds have at the base vertices; without them, all of it.
        """
        touched, near = np.nonzero(zones[:, vertices.host])
        found: dict[int, tuple[npt.NDArray[Any], ...]] = {}
        for k in np.unique(touched).tolist():
            first = k if alike is None else alike[k]
            if first not in found:
                found[first] = _of_muscle(first, muscles[first], near[touched == k], vertices.points)
            where, *columns = found[first]
            found[k] = (where, np.full(len(where), k), *columns[1:])
        parts = [part for _, part in sorted(found.items()) if len(part[0])]
        if not parts:
            return cls.none(len(vertices.points))
        columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
        order = np.argsort(columns[0], kind="stable")
        where, muscle_of, height, blunt, swing, lean, cycle, coordinates, direction = (c[order] for c in columns)
        if shares is not None:
            part = (vertices.barycentric[where] * shares[vertices.corners[where]]).sum(axis=1)
            height, blunt, swing = part * height, part * blunt, part * swing
        normal = vertices.normals[where]
        direction = direction - (direction * normal).sum(axis=1, keepdims=True) * normal
        direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-12)
        tensors = np.einsum("pc,pck->pk", vertices.barycentric[where], metric[vertices.corners[where]])
        squares = products(direction) / np.maximum(along(tensors, direction), 1e-6)[:, None]
        starts = np.searchsorted(where, np.arange(len(vertices.points) + 1)).astype(np.int32)
        leading = _leading(starts, np.abs(height), swing)
        steep = swing / deepest(2.0 * unit * cycle, 1.0)
        return cls(
            starts, muscle_of.astype(np.int32), height, blunt, swing, lean, steep, cycle, coordinates, direction,
            squares, leading,
        )  # fmt: skip

    @classmethod
    def none(cls, n: int) -> Self:
        """Return no entries for n vertices."""
        e, i = np.empty(0), np.empty(0, np.int32)
        starts, leading = np.zeros(n + 1, np.int32), np.full(n, -1, np.int32)
        return cls(starts, i, e, e, e, e, e, e, np.empty((0, 2)), np.empty((0, 3)), np.empty((0, 6)), leading)

    def followed(self, kept: slice | npt.NDArray[np.int64], new: Folds) -> Folds:
        """Return the entries of the vertices that live on, then those of the new ones."""
        old = self if isinstance(kept, slice) else self._kept(kept)
        if not len(new.leading):
            return old
        shift = old.starts[-1]
        columns = old._room.appended(*([getattr(each, c) for c in OF_ENTRIES] for each in (old, new)))
        leading = np.concatenate([old.leading, np.where(new.leading >= 0, new.leading + shift, -1)])
        starts = np.concatenate([old.starts, new.starts[1:] + shift])
        named = dict(zip(OF_ENTRIES, columns, strict=True))
        followed = Folds(starts=starts, leading=leading.astype(np.int32), **named)
        object.__setattr__(followed, "_room", old._room)
        return followed

    def _kept(self, kept: npt.NDArray[np.int64]) -> Folds:
        counts = np.diff(self.starts)
        alive = np.zeros(len(counts), bool)
        alive[kept] = True
        entries = np.flatnonzero(np.repeat(alive, counts))
        starts = np.concatenate([[0], np.cumsum(counts[kept])]).astype(np.int32)
        offset = self.leading[kept] - self.starts[:-1][kept]
        leading = np.where(self.leading[kept] >= 0, starts[:-1] + offset, -1).astype(np.int32)
        return Folds(starts=starts, leading=leading, **{c: getattr(self, c)[entries] for c in OF_ENTRIES})


def alike(muscles: Sequence[Muscle], zones: BoolArray) -> list[int]:
    """Return the number of the first muscle (k,) that has the same folds as each, however deep they are.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> names, patterns = list(face.muscles), [muscle.fold_pattern for muscle in face.muscles.values()]
    >>> first = alike(patterns, face.zones)
    >>> names[first[names.index("levator_labii_superioris_l")]], first[0]
    ('zygomaticus_major_l', 0)
    """
    seen: dict[object, int] = {}
    return [
        seen.setdefault(_kind(muscle, zone), k) for k, (muscle, zone) in enumerate(zip(muscles, zones, strict=True))
    ]


def _kind(muscle: Muscle, zone: BoolArray) -> tuple[object, ...]:
    """All that the folds of a muscle depend on, but their depth."""
    style = repr(dataclasses.replace(muscle.wrinkles, depth=1.0))
    own = (getattr(muscle, f.name) for f in dataclasses.fields(muscle) if f.name not in OF_MUSCLES)
    values = [np.asarray(value).tobytes() for value in own]
    return type(muscle), *values, style, zone.tobytes()


def _of_muscle(k: int, muscle: Muscle, near: npt.NDArray[np.int64], points: Array) -> tuple[npt.NDArray[Any], ...]:
    """Columns of one muscle's entries among the points `near`: their numbers, then those of Folds."""
    inside, envelope, height, blunt, *others = muscle.folded(points[near], BLUNT)
    if not len(inside):
        return (inside,)
    swing = 2.0**muscle.wrinkles.alpha * envelope
    return near[inside], np.full(len(inside), k), height * envelope, blunt * envelope, swing, *others


def _leading(starts: IntArray, size: Array, swing: Array) -> IntArray:
    """The entry of the largest |H At| per vertex; where H is 0, that of the largest `swing`."""
    n = len(starts) - 1
    owner = np.repeat(np.arange(n), np.diff(starts))
    order = np.lexsort((swing, size, owner))
    last = np.flatnonzero(np.append(owner[1:] != owner[:-1], True)) if len(owner) else np.empty(0, int)
    leading = np.full(n, -1, np.int32)
    leading[owner[last]] = order[last]
    return leading
