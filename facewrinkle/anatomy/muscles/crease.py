"""Creases: folds along a curve through given points, steps of flesh that hang over with age."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from ...array_types import Array, BoolArray
from ...checks import finite, vector, vectors
from ...errors import ParameterError, check_positive, check_range, check_ranges
from ...geometry import compiled, smoothstep, unit
from .base import Muscle, checked_points, checked_size

LINE, WORN = 0.6, 0.7
"""Widths, relative to that of a step: of the line where its skin is bound, and of the old flesh that hangs over it."""

FADING = 0.7
"""Share of its depth that a fold of the old has lost at its end, where its tapers differ by 1: flesh hangs most where
the shorter one is."""


@dataclass(frozen=True, eq=False)
class Crease(Muscle):
    """A region of folds along a curve, such as the nasolabial fold: the furrow lies where the skin is bound to what is
    below it, and the loose skin on one side of it rolls over it. It does not pull.

    It is a step, rounded and without a far wall that one would see; in the old, it is steeper: the flesh hangs over.

    Parameters
    ----------
    path : (3, 3) array_like
        Start of the furrow, a point that it runs through, and its end.
    crest : (3,) array_like
        Direction from the furrow towards the crest of the fold; the side on which the skin bulges.
    width : float
        Width of the region across the furrow, > 0.
    worn : float
        In [0, 1], from a gentle step of flesh to one that hangs over: :class:`facewrinkle.Creases` sets it by the age.
    span : pair of float
        The part of the path, between 0 and 1, along which the skin folds: several muscles may fold parts of one line.
    thickness : float, optional
        How far in front of and behind the plane of chord and `crest` it reaches; by default 0.3 of the chord.
    variety : float
        In [0, 1]: how much people differ, and left from right; see :meth:`of_person`. 0: all are alike.

    Raises
    ------
    ParameterError
        If the points do not make a path, or a length is not positive.

    Notes
    -----
    In the plane of the chord from start to end (length c) and the direction to the crest, the furrow is the parabola
    ``f(x) = h x (c - x)`` through the three points. Points (x, y) have the coordinates ``lambda = x / c`` and, across,
    ``q = (y - f) / sqrt(1 + f'^2)``, the distance from the furrow up to the second order of f'.

    H is a furrow and the broad crest that its skin makes on one side of it. At `worn` = w, let a be a quarter of the
    width times 1 - 0.3 w, b = 3 a, c three eighths of the width, and F the furrow ``(1 - |s|)^(1 + alpha)`` averaged
    over r = 0.3 to either side and 1 deep::

        H(q) = 2^alpha (beta t (1 - t)^2 - F((1 + r) s)) / (1 + 4 beta / 27),  t = q / b,  s = q / a (q > 0) or q / c,

    each term being 0 outside of (0, b) and (-c, a), where beta makes the integral 0. The crest is highest at q = a, and
    from bulge to furrow it is 2^alpha as in all wrinkles. Along the furrow act `taper` and, if that at the
    end is longer by d, the factor ``1 - 0.7 w d m``, where m goes from 0 at the start of the `span` to 1 at its end.

    Examples
    --------
    A straight furrow whose crest is on the right:

    >>> crease = Crease([(0, 40, 0), (0, 20, 0), (0, 0, 0)], crest=(1, 0, 0), width=16.0)
    >>> along, across = crease.coordinates([[0.0, 10.0, 0.0], [4.0, 10.0, 0.0]])
    >>> along.tolist(), across.tolist()
    ([0.75, 0.75], [0.0, 0.25])
    """

    ignored = frozenset({"count", "start", "core", "ends", "falloff", "fronts", "waves"})
    folding = "it folds one line along its path; replaced(folds=None) lets a muscle fold the skin across its fibers"

    path: Array
    crest: Array
    width: float
    span: tuple[float, float] = (0.0, 1.0)
    thickness: float = 0.0
    variety: float = 0.0
    worn: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        path = vectors("path", self.path)
        if path.shape != (3, 3):
            raise ParameterError(f"path must be three points, received an array of shape {path.shape}.")
        path.setflags(write=False)
        crest, chord = vector("crest", self.crest), path[2] - path[0]
        length = float(np.linalg.norm(chord))
        if not np.linalg.norm(np.cross(chord, crest)) > 1e-6 * length * np.linalg.norm(crest):
            raise ParameterError("crest must cross the line from the start to the end of the path.")
        if not 0.0 < (path[1] - path[0]) @ chord < length**2:
            raise ParameterError("the second point of the path must lie between the first and the third.")
        width = check_positive("width", self.width)
        check_ranges(self, variety=(0.0, 1.0), worn=(0.0, 1.0))
        thickness = checked_size("thickness", self.thickness) or 0.3 * length
        span = finite("span", self.span)
        if span.shape != (2,) or not 0.0 <= span[0] < span[1] <= 1.0:
            raise ParameterError(f"span must be two numbers that rise between 0 and 1, received {self.span!r}.")
        self._set(path=path, crest=crest, span=tuple(span.tolist()), width=width, thickness=thickness)

    @cached_property
    def _axes(self) -> tuple[float, Array, Array, Array]:
        """Length of the chord, its direction, the one towards the crest, and the plane's normal."""
        chord = self.path[2] - self.path[0]
        along = unit(chord)
        aside = unit(self.crest - (self.crest @ along) * along)
        return float(np.linalg.norm(chord)), along, aside, np.cross(along, aside)

    @cached_property
    def _bow(self) -> float:
        """h of the parabola."""
        length, along, aside, _ = self._axes
        middle = self.path[1] - self.path[0]
        x = float(middle @ along)
        return float(middle @ aside) / (x * (length - x))

    def _plane(self, points: npt.ArrayLike) -> tuple[Array, Array, Array, Array]:
        """x, q, the slope f' and the distance from the plane."""
        places = np.ascontiguousarray(checked_points(points))
        x, q, slope, away = np.empty((4, len(places)))
        _in_plane(places, self.path[0], *self._axes, self._bow, x, q, slope, away)
        return x, q, slope, away

    @property
    def _furrow(self) -> float:
        """a, half the width of the furrow; the crest reaches three times as far."""
        return 0.25 * self.width * (1.0 - (1.0 - WORN) * self.worn)

    @property
    def _far(self) -> float:
        """c, how far the furrow reaches on the side without a crest."""
        return 0.375 * self.width

    def located(self, points: npt.ArrayLike) -> tuple[Array, Array, BoolArray]:
        """lambda, the place along the furrow, and q over the width, positive towards the crest, of (n, 3) points; and
        True where lambda is within the span, and they are within the width and the thickness.
        """
        x, q, _, away = self._plane(points)
        place, across = x / self._axes[0], (q <= 3.0 * self._furrow) & (q >= -self._far)
        inside = (place >= self.span[0]) & (place <= self.span[1]) & across & (away <= self.thickness)
        return place, q / self.width, inside

    def of_person(self, rng: np.random.Generator) -> Self:
        """Return the crease of a person: its depth times ``1 + variety r``, and ``variety r / 2`` of its width as a
        line towards the crest or away from it, each with a random number r in [-1, 1].

        Examples
        --------
        >>> crease = Crease([(0, 40, 0), (0, 20, 0), (0, 0, 0)], crest=(1, 0, 0), width=16.0, variety=0.5)
        >>> person = crease.of_person(np.random.default_rng(0))
        >>> round(person.wrinkles.depth, 2), person.path[0].round(2).tolist()
        (0.68, [-1.11, 40.0, 0.0])
        """
        deeper, aside = (self.variety * rng.uniform(-1.0, 1.0, 2)).tolist()
        path = self.path + 0.5 * aside * LINE * self.width * self._axes[2]
        return self.replaced(path=path, depth=(1.0 + deeper) * self.wrinkles.depth)

    def points_at(self, along: npt.ArrayLike, across: npt.ArrayLike) -> Array:
        """Return the points (n, 3), in the plane of the path, at `along` (lambda) and `across` (in widths)."""
        length, forward, aside, _ = self._axes
        x, q = length * np.ravel(along), self.width * np.ravel(across)
        slope = self._bow * (length - 2.0 * x)
        y = self._bow * x * (length - x) + q * np.sqrt(1.0 + slope**2)
        return np.asarray(self.path[0] + x[:, None] * forward + y[:, None] * aside)

    @property
    def reach(self) -> tuple[Array, float]:
        """About the middle of the chord, up to the corners of the box that holds the region."""
        length, along, _, _ = self._axes
        rise = abs(self._bow) * (0.5 * length) ** 2
        steep = np.hypot(1.0, self._bow * length)
        half = 0.5 * length, rise + steep * self.width, self.thickness
        return self.path[0] + 0.5 * length * along, float(np.linalg.norm(half))

    def envelope(self, points: npt.ArrayLike) -> Array:
        """At: the taper towards both ends, and the fading of what is worn towards the second."""
        along, _, inside = self.located(points)
        share = (along - self.span[0]) / (self.span[1] - self.span[0])
        first, last = self.wrinkles.tapers
        left = 1.0 - FADING * self.worn * max(last - first, 0.0) * share
        return np.where(inside, left * self._tapered(share), 0.0)

    def cover(self, points: npt.ArrayLike) -> Array:
        """Share (n,) of the skin that this fold takes up: all of it at the furrow, none at the borders of the line."""
        q = self._plane(points)[1] / (0.25 * LINE * self.width)
        return self.envelope(points) * (1.0 - smoothstep(np.where(q > 0.0, q / 3.0, -q)))

    def height(self, points: npt.ArrayLike, blunt: float = 0.0) -> Array:
        """H, a furrow and its crest; the furrow is averaged over `blunt` of its half cycle to either side at least."""
        rounded = max(check_range("blunt", blunt, 0.0, 1.0), 0.3)
        q, alpha = self._plane(points)[1], self.wrinkles.alpha
        t = np.clip(q / (3.0 * self._furrow), 0.0, 1.0)
        s = (1.0 + rounded) * q / np.where(q > 0.0, self._furrow, self._far)
        deepest = float(_averaged(np.zeros(1), alpha, rounded)[0])
        taken = (1.0 + self._far / self._furrow) / ((2.0 + alpha) * (1.0 + rounded) * deepest)
        furrow = _averaged(s, alpha, rounded) / deepest
        beta = 4.0 * taken
        return np.asarray(2.0**alpha * (beta * t * (1.0 - t) ** 2 - furrow) / (1.0 + 4.0 * beta / 27.0))

    def loose_share(self, points: npt.ArrayLike) -> Array:
        """Share (n,) in which points lie on the side of the crest, where skin is loose: 0 up to three eighths of the
        width of the line before the furrow, 1 from an eighth of it beyond.
        """
        return smoothstep(2.0 * self._plane(points)[1] / (LINE * self.width) + 0.75)

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """Unit directions across the furrow, towards the crest: those of the gradient of q."""
        _, q, slope, _ = self._plane(points)
        _, along, aside, _ = self._axes
        # q = (y - f) / S with S^2 = 1 + f'^2: S dq/dx = -f' - q f' f'' / S, S dq/dy = 1.
        bend = -2.0 * self._bow
        down = -slope * (1.0 + q * bend / np.sqrt(1.0 + slope**2))
        return unit(down[:, None] * along + aside)

    @property
    def half_wavelength(self) -> float:
        """Half the width, as worn: furrow and crest make one cycle."""
        return 2.0 * self._furrow

    def half_cycles(self, points: npt.ArrayLike) -> Array:
        """From the bottom of the furrow to the top of the crest, for (n, 3) points: half as much."""
        return np.full(len(checked_points(points)), self._furrow)


@compiled
def _in_plane(points, start, length, along, aside, normal, bow, x, q, slope, away):
    """Write what `Crease._plane` returns. What it is for a point does not depend on which others there are."""
    for i in range(len(points)):
        a, b, c = points[i, 0] - start[0], points[i, 1] - start[1], points[i, 2] - start[2]
        x[i] = a * along[0] + b * along[1] + c * along[2]
        slope[i] = bow * (length - 2.0 * x[i])
        y = a * aside[0] + b * aside[1] + c * aside[2]
        q[i] = (y - bow * x[i] * (length - x[i])) / np.sqrt(1.0 + slope[i] * slope[i])
        away[i] = abs(a * normal[0] + b * normal[1] + c * normal[2])


@compiled
def _averaged(q, alpha, width):
    """``(1 - |q|)^(1 + alpha)``, 0 beyond 1, averaged over a width to either side."""
    out = np.empty_like(q)
    for i in range(len(q)):
        out[i] = (_dug(q[i] + width, alpha) - _dug(q[i] - width, alpha)) / (2.0 * width)
    return out


@compiled(inline="always")
def _dug(q, alpha):
    """Integral from 0 to q of ``(1 - |q|)^(1 + alpha)``, which is 0 beyond 1."""
    return np.sign(q) * (1.0 - max(1.0 - abs(q), 0.0) ** (2.0 + alpha)) / (2.0 + alpha)
