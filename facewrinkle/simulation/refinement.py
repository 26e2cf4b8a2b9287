"""The refinement of a simulation: its settings, the level that a face needs, and which triangles to split."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..array_types import Array, BoolArray
from ..errors import ParameterError, check_range, check_whole, warn
from ..geometry import _mesh_kernels as kernels
from ..geometry.refinement import RedGreenForest
from ..layers.base import Displacement, Layer, SurfacePoints
from ..layers.patterns_on_skin.layer import PatternLayer

FINEST = 8
"""The most times that a triangle is ever split."""

LATE = 0.01
"""Share of triangles that splitting once does not make fine enough, from which on a motion is no longer followed with
one round of splitting per frame.
"""

RECENT = 4
"""Steps between taking back and splitting within which a base triangle counts as restless."""

STILL, AWAKE = 1e-4, 0.005
"""Movement of the skin in a step, mm, up to which a pose that is held is at rest, and beyond which it is no longer."""

ENOUGH_SPACING = 0.35
"""Distance of vertices that suffices for the default level, in half wavelengths: about three vertices in each."""


@dataclass(frozen=True)
class Refinement:
    """Settings for splitting triangles and taking them back.

    Attributes
    ----------
    gamma_c : float
        Threshold of Eq. 19: 0.03 is a bend of 14 degrees along an edge.
    max_level : int, optional
        The most times that a triangle is split; 0 turns refinement off. Default: as many as nine in ten muscles need
        for about three vertices per half cycle, and at least 1: 2 on the built-in head, 3 on one with twice its edges
        and on surfaces without muscles.
    samples : float
        Vertices per half cycle that a wrinkle needs across its folds (the paper's criterion is blind at 1 and 2); 0
        for the paper's alone, Eq. 19.
    hysteresis : float
        In (0, 1): triangles are taken back when the bend of their edges is below this share of the threshold, and edges
        twice as long would still be short enough, with this share to spare.
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

    gamma_c: float = 0.03
    max_level: int | None = None
    samples: float = 4.0
    hysteresis: float = 0.2
    coarsen: bool = True

    def __post_init__(self) -> None:
        check_range("gamma_c", self.gamma_c, 1e-9, 2.0)
        if self.max_level is not None:
            check_whole("max_level", self.max_level, 0, FINEST, "Each level has four times as many triangles.")
        if self.samples != 0.0:
            check_range("samples", self.samples, 1.0, 64.0, "Or give 0 for Eq. 19 alone.")
        check_range("hysteresis", self.hysteresis, 1e-9, 1.0 - 1e-9)


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
    corners = face.points[face.triangles]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return np.array([np.median(lengths[zone]) if zone.any() else 0.0 for zone in face.zones])


def levels_of_patterns(layers: Iterable[Layer], face: Face) -> list[tuple[str, int]]:
    """Return the names of the patterns among some layers, and the level that each needs."""
    return [(layer.name, layer.level_needed(face)) for layer in layers if isinstance(layer, PatternLayer)]


def default_level(face: Face, edges: Array, needed: int) -> int:
    """Return the level that nine in ten muscles, with edges (k,) in their regions, and, if possible, patterns need.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> default_level(face, typical_edges(face), needed=0), default_level(face, 4.0 * typical_edges(face), needed=0)
    (2, 4)
    """
    needed = min(needed, FINEST)
    if not face.muscles:
        return needed or 3
    cycles = np.array([muscle.fold_pattern.half_wavelength for muscle in face.muscles.values()])
    folding = np.isfinite(cycles) & (edges > 0.0)
    if not folding.any():
        return max(needed, 1)
    levels = np.log2(edges[folding] / (ENOUGH_SPACING * cycles[folding]))
    return int(np.clip(np.ceil(np.quantile(levels, 0.9)), max(needed, 1), max(needed, 4)))


def check_patterns(needed: Iterable[tuple[str, int]], level: int) -> None:
    """Warn of each pattern, given by name and needed level, that the mesh cannot carry well at a level.

    Patterns that need at least two levels more raise a ParameterError, unless refinement is off (level 0).
    """
    for name, own in needed:
        if own <= level:
            continue
        ask = f"max_level={own}, for " if own <= FINEST else ""
        remedy = f"Ask for {ask}fewer wrinkles, for a larger region, or begin with a finer mesh."
        if 0 < level < own - 1:
            raise ParameterError(
                f"the mesh is too coarse to carry the pattern {name}: its triangles would have to be split {own} "
                f"times, and max_level={level} is allowed. {remedy}"
            )
        warn(
            f"the mesh is too coarse to carry the pattern {name} well: its triangles should be split "
            f"{own} {'time' if own == 1 else 'times'}, and max_level={level} is allowed. {remedy}"
        )


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
    levels: npt.NDArray[np.integer],
    vertices: SurfacePoints,
    normals: Array,
    displacements: Sequence[Displacement],
) -> tuple[BoolArray, BoolArray, BoolArray, bool, Array]:
    """Mark the triangles (m,) to split and those (m,) to take back.

    Parameters
    ----------
    refinement : Refinement
    forest : RedGreenForest
    levels : ndarray of int, shape (m,)
        Levels of the present triangles.
    vertices : SurfacePoints
        All present vertices.
    normals : ndarray, shape (n, 3)
        Unit normals of the wrinkled surface.
    displacements : sequence of Displacement
        What all layers add.

    Returns
    -------
    split, fine : ndarray of bool, shape (m,)
        Triangles that are too coarse, and those that are finer than needed.
    active : ndarray of bool, shape (n,)
        Vertices at which a layer may displace the surface.
    late : bool
        True if splitting once is not enough for one in a hundred triangles: the motion has gone far since the last.
    largest : ndarray, shape (n,)
        The largest split criterion (Eq. 19) over the edges of each vertex.
    """
    triangles = forest.triangles
    n, m = len(normals), len(triangles)
    spacing, across, active, bends = _finest(displacements, n)
    spacing = spacing / refinement.samples if refinement.samples else np.full(n, np.inf)
    split, fine, largest = np.empty(m, bool), np.empty(m, bool), np.zeros(n)
    late = kernels.mark_triangles(
        triangles, levels, forest.max_level, normals, vertices.normals, vertices.points, spacing,
        across, active, bends, refinement.gamma_c, refinement.hysteresis, split, fine, largest,
    )  # fmt: skip
    return split, fine, active, late > LATE * m, largest


