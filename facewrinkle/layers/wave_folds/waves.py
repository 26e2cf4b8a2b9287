"""Waves of all families at the vertices of a refined mesh, in columns with an entry per vertex and family."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from ...array_types import Array, IntArray
from ...geometry.interpolation import interpolated
from ..base import SurfacePoints
from ..compression import along, tangents_of
from ..entries import Entries

LONGEST = 1.7
"""Greatest wavelength of an entry, relative to that of the skin: where directions turn, the sum of waves has too small
a wave vector.
"""

GONE, WHOLE = 0.12, 0.67
"""Strength of the sum of waves below which there is no line, and from which it is whole."""


@dataclass(frozen=True, eq=False)
class Waves(Entries):
    """The waves at n vertices: for each family that has lines there an entry, p in all.

    Attributes
    ----------
    family : ndarray of int32, shape (p,)
    theta : ndarray, shape (p,)
        Phase: 0 on a bulge, pi in a furrow. Its sign means nothing.
    strength, window : ndarray, shape (p,)
        Share of the depth, and of the compression, in [0, 1] (times what was asked for here).
    length : ndarray, shape (p,)
        Wavelength, mm.
    old : ndarray, shape (p,)
        Depth of the lines at rest, mm.
    wave : ndarray, shape (p, 3)
        Wave vector, 1/mm.
    tangents : ndarray, shape (p, 6)
        The directions across and along the lines, each of unit length in the rest metric.
    """

    family: IntArray
    theta: Array
    strength: Array
    window: Array
    length: Array
    old: Array
    wave: Array
    tangents: Array

    @classmethod
    def none(cls, n: int) -> Self:
        """Return no waves at n vertices.

        Examples
        --------
        >>> Waves.none(2).starts.tolist()
        [0, 0, 0]
        """
        e = np.empty(0)
        starts, family = np.zeros(n + 1, np.int32), np.empty(0, np.int32)
        return cls(starts, family, e, e, e, e, e, np.empty((0, 3)), np.empty((0, 6)))


class Now(NamedTuple):
    """What the waves do in a frame, entry by entry, each an array of the shape (p,).

    Attributes
    ----------
    epsilon, excess, left : ndarray
        Compression across the lines; beyond the onset; what crossing families leave of that.
    deep, alpha, height : ndarray
        Depth, mm, before all families of a vertex share the length of the skin; shape exponent; height, mm.
    """

    epsilon: Array
    excess: Array
    left: Array
    deep: Array
    alpha: Array
    height: Array


def directed(wave: Array, vertices: SurfacePoints, near: np.ndarray, metric: Array) -> Array:
    """Return the tangents (p, 6) across and along waves (p, 3) at the vertices `near`.

    They are of unit length in the rest metric (n0, 6).
    """
    normals, tensors = vertices.normals[near], interpolated(metric, vertices.corners[near], vertices.barycentric[near])
    first = tangents_of(wave, normals)
    both = first, np.cross(normals, first)
    return np.hstack([each / np.sqrt(np.maximum(along(tensors, each), 1e-6))[:, None] for each in both])
