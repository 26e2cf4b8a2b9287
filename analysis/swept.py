"""The volume between a triangle mesh and the same mesh displaced."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from facewrinkle.array_types import Array


def swept_areas(points: npt.ArrayLike, displacement: npt.ArrayLike, triangles: npt.ArrayLike) -> Array:
    """Area vectors of triangles, averaged over a straight displacement of their corners.

    The volume that a triangle sweeps is the mean displacement of its corners times this vector: exactly, as the area
    vector is a quadratic function of time, which Simpson's rule integrates. Where triangles share an edge, the swept
    solids share a face, so the volumes add up to that between the two surfaces.

    Parameters
    ----------
    points, displacement : array_like, shape (n, 3)
    triangles : array_like of int, shape (m, 3)

    Returns
    -------
    ndarray, shape (m, 3)

    Examples
    --------
    >>> flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> swept_areas(flat, [[0, 0, 1.0]] * 3, [[0, 1, 2]])
    array([[0. , 0. , 0.5]])
    """
    x, d, t = np.asarray(points, np.float64), np.asarray(displacement, np.float64), np.asarray(triangles)

    def areas(share: float) -> Array:
        a, b, c = ((x + share * d)[t[:, k]] for k in range(3))
        return np.asarray(0.5 * np.cross(b - a, c - a))

    return np.asarray((areas(0.0) + 4.0 * areas(0.5) + areas(1.0)) / 6.0)


def swept_volumes(points: npt.ArrayLike, displacement: npt.ArrayLike, triangles: npt.ArrayLike) -> Array:
    """Signed volume (m,) that each triangle sweeps when its corners are displaced; positive if outwards.

    Examples
    --------
    >>> flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> swept_volumes(flat, [[0, 0, 3.0], [0, 0, 0], [0, 0, 0]], [[0, 1, 2]])
    array([0.5])
    """
    mean = np.asarray(displacement, np.float64)[np.asarray(triangles)].mean(axis=1)
    return np.asarray((mean * swept_areas(points, displacement, triangles)).sum(axis=1))
