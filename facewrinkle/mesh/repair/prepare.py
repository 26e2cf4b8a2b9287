"""Surfaces are checked and mended until the algorithms can rely on them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree

from ...errors import LARGEST, MeshError, ParameterError, warn
from ...geometry import topology
from ..arrays import COLORS, CORNERS, IMAGE, MOVED, PART, SOURCE, with_data
from ..formats.reading import read_surface
from .reconstruction import closed_up, reconstructed
from .self_intersections import resolved, self_intersection_report
from .topology_repair import RepairedMesh, areas_doubled, mended, unfolded

IN_PIECES, FEW = 0.5, 4
"""One sheet must be the nearest to this share of the landmarks, where there are so many."""


@dataclass(frozen=True)
class CleanSurface:
    """One connected, manifold, consistently oriented surface that faces outward.

    Attributes
    ----------
    mesh : pyvista.PolyData
        With the point data of the input.
    triangles : (m, 3) int32
    points : (n, 3) float64
    source_points : (n,) int
        The number that each point has in the input.
    report : tuple of str
        What was mended, one sentence each.
    others : pyvista.PolyData, optional
        The other parts of the input, as they are there; its cell data "part" number them, and its point data "source
        point" say which points of the input they have.

    Examples
    --------
    A sheet with a ball beside it; the sheet is larger:

    >>> import pyvista as pv
    >>> import warnings
    >>> with warnings.catch_warnings(action="ignore"):
    ...     surface = prepare(pv.Plane() + pv.Sphere(radius=0.1, center=(0, 0, 2)))
    >>> surface.triangles.shape, surface.others.n_cells
    ((200, 3), 1680)
    >>> surface.report
    ('Kept one of 2 separate parts, the largest, with 200 triangles; set apart parts of 1680 triangles.',)
    """

    mesh: pv.PolyData
    triangles: np.ndarray
    points: np.ndarray
    source_points: np.ndarray
    report: tuple[str, ...]
    others: pv.PolyData | None = None


def prepare(
    mesh: object,
    near: np.ndarray | None = None,
    forward: np.ndarray | None = None,
    resolve_self_intersections: bool = False,
) -> CleanSurface:
    """A clean copy of a surface, on which the algorithms can rely.

    Degenerate and duplicate triangles are dropped without tearing the surface, points that are split at seams are
    joined, edges with three triangles or more are cut, one component is chosen, the triangles are oriented alike and
    outward, those that lie turned over are laid flat, and unused points are dropped. Where the surface under the
    landmarks is in pieces or has only one side, small gaps are closed; if that is not enough, pymeshlab (extra
    `remesh`) reconstructs it. What changes the surface is reported. Places where it runs through itself are reported,
    too, and stay, for lips and lids of real faces do; unless they are to be resolved.

    Parameters
    ----------
    mesh : anything that `read_surface` takes
        Not changed.
    near : (k, 3) float, optional
        Landmarks. The component that is nearest to most of them is chosen; without them the one of the
        largest area.
    forward : (3,) float, optional
        The direction in which the face looks. The inside of the surface lies behind it. Without it, the
        inside is taken to be where the centroid is, which holds for closed surfaces and for masks that bulge
        outward.
    resolve_self_intersections : bool
        Smooth small places where the surface runs through itself, as much as it takes.

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
    near = None if near is None else _vectors("near", np.atleast_2d(near))
    forward = None if forward is None else _vectors("forward", np.atleast_2d(forward))[0]
    source = read_surface(mesh)
    points, faces = np.asarray(source.points), np.asarray(source.regular_faces)
    _check_finite(points, faces)
    moved = source.point_data.pop(MOVED, None)  # of a new object
    whole = _in_one_piece(mended(RepairedMesh.of(points, faces), moved), near)
    skin, others = _parted(source, whole, near)
    skin = _oriented(skin, forward)
    skin = unfolded(resolved(skin) if resolve_self_intersections else skin)
    for sentence in skin.report:
        warn(sentence)
    if sentence := self_intersection_report(
        skin.points, skin.triangles
    ):  # as the lips of many sound heads do: no warning
        skin = skin.reported(sentence)
    return _surface(source, skin, others)


