"""Values at the corners of triangles; at a seam, the triangles around a vertex have different ones.

Texture coordinates are such values. The mesh itself stays whole at a seam, so that it moves as one; only for pictures
and files is it split into vertices that have one value each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_types import Array, IntArray
from . import _mesh_kernels as kernels
from .refinement import RedGreenForest


@dataclass(frozen=True)
class SplitMesh:
    """A mesh whose vertices have one value each.

    Attributes
    ----------
    triangles : ndarray of int, shape (m, 3)
        Numbers of the split vertices.
    origin : ndarray of int, shape (p,)
        The vertex of the mesh that each comes from; the first n are those of the mesh, in order.
    values : ndarray, shape (p, d)
    """

    triangles: IntArray
    origin: IntArray
    values: Array


def split_vertices(triangles: IntArray, values: Array, n_points: int) -> SplitMesh:
    """Split the vertices whose corners have different values into one vertex for each value.

    Parameters
    ----------
    triangles : ndarray of int, shape (m, 3)
    values : ndarray, shape (m, 3, d)
        At the corners.
    n_points : int
        Number of vertices, n. Those without a triangle get the value 0.

    Examples
    --------
    >>> values = np.array([[[0.0], [1.0], [2.0]], [[2.0], [5.0], [6.0]]])
    >>> parts = split_vertices(np.array([[0, 1, 2], [2, 1, 3]]), values, 4)
    >>> parts.triangles.tolist(), parts.origin.tolist(), parts.values.ravel().tolist()
    ([[0, 1, 2], [2, 4, 3]], [0, 1, 2, 3, 1], [0.0, 1.0, 2.0, 6.0, 5.0])
    """
    vertices, flat = np.array(triangles, np.int64).ravel(), values.reshape(-1, values.shape[-1])
    own, (used, first) = np.zeros((n_points, flat.shape[1])), np.unique(vertices, return_index=True)
    own[used] = flat[first]
    differs = (flat != own[vertices]).any(axis=1)
    differs[first] = False  # not even if it is NaN
    further = np.flatnonzero(differs)
    rows, which = np.unique(np.column_stack([vertices[further], flat[further]]), axis=0, return_inverse=True)
    vertices[further] = n_points + which.ravel()
    origin = np.concatenate([np.arange(n_points), rows[:, 0].astype(np.int64)])
    return SplitMesh(vertices.reshape(-1, 3), origin, np.concatenate([own, rows[:, 1:]]))


def refined_values(values: Array, base: IntArray, forest: RedGreenForest) -> Array:
    """Values (m, 3, d) at the corners of a refined mesh, by linear interpolation in the base triangles.

    Parameters
    ----------
    values : ndarray, shape (m0, 3, d)
        At the corners of the base triangles.
    base : ndarray of int, shape (m0, 3)
        The triangles that the forest was made of.
    forest : RedGreenForest

    Examples
    --------
    >>> forest = RedGreenForest([[0, 1, 2]])
    >>> forest.split([0])
    Change(kept=slice(None, None, None), n_created=3)
    >>> refined_values(np.array([[[0.0], [4.0], [8.0]]]), np.array([[0, 1, 2]]), forest)[0].ravel().tolist()
    [0.0, 2.0, 4.0]
    """
    out = np.empty((*forest.triangles.shape, values.shape[2]))
    base = np.ascontiguousarray(base, dtype=np.int32)
    kernels.interpolate_corners(values, base, forest.triangles, forest.root, forest.corners, forest.barycentric, out)
    return out
