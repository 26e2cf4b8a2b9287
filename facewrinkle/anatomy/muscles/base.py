"""Properties of all muscles, of the folds of the skin over them, and the triangles of a mesh that they fold."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, Self

import numpy as np
import numpy.typing as npt

from ...array_types import Array, BoolArray
from ...errors import ParameterError, check_range, unknown_name
from ...geometry import equations
from ...geometry.interpolation import smoothstep

Fronts = Literal["straight", "round"]

FRONTS: tuple[Fronts, ...] = ("straight", "round")


def checked_points(points: npt.ArrayLike) -> Array:
    """Return points (n, 3); a ParameterError for another shape."""
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ParameterError(f"points must have the shape (n, 3), received {array.shape}.")
    return array


def unit(vectors: Array) -> Array:
    """Unit vectors; zero where the length is zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)


def within(points: Array, centre: Array, radius: float) -> npt.NDArray[np.int64]:
    """Return the numbers of the points (n, 3) in a ball, with those next to its border."""
    x, y, z = points.T
    square = (x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2
    return np.flatnonzero(square <= ((1.0 + 1e-6) * radius) ** 2)


@dataclass(frozen=True, eq=False)
class Wrinkles:
    """Folds of the skin over a muscle.

    Parameters
    ----------
    count : int
        Number of furrows nw across the wrinkling region.
    start : float
        lambda_w in [0, 1): the start of the region along the muscle. Not used by sphincters.
    depth : float
        kappa, the furrow depth factor k0 at full contraction, mm. From bulge to furrow a wrinkle measures
        ``k0 2^alpha sin(pi epsilon / 2)``.
    alpha : float
        Shape exponent, >= 0: 1 is soft, 4 very sharp.
    core : float
        In [0, 1]: share of the half width (or of half the ring, for a sphincter) without lateral attenuation.
    ends : {"continuous", "paper"}
        See :func:`facewrinkle.geometry.equations.phase`.
    falloff : {"paper", "smoothstep"}
        See :func:`facewrinkle.geometry.equations.attenuation`.
    fronts : {"straight", "round"}
        The furrows of a linear muscle run straight across its central fibre, as in the paper, or as arcs about its
        attachment, everywhere at right angles to the measured compression.
    taper : float or tuple of float
        In [0, 2], one number, or two for start and end: the distance from the ends of the region over which furrows
        grow shallower towards them, in halves of its length. 0 as in the paper: all are alike.
    waves : bool
        True for lines that differ from person to person, which :class:`facewrinkle.WaveFolds` draws as waves.

    Examples
    --------
    >>> Wrinkles(count=4, depth=0.7).alpha
    2.0
    """

    count: int = 3
    start: float = 0.2
    depth: float = 0.6
    alpha: float = 2.0
    core: float = 0.5
    ends: equations.Ends = "continuous"
    falloff: equations.Falloff = "paper"
    fronts: Fronts = "straight"
    taper: float | tuple[float, float] = 0.0
    waves: bool = False

    def __post_init__(self) -> None:
        equations.half_cycle(1.0, self.start, self.count)
        equations.phase(0.0, 0.0, 1.0, self.alpha, self.ends)
        equations.attenuation(0.0, self.falloff)
        check_range("depth", self.depth, 0.0, 1e6)
        check_range("core", self.core, 0.0, 1.0)
        for taper in self.tapers:
            check_range("taper", taper, 0.0, 2.0)
        if self.fronts not in FRONTS:
            raise ParameterError(f"fronts must be one of {', '.join(FRONTS)}, received {self.fronts!r}.")

    @property
    def tapers(self) -> tuple[float, float]:
        """`taper` at the start and at the end of the region."""
        if isinstance(self.taper, float | int):
            return self.taper, self.taper
        try:
            first, last = self.taper
        except (TypeError, ValueError):
            raise ParameterError(f"taper must be one number or two, received {self.taper!r}.") from None
        return first, last


@dataclass(frozen=True, eq=False)
class Muscle:
    """Base class of all muscles. By itself it neither pulls the skin nor folds it: :class:`LinearMuscle`,
    :class:`SheetMuscle` and :class:`SphincterMuscle` do; the others move a bone, a lid, an eye or the tongue.

    Examples
    --------
    A muscle of a face, stronger, with deeper furrows:

    >>> import facewrinkle as fw
    >>> muscle = fw.default_face().muscles["zygomaticus_major_l"]
    >>> other = muscle.replaced(strength=1.5, depth=2.0)
    >>> other.strength, other.fold_pattern.wrinkles.depth
    (1.5, 2.0)
    """

    wrinkles: Wrinkles = field(default_factory=Wrinkles, kw_only=True)
    strength: float = field(default=1.0, kw_only=True)
    """Force at full contraction, relative to that of the other muscles."""
    normal_share: float = field(default=1.0, kw_only=True)
    """Share of the pull along the skin's normal that reaches the skin."""
    swell: float = field(default=0.0, kw_only=True)
    """Outward push on the skin, by the flesh that the muscle bunches up, relative to its pull."""
    modiolus: float = field(default=0.0, kw_only=True)
    """Pull inwards on the modiolus, the knot of muscle beside the corner of the mouth, relative to the pull there."""
    closing: float = field(default=0.0, kw_only=True)
    """Pressure with which the muscle closes the lips, relative to its pull."""
    folds: Muscle | None = field(default=None, kw_only=True)
    """The muscle-like region on which the wrinkles are laid, if the skin folds elsewhere than over the muscle, or not
    across its fibres. None, as in the paper: over the muscle and across its fibres.
    """

    def _check_common(self) -> None:
        for name in ("strength", "swell", "modiolus", "closing"):
            check_range(name, getattr(self, name), 0.0, 1e6)
        check_range("normal_share", self.normal_share, 0.0, 1.0)

    def _set(self, **values: object) -> None:
        """Replace values that were given by those that were made of them, of a muscle that is frozen otherwise."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def fold_pattern(self) -> Muscle:
        """The region on which this muscle's wrinkles are laid: `folds`, or the muscle itself."""
        return self.folds or self

    def coordinates(self, points: npt.ArrayLike) -> tuple[Array, Array]:
        """The muscle's two coordinates of (n, 3) points."""
        n = len(checked_points(points))
        return np.zeros(n), np.zeros(n)

    def wrinkling_region(self, points: npt.ArrayLike) -> BoolArray:
        """True (n,) for points (n, 3) in the wrinkling region."""
        return np.zeros(len(checked_points(points)), dtype=bool)

    @property
    def reach(self) -> tuple[Array, float]:
        """Centre (3,) and radius of a ball that holds the wrinkling region, and beyond which :meth:`force` and
        :meth:`bunched` are 0; infinite if none is known.
        """
        acts = any(
            getattr(type(self), name) is not getattr(Muscle, name) for name in ("wrinkling_region", "force", "bunched")
        )
        return np.zeros(3), np.inf if acts else 0.0

    def envelope(self, points: npt.ArrayLike) -> Array:
        """The lateral attenuation At of (n, 3) points; exactly 0 outside the wrinkling region."""
        return np.zeros(len(checked_points(points)))

    def cover(self, points: npt.ArrayLike) -> Array:
        """Share (n,) of the skin at (n, 3) points that these folds take up."""
        return self.envelope(points)

    def unit_amplitude(self, points: npt.ArrayLike) -> Array:
        """``H At`` at k0 = 1 for (n, 3) points; exactly 0 outside the wrinkling region (Eq. 3)."""
        fade = self.envelope(points)
        return np.where(fade > 0.0, self.height(points) * fade, 0.0)

    def height(self, points: npt.ArrayLike, blunt: float = 0.0) -> Array:
        """H at k0 = 1, periodic along the muscle; `blunt` as in :func:`facewrinkle.geometry.equations.shape`."""
        return np.zeros(len(checked_points(points)))

    def half_cycles(self, points: npt.ArrayLike) -> Array:
        """Half cycle u at (n, 3) points, as a length."""
        return np.full(len(checked_points(points)), self.half_wavelength)

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """Unit directions (n, 3) across the folds, along which compression is measured."""
        return np.zeros_like(checked_points(points))

    def force(self, points: npt.ArrayLike) -> Array:
        """Pull (n, 3) at full contraction and strength 1; 0 outside the area of influence."""
        return np.zeros_like(checked_points(points))

    def bunched(self, points: npt.ArrayLike) -> Array:
        """Flesh that is bunched up under (n, 3) points at full contraction, in [0, 1]."""
        return np.zeros(len(checked_points(points)))

    @property
    def half_wavelength(self) -> float:
        """Half cycle u as a length (for a sphincter: along its outer border, where it is longest); infinite without
        folds.
        """
        return float("inf")

    def replaced(self, **changes: object) -> Self:
        """Return a copy with some values changed.

        Names of :class:`Wrinkles` (count, depth, alpha, ...) are accepted too; they change the wrinkles of `folds`, if
        there are any, otherwise of the muscle itself.
        """
        own, of_wrinkles = ([f.name for f in dataclasses.fields(kind)] for kind in (self, Wrinkles))
        for name in changes:
            if name not in (*own, *of_wrinkles):
                raise unknown_name("property of a muscle", name, (*own, *of_wrinkles))
        inner = {k: changes.pop(k) for k in list(changes) if k in of_wrinkles}
        if inner and self.folds is not None:
            changes["folds"] = self.folds.replaced(**inner)
        elif inner:
            changes["wrinkles"] = dataclasses.replace(self.wrinkles, **inner)  # type: ignore[arg-type]
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]

    def _tapered(self, place: Array) -> Array:
        """Share of the depth at `place` in the wrinkling region, from 0 to 1 along the muscle."""
        share = np.ones_like(place)
        for taper, away in zip(self.wrinkles.tapers, (place, 1.0 - place), strict=True):
            if taper > 0.0:
                share = np.minimum(share, smoothstep(away / (0.5 * taper)))
        return share

    def _profile(self, distance: Array, start: float, u: float, blunt: float) -> Array:
        """H at k0 = 1 of points at `distance` along the muscle."""
        style = self.wrinkles
        w = equations.phase(distance, start, u, style.alpha, style.ends)
        return equations.shape(w, u, 1.0, style.alpha, blunt)