def _surface(source: pv.PolyData, skin: RepairedMesh, others: pv.PolyData | None) -> CleanSurface:
    """The mended triangles with the data of the source at their points and corners."""
    used, renumbered = np.unique(skin.triangles, return_inverse=True)
    triangles = renumbered.reshape(-1, 3)
    kept = skin.origin[used]
    clean = with_data(source, triangles, kept)
    clean.points = skin.points[used]
    if COLORS in clean.point_data and not np.ptp(clean.point_data[COLORS], axis=0).any():
        del clean.point_data[COLORS]  # one colour is that of a material, and tells nothing
    if IMAGE in source.cell_data:
        clean.cell_data[IMAGE] = np.asarray(source.cell_data[IMAGE])[skin.corners[:, 0] // 3]
    faces = np.asarray(source.regular_faces)
    texture = source.active_texture_coordinates
    if CORNERS in source.cell_data:
        at_corners = np.asarray(source.cell_data[CORNERS], dtype=np.float64).reshape(-1, 2)[skin.corners]
        clean.cell_data[CORNERS] = at_corners.reshape(-1, 6)
    elif texture is not None:
        at_corners = np.asarray(texture, dtype=np.float64)[faces.ravel()[skin.corners]]
        if not np.array_equal(at_corners, np.asarray(texture)[kept][triangles]):
            clean.cell_data[CORNERS] = at_corners.reshape(-1, 6)
    return CleanSurface(clean, triangles.astype(np.int32), np.array(clean.points), kept, skin.report, others)


def _parted(
    source: pv.PolyData, whole: RepairedMesh, near: np.ndarray | None
) -> tuple[RepairedMesh, pv.PolyData | None]:
    """The sheet that is meant, and the other parts as they are in the source."""
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
    """How much speaks for each sheet: the landmarks that are nearest to it, or its area; and which it was, in words."""
    count = int(label.max()) + 1
    if near is None:
        return np.bincount(label, areas_doubled(whole.points, whole.triangles), count), "the largest"
    used, first = np.unique(whole.triangles, return_index=True)
    nearest = cKDTree(whole.points[used]).query(near)[1]
    votes = np.bincount(label[first[nearest] // 3], minlength=count)
    return votes, f"nearest to {votes.max()} of {len(near)} landmarks"


def _in_one_piece(whole: RepairedMesh, near: np.ndarray | None) -> RepairedMesh:
    """The mesh, joined as far as is needed for one sheet of it to be nearest to enough landmarks."""
    if near is None or len(near) < FEW or not (fault := _fault(whole, near)):
        return whole
    joined = closed_up(whole)
    if not _fault(joined, near):
        return joined
    joined = reconstructed(whole, f"The surface under the landmarks {fault}")
    if left := _fault(joined, near):
        raise MeshError(
            f"the surface under the landmarks {fault}; when it is reconstructed, it {left}. Make it one surface in a "
            "modeller, or check that the landmarks are those of this mesh."
        )
    return joined


def _fault(whole: RepairedMesh, near: np.ndarray) -> str:
    """What is wrong with the surface under the landmarks: in pieces, or without two sides."""
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
    """The triangles of the source that are none of the skin's, with the number of their part."""
    rows, first = np.unique(apart.corners[:, 0] // 3, return_index=True)
    kept, renumbered = np.unique(np.asarray(source.regular_faces)[rows], return_inverse=True)
    others = with_data(source, renumbered.reshape(-1, 3), kept)
    others.point_data[SOURCE] = kept
    if CORNERS in source.cell_data:
        others.cell_data[CORNERS] = np.asarray(source.cell_data[CORNERS])[rows]
    if IMAGE in source.cell_data:
        others.cell_data[IMAGE] = np.asarray(source.cell_data[IMAGE])[rows]
    others.cell_data[PART] = np.unique(label[first], return_inverse=True)[1].ravel()
    return others


def _vectors(name: str, values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != 3 or not np.isfinite(values).all() or not values.any():
        raise ParameterError(
            f"{name} must be finite vectors of three numbers that are not all zero, received {values}."
        )
    return values


def _check_finite(points: np.ndarray, triangles: np.ndarray) -> None:
    broken = np.flatnonzero(~(np.abs(points) < LARGEST).all(axis=1))
    broken = broken[np.isin(broken, triangles)] if len(broken) else broken  # loose points do no harm
    if len(broken):
        raise MeshError(
            f"{len(broken)} of {len(points)} points are NaN, infinite or beyond {LARGEST:g}, the first is point "
            f"{broken[0]}: {points[broken[0]]}. "
            "Delete them in a modeller, or export the mesh again."
        )


def _oriented(skin: RepairedMesh, forward: np.ndarray | None) -> RepairedMesh:
    """The triangles, all oriented alike and outward."""
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
    triangles, corners = (np.where(which[:, None], a[:, [0, 2, 1]], a) for a in (skin.triangles, skin.corners))
    return replace(skin, triangles=triangles, corners=corners)


def _enclosed_volume(points: np.ndarray, triangles: np.ndarray, forward: np.ndarray | None) -> float:
    """The signed volume between the surface and an apex inside it; 0 where it is too small to tell.

    The apex is the centroid, moved far back along `forward`. For a closed surface it does not matter; for an
    open one the volume grows with the part of the area vector that looks forward.
    """
    corners = points[triangles]
    areas = 0.5 * areas_doubled(points, triangles)
    apex = np.average(corners.mean(axis=1), axis=0, weights=areas)
    if forward is not None:
        apex = apex - forward / np.linalg.norm(forward) * np.linalg.norm(np.ptp(corners, axis=(0, 1)))
    a, b, c = (corners[:, corner] - apex for corner in range(3))
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
    return volume if abs(volume) > 1e-6 * areas.sum() ** 1.5 else 0.0
