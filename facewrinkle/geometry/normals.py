"""Vertex normals of triangle meshes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]


@njit(cache=True)
def _accumulate(points, triangles, out):  # type: ignore[no-untyped-def]
    """Sum of face normals, weighted by area, per vertex; not normalised."""
    out[:] = 0.0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        for v in (i, j, k):
            out[v, 0] += nx
            out[v, 1] += ny
            out[v, 2] += nz


@njit(cache=True)
def _normalise(vectors):  # type: ignore[no-untyped-def]
    for v in range(vectors.shape[0]):
        x, y, z = vectors[v, 0], vectors[v, 1], vectors[v, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            vectors[v, 0] = x / length
            vectors[v, 1] = y / length
            vectors[v, 2] = z / length


def vertex_normals(points: npt.ArrayLike, triangles: npt.ArrayLike) -> Array:
    """Unit vertex normals, weighted by the area of the adjacent triangles; zero for unused vertices.

    Parameters
    ----------
    points : array_like, shape (n, 3)
    triangles : array_like of int, shape (m, 3)

    Returns
    -------
    ndarray, shape (n, 3)

    Examples
    --------
    >>> vertex_normals([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])[0]
    array([0., 0., 1.])
    """
    positions = np.ascontiguousarray(points, dtype=np.float64)
    normals = np.empty_like(positions)
    _accumulate(positions, np.ascontiguousarray(triangles, dtype=np.int32), normals)
    _normalise(normals)
    return normals


@njit(cache=True)
def _detail(bare, displaced, triangles, smooth, scratch, out):  # type: ignore[no-untyped-def]
    _accumulate(bare, triangles, scratch)
    _normalise(scratch)
    _accumulate(displaced, triangles, out)
    _normalise(out)
    for v in range(out.shape[0]):
        for k in range(3):
            out[v, k] += smooth[v, k] - scratch[v, k]
    _normalise(out)


def detail_normals(bare: Array, displaced: Array, triangles: npt.NDArray[np.int32], smooth: Array) -> Array:
    """Normals of a displaced refined mesh without the facets of the coarse mesh below it.

    New vertices lie on flat coarse triangles, and shading by their own normals would show these. So only the change that
    the displacement makes to the normals is taken from the mesh, and added to `smooth`, the interpolated coarse normals.

    Parameters
    ----------
    bare, displaced, smooth : ndarray, shape (n, 3)
    triangles : ndarray of int32, shape (m, 3)

    Returns
    -------
    ndarray, shape (n, 3)
        Exactly the normalised `smooth` where nothing is displaced.

    Examples
    --------
    >>> p = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> detail_normals(p, p, np.array([[0, 1, 2]], np.int32), np.tile([0.6, 0.0, 0.8], (3, 1)))[0]
    array([0.6, 0. , 0.8])
    """
    scratch, out = np.empty_like(bare), np.empty_like(bare)
    _detail(bare, displaced, triangles, smooth, scratch, out)
    return out


def vertex_areas(points: npt.ArrayLike, triangles: npt.ArrayLike) -> Array:
    """A third of the area of the adjacent triangles, per vertex (n,).

    Examples
    --------
    >>> vertex_areas([[0, 0, 0], [3, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    array([1., 1., 1.])
    """
    positions, faces = np.asarray(points, dtype=np.float64), np.asarray(triangles)
    a, b, c = (positions[faces[:, k]] for k in range(3))
    double = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return np.bincount(faces.ravel(), np.repeat(double / 6.0, 3), minlength=len(positions))
