"""Properties of all muscles, of the folds of the skin over them, and the triangles of a mesh that they fold."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, Self

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from ...array_types import Array, BoolArray
from ...errors import LARGEST, ParameterError, UnknownNameError, check_range, check_ranges, type_of, unknown_name
from ...geometry import equations, side_lengths, smoothstep

Fronts = Literal["straight", "round"]

FRONTS: tuple[Fronts, ...] = ("straight", "round")


def unknown_property(kind: str, name: str, known: Iterable[str]) -> UnknownNameError:
    """Return the error for an unknown property, which says what a symbol of the paper is called here.

    Examples
    --------
    >>> print(unknown_property("property of a muscle", "k0", ["count", "depth"]))
    unknown property of a muscle 'k0'. The k0 of the paper is called 'depth' here.
    """
    called = {  # symbols of Zhang, Sim and Tan
        "k0": "depth", "kappa": "depth", "n_w": "count", "nw": "count", "lambda_w": "start", "R": "radius",
        "phi": "max_angle", "mA": "attachment", "mI": "insertion", "Ls": "length", "Ws": "width", "o": "centre",
        "a": "semi_major", "b": "semi_minor", "rw": "inner", "r_w": "inner",
    }  # fmt: skip
    known = list(known)
    if called.get(name) in known:
        return UnknownNameError(f"unknown {kind} {name!r}. The {name} of the paper is called {called[name]!r} here.")
    return unknown_name(kind, name, known)


def checked_size(name: str, value: float) -> float:
    """Return a length of at least 0 that is finite; a ParameterError for another."""
    size = check_range(name, value, 0.0, np.inf)
    if not size < LARGEST:
        raise ParameterError(f"{name} must be a finite length, received {size:g}.")
    return size


def checked_points(points: npt.ArrayLike) -> Array:
    """Return points (n, 3); a ParameterError for another shape."""
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ParameterError(f"points must have the shape (n, 3), received {array.shape}.")
    return array


def within(points: Array, centre: Array, radius: float) -> npt.NDArray[np.int64]:
    """Return the numbers of the points (n, 3) in a ball, with those next to its border."""
    x, y, z = points.T
    square = (x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2
    return np.flatnonzero(square <= ((1.0 + 1e-6) * radius) ** 2)


@dataclass(frozen=True, eq=False)
class Wrinkles:
    """Folds of the skin over a muscle.

    Not every kind of fold has all of these: those of a sphincter have no `start`, a :class:`Crease` has `depth`,
    `alpha` and `taper` alone, and only a linear muscle has `fronts`. Others must be left out there.

    Parameters
    ----------
    count : int
        Number of furrows nw across the wrinkling region.
    start : float
        lambda_w in [0, 1): the start of the region along the muscle.
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
        The furrows of a linear muscle run straight across its central fiber, as in the paper, or as arcs about its
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
        check_ranges(self, depth=(0.0, 1e6), core=(0.0, 1.0))
        for taper in self.tapers:
            check_range("taper", taper, 0.0, 2.0)
        if self.fronts not in FRONTS:
            raise ParameterError(f"fronts must be one of {', '.join(FRONTS)}, received {self.fronts!r}.")

    @property
    def tapers(self) -> tuple[float, float]:
        """`taper` at the start and at the end of the region."""
        try:
            first, last = np.broadcast_to(self.taper, np.shape(self.taper) or 2).tolist()
        except (TypeError, ValueError):
            raise ParameterError(f"taper must be one number or two, received {self.taper!r}.") from None
        return first, last


WRINKLES = tuple(each.name for each in dataclasses.fields(Wrinkles))
"""Names of the parameters of wrinkles."""

