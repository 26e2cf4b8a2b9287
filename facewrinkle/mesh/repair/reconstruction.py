"""Surfaces in pieces become one: small gaps are closed, or the surface is reconstructed through its points."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ...array_types import Array, IntArray
from ...errors import MeshError, missing_package
from ...geometry import topology
from ...geometry.sampling import triangle_samples
from .topology_repair import RepairedMesh, mended, merged_points

GAP = 0.002
"""Points on borders that are nearer to each other than this share of the diagonal of the mesh become one."""

MARGIN = 0.012
"""A reconstructed surface is cut off at this distance from the old one, as a share of its diagonal."""

SAMPLES = 60_000
"""Points on the old surface from which the new one is reconstructed."""

MOST = 16_000
"""The most triangles of a reconstructed surface, unless twice as many as there were is more."""


def closed_up(mesh: RepairedMesh) -> RepairedMesh:
    """Close small gaps: merge points on borders that are nearer to each other than `GAP`."""
    edges, sides = topology.unique_edges(mesh.triangles)
    border = np.unique(edges[np.bincount(sides.ravel()) == 1]).astype(np.int64)
    if not len(border):
        return mesh
    pairs = cKDTree(mesh.points[border]).query_pairs(GAP * _diagonal(mesh), output_type="ndarray")
    count = len(np.unique(mesh.triangles))
    closer = merged_points(mesh, border[pairs])
    merged = count - len(np.unique(closer.triangles))
    if not merged:
        return mesh
    return mended(closer.reported(f"Joined points on borders that were close to each other: {merged} of {count}."))


def reconstructed(mesh: RepairedMesh, why: str) -> RepairedMesh:
    """Replace the mesh by one surface through its points (screened Poisson, by pymeshlab), cut off at its borders.

    Points keep the data of the nearest ones of the source.

    Parameters
    ----------
    mesh : RepairedMesh
    why : str
        The fault, for the error and the report.

    Raises
    ------
    MissingPackageError
        Without pymeshlab (extra `remesh`).
    MeshError
        If pymeshlab fails.
    """
    try:
        import pymeshlab
    except ImportError:
        otherwise = ". Or reconstruct it as one surface in a modeller."
        raise missing_package(f"{why}. To mend it needs", "pymeshlab", "remesh", otherwise) from None
    places, normals, corner = _samples(mesh)
    middle, size = mesh.points[mesh.triangles].mean(axis=(0, 1)), _diagonal(mesh)
    work = pymeshlab.MeshSet(verbose=False)  # kept while its mesh is in use
    try:
        work.add_mesh(pymeshlab.Mesh(vertex_matrix=(places - middle) / size, v_normals_matrix=normals))
        work.generate_surface_reconstruction_screened_poisson(depth=7, threads=1)
        target = max(MOST, 2 * len(mesh.triangles))
        if work.current_mesh().face_number() > target:
            work.meshing_decimation_quadric_edge_collapse(targetfacenum=target, preservetopology=True)
        result = work.current_mesh()
        points, triangles = np.array(result.vertex_matrix()), np.array(result.face_matrix(), dtype=np.int64)
    except pymeshlab.PyMeshLabException as problem:
        raise MeshError(f"{why}, and pymeshlab cannot mend it: {problem}. Clean it in a modeller.") from None
    points = points * size + middle
    distance, nearest = cKDTree(places).query(points)
    triangles = triangles[(distance[triangles] < MARGIN * size).all(axis=1)]
    if not len(triangles):
        raise MeshError(f"{why}, and nothing is left when it is mended. Clean it in a modeller.")
    corner = corner[nearest]
    whole = RepairedMesh(
        points, triangles, mesh.corners.ravel()[corner][triangles], mesh.origin[mesh.triangles.ravel()][corner],
        mesh.report, rebuilt=True,
    )  # fmt: skip
    return mended(whole.reported(f"{why}; it was reconstructed with pymeshlab, with {len(triangles)} triangles."))


def _diagonal(mesh: RepairedMesh) -> float:
    used = mesh.points[mesh.triangles].reshape(-1, 3)
    return float(np.linalg.norm(np.ptp(used, axis=0)))


def _samples(mesh: RepairedMesh) -> tuple[Array, Array, IntArray]:
    """Points spread over the triangles, their outward unit normals, and the corner nearest to each."""
    corners = mesh.points[mesh.triangles]
    middle = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    normals /= doubled[:, None]
    outwards = (normals * (middle - middle.mean(axis=0))).sum(axis=1)
    inward = float((outwards < 0.0).mean())
    if 0.25 < inward < 0.75:  # the triangles are not oriented alike
        normals[outwards < 0.0] *= -1.0
    elif inward >= 0.75:
        normals = -normals
    counts = np.clip(SAMPLES * doubled / doubled.sum(), 3.0, 1e4).astype(np.int64)
    which = np.repeat(np.arange(len(corners)), counts)
    u, v = triangle_samples(len(which))
    weights = np.stack([1.0 - u - v, u, v], axis=1)
    places = np.einsum("nk,nkj->nj", weights, corners[which])
    return places, normals[which], 3 * which + np.argmax(weights, axis=1)
