"""Check and repair surfaces until the algorithms can rely on them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree

from ...array_types import Array, IntArray
from ...checks import vector, vectors
from ...errors import LARGEST, MeshError, ParameterError, missing_package, warn
from ...geometry import topology
from ...geometry.sampling import triangle_samples
from ..arrays import COLORS, CORNERS, MESH, MOVED, PART, SOURCE, corner_texture, with_data
from ..formats.reading import MeshLike, read_surface
from .topology_repair import ROUNDING, RepairedMesh, areas_doubled, mended, merged_points, unfolded, votes_of

IN_PIECES = 0.5
"""A surface is in pieces unless one sheet of it is the nearest to this share of the landmarks."""

FEW = 4
"""With fewer landmarks, a surface is never taken to be in pieces; and a further mesh of the file belongs to the face if
so many lie on it."""

GAP = 0.002
"""Points on borders that are nearer to each other than this share of the diagonal of the mesh become one."""

MARGIN = 0.012
"""A reconstructed surface is cut off at this distance from the old one, as a share of its diagonal."""

SAMPLES = 60_000
"""Points on the old surface from which the new one is reconstructed."""

MOST = 16_000
"""The most triangles of a reconstructed surface, unless twice as many as there were is more."""


@dataclass(frozen=True)
class CleanSurface:
    """One connected, manifold, consistently oriented surface that faces outward.

    Attributes
    ----------
    mesh : pyvista.PolyData
        With the point data of the input.
    triangles : ndarray of int32, shape (m, 3)
    points : ndarray, shape (n, 3)
    source_points : ndarray of int, shape (n,)
        The number that each point has in the input; -1 for all, if the surface had to be reconstructed.
    report : tuple of str
        One sentence for each repair.
    others : pyvista.PolyData, optional
        The other parts of the input, unchanged; the cell data "part" number them, and the point data "source point"
        give the numbers of their points in the input.

    Examples
    --------
    A sheet and a ball; the sheet is larger:

    >>> import pyvista as pv
    >>> import warnings
    >>> with warnings.catch_warnings(action="ignore"):
    ...     surface = prepare(pv.Plane() + pv.Sphere(radius=0.1, center=(0, 0, 2)))
    >>> surface.triangles.shape, surface.others.n_cells
    ((200, 3), 1680)
    >>> surface.report
    ('Kept one of 2 separate parts, the one with the largest area, with 200 triangles; set apart parts of 1680 ...',)
    """

    mesh: pv.PolyData
    triangles: np.ndarray
    points: np.ndarray
    source_points: np.ndarray
    report: tuple[str, ...]
    others: pv.PolyData | None = None


def prepare(mesh: MeshLike, near: np.ndarray | None = None, forward: np.ndarray | None = None) -> CleanSurface:
    """Return a clean copy of a surface on which the algorithms can rely.

    Degenerate and duplicate triangles are dropped without tearing the surface, points that are split at seams are
    merged within each mesh of a file, edges with three triangles or more are cut, one component is chosen, the
    triangles are oriented alike and outward, those that lie turned over are laid flat, and unused points are
    dropped. If the surface under the landmarks is in pieces or has only one side, small gaps are closed; if that is
    not enough, pymeshlab (extra `remesh`) reconstructs it. All changes are reported.
    Places where the surface runs through itself stay: lips and lids of real faces have such places.

    Parameters
    ----------
    mesh : anything that `read_surface` takes
        Not changed.
    near : array_like, shape (k, 3), optional
        Landmarks. The component that is nearest to most of them is chosen; without them, the one with the largest area.
    forward : array_like, shape (3,), optional
        The direction in which the face looks; the inside of the surface lies behind it. Without it, the inside is taken
        to be where the centroid is, which holds for closed surfaces and for masks that bulge outward.

    Returns
    -------
    CleanSurface

    Raises
    ------
    MeshError
        If there are no points or faces; for points that are not finite; for a surface that cannot be oriented, such as
        a Möbius strip; for one that stays in pieces under the landmarks.
    MissingPackageError
        If it is in pieces, and pymeshlab is not installed.
    ParameterError
        For landmarks or a direction of the wrong shape, not finite, or zero.

    Warns
    -----
    FaceWrinkleWarning
        Once for each kind of change.

    Examples
    --------
    >>> import pyvista as pv
    >>> surface = prepare(pv.Plane(i_resolution=2, j_resolution=2))
    >>> surface.points.shape, surface.triangles.shape, surface.report
    ((9, 3), (8, 3), ())
    """
    near = None if near is None else vectors("near", near)
    if forward is not None and not vector("forward", forward).any():
        raise ParameterError("forward must be a direction, received (0, 0, 0).")
    source = read_surface(mesh)
    points, faces = np.asarray(source.points), np.asarray(source.regular_faces)
    _check_finite(points, faces)
    moved, meshes = source.point_data.pop(MOVED, None), source.cell_data.pop(MESH, None)  # `source` is a new object
    whole = mended(RepairedMesh.of(points, faces), moved, meshes)
    if meshes is not None and near is not None:
        joined = mended(RepairedMesh.of(points, faces), moved)
        if _touched(joined, near) >= _touched(whole, near) + FEW:  # a face that is several meshes of its file
            whole = joined
    whole = _in_one_piece(whole, near)
    skin, others = _chosen_sheet(source, whole, near)
    skin = unfolded(_oriented(skin, forward))
    for sentence in skin.report:
        warn(sentence)
    return _surface(source, skin, others)


def _surface(source: pv.PolyData, skin: RepairedMesh, others: pv.PolyData | None) -> CleanSurface:
    """Return the repaired triangles with the data of the source at their points and corners."""
    used, triangles = np.unique(skin.triangles, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    kept = skin.origin[used]
    clean = with_data(source, triangles, kept, skin.corners[:, 0] // 3)
    clean.points = skin.points[used]
    if COLORS in clean.point_data:
        clean.point_data[COLORS] = np.array(clean.point_data[COLORS][:, :3])  # skin is opaque
        if not np.ptp(clean.point_data[COLORS], axis=0).any():
            del clean.point_data[COLORS]  # a single colour is that of the material, and of no use
    texture, of_points = corner_texture(source), clean.active_texture_coordinates
    if texture is not None:
        at_corners = texture.reshape(-1, 2)[skin.corners]
        if CORNERS in clean.cell_data or of_points is None or not np.array_equal(at_corners, of_points[triangles]):
            clean.cell_data[CORNERS] = at_corners.reshape(-1, 6)
    numbers = np.full_like(kept, -1) if skin.rebuilt else kept
    return CleanSurface(clean, triangles.astype(np.int32), np.array(clean.points), numbers, skin.report, others)


def _chosen_sheet(
    source: pv.PolyData, whole: RepairedMesh, near: np.ndarray | None
) -> tuple[RepairedMesh, pv.PolyData | None]:
    """Return the sheet that is the skin, and the other parts as they are in the source."""
    label = topology.sheets(whole.triangles)
    votes, reason = _votes(whole, label, near)
    apart = label != np.argmax(votes)
    skin = whole.only(~apart)
    if not apart.any():
        return skin, None
    counts = np.bincount(label[apart])
    counts = np.sort(counts[counts > 0])[::-1]
    listed = ", ".join(map(str, counts[:10])) + (", ..." if len(counts) > 10 else "")
    skin = skin.reported(
        f"Kept one of {len(counts) + 1} separate parts, {reason}, with {len(skin.triangles)} triangles; set apart "
        f"parts of {listed} triangles."
    )
    return skin, _others(source, whole.only(apart), label[apart])


def _votes(whole: RepairedMesh, label: np.ndarray, near: np.ndarray | None) -> tuple[np.ndarray, str]:
    """Votes for each sheet (the number of landmarks nearest to it, or its area), and the reason for the choice."""
    if near is None:
        return np.bincount(label, areas_doubled(whole.points, whole.triangles)), "the one with the largest area"
    votes = votes_of(whole.points, whole.triangles, label, near)
    return votes, f"nearest to {votes.max()} of {len(near)} landmarks"


def _in_one_piece(whole: RepairedMesh, near: np.ndarray | None) -> RepairedMesh:
    """Close gaps or reconstruct the mesh as far as needed for one sheet to be nearest to enough landmarks."""
    if near is None or len(near) < FEW or not (fault := _fault(whole, near)):
        return whole
    closed = closed_up(whole)
    if not _fault(closed, near):
        return closed
    rebuilt = reconstructed(whole, f"The surface under the landmarks {fault}")
    if left := _fault(rebuilt, near):
        raise MeshError(
            f"the surface under the landmarks {fault}; when it is reconstructed, it {left}. Make it one surface in a "
            "modeller, or check that the landmarks are those of this mesh."
        )
    return rebuilt


def _touched(whole: RepairedMesh, near: np.ndarray) -> int:
    """Return the number of landmarks to which no other sheet is nearer than the one that is nearest to most."""
    label = topology.sheets(whole.triangles)
    own = np.unique(whole.triangles[label == np.argmax(_votes(whole, label, near)[0])])
    least = cKDTree(whole.points[np.unique(whole.triangles)]).query(near)[0]
    return int((cKDTree(whole.points[own]).query(near)[0] <= (1.0 + ROUNDING) * least).sum())


def _fault(whole: RepairedMesh, near: np.ndarray) -> str:
    """The fault of the surface under the landmarks, in pieces or with only one side; empty if there is none."""
    label = topology.sheets(whole.triangles)
    votes, _ = _votes(whole, label, near)
    if votes.max() < IN_PIECES * len(near):
        return f"is in {np.count_nonzero(votes)} pieces"
    try:
        topology.oriented(whole.triangles[label == np.argmax(votes)])
    except MeshError:
        return "has only one side"
    return ""


def _others(source: pv.PolyData, apart: RepairedMesh, label: np.ndarray) -> pv.PolyData:
    """Triangles of the source that do not belong to the skin, with the numbers of their parts."""
    rows, first = np.unique(apart.corners[:, 0] // 3, return_index=True)
    kept, renumbered = np.unique(np.asarray(source.regular_faces)[rows], return_inverse=True)
    others = with_data(source, renumbered.reshape(-1, 3), kept, rows)
    others.point_data[SOURCE] = kept
    others.cell_data[PART] = np.unique(label[first], return_inverse=True)[1].ravel()
    return others


def _check_finite(points: np.ndarray, triangles: np.ndarray) -> None:
    broken = np.flatnonzero(~(np.abs(points) < LARGEST).all(axis=1))
    broken = broken[np.isin(broken, triangles)] if len(broken) else broken  # unused points do no harm
    if len(broken):
        raise MeshError(
            f"{len(broken)} of {len(points)} points are NaN, infinite or beyond {LARGEST:g}, the first is point "
            f"{broken[0]}: {points[broken[0]]}. "
            "Delete them in a modeller, or export the mesh again."
        )


def _oriented(skin: RepairedMesh, forward: np.ndarray | None) -> RepairedMesh:
    """Orient the triangles alike and outward."""
    alike = topology.oriented(skin.triangles)
    turned = (alike != skin.triangles).any(axis=1)
    if turned.any():
        skin = _turned(skin, turned).reported(
            f"Turned triangles that were oriented against their neighbours: {turned.sum()} of {len(turned)}."
        )
    if _enclosed_volume(skin.points, skin.triangles, forward) < 0:
        skin = _turned(skin, np.ones(len(turned), bool)).reported(
            "The surface was oriented inward; all its triangles were turned."
        )
    return skin


def _turned(skin: RepairedMesh, which: np.ndarray) -> RepairedMesh:
    """Reverse the orientation of some triangles."""
    triangles, corners = (np.where(which[:, None], a[:, [0, 2, 1]], a) for a in (skin.triangles, skin.corners))
    return replace(skin, triangles=triangles, corners=corners)


def _enclosed_volume(points: np.ndarray, triangles: np.ndarray, forward: np.ndarray | None) -> float:
    """Signed volume between the surface and an apex inside it; 0 if it is too small to tell.

    The apex is the centroid, moved far back along `forward`. For a closed surface it makes no difference; for an open
    one the volume grows with the part of the area vector that looks forward.
    """
    corners = points[triangles]
    areas = 0.5 * areas_doubled(points, triangles)
    apex = np.average(corners.mean(axis=1), axis=0, weights=areas)
    if forward is not None:
        apex = apex - np.asarray(forward) / np.linalg.norm(forward) * np.linalg.norm(np.ptp(corners, axis=(0, 1)))
    a, b, c = (corners[:, corner] - apex for corner in range(3))
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
    return volume if abs(volume) > 1e-6 * areas.sum() ** 1.5 else 0.0


# --- surfaces in pieces become one ----------------------------------------------------------------------------


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