USUAL = Wrinkles()
"""Wrinkles of muscles for which none are given."""


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
    >>> other.strength, other.wrinkles.depth
    (1.5, 2.0)
    """

    ignored: ClassVar[Collection[str]] = ()
    """Names of :class:`Wrinkles` that the folds of this kind of muscle do not have."""
    folding: ClassVar[str] = ""
    """Why not."""

    wrinkles: Wrinkles = field(default=USUAL, kw_only=True)
    """The folds of the skin. If there are `folds`, these are theirs."""
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
    across its fibers. None, as in the paper: over the muscle and across its fibers.
    """

    def __post_init__(self) -> None:
        most = (0.0, 1e6)
        check_ranges(self, strength=most, swell=most, modiolus=most, closing=most, normal_share=(0.0, 1.0))
        if self.folds is None:
            given = (name for name in self.ignored if repr(getattr(self.wrinkles, name)) != repr(getattr(USUAL, name)))
            self._check_folds(given)
        elif self.wrinkles not in (USUAL, self.folds.wrinkles):
            raise ParameterError(
                "the wrinkles of a muscle with folds are those of its folds; received both. Give them to the folds "
                "alone, or change them with replaced()."
            )
        else:
            self._set(wrinkles=self.folds.wrinkles)

    def _check_folds(self, names: Iterable[str]) -> None:
        """Raise a ParameterError if one of some names of wrinkles is ignored by this kind of folds."""
        known = [each for each in WRINKLES if each not in self.ignored]
        others = f" It has {', '.join(known[:-1])} and {known[-1]}." if known else ""
        for name in sorted(set(names) - set(known)):
            raise ParameterError(f"{type_of(self)} has no {name}: {self.folding}.{others}")

    def _set(self, **values: object) -> None:
        """Replace values that were given by those that were made of them, of a muscle that is frozen otherwise."""
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def fold_pattern(self) -> Muscle:
        """The region on which this muscle's wrinkles are laid: `folds`, or the muscle itself."""
        return self.folds or self

    def coordinates(self, points: npt.ArrayLike) -> tuple[Array, Array]:
        """The muscle's two coordinates of (n, 3) points; see :meth:`located`."""
        return self.located(points)[:2]

    def wrinkling_region(self, points: npt.ArrayLike) -> BoolArray:
        """True (n,) for points (n, 3) in the wrinkling region; see :meth:`located`."""
        return self.located(points)[2]

    def located(self, points: npt.ArrayLike) -> tuple[Array, Array, BoolArray]:
        """The two coordinates of (n, 3) points, and whether they lie in the wrinkling region."""
        n = len(checked_points(points))
        return np.zeros(n), np.zeros(n), np.zeros(n, dtype=bool)

    @property
    def reach(self) -> tuple[Array, float]:
        """Centre (3,) and radius of a ball that holds the wrinkling region, and beyond which :meth:`force` and
        :meth:`bunched` are 0; infinite if none is known.
        """
        acts = any(getattr(type(self), name) is not getattr(Muscle, name) for name in ("located", "force", "bunched"))
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

    def same_as(self, other: Muscle) -> bool:
        """Tell whether another muscle has the same kind and, to the last bit, the same values."""
        return _same(self, other)

    def replaced(self, **changes: Any) -> Self:
        """Return a copy with some values changed.

        Names of :class:`Wrinkles` (count, depth, alpha, ...) are accepted too: what ``muscle.wrinkles`` tells is what
        they change, on the `folds` if there are any.

        Raises
        ------
        UnknownNameError
            For a name that no muscle has. For symbols of Zhang, Sim and Tan, it tells what they are called here.
        ParameterError
            For a value that folds of this kind do not have.

        Examples
        --------
        The fold of a frown is a :class:`Crease`, one line. Without it the muscle folds the skin across its fibers, as
        in the paper, and its lines can be counted:

        >>> import facewrinkle as fw
        >>> muscle = fw.default_face().muscles["corrugator_l"]
        >>> muscle.replaced(depth=2.0 * muscle.wrinkles.depth).wrinkles.depth
        3.6
        >>> muscle.replaced(folds=None, count=4).wrinkles.count
        4
        """
        own = [each.name for each in dataclasses.fields(self)]
        for name in changes:
            if name not in (*own, *WRINKLES):
                raise unknown_property("property of a muscle", name, (*own, *WRINKLES))
        inner = {name: changes.pop(name) for name in WRINKLES if name in changes}
        before, folds = changes.get("folds") or self, changes.pop("folds", self.folds)
        pattern = folds or self
        pattern._check_folds(inner)
        kept = {name: getattr(before.wrinkles, name) for name in WRINKLES if name not in pattern.ignored}
        wrinkles = dataclasses.replace(changes.pop("wrinkles", Wrinkles(**kept)), **inner)
        folds = folds and dataclasses.replace(folds, wrinkles=wrinkles)
        return dataclasses.replace(self, **changes, folds=folds, wrinkles=wrinkles)

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


def _same(one: Any, other: Any) -> bool:
    if not isinstance(one, Muscle | Wrinkles):
        return np.array_equal(one, other)
    names = [each.name for each in dataclasses.fields(one)]
    return type(one) is type(other) and all(_same(getattr(one, name), getattr(other, name)) for name in names)


def zones(muscles: Sequence[Muscle], points: Array, triangles: npt.NDArray[np.int32]) -> BoolArray:
    """True (k, m) for the triangles that the wrinkling region of each muscle may touch.

    These are the ones with a corner in it, or, where the muscle reaches less than two edges far, another place; and the
    ring around them.

    Examples
    --------
    >>> from facewrinkle.anatomy.muscles import LinearMuscle
    >>> points = np.array([[0.0, 20, 0], [1, 20, 0], [0, 21, 0], [90, 0, 0], [91, 0, 0], [90, 1, 0]])
    >>> muscle = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=40.0)
    >>> zones([muscle], points, np.array([[0, 1, 2], [3, 4, 5]], np.int32)).tolist()
    [[True, False]]
    """
    begins, shape = 3 * np.arange(len(triangles) + 1), (len(triangles), len(points))
    corners = csr_array((np.ones(triangles.size, bool), triangles.ravel(), begins), shape=shape)
    inside = np.zeros((len(points), len(muscles)), bool)
    between = np.zeros((len(triangles), len(muscles)), bool)
    longest = side_lengths(points[triangles]).max(axis=1)
    # Places of a large triangle that are looked at, by their shares of its corners.
    shares = np.array([(i, j, 8 - i - j) for i in range(9) for j in range(9 - i)]) / 8.0
    for k, muscle in enumerate(muscles):
        near = within(points, *muscle.reach)
        inside[near, k] = muscle.wrinkling_region(points[near])
        centre, reach = muscle.reach
        large = np.flatnonzero((longest > 0.5 * reach) & (reach > 0.0))
        large = large[np.linalg.norm(points[triangles[large, 0]] - centre, axis=1) < reach + longest[large]]
        places = (shares @ points[triangles[large]]).reshape(-1, 3)
        between[large, k] = muscle.wrinkling_region(places).reshape(-1, len(shares)).any(axis=1)
    touched = corners @ csr_array(inside) + csr_array(between)
    return np.asarray((corners @ (corners.T @ touched)).T.toarray())
