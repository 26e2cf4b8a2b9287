"""Repair of the connectivity of triangle meshes, on plain arrays, with a report; points move as little as possible.

A mesh here is its points and triangles (m, 3), and for each corner the number of the corner of the source that it comes
from, counted over all triangles: these numbers lead back to the data of points and corners.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..array_types import Array, BoolArray, IntArray
from ..errors import MeshError
from ..geometry import double_areas, topology, triangle_normals, unit

ROUNDING = 4.0 * float(np.finfo(np.float32).eps)
"""Positions that differ by less than this share of the largest coordinate are the same: files have single precision."""


@dataclass(frozen=True)
class RepairedMesh:
    """Points and triangles, and the points and corners of the source that they come from.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int64, shape (m, 3)
    corners : ndarray of int64, shape (m, 3)
        The corner of the source that each corner comes from, ``3 * triangle + side``.
    origin : ndarray of int64, shape (n,)
        The point of the source that each point comes from.
    report : tuple of str
        One sentence for each repair.
    """

    points: Array
    triangles: IntArray
    corners: IntArray
    origin: IntArray
    report: tuple[str, ...] = field(default=())

    @classmethod
    def of(cls, points: Array, triangles: NDArray[np.integer]) -> RepairedMesh:
        """Return a source mesh as it is, before any repair."""
        faces = np.array(triangles, dtype=np.int64, order="C")
        return cls(np.array(points, order="C"), faces, np.arange(faces.size).reshape(-1, 3), np.arange(len(points)))

    def only(self, kept: BoolArray | IntArray) -> RepairedMesh:
        """Return the mesh with only some of its triangles."""
        return replace(self, triangles=self.triangles[kept], corners=self.corners[kept])

    def reported(self, sentence: str) -> RepairedMesh:
        """Return the mesh with one more sentence in the report."""
        return replace(self, report=(*self.report, sentence))


def mended(mesh: RepairedMesh, moved: Array | None = None, meshes: IntArray | None = None) -> RepairedMesh:
    """Return the mesh without degenerate or duplicate triangles, stitched at seams and without non-manifold edges.

    `moved` (n, 3) says how the points of the source move in an animation: borders that part are no seams. `meshes` (m,)
    numbers the meshes of the source by its triangles: borders of two of them are no seams either.

    Raises
    ------
    MeshError
        If no triangle has an area.
    """
    single = without_duplicates(mesh)
    whole = stitched(without_slivers(single), moved, meshes)
    return without_non_manifold_edges(single if whole is single else without_duplicates(whole))


def votes_of(points: Array, triangles: IntArray, label: IntArray, places: Array) -> IntArray:
    """The number of places (n, 3) whose nearest points belong to the triangles of each label (m,)."""
    used, first = np.unique(triangles, return_index=True)
    nearest = cKDTree(points[used]).query(places)[1]
    return np.bincount(label[first[nearest] // 3], minlength=int(label.max()) + 1)


def degenerate(points: Array, triangles: IntArray) -> BoolArray:
    """True (m,) for triangles without area: twice that is at most 1e-10 of their longest side squared, while rounding
    errors are about 1e-16 of it.
    """
    corners = points[triangles]
    longest = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    return np.asarray(~(double_areas(points, triangles) > 1e-10 * longest))


# --- duplicate and degenerate triangles -------------------------------------------------------------


def without_duplicates(mesh: RepairedMesh) -> RepairedMesh:
    """Keep each triangle once, by the positions of its corners, so that two sheets back to back become one."""
    number = np.unique(mesh.points, axis=0, return_inverse=True)[1].ravel()
    places = number[mesh.triangles]
    first = np.unique(np.sort(places, axis=1), axis=0, return_index=True)[1]
    count = len(mesh.triangles)
    flat = (places == np.roll(places, 1, axis=1)).any(axis=1)  # these are not duplicates of each other
    kept = flat
    kept[first] = True
    if kept.all():
        return mesh
    return mesh.only(kept).reported(f"Dropped duplicate triangles: {count - kept.sum()} of {count}.")


def without_slivers(mesh: RepairedMesh) -> RepairedMesh:
    """Drop the triangles without area, without tearing the mesh.

    Such a triangle may hold its neighbors together. If two of its corners coincide, they become one point; if a corner
    lies on the opposite side, the neighbor there is split at it.
    """
    flat = degenerate(mesh.points, mesh.triangles)
    if not flat.any():
        return mesh
    count, dropped = len(mesh.triangles), int(flat.sum())
    mesh = _collapsed(mesh, flat)
    mesh = _flipped(mesh)
    mesh = mesh.only(~degenerate(mesh.points, mesh.triangles))
    if not len(mesh.triangles):
        raise MeshError("all triangles are degenerate: none has an area. Export the mesh again.")
    return mesh.reported(f"Dropped degenerate triangles (no area): {dropped} of {count}.")


def _collapsed(mesh: RepairedMesh, flat: BoolArray) -> RepairedMesh:
    """Merge corners of triangles without area that coincide."""
    sides = mesh.triangles[flat][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    length = np.linalg.norm(mesh.points[sides[:, 0]] - mesh.points[sides[:, 1]], axis=1)
    same = length <= ROUNDING * 1e-3 * np.abs(mesh.points[sides]).max(axis=(1, 2))
    return _merged_points(mesh, sides[same])


def _merged_points(mesh: RepairedMesh, pairs: IntArray) -> RepairedMesh:
    """Merge pairs (k, 2) of points into the first; triangles that collapse are dropped."""
    if not len(pairs):
        return mesh
    label = topology.connected(pairs, len(mesh.points))
    first = np.unique(label, return_index=True)[1][label]
    triangles = first[mesh.triangles]
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return replace(mesh, triangles=triangles).only(whole)


def _flipped(mesh: RepairedMesh) -> RepairedMesh:
    """Flip the longest side of triangles without area: the corner on it splits the neighbor at this side."""
    for _ in range(4):  # neighbors of slivers may be slivers
        flat = np.flatnonzero(degenerate(mesh.points, mesh.triangles))
        flat = flat[(mesh.triangles[flat] != np.roll(mesh.triangles[flat], 1, axis=1)).all(axis=1)]
        if not len(flat):
            break
        triangles, corners = mesh.triangles.copy(), mesh.corners.copy()
        _, sides = topology.unique_edges(triangles)
        offsets, around = topology.incident_triangles(sides)
        touched: set[int] = set()
        for t in flat.tolist():
            ends = mesh.points[triangles[t]]
            k = int(np.argmax(np.linalg.norm(ends - np.roll(ends, -1, axis=0), axis=1)))  # the longest side
            on = [around[offsets[e] : offsets[e + 1]].tolist() for e in sides[t]]
            opposite = [u for u in on[k] if u != t]
            holds = max(len(on[(k + 1) % 3]), len(on[(k + 2) % 3])) > 1
            if len(opposite) != 1 or not holds or t in touched or opposite[0] in touched:
                continue
            u = opposite[0]
            touched |= {t, u}
            a, b, c = (int(triangles[t, (k + i) % 3]) for i in range(3))
            tip = corners[t, (k + 2) % 3]
            first, second = (np.where(triangles[u] == end, c, triangles[u]) for end in (a, b))
            tips = [np.where(triangles[u] == end, tip, corners[u]) for end in (a, b)]
            triangles[t], corners[t], triangles[u], corners[u] = first, tips[0], second, tips[1]
        if not touched:
            break
        mesh = replace(mesh, triangles=triangles, corners=corners)
    return mesh


# --- seams ------------------------------------------------------------------------------------------


def stitched(mesh: RepairedMesh, moved: Array | None = None, meshes: IntArray | None = None) -> RepairedMesh:
    """Stitch the mesh where two of its borders run along the same positions, as at seams of texture or shading.

    Points alone are not merged, as lids and lips may touch; nor are borders that part in an animation (`moved`), nor
    those of two of the `meshes` (m,) of the source.
    """
    edges, sides = topology.unique_edges(mesh.triangles)
    single = np.bincount(sides.ravel()) == 1
    border = edges[single].astype(np.int64)
    if not len(border):
        return mesh
    where = mesh.points if moved is None else np.hstack([mesh.points, moved[mesh.origin]])
    ends = _near_places(where, np.unique(border))[border]
    turned = ends[:, 0] > ends[:, 1]
    border[turned], ends[turned] = border[turned][:, ::-1], ends[turned][:, ::-1]
    corner = np.empty(len(edges), np.int64)
    corner[sides.ravel()] = np.repeat(mesh.corners[:, 0], 3)  # of a triangle at each edge
    owner = np.zeros(len(border), np.int64) if meshes is None else meshes[corner[single] // 3]
    rows = np.column_stack([ends, owner])
    _, first, group = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    pairs = np.stack([border[first[group.ravel()]], border], axis=2)[ends[:, 0] != ends[:, 1]].reshape(-1, 2)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    if not len(pairs):
        return mesh
    before = len(np.unique(mesh.triangles))
    mesh = _merged_points(mesh, pairs)
    merged = before - len(np.unique(mesh.triangles))
    return mesh.reported(f"Joined points at which the mesh was split along seams: {merged} of {before}.")


def _near_places(points: Array, which: IntArray) -> IntArray:
    """Number the positions of the points `which`, with equal numbers where they coincide but for rounding; (n,), -1 for
    other points.
    """
    place = np.full(len(points), -1)
    radius = ROUNDING * float(np.abs(points[which]).max())
    pairs = cKDTree(points[which]).query_pairs(radius, output_type="ndarray")
    place[which] = topology.connected(pairs, len(which))
    return place


# --- non-manifold edges ---------------------------------------------------------------------------------


def without_non_manifold_edges(mesh: RepairedMesh) -> RepairedMesh:
    """Cut the mesh open along edges with three triangles or more, of which two stay together.

    Those two are of the same sheet if possible, and meet at the flattest angle. Points on cuts are duplicated. If the
    other triangles are connected to both points of the edge by another way, a cut does not separate them, and they are
    dropped.
    """
    edges, sides = topology.unique_edges(mesh.triangles)
    non_manifold = np.flatnonzero(np.bincount(sides.ravel()) > 2)
    if not len(non_manifold):
        return mesh
    cut = _cut(mesh, edges, sides, non_manifold)
    cut = cut.reported(f"Cut edges that had three or more triangles: {len(non_manifold)} of {len(edges)}.")
    count = len(cut.triangles)
    while len(extra := _in_excess(cut)):
        cut = cut.only(np.delete(np.arange(len(cut.triangles)), extra))
    dropped = count - len(cut.triangles)
    return cut.reported(f"Dropped triangles on edges that two others share: {dropped} of {count}.") if dropped else cut


def _cut(
    mesh: RepairedMesh, edges: NDArray[np.int32], sides: NDArray[np.int32], non_manifold: IntArray
) -> RepairedMesh:
    """Connect the triangles only at edges with two triangles, and by chosen pairs at non-manifold edges."""
    valence = np.bincount(sides.ravel())
    offsets, around = topology.incident_triangles(sides)
    inner = np.flatnonzero(valence == 2)
    pairs = np.stack([inner, around[offsets[inner]], around[offsets[inner] + 1]], axis=1).astype(np.int64)
    sheet = topology.connected(pairs[:, 1:], len(mesh.triangles))
    chosen = [
        (int(e), t, u)
        for e in non_manifold
        for t, u in _continued(mesh, edges[e], around[offsets[e] : offsets[e + 1]], sheet)
    ]
    edge, one, other = np.concatenate([pairs, np.array(chosen, dtype=np.int64).reshape(-1, 3)]).T
    corners = [
        [3 * t + np.argmax(mesh.triangles[t] == edges[edge, end][:, None], axis=1) for t in (one, other)]
        for end in (0, 1)
    ]
    label = topology.connected(np.concatenate(corners, axis=1).T, mesh.triangles.size)
    # Each class of corners is a point; the first class of each point keeps its number, the others get new ones.
    vertex = mesh.triangles.ravel()[np.unique(label, return_index=True)[1]]
    first = np.unique(vertex, return_index=True)[1]
    number = np.full(len(vertex), -1)
    number[first] = vertex[first]
    new = np.flatnonzero(number < 0)
    number[new] = len(mesh.points) + np.arange(len(new))
    points, origin = (np.concatenate([values, values[vertex[new]]]) for values in (mesh.points, mesh.origin))
    return replace(mesh, points=points, triangles=number[label].reshape(-1, 3), origin=origin)


def _continued(
    mesh: RepairedMesh, edge: NDArray[np.integer], around: NDArray[np.integer], sheet: NDArray[np.integer]
) -> list[tuple[int, int]]:
    """Pairs of the triangles around an edge that continue each other: of one sheet first, then the flattest."""
    a, b = mesh.points[edge[0]], mesh.points[edge[1]]
    along = (b - a) / np.linalg.norm(b - a)
    tips = np.array([mesh.points[next(v for v in mesh.triangles[t] if v not in edge)] for t in around]) - a
    out = unit(tips - np.outer(tips @ along, along))
    bend = out @ out.T
    order = sorted(
        (sheet[around[i]] != sheet[around[j]], bend[i, j], i, j) for i in range(len(around)) for j in range(i)
    )
    taken: set[int] = set()
    chosen = []
    for _, cosine, i, j in order:
        if cosine < 0.5 and not {i, j} & taken:  # not two that lie on top of each other
            taken |= {i, j}
            chosen.append((int(around[i]), int(around[j])))
    return chosen


def _in_excess(mesh: RepairedMesh) -> IntArray:
    """Triangles beyond two at an edge: first those with the most border sides, then the smallest."""
    _, sides = topology.unique_edges(mesh.triangles)
    valence = np.bincount(sides.ravel())
    non_manifold = np.flatnonzero(valence > 2)
    if not len(non_manifold):
        return np.zeros(0, np.int64)
    offsets, around = topology.incident_triangles(sides)
    loose = (valence[sides] == 1).sum(axis=1)
    size = double_areas(mesh.points, mesh.triangles)
    out: set[int] = set()
    for e in non_manifold:
        here = [t for t in around[offsets[e] : offsets[e + 1]].tolist() if t not in out]
        out |= set(sorted(here, key=lambda t: (-loose[t], size[t]))[: len(here) - 2])
    return np.array(sorted(out), dtype=np.int64)


# --- triangles turned over ------------------------------------------------------------------------------


def turned_over(points: Array, triangles: NDArray[np.integer]) -> BoolArray:
    """True (m,) for triangles that lie back to back with at least two neighbors; the mesh must be oriented."""
    normals = triangle_normals(points, triangles)
    _, sides = topology.unique_edges(triangles)
    offsets, around = topology.incident_triangles(sides)
    inner = np.flatnonzero(np.diff(offsets) == 2)
    t, u = around[offsets[inner]], around[offsets[inner] + 1]
    folded = (normals[t] * normals[u]).sum(axis=1) < -0.9  # they lie back to back
    return np.asarray(np.bincount(np.concatenate([t[folded], u[folded]]), minlength=len(triangles)) >= 2)


def unfolded(mesh: RepairedMesh) -> RepairedMesh:
    """Lay triangles that are turned over flat: their points move to the mean of their neighbors.

    Points on borders stay where they are; so do triangles that have no others.
    """
    over = turned_over(mesh.points, mesh.triangles)
    if not over.any():
        return mesh
    count, points = int(over.sum()), mesh.points.copy()
    start, ring = topology.vertex_rings(mesh.triangles, len(points))
    edges, sides = topology.unique_edges(mesh.triangles)
    border = np.zeros(len(points), bool)
    border[edges[np.bincount(sides.ravel()) == 1]] = True
    for _ in range(8):
        moved = np.unique(mesh.triangles[over])
        moved = moved[~border[moved]]
        if not len(moved):
            break
        points[moved] = [points[ring[start[v] : start[v + 1]]].mean(axis=0) for v in moved]
        over = turned_over(points, mesh.triangles)
    laid = count - int(over.sum())
    if laid <= 0 or degenerate(points, mesh.triangles).any():
        return mesh
    return replace(mesh, points=points).reported(f"Laid triangles flat that were turned over: {laid} of {count}.")