class Restless:
    """Base triangles whose triangles were split again right after they had been taken back: they keep them as long as a
    layer is active there. Else a pose that is held could go to and fro, where splitting itself changes the bends.

    Parameters
    ----------
    forest : RedGreenForest
    """

    def __init__(self, forest: RedGreenForest) -> None:
        self._roots = forest.root
        self._counts = np.bincount(self._roots)
        self._taken = np.full(len(self._counts), -RECENT - 1)
        self._kept = np.zeros(len(self._counts), bool)

    def follow(self, forest: RedGreenForest, step: int) -> None:
        """Take note of a change of the triangles."""
        self._roots = forest.root
        counts = np.bincount(self._roots, minlength=len(self._counts))
        self._kept |= (counts > self._counts) & (step - self._taken <= RECENT)
        self._taken[counts < self._counts] = step
        self._counts = counts

    def may_go(self, forest: RedGreenForest, fine: BoolArray, active: BoolArray) -> BoolArray:
        """Return which of the triangles (m,) that are finer than needed may be taken back; the marks are changed."""
        if not self._kept.any():
            return fine
        restless = self._kept[self._roots] & active[forest.triangles].any(axis=1)
        fine &= ~restless
        self._kept[:] = False
        self._kept[self._roots[restless]] = True
        return fine


class Hold:
    """Notices when a pose that is held has come to rest.

    Attributes
    ----------
    resting : bool
        The rates of the last step were those of the step before, and the skin hardly moved.

    Examples
    --------
    >>> hold, rates, points = Hold(), np.ones(3), np.zeros((5, 3))
    >>> [hold.begins(rates, points + shift) for shift in (0.0, 0.5, 0.5, 0.5)]
    [False, False, True, False]
    >>> hold.begins(0.5 * rates, points), hold.resting
    (False, False)
    """

    def __init__(self) -> None:
        self.resting = False
        self._rates, self._base = np.empty(0), np.empty((0, 3))

    def begins(self, rates: Array, base: Array) -> bool:
        """Tell whether a step with these rates, which led to base points (n0, 3) in mm, is the first at rest."""
        before, allowed = self.resting, AWAKE if self.resting else STILL
        held = len(base) == len(self._base) and np.array_equal(rates, self._rates)
        self.resting = held and bool(np.abs(base - self._base).max(initial=0.0) <= allowed)
        self._rates, self._base = rates.copy(), base.copy()
        return self.resting and not before

    def rest(self, rates: Array, base: Array) -> None:
        """Take note that a face rests with these rates at base points (n0, 3)."""
        self.resting, self._rates, self._base = True, rates.copy(), base.copy()


def _finest(displacements: Sequence[Displacement], n: int) -> tuple[Array, Array, BoolArray, BoolArray]:
    """Return the finest spacing that any layer needs at each vertex, its direction, and where any layer is active, and
    any that counts bends.
    """
    if len(displacements) == 1 and displacements[0].bends:
        own = displacements[0]
        return own.spacing, own.across, own.active, own.active
    spacing, across = np.full(n, np.inf), np.zeros((n, 3))
    active, bends = np.zeros(n, bool), np.zeros(n, bool)
    for own in displacements:
        kernels.take_finest(own.spacing, own.across, own.active, own.bends, spacing, across, active, bends)
    return spacing, across, active, bends
