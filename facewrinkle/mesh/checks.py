"""Surfaces are checked and mended until the algorithms can rely on them."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree

from ..errors import LARGEST, FaceWrinkleWarning, MeshError, ParameterError
from ..geometry import topology
from .arrays import with_data
from .reading import read_surface


@dataclass(frozen=True)
class Surface:
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
    """

    mesh: pv.PolyData
    triangles: np.ndarray
    points: np.ndarray
    source_points: np.ndarray
    report: tuple[str, ...]


def prepare(mesh: object, near: np.ndarray | None = None, forward: np.ndarray | None = None) -> Surface:
    """A clean copy of a surface, on which the algorithms can rely.

    Degenerate and duplicate triangles are dropped, one component is chosen, the triangles are oriented alike
    and outward, and unused points are dropped. What changes the surface is reported.

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

    Returns
    -------
    Surface

    Raises
    ------
    MeshError
        If there are no points or faces; for points that are not finite; for edges with three or more
        triangles; for a surface that cannot be oriented, such as a Möbius strip.
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
    points = np.asarray(source.points)
    _check_finite(points)
    report: list[str] = []
    triangles = _without_degenerate(points, np.asarray(source.regular_faces), report)
    triangles = _one_component(points, triangles, near, report)
    _check_manifold(triangles)
    triangles = _oriented(points, triangles, forward, report)
    kept, renumbered = np.unique(triangles, return_inverse=True)
    for sentence in report:
        warnings.warn(sentence, FaceWrinkleWarning, stacklevel=2)
    clean = with_data(source, renumbered.reshape(-1, 3), kept)
    return Surface(
        mesh=clean,
        triangles=renumbered.reshape(-1, 3).astype(np.int32),
        points=np.array(clean.points),
        source_points=kept,
        report=tuple(report),
    )


def _vectors(name: str, values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != 3 or not np.isfinite(values).all() or not values.any():
        raise ParameterError(
            f"{name} must be finite vectors of three numbers that are not all zero, received {values}."
        )
    return values


def _check_finite(points: np.ndarray) -> None:
    broken = np.flatnonzero(~(np.abs(points) < LARGEST).all(axis=1))
    if len(broken):
        raise MeshError(
            f"{len(broken)} of {len(points)} points are NaN, infinite or beyond {LARGEST:g}, the first is point "
            f"{broken[0]}: {points[broken[0]]}. "
            "Delete them in a modeller, or export the mesh again."
        )


def _without_degenerate(points: np.ndarray, triangles: np.ndarray, report: list[str]) -> np.ndarray:
    """The triangles that have an area, each once."""
    corners = points[triangles]
    longest = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    has_area = doubled > 1e-10 * longest  # rounding leaves about 1e-16 of a triangle that has none
    if not has_area.all():
        report.append(f"Dropped degenerate triangles (no area): {np.sum(~has_area)} of {len(triangles)}.")
        triangles = triangles[has_area]
    _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    if len(first) < len(triangles):
        report.append(f"Dropped duplicate triangles: {len(triangles) - len(first)} of {len(triangles)}.")
        triangles = triangles[np.sort(first)]
    if not len(triangles):
        raise MeshError("all triangles are degenerate: none has an area. Export the mesh again.")
    return triangles


def _check_manifold(triangles: np.ndarray) -> None:
    crowded = topology.non_manifold_edges(triangles)
    if len(crowded):
        a, b = crowded[0]
        shared = int(((triangles == a).any(axis=1) & (triangles == b).any(axis=1)).sum())
        raise MeshError(
            f"an edge must have one or two triangles; {len(crowded)} edges have more, the one between points "
            f"{a} and {b} "
            f"has {shared}. Clean the mesh in a modeller, or with pymeshlab's "
            "meshing_repair_non_manifold_edges "
            "(pip install facewrinkle[remesh])."
        )


def _one_component(points: np.ndarray, triangles: np.ndarray, near: np.ndarray | None, report: list[str]) -> np.ndarray:
    """The triangles of the component that is nearest to most landmarks, or that has the largest area."""
    label = topology.components(triangles)
    counts = np.bincount(label)
    if len(counts) == 1:
        return triangles
    if near is None:
        votes = np.bincount(label, weights=_areas(points, triangles))
        reason = "the largest"
    else:
        used, first = np.unique(triangles, return_index=True)
        _, nearest = cKDTree(points[used]).query(near)
        votes = np.bincount(label[first[nearest] // 3], minlength=len(counts))
        reason = f"nearest to {votes.max()} of {len(near)} landmarks"
    chosen = int(np.argmax(votes))
    others = np.sort(np.delete(counts, chosen))[::-1]
    listed = ", ".join(map(str, others[:10])) + (", ..." if len(others) > 10 else "")
    report.append(
        f"Kept one of {len(counts)} separate parts, {reason}, with {counts[chosen]} triangles; left out "
        "parts of "
        f"{listed} triangles."
    )
    return triangles[label == chosen]


def _areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def _oriented(points: np.ndarray, triangles: np.ndarray, forward: np.ndarray | None, report: list[str]) -> np.ndarray:
    """The triangles, all oriented alike and outward."""
    alike = topology.oriented(triangles)
    turned = int((alike != triangles).any(axis=1).sum())
    if turned:
        report.append(f"Turned triangles that were oriented against their neighbours: {turned} of {len(triangles)}.")
    if _enclosed_volume(points, alike, forward) < 0:
        report.append("The surface was oriented inward; all its triangles were turned.")
        alike = alike[:, [0, 2, 1]]
    return alike


def _enclosed_volume(points: np.ndarray, triangles: np.ndarray, forward: np.ndarray | None) -> float:
    """The signed volume between the surface and an apex inside it; 0 where it is too small to tell.

    The apex is the centroid, moved far back along `forward`. For a closed surface it does not matter; for an
    open one the volume grows with the part of the area vector that looks forward.
    """
    corners = points[triangles]
    areas = _areas(points, triangles)
    apex = np.average(corners.mean(axis=1), axis=0, weights=areas)
    if forward is not None:
        apex = apex - forward / np.linalg.norm(forward) * np.linalg.norm(np.ptp(corners, axis=(0, 1)))
    a, b, c = (corners[:, corner] - apex for corner in range(3))
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
    return volume if abs(volume) > 1e-6 * areas.sum() ** 1.5 else 0.0
