"""Check and repair surfaces until the algorithms can rely on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..checks import vector, vectors
from ..errors import LARGEST, MeshError, ParameterError, warn
from ..geometry import double_areas, topology
from .arrays import COLORS, blended, has_colors
from .formats.reading import MeshLike, surface_in
from .repair import ROUNDING, RepairedMesh, mended, unfolded, votes_of
from .surface import Surface

CONNECT = (
    "Connect them, such as in MeshLab by a screened Poisson reconstruction, or check that the landmarks are those of "
    "this mesh."
)
"""What helps against pieces."""

FEW = 4
"""With fewer landmarks, a surface is never taken to be in pieces; and a further mesh of the file belongs to the face if
so many lie on it."""


def prepare(mesh: MeshLike, near: np.ndarray | None = None, forward: np.ndarray | None = None) -> Surface:
    """Return a clean copy of a surface on which the algorithms can rely.

    Degenerate and duplicate triangles are dropped without tearing the surface, points that are split at seams are
    merged within each mesh of a file, edges with three triangles or more are cut, one component is chosen, the
    triangles are oriented alike and outward, those that lie turned over are laid flat, and unused points are
    dropped. All changes are reported. Places where the surface runs through itself stay: lips and lids of real faces
    have such places.

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
    Surface
        One connected, manifold, consistently oriented surface that faces outward; its `source_points` are the numbers
        of its points in the input, its `others` the other parts of the input, unchanged.

    Raises
    ------
    MeshError
        If there are no points or faces; for points that are not finite; for a surface that cannot be oriented, such as
        a Möbius strip; for one that is in pieces under the landmarks.
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

    A sheet and a ball; the sheet is larger:

    >>> import warnings
    >>> with warnings.catch_warnings(action="ignore"):
    ...     surface = prepare(pv.Plane() + pv.Sphere(radius=0.1, center=(0, 0, 2)))
    >>> surface.triangles.shape, surface.others.triangles.shape
    ((200, 3), (1680, 3))
    >>> surface.report
    ('Kept one of 2 separate parts, the one with the largest area, with 200 triangles; set apart parts of 1680 ...',)
    """
    near = None if near is None else vectors("near", near)
    if forward is not None and not vector("forward", forward).any():
        raise ParameterError("forward must be a direction, received (0, 0, 0).")
    source = surface_in(mesh)
    _check_finite(source.points, source.triangles)
    moved, meshes = None if source.shapes is None else blended(source.shapes), source.meshes
    whole = mended(RepairedMesh.of(source.points, source.triangles), moved, meshes)
    if meshes.any() and near is not None:
        joined = mended(RepairedMesh.of(source.points, source.triangles), moved)
        if _touched(joined, near) >= _touched(whole, near) + FEW:  # a face that is several meshes of its file
            whole = joined
    skin, others = _chosen_sheet(source, whole, near)
    skin = unfolded(_oriented(skin, forward))
    for sentence in skin.report:
        warn(sentence)
    return _surface(source, skin, others)


def _surface(source: Surface, skin: RepairedMesh, others: Surface | None) -> Surface:
    """Return the repaired triangles with the data of the source at their points and corners."""
    used, triangles = np.unique(skin.triangles, return_inverse=True)
    clean = source.mapped(triangles.reshape(-1, 3).astype(np.int32), skin.origin[used], skin.corners[:, 0] // 3)
    data = dict(clean.point_data)
    if has_colors(data):
        data[COLORS] = data[COLORS][:, :3]  # skin is opaque
        if not np.ptp(data[COLORS], axis=0).any():
            del data[COLORS]  # a single color is that of the material, and of no use
    texture = None if source.texture is None else source.texture.reshape(-1, 2)[skin.corners]
    points = skin.points[used]
    return replace(clean, points=points, texture=texture, point_data=data, report=skin.report, others=others)


def _chosen_sheet(source: Surface, whole: RepairedMesh, near: np.ndarray | None) -> tuple[RepairedMesh, Surface | None]:
    """Return the sheet that is the skin, and the other parts as they are in the source."""
    label = topology.sheets(whole.triangles)
    votes, reason = _votes(whole, label, near)
    if near is not None and len(near) >= FEW and votes.max() < 0.5 * len(near):  # no sheet is the nearest to half
        raise MeshError(f"the surface under the landmarks is in {np.count_nonzero(votes)} pieces. {CONNECT}")
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
        return np.bincount(label, double_areas(whole.points, whole.triangles)), "the one with the largest area"
    votes = votes_of(whole.points, whole.triangles, label, near)
    return votes, f"nearest to {votes.max()} of {len(near)} landmarks"


def _touched(whole: RepairedMesh, near: np.ndarray) -> int:
    """Return the number of landmarks to which no other sheet is nearer than the one that is nearest to most."""
    label = topology.sheets(whole.triangles)
    own = np.unique(whole.triangles[label == np.argmax(_votes(whole, label, near)[0])])
    least = cKDTree(whole.points[np.unique(whole.triangles)]).query(near)[0]
    return int((cKDTree(whole.points[own]).query(near)[0] <= (1.0 + ROUNDING) * least).sum())


def _others(source: Surface, apart: RepairedMesh, label: np.ndarray) -> Surface:
    """Triangles of the source that do not belong to the skin, with the numbers of their parts."""
    rows, first = np.unique(apart.corners[:, 0] // 3, return_index=True)
    return replace(source.only(rows), sheet=np.unique(label[first], return_inverse=True)[1].ravel())


def _check_finite(points: np.ndarray, triangles: np.ndarray) -> None:
    broken = np.flatnonzero(~(np.abs(points) < LARGEST).all(axis=1))
    broken = broken[np.isin(broken, triangles)] if len(broken) else broken  # unused points do no harm
    if len(broken):
        raise MeshError(
            f"{len(broken)} of {len(points)} points are NaN, infinite or beyond {LARGEST:g}, the first is point "
            f"{broken[0]}: {points[broken[0]]}. "
            "Delete them in a modeling program, or export the mesh again."
        )


def _oriented(skin: RepairedMesh, forward: np.ndarray | None) -> RepairedMesh:
    """Orient the triangles alike and outward."""
    alike = topology.oriented(skin.triangles)
    turned = (alike != skin.triangles).any(axis=1)
    if turned.any():
        skin = _turned(skin, turned).reported(
            f"Turned triangles that were oriented against their neighbors: {turned.sum()} of {len(turned)}."
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
    areas = 0.5 * double_areas(points, triangles)
    apex = np.average(corners.mean(axis=1), axis=0, weights=areas)
    if forward is not None:
        apex = apex - np.asarray(forward) / np.linalg.norm(forward) * np.linalg.norm(np.ptp(corners, axis=(0, 1)))
    a, b, c = (corners[:, corner] - apex for corner in range(3))
    volume = float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
    return volume if abs(volume) > 1e-6 * areas.sum() ** 1.5 else 0.0
