"""Soft tissue and the skull under it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array, eye_array
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from ..geometry.normals import vertex_normals
from ..geometry.topology import boundary_loops

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Tissue:
    """What lies between skin and bone, per vertex of the skin.

    Attributes
    ----------
    depth : ndarray, shape (n,)
        Thickness, in the unit of the mesh.
    stiffness : ndarray, shape (n,)
        Of the ties to the bone, relative to that of the forehead.
    normals : ndarray, shape (n, 3)
        Unit normals of the skin, smoothed over about the thickness: the direction of the ties.
    foot : ndarray, shape (n, 3)
        Where the ties start: the vertices of the skull.
    """

    depth: Array
    stiffness: Array
    normals: Array
    foot: Array


def tissue_of(points: Array, triangles: npt.NDArray[np.int32], samples: tuple[Array, Array, Array], size: float) -> Tissue:
    """Soft tissue from samples of its depth and stiffness at landmarks.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    samples : tuple of ndarray
        Positions (k, 3), depths (k,) in the unit of the mesh, and relative stiffness (k,).
    size : float
        Distance between the pupils, in the unit of the mesh.

    Notes
    -----
    Samples are spread with inverse distance weights (Shepard), the stiffness by its logarithm. The skull is the skin moved
    inwards by the depth along the smoothed normals; smoothing (implicit, so any mesh resolution will do) keeps it from
    following lips, nostrils and lids.
    """
    where, depths, stiffness = samples
    square = ((points[:, None, :] - where[None]) ** 2).sum(axis=2) / size**2
    weights = (square + 0.03**2) ** -1.5
    weights /= weights.sum(axis=1, keepdims=True)
    depth = weights @ depths
    ties = np.exp(weights @ np.log(stiffness)) * (1.0 + RIM * _near_rim(points, triangles, 0.15 * size))
    smooth = _smoother(points, triangles, 0.12 * size)
    normals = smooth(vertex_normals(points, triangles))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    foot = smooth(points - depth[:, None] * normals)
    # Smoothing cuts corners where the face is concave: the bone stays below the skin by a third of the tissue at least.
    above = ((points - foot) * normals).sum(axis=1)
    foot -= np.maximum(depth / 3.0 - above, 0.0)[:, None] * normals
    return Tissue(depth, ties, normals, foot)


RIM = 12.0
"""How much stiffer the ties are at the outer rim of an open mesh, where the skin beyond it would hold it."""


def _near_rim(points: Array, triangles: npt.NDArray[np.int32], reach: float) -> Array:
    """1 at the longest boundary loop, falling to 0 over about `reach`; 0 everywhere on a closed mesh."""
    loops = boundary_loops(triangles)
    if not loops:
        return np.zeros(len(points))
    lengths = [np.linalg.norm(points[loop] - points[np.roll(loop, 1)], axis=1).sum() for loop in loops]
    distance, _ = cKDTree(points[loops[int(np.argmax(lengths))]]).query(points)
    return np.asarray(np.exp(-((distance / reach) ** 2)))


def _smoother(points: Array, triangles: npt.NDArray[np.int32], radius: float):  # type: ignore[no-untyped-def]
    """Implicit Laplacian smoothing over about `radius`: (I + r^2 L)^-1, with weights by edge length."""
    i = triangles[:, [0, 1, 2, 1, 2, 0]].ravel()
    j = triangles[:, [1, 2, 0, 0, 1, 2]].ravel()
    n = len(points)
    length = np.maximum(np.linalg.norm(points[i] - points[j], axis=1), 1e-12 * radius)
    graph = csr_array((1.0 / length**2, (i, j)), shape=(n, n))
    degree = np.maximum(np.asarray((graph > 0).sum(axis=1)), 1)
    graph = diags_array(1.0 / degree) @ graph
    laplacian = diags_array(np.asarray(graph.sum(axis=1))) - graph
    system = (eye_array(n) + radius**2 * laplacian).tocsc()
    return lambda values: spsolve(system, values)
