"""The refinement of a simulation: its settings, the level that a face needs, and which triangles to split."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..anatomy import Face
from ..array_types import Array, BoolArray
from ..errors import ParameterError, check_range, check_whole
from ..geometry import RedGreenForest, compiled, side_lengths, split_criterion
from ..layers.base import FINEST, Displacement, SurfacePoints

BENT = 0.03
"""Usual threshold of Eq. 19: a bend of 14 degrees along an edge."""


@dataclass(frozen=True, kw_only=True)
class Refinement:
    """Settings for splitting triangles and taking them back.

    Attributes
    ----------
    gamma_c : float, optional
        Split edges that bend by more than this threshold of Eq. 19, too: 0.03 is a bend of 14 degrees. Their triangles
        merge only where no layer is active any more. Default: 0.03 with ``folds="paper"`` and with ``samples=0``.
    max_level : int, optional
        The most times that a triangle is split; 0 turns refinement off. Default: as many as nine in ten muscles need
        for about three vertices per half cycle, and at least 1: 2 on the built-in head, 3 on one with twice its edges
        and on surfaces without muscles.
    samples : float
        Vertices per half cycle that a wrinkle needs across its folds (the paper's criterion is blind at 1 and 2); 0
        for Eq. 19 alone.
    coarsen : bool
        Take back triangles that are finer than needed. Without, the mesh only grows: vertices keep their numbers from
        frame to frame, and new ones are appended.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), fw.Refinement(max_level=0))
    >>> sim.express("surprise")
    >>> {frame.n_cells for frame in sim.run(10)}
    {4517}
    """

    gamma_c: float | None = None
    max_level: int | None = None
    samples: float = 4.0
    coarsen: bool = True

    def __post_init__(self) -> None:
        if self.gamma_c is not None:
            check_range("gamma_c", self.gamma_c, 1e-9, 2.0)
        if self.max_level is not None:
            check_whole("max_level", self.max_level, 0, FINEST, "Each level has four times as many triangles.")
        if self.samples != 0.0:
            check_range("samples", self.samples, 1.0, 64.0, "Or give 0 for Eq. 19 alone.")


PRINTED = Refinement(gamma_c=0.01, samples=0)
"""For wrinkles as printed: Eq. 19 alone, with one threshold at which it splits all of the paper's expressions."""


# --- the level --------------------------------------------------------------------------------------


def typical_edges(face: Face) -> Array:
    """Return the median edge (k,) of the base mesh in the wrinkling region of each muscle, in the unit of the mesh.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> typical_edges(face).shape == (len(face.muscles),)
    True
    """
    lengths = side_lengths(face.points[face.triangles])
    return np.array([np.median(lengths[zone]) if zone.any() else 0.0 for zone in face.zones])


def default_level(face: Face, edges: Array) -> int:
    """Return the level that nine in ten muscles, with edges (k,) in their regions, need; 0 without muscles.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> default_level(face, typical_edges(face)), default_level(face, 4.0 * typical_edges(face))
    (2, 4)
    """
    cycles = np.array([muscle.fold_pattern.half_wavelength for muscle in face.muscles.values()])
    folding = np.isfinite(cycles) & (edges > 0.0)
    if not folding.any():
        return int(len(cycles) > 0)
    levels = np.log2(edges[folding] / (0.35 * cycles[folding]))  # about three vertices in each half wavelength
    return int(np.clip(np.ceil(np.quantile(levels, 0.9)), 1, 4))


def check_wavelength(face: Face, muscle: str, edge: float, level: int) -> None:
    """Raise a ParameterError if the wrinkles of a muscle are finer than the edges of the mesh at the highest level."""
    half = face.muscles[muscle].fold_pattern.half_wavelength
    finest = edge / 2.0**level
    if half < finest:
        own = level + int(np.ceil(np.log2(finest / half)))
        remedy = "Ask for fewer wrinkles" + (f", or for max_level={own}." if own <= FINEST else ".")
        raise ParameterError(
            f"the wrinkles of {muscle} are too fine: half a wavelength of {half * face.unit:.3g} mm, "
            f"but with max_level={level} vertices are {finest * face.unit:.3g} mm apart. {remedy}"
        )


