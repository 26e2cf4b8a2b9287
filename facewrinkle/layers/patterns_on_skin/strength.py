"""Strength of a pattern, set by the compression of the skin under it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...anatomy.face import Face
from ...array_types import Array
from ...checks import vector
from ...errors import ParameterError, check_range
from ...geometry.interpolation import smoothstep
from ...geometry.normals import vertex_areas, vertex_normals
from ..compression import StrainField, compression_along, principal_compression
from .region import LaidRegion


@dataclass(frozen=True)
class Compression:
    """A strength set by the skin under the pattern: 0 up to a compression of `low`, 1 from `full` on.

    Attributes
    ----------
    low, full : float
        Share by which the skin is shortened, on average over the region.
    along : tuple of float, optional
        Direction in which it is measured; default: that of the largest compression at each point.

    Examples
    --------
    >>> Compression(low=0.0, full=0.25)(0.125)
    0.5
    """

    low: float = 0.03
    full: float = 0.2
    along: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        check_range("low", self.low, -10.0, 1.0)
        check_range("full", self.full, self.low + 1e-9, 1.0, "It has to be above low.")
        if self.along is not None and not np.any(vector("along", self.along)):
            raise ParameterError("along must be a direction, received three zeros.")

    def __call__(self, epsilon: float) -> float:
        """Return the strength at a compression."""
        return float(smoothstep((epsilon - self.low) / (self.full - self.low)))


class RegionCompression:
    """Mean compression of the skin under a region, whatever its triangles.

    Parameters
    ----------
    face : Face
    laid : LaidRegion
        The region on it.
    along : tuple of float, optional
        See :class:`Compression`.
    """

    def __init__(self, face: Face, laid: LaidRegion, along: tuple[float, float, float] | None) -> None:
        inside = laid.base_window
        if not inside.any():
            inside[laid.corners] = 1.0
        points = face.points * face.unit
        self._at = np.flatnonzero(inside)
        share = inside * vertex_areas(points, face.triangles)
        self._share, self._metric = share[self._at] / share.sum(), StrainField.of(face).metric[self._at]
        self._normals = vertex_normals(points, face.triangles)[self._at]
        self._along = None if along is None else np.asarray(along, dtype=np.float64)

    def at(self, strain: Array) -> float:
        """Return the compression at a strain (n0, 6) of the base mesh."""
        if self._along is None:
            epsilon, _ = principal_compression(strain[self._at], self._metric, self._normals)
        else:
            epsilon = compression_along(strain[self._at], self._metric, self._normals, self._along)
        return float(self._share @ epsilon)
