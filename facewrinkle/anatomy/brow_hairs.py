"""Eyebrow hairs, bound to the triangles of the skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class BrowHairs:
    """Eyebrow hairs, tied to the skin.

    Parameters
    ----------
    triangles : (k, p) int array
        The skin triangle under each of the p points of k hairs.
    weights : (k, p, 3) float array
        Barycentric coordinates in it.
    heights : (p,) float array
        Height of a hair's points above the skin, mm.

    Examples
    --------
    They go with the skin, which is raised by 5 mm here:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> rest = face.brows.polylines(face.points, face.triangles, face.tissue.normals)
    >>> raised = face.brows.polylines(face.points + [0, 5, 0], face.triangles, face.tissue.normals)
    >>> len(rest), float((raised - rest)[..., 1].mean().round(3))
    (640, 5.0)
    """

    triangles: Ints
    weights: Floats
    heights: Floats

    def polylines(self, points: Floats, triangles: NDArray[np.int32], normals: Floats) -> Floats:
        """Points (k, p, 3) of the hairs on the skin as it is now: its points and vertex normals (n, 3)."""
        corners = triangles[self.triangles]
        foot = np.einsum("kpc,kpci->kpi", self.weights, points[corners])
        up = np.einsum("kpc,kpci->kpi", self.weights, normals[corners])
        return foot + self.heights[:, None] * up
