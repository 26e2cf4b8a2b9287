"""Soft tissue and the skull under it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ..array_types import Array
from ..geometry.laplacian import graph_laplacian
from ..geometry.normals import vertex_normals
from ..geometry.topology import boundary_loops, unique_edges

# Lengths are in distances between the pupils.

SAMPLE_RADIUS = 0.03
"""Within about this distance from a sample of the tissue, its weight grows no further."""

BORDER_STIFFNESS, BORDER_FADE = 12.0, 0.15
"""Additional stiffness of the tethers, as a factor, at the outer border of an open mesh, where the skin beyond it would
hold it; and the distance over which that falls to nothing.
"""

SMOOTHING = 0.12
"""The surface and its normals are smoothed over this, so that the skull does not follow lips, nostrils and lids."""

LEAST_DEPTH = 1.0 / 3.0
"""The bone stays below the skin by this share of the tissue: smoothing cuts corners where a face is concave."""


@dataclass(frozen=True, eq=False)
class Tissue:
    """Soft tissue between skin and bone, per vertex of the skin.

    Attributes
    ----------
    depth : ndarray, shape (n,)
        Thickness, in the unit of the mesh.
    stiffness : ndarray, shape (n,)
        Of the tethers to the bone, relative to that of the forehead.
    normals : ndarray, shape (n, 3)
        Unit normals of the skin, smoothed over about the thickness: the direction of the tethers.
    anchors : ndarray, shape (n, 3)
        Ends of the tethers on the bone: the vertices of the skull.
    across : ndarray, shape (n,)
        Stiffness of the tethers across the skin, relative to the forehead's.
    bulge : ndarray, shape (n,)
        Height that tissue gains where the skin over it loses area, relative to its thickness times the share that is
        lost: half for tissue that keeps its volume and whose base on the bone stays, more for fat that is squeezed out
        of its compartment, less for flesh that is bound to what is beneath it.

    Examples
    --------
    Tissue is thin on the forehead and thick in the cheeks; millimetres:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> for name in ("forehead_mid", "malar_l", "mouth_l"):
    ...     print(round(float(face.tissue.depth[face.mesh.find_closest_point(face.landmarks[name])])))
    5
    10
    12
    """

    depth: Array
    stiffness: Array
    normals: Array
    anchors: Array
    across: Array
    bulge: Array


def tissue_of(points: Array, triangles: npt.NDArray[np.int32], samples: tuple[Array, Array], size: float) -> Tissue:
    """Return the soft tissue, from samples of its depth and mechanics at landmarks.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    samples : tuple of ndarray
        Positions (k, 3), and what holds there (k, 4): depth in the unit of the mesh, relative stiffness along and
        across the skin, and bulge.
    size : float
        Distance between the pupils, in the unit of the mesh.

    Notes
    -----
    Samples are spread with inverse distance weights (Shepard), stiffness by its logarithm. The skull is the skin
    moved inwards by the depth along the smoothed normals, and smoothed (implicitly, so any mesh resolution will do).

    Examples
    --------
    A sheet 40 mm wide, with samples of 4 mm at its left border and 12 mm at its right:

    >>> import pyvista as pv
    >>> sheet = pv.Plane(i_size=40.0, j_size=40.0, i_resolution=4)
    >>> samples = np.array([[-20.0, 0, 0], [20, 0, 0]]), np.array([[4.0, 1, 1, 0.5], [12, 0.5, 1, 0.5]])
    >>> tissue = tissue_of(sheet.points.astype(float), sheet.triangulate().regular_faces, samples, size=63.0)
    >>> tissue.depth[:5].round(1)
    array([ 4.7,  5.5,  8. , 10.5, 11.3])
    """
    where, values = samples
    square = cdist(points, where, "sqeuclidean") / size**2
    weights = (square + SAMPLE_RADIUS**2) ** -1.5
    weights /= weights.sum(axis=1, keepdims=True)
    depth, bulge = weights @ values[:, 0], weights @ values[:, 3]
    stiffness, across = np.exp(weights @ np.log(values[:, 1:3])).T
    near_border = np.exp(-((_distance_to_border(points, triangles) / (BORDER_FADE * size)) ** 2))
    stiffness = stiffness * (1.0 + BORDER_STIFFNESS * near_border)
    smooth = _smoother(points, triangles, SMOOTHING * size)
    normals = smooth(vertex_normals(points, triangles))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    anchors = smooth(points - depth[:, None] * normals)
    above = ((points - anchors) * normals).sum(axis=1)
    anchors -= np.maximum(LEAST_DEPTH * depth - above, 0.0)[:, None] * normals
    return Tissue(depth, stiffness, normals, anchors, across, bulge)


def _distance_to_border(points: Array, triangles: npt.NDArray[np.int32]) -> Array:
    """Distance of each vertex from the longest boundary loop; infinite where there is none."""
    loops = boundary_loops(triangles)
    lengths = [np.linalg.norm(points[loop] - points[np.roll(loop, 1)], axis=1).sum() for loop in loops]
    if not loops:
        return np.full(len(points), np.inf)
    return np.asarray(cKDTree(points[loops[int(np.argmax(lengths))]]).query(points)[0])


def _smoother(points: Array, triangles: npt.NDArray[np.int32], radius: float):  # type: ignore[no-untyped-def]
    """Implicit Laplacian smoothing over about `radius`: (I + r^2 L)^-1, with weights by edge length."""
    edges, sides = unique_edges(triangles)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    weight = np.bincount(sides.ravel()) / np.maximum(length, 1e-12 * radius) ** 2  # edges count once per triangle
    degree = np.bincount(edges.ravel(), minlength=len(points))
    # Both sides times the degrees: so the matrix is symmetric, and its factors stay small if they are well ordered.
    mass = np.maximum(degree, 1).astype(float)
    system = diags_array(mass) + radius**2 * graph_laplacian(edges, weight, len(points))
    factor = splu(system.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def smooth(values: Array) -> Array:
        return np.asarray(factor.solve(mass[:, None] * values))

    return smooth
