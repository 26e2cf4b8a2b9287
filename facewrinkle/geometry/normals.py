"""Vertex normals of triangle meshes."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from .compilation import compiled


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
    normalize(normals)
    return normals


def detail_normals(bare: Array, displaced: Array, triangles: npt.NDArray[np.int32], smooth: Array) -> Array:
    """Normals of a displaced refined mesh without the facets of the coarse mesh below it.

    New vertices lie on flat coarse triangles, and shading by their own normals would show those facets. So only the
    change of the normals by the displacement is taken from the mesh, and added to `smooth`, the interpolated coarse
    normals.

    Parameters
    ----------
    bare, displaced, smooth : ndarray, shape (n, 3)
    triangles : ndarray of int32, shape (m, 3)

    Returns
    -------
    ndarray, shape (n, 3)
        Exactly `smooth`, normalized, where nothing is displaced.

    Examples
    --------
    >>> p = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> detail_normals(p, p, np.array([[0, 1, 2]], np.int32), np.tile([0.6, 0.0, 0.8], (3, 1)))[0]
    array([0.6, 0. , 0.8])
    """
    return details_normals(bare, [displaced], triangles, smooth)[0]


def details_normals(
    bare: Array, displaced: Sequence[Array], triangles: npt.NDArray[np.int32], smooth: Array
) -> list[Array]:
    """Return :func:`detail_normals` of several displacements of one bare mesh.

    Examples
    --------
    >>> p, up = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.tile([0.0, 0.0, 1.0], (3, 1))
    >>> lifted = p + [[0, 0, 0], [0, 0, 1], [0, 0, 0]]
    >>> even, tilted = details_normals(p, [p, lifted], np.array([[0, 1, 2]], np.int32), up)
    >>> even[0].round(3).tolist(), tilted[0].round(3).tolist()
    ([0.0, 0.0, 1.0], [-0.707, 0.0, 0.707])
    """
    before = vertex_normals(bare, triangles)
    out = [vertex_normals(points, triangles) for points in displaced]
    for normals in out:
        normals -= before
        normals += smooth
        normalize(normals)
    return out


def unit(vectors: Array) -> Array:
    """Return vectors (..., d) scaled to the length 1; zero vectors stay.

    Examples
    --------
    >>> unit(np.array([[0.0, 3, 4], [0, 0, 0]])).tolist()
    [[0.0, 0.6, 0.8], [0.0, 0.0, 0.0]]
    """
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300))


def tangent_axes(normals: Array) -> tuple[Array, Array]:
    """Return two unit tangents (n, 3) at right angles to unit normals (n, 3), and to each other.

    Examples
    --------
    >>> first, second = tangent_axes(np.array([[0.0, 0.6, 0.8]]))
    >>> first.tolist(), (second + 0.0).round(9).tolist()
    ([[1.0, 0.0, 0.0]], [[0.0, 0.8, -0.6]])
    """
    first = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = unit(first - (first * normals).sum(axis=1, keepdims=True) * normals)
    return first, np.cross(normals, first)


def triangle_normals(points: Array, triangles: npt.NDArray[np.integer]) -> Array:
    """Return the unit normals (m, 3) of triangles; zero for those without area.

    Examples
    --------
    >>> triangle_normals(np.array([[0.0, 0, 0], [3, 0, 0], [0, 2, 0]]), np.array([[0, 1, 2], [0, 1, 1]])).tolist()
    [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]
    """
    return unit(area_vectors(points, triangles))


def area_vectors(points: Array, triangles: npt.NDArray[np.integer]) -> Array:
    """Normals (m, 3) of triangles, as long as twice their areas.

    Examples
    --------
    >>> area_vectors(np.array([[0.0, 0, 0], [3, 0, 0], [0, 2, 0]]), np.array([[0, 1, 2]])).tolist()
    [[0.0, 0.0, 6.0]]
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def double_areas(points: Array, triangles: npt.NDArray[np.integer]) -> Array:
    """Twice the area (m,) of each triangle.

    Examples
    --------
    >>> double_areas(np.array([[0.0, 0, 0], [3, 0, 0], [0, 2, 0]]), np.array([[0, 1, 2]])).tolist()
    [6.0]
    """
    return np.asarray(np.linalg.norm(area_vectors(points, triangles), axis=1))


def vertex_areas(points: npt.ArrayLike, triangles: npt.ArrayLike) -> Array:
    """A third of the area of the adjacent triangles, per vertex (n,).

    Examples
    --------
    >>> vertex_areas([[0, 0, 0], [3, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    array([1., 1., 1.])
    """
    positions = np.ascontiguousarray(points, dtype=np.float64)
    areas = np.zeros(len(positions))
    _add_areas(positions, np.ascontiguousarray(triangles, dtype=np.int32), areas)
    return areas


# Numbers of vertices are made unsigned in the loops of every frame: none counts from the end, and looking for that
# takes a third of the time.


@compiled(inline="always")
def area_vector(points, i, j, k):
    """Normal of the triangle of three points, twice its area long."""
    ax, ay, az = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    bx, by, bz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@compiled
def _accumulate(points, triangles, out):
    """Sum the normals of the triangles at each vertex, weighted by area; not normalized."""
    out[:] = 0.0
    for f in range(triangles.shape[0]):
        i, j, k = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        nx, ny, nz = area_vector(points, i, j, k)
        for v in (i, j, k):
            out[v, 0] += nx
            out[v, 1] += ny
            out[v, 2] += nz


@compiled
def _add_areas(points, triangles, out):
    """Add a third of the area of each triangle at its vertices."""
    for f in range(triangles.shape[0]):
        i, j, k = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        nx, ny, nz = area_vector(points, i, j, k)
        area = np.sqrt(nx * nx + ny * ny + nz * nz) / 6.0
        out[i] += area
        out[j] += area
        out[k] += area


@compiled
def normalize(vectors):
    """Scale vectors (n, 3) to unit length in place; zero vectors stay."""
    for v in range(vectors.shape[0]):
        x, y, z = vectors[v, 0], vectors[v, 1], vectors[v, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            vectors[v, 0] = x / length
            vectors[v, 1] = y / length
            vectors[v, 2] = z / length