# --- which triangles --------------------------------------------------------------------------------


def mark(
    refinement: Refinement,
    forest: RedGreenForest,
    vertices: SurfacePoints,
    normals: Array,
    displacements: Sequence[Displacement],
) -> tuple[BoolArray, bool, Array]:
    """Mark the nodes of a forest (k,) that are to be split.

    Parameters
    ----------
    refinement : Refinement
    forest : RedGreenForest
    vertices : SurfacePoints
        All present vertices.
    normals : ndarray, shape (n, 3)
        Unit normals of the wrinkled surface.
    displacements : sequence of Displacement
        What all layers add.

    Returns
    -------
    wanted : ndarray of bool, shape (k,)
        See :meth:`facewrinkle.geometry.refinement.RedGreenForest.adapt`.
    late : bool
        True if splitting once is not enough for one in a hundred triangles: the motion has gone far since the last.
    largest : ndarray, shape (n,)
        The largest split criterion (Eq. 19) over the edges of each vertex.
    """
    n = len(normals)
    spacing, across, active = np.full(n, np.inf), np.zeros((n, 3)), np.zeros(n, bool)
    for own in displacements:  # of several layers the finest counts
        finer = np.flatnonzero(own.active & (own.spacing < spacing))
        spacing[finer], across[finer] = own.spacing[finer], own.across[finer]
        active |= own.active
    bent, largest = _bends(forest.triangles, normals, vertices.normals, active)
    need = spacing / refinement.samples if refinement.samples else np.full(n, np.inf)
    excess = _excesses(forest.nodes, vertices.points, need, across)
    wanted = excess > 1.0
    late = (excess[forest.leaf] > 2.0) & (forest.level < forest.max_level)
    if refinement.gamma_c is not None:
        split = np.ones(len(wanted), bool)
        split[forest.leaf] = False
        wanted |= split & active[forest.nodes].any(axis=1)
        wanted[forest.leaf[bent > refinement.gamma_c]] = True
    return wanted, bool(late.mean() > 0.01), largest


@compiled
def _excesses(triangles, points, need, across):
    """The longest edge (k,) of each triangle across the folds, relative to the spacing (n,) that its ends need."""
    steps, out = np.zeros_like(across), np.zeros(len(triangles))
    for v in range(len(need)):
        if need[v] < np.inf:
            for axis in range(3):
                steps[v, axis] = across[v, axis] / need[v]
    for f in range(len(triangles)):
        a, b, c = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        for i, j in ((a, b), (b, c), (c, a)):
            x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            first = abs(x * steps[i, 0] + y * steps[i, 1] + z * steps[i, 2])
            second = abs(x * steps[j, 0] + y * steps[j, 1] + z * steps[j, 2])
            out[f] = max(out[f], first, second)
    return out


@compiled
def _bends(triangles, normals, rest_normals, active):
    """The largest bend, Eq. 19, over the edges of each triangle (m,) and vertex (n,), where any end is active.

    The denominator is bounded, for rest normals that are nearly orthogonal.
    """
    out, largest = np.zeros(len(triangles)), np.zeros(len(normals))
    for f in range(len(triangles)):
        a, b, c = np.uint32(triangles[f, 0]), np.uint32(triangles[f, 1]), np.uint32(triangles[f, 2])
        for i, j in ((a, b), (b, c), (c, a)):
            if active[i] or active[j]:
                rest = rest_normals[i, 0] * rest_normals[j, 0]
                rest += rest_normals[i, 1] * rest_normals[j, 1] + rest_normals[i, 2] * rest_normals[j, 2]
                now = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2]
                gamma = split_criterion(rest, now)
                out[f] = max(out[f], gamma)
                largest[i] = max(largest[i], gamma)
                largest[j] = max(largest[j], gamma)
    return out, largest
