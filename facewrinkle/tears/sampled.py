"""Tears on triangles that stay, for animated files: where there is no water, the sheet is under the skin or a point."""

from __future__ import annotations

from dataclasses import dataclass

from ..array_types import Array, IntArray


@dataclass(frozen=True, eq=False)
class Sampled:
    """A tear at f times, in the unit of its surface.

    Attributes
    ----------
    points, normals : ndarray, shape (f, n, 3)
    triangles : ndarray of int32, shape (m, 3)

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face, times = fw.default_face(), [0.5, 1.0, 1.5]
    >>> tear = fw.SheddingTear(face, start="l")
    >>> sampled = tear.sampled(times, [face.mesh] * 3)
    >>> sampled.points.shape == (3, *sampled.normals.shape[1:]), int(sampled.triangles.max()) < sampled.points.shape[1]
    (True, True)
    """

    points: Array
    normals: Array
    triangles: IntArray
