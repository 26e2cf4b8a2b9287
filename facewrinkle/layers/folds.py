"""Folds: the wrinkles that each muscle can make at each vertex, as far as they do not depend on its contraction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from ..anatomy.muscles import Muscle
from ..array_types import Array, BoolArray, IntArray
from ..geometry.equations import deepest
from ..geometry.interpolation import interpolated
from .base import SurfacePoints
from .compression import per_length, tangents_of
from .entries import Entries, sorted_by_vertex

BLUNT = 0.18
"""Half the width over which heights are averaged for the shading normals, in half cycles: about the distance of the
vertices. Some vertices lie at the very bottom of a sharp furrow and others beside it; normals of the heights themselves
would vary along the furrow, and its line would look serrated.
"""


@dataclass(frozen=True, eq=False)
class Folds(Entries):
    """Folds of all muscles, with one entry per vertex and muscle whose wrinkling region it lies in.

    The last one of a vertex is that of the dominant muscle: the entries rise by abs(H At), and where H is 0 by `swing`.

    Attributes
    ----------
    muscle : ndarray of int32, shape (p,)
    height : ndarray, shape (p,)
        H At at k0 = 1.
    blunt : ndarray, shape (p,)
        The same with H averaged for the shading normals, see `BLUNT`.
    swing : ndarray, shape (p,)
        2^alpha At: from bulge to furrow at k0 = 1.
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

    Examples
    --------
    One muscle, a point in its middle, and one beside it that has no entry:

    >>> from facewrinkle.anatomy.muscles import LinearMuscle
    >>> muscle = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=40.0)
    >>> points, up = np.array([[0.0, 20, 0], [30, 20, 0]]), np.tile([0.0, 0, 1], (2, 1))
    >>> vertices = SurfacePoints(points, up, np.zeros((2, 3), np.int32), np.full((2, 3), 1 / 3), np.zeros(2, np.int32))
    >>> flat = np.array([[1.0, 1, 0, 0, 0, 0]])
    >>> folds = Folds.at(vertices, [muscle], np.array([[True]]), flat, unit=1.0)
    >>> folds.starts.tolist(), folds.coordinates.tolist(), folds.cycle.round(2).tolist()
    ([0, 1, 1], [[0.5, 0.0]], [5.33])
    """

    muscle: IntArray
    height: Array
    blunt: Array
    swing: Array
    steep: Array
    cycle: Array
    coordinates: Array
    direction: Array
    products: Array

    @classmethod
    def at(
        cls,
        vertices: SurfacePoints,
        muscles: list[Muscle],
        zones: BoolArray,
        metric: Array,
        unit: float,
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
        shares : ndarray, shape (n0,), optional
            Share of their depth that folds have at the base vertices; without them, all of it.
        """
        touched, near = np.nonzero(zones[:, vertices.host])
        found = [_of_muscle(k, muscles[k], near[touched == k], vertices.points) for k in np.unique(touched).tolist()]
        parts = [part for part in found if len(part[0])]
        if not parts:
            return cls.none(len(vertices.points))
        where, muscle_of, height, blunt, swing, cycle, coordinates, direction = map(
            np.concatenate, zip(*parts, strict=True)
        )
        at = vertices.corners[where], vertices.barycentric[where]
        if shares is not None:
            part = interpolated(shares[:, None], *at)[:, 0]
            height, blunt, swing = part * height, part * blunt, part * swing
        direction = tangents_of(direction, vertices.normals[where])
        squares = per_length(interpolated(metric, *at), direction)
        steep = swing / deepest(2.0 * unit * cycle, 1.0)
        columns = muscle_of.astype(np.int32), height, blunt, swing, steep, cycle, coordinates, direction, squares
        rising = np.lexsort((swing, np.abs(height)))
        of_vertices = sorted_by_vertex(where[rising], *(column[rising] for column in columns), n=len(vertices.points))
        return cls(*of_vertices)

    @classmethod
    def none(cls, n: int) -> Self:
        """Return no entries for n vertices."""
        e, i = np.empty(0), np.empty(0, np.int32)
        coordinates, direction, squares = (np.empty((0, width)) for width in (2, 3, 6))
        return cls(np.zeros(n + 1, np.int32), i, e, e, e, e, e, coordinates, direction, squares)


def _of_muscle(k: int, muscle: Muscle, near: npt.NDArray[np.int64], points: Array) -> tuple[npt.NDArray[Any], ...]:
    """Columns of one muscle's entries among the points `near`: their numbers, then those of Folds."""
    envelope = muscle.envelope(points[near])
    inside = envelope > 0.0
    near, envelope = near[inside], envelope[inside]
    x, swing = points[near], 2.0**muscle.wrinkles.alpha * envelope
    return (
        near,
        np.full(len(near), k),
        muscle.height(x) * envelope,
        muscle.height(x, BLUNT) * envelope,
        swing,
        muscle.half_cycles(x),
        np.stack(muscle.coordinates(x), axis=1),
        muscle.fold_direction(x),
    )