def zones(muscles: Iterable[Muscle], points: Array, triangles: npt.NDArray[np.int32]) -> BoolArray:
    """True (k, m) for the triangles that the wrinkling region of each muscle may touch.

    These are the ones with a corner, an edge's midpoint or the centroid in it, and the ring around them.

    Examples
    --------
    >>> from facewrinkle.anatomy.muscles import LinearMuscle
    >>> points = np.array([[0.0, 20, 0], [1, 20, 0], [0, 21, 0], [90, 0, 0], [91, 0, 0], [90, 1, 0]])
    >>> muscle = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=40.0)
    >>> zones([muscle], points, np.array([[0, 1, 2], [3, 4, 5]], np.int32)).tolist()
    [[True, False]]
    """
    corners = points[triangles]
    centres = corners.mean(axis=1)
    sizes = np.sqrt(((corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1, initial=0.0))
    between = 0.5 * (corners + np.roll(corners, 1, axis=1))
    places = np.concatenate([corners, between, centres[:, None]], axis=1)
    out = np.zeros((0, len(triangles)), bool)
    for muscle in muscles:
        middle, reach = muscle.reach
        away = ((centres - middle) ** 2).sum(axis=1)
        near = np.flatnonzero(away <= (1.0 + 1e-9) * (reach + sizes) ** 2)
        touched = muscle.wrinkling_region(places[near].reshape(-1, 3)).reshape(-1, 7).any(axis=1)
        ring = np.zeros(len(points), bool)
        ring[triangles[near[touched]]] = True
        out = np.vstack([out, ring[triangles].any(axis=1)])
    return out
