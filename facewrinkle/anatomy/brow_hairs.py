"""Eyebrow hairs, bound to the triangles of the skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array, IntArray


@dataclass(frozen=True)
class BrowHairs:
    """Eyebrow hairs that go with the skin.

    Parameters
    ----------
    triangles : ndarray of int, shape (k, p)
        The skin triangle under each of the p points of k hairs.
    weights : ndarray, shape (k, p, 3)
        Barycentric coordinates of the points in these triangles.
    heights : ndarray, shape (p,)
        Heights of a hair's points above the skin, in the unit of the mesh.

    Examples
    --------
    Skin that is raised by 5 mm takes the hairs along:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> rest = face.brows.polylines(face.points, face.triangles, face.tissue.normals)
    >>> raised = face.brows.polylines(face.points + [0, 5, 0], face.triangles, face.tissue.normals)
    >>> len(rest), float((raised - rest)[..., 1].mean().round(3))
    (640, 5.0)
    """

    triangles: IntArray
    weights: Array
    heights: Array

    def polylines(self, points: Array, triangles: NDArray[np.int32], normals: Array) -> Array:
        """Points (k, p, 3) of the hairs on the skin as it is now, given its points and vertex normals (n, 3)."""
        return self.on_skin(points, triangles, normals)[0]

    def on_skin(self, points: Array, triangles: NDArray[np.int32], normals: Array) -> tuple[Array, Array]:
        """:meth:`polylines`, and the normals (k, p, 3) of the skin below them."""
        corners = triangles[self.triangles]
        below = np.einsum("kpc,kpci->kpi", self.weights, points[corners])
        up = np.einsum("kpc,kpci->kpi", self.weights, normals[corners])
        return below + self.heights[:, None] * up, up
