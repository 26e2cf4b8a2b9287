"""Muscles that pull the skin and fold it: linear ones (Eqs. 1-2), sheets (12-13), triangles
and sphincters (14-18).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ...array_types import Array, BoolArray
from ...checks import vector, vectors
from ...errors import ParameterError, check_positive, check_range, check_ranges
from ...geometry import equations, unit
from .base import Muscle, checked_points, checked_size
from .crease import Crease

BELLY = (0.22, 0.7)
"""Place along a linear muscle at which flesh is bunched up most, and its extent about this, relative to R; captured
smiles bulge there.
"""


def _longitudinal(along: Array, insertion: float) -> Array:
    """Theta1: rises to 1 at the insertion, falls to 0 at lambda = 1; 0 outside [0, 1]."""
    rising = np.cos((1.0 - along / insertion) * (0.5 * np.pi))
    if insertion < 1.0:
        falling = np.cos((along - insertion) / (1.0 - insertion) * (0.5 * np.pi))
        rising = np.where(along <= insertion, rising, falling)
    return np.where((along > 0.0) & (along <= 1.0), rising, 0.0)


def _lateral(across: Array) -> Array:
    """Theta2: 1 on the central fiber, 0 from the border on."""
    return np.where(across < 1.0, np.cos(across * (0.5 * np.pi)), 0.0)


def _belly(points: npt.ArrayLike, origin: Array, way: Array) -> Array:
    """Flesh bunched up (n,), in [0, 1], by fibers that run from an origin along a way (3,) as long as the muscle: most
    at the belly, none beyond its extent; see `BELLY`.
    """
    at, reach = BELLY
    offset = checked_points(points) - origin - at * way
    return np.asarray(np.maximum(1.0 - (offset**2).sum(axis=1) / (reach**2 * (way @ way)), 0.0) ** 2)


@dataclass(frozen=True, eq=False)
class LinearMuscle(Muscle):
    """A muscle that pulls a cone of skin towards one point on the bone (Eqs. 1-2).

    Parameters
    ----------
    attachment, insertion : (3,) array_like
        mA on the bone and mI in the skin.
    max_angle : float
        phi, half the opening angle of the cone, in (0, pi/2).
    radius : float
        R, the length of the cone, at least the distance from mA to mI.
    sliding : float
        Share of the pull that the skin beyond the furrow of `folds` lacks, if that is a crease: the fibers insert in
        the skin up to there, and slide beneath the skin that rolls over the furrow. 0 as in the paper: they pull all
        skin over them.

    Raises
    ------
    ParameterError
        If attachment and insertion coincide, or an angle or length is out of range.

    Examples
    --------
    >>> muscle = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=40.0)
    >>> along, across = muscle.coordinates([[0.0, 20.0, 0.0]])
    >>> float(along[0]), float(across[0])
    (0.5, 0.0)
    """

    attachment: Array
    insertion: Array
    max_angle: float
    radius: float
    sliding: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("sliding", self.sliding, 0.0, 1.0)
        self._set(**{name: vector(name, getattr(self, name)) for name in ("attachment", "insertion")})
        if not 0.0 < self.max_angle < 0.5 * np.pi:
            raise ParameterError(f"max_angle must lie in (0, pi/2) radians, received {self.max_angle!r}.")
        if self.length == 0.0:
            raise ParameterError("attachment and insertion coincide; a muscle needs a direction.")
        if not check_positive("radius", self.radius) >= self.length * (1.0 - 1e-12):
            raise ParameterError(
                f"radius must be at least the distance from attachment to insertion ({self.length:g}), "
                f"received {self.radius!r}. Usual is 1.1 to 1.3 times that distance."
            )

    @property
    def length(self) -> float:
        """Distance from attachment to insertion."""
        return float(np.linalg.norm(np.subtract(self.insertion, self.attachment)))

    def _polar(self, points: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """l (Eq. 1), the angle phi_i, and the offsets x - mA."""
        offset = checked_points(points) - self.attachment
        fiber = np.subtract(self.insertion, self.attachment) / self.length
        along = offset @ fiber
        across = np.linalg.norm(offset - along[:, None] * fiber, axis=1)
        return along, np.arctan2(across, along), offset

    def _region(self, along: Array, angle: Array, offset: Array) -> tuple[Array, BoolArray]:
        """The place along the muscle, by which furrows lie, and the wrinkling region: lambda_w <= lambda <= 1 and
        gamma <= 1, in front of the attachment; where furrows are round, with r / R for lambda.
        """
        lam = self._towards_folds(along, offset) / self.radius
        return lam, (lam >= self.wrinkles.start) & (lam <= 1.0) & (angle <= self.max_angle) & (along > 0.0)

    def located(self, points: npt.ArrayLike) -> tuple[Array, Array, BoolArray]:
        """lambda = l / R and gamma = phi_i / phi (Eq. 2) of (n, 3) points, and True in the wrinkling region."""
        along, angle, offset = self._polar(points)
        place = equations.linear_coordinates(along, angle, self.radius, self.max_angle)
        return *place, self._region(along, angle, offset)[1]

    @property
    def reach(self) -> tuple[Array, float]:
        """About the attachment, up to the farthest corner of the cone, and at least to the end of the belly."""
        return self.attachment, self.radius * max(1.0 / float(np.cos(self.max_angle)), sum(BELLY))

    def envelope(self, points: npt.ArrayLike) -> Array:
        """At (Eq. 11)."""
        along, angle, offset = self._polar(points)
        style, (lam, inside) = self.wrinkles, self._region(along, angle, offset)
        fade = equations.attenuation(equations.band(angle, style.core * self.max_angle, self.max_angle), style.falloff)
        fade = fade * self._tapered((lam - style.start) / (1.0 - style.start))
        return np.where(inside, fade, 0.0)

    def height(self, points: npt.ArrayLike, blunt: float = 0.0) -> Array:
        """H (Eqs. 4-6)."""
        along, _, offset = self._polar(points)
        distance = self._towards_folds(along, offset)
        return self._profile(distance, self.wrinkles.start * self.radius, self.half_wavelength, blunt)

    def _towards_folds(self, along: Array, offset: Array) -> Array:
        """The distance that is constant along a furrow: l, or r from the attachment."""
        return along if self.wrinkles.fronts == "straight" else np.linalg.norm(offset, axis=1)

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """Unit directions towards the attachment."""
        return -unit(self._polar(points)[2])

    def force(self, points: npt.ArrayLike) -> Array:
        """``Theta1(lambda) Theta2(gamma)`` towards the attachment; less on skin beneath which the fibers slide."""
        lam, gamma = self.coordinates(points)
        size = _longitudinal(lam, min(self.length / self.radius, 1.0)) * _lateral(gamma)
        if self.sliding and isinstance(self.folds, Crease):
            size = size * (1.0 - self.sliding * self.folds.loose_share(points))
        return size[:, None] * self.fold_direction(points)

    def bunched(self, points: npt.ArrayLike) -> Array:
        """Flesh bunched up, in [0, 1]: most at the belly of the muscle, none beyond its extent; see `BELLY`."""
        way = np.subtract(self.insertion, self.attachment) * (self.radius / self.length)
        return _belly(points, self.attachment, way)

    @property
    def half_wavelength(self) -> float:
        """Half cycle u (Eq. 5)."""
        return equations.half_cycle(self.radius, self.wrinkles.start, self.wrinkles.count)


@dataclass(frozen=True, eq=False)
class SheetMuscle(Muscle):
    """Parallel fibers over a rectangle that pull towards a line on the bone (Eqs. 12-13).

    Parameters
    ----------
    attachment, insertion : pair of (3,) array_like
        The end points of the attachment line (mA1, mA2) and of the insertion line (mI1, mI2).
    length, width : float, optional
        Ls and Ws of the area of influence. Default: the distance between the two lines, and the attachment line's
        length.
    thickness : float, optional
        How far in front of and behind the sheet's plane it reaches; by default the larger of length and width, so that
        a forehead's muscle does not act on the back of the head.
    recoil : float
        Pull towards the attachment line from behind it, relative to that in front: for a muscle that is attached not to
        bone but to a sheet of tendon, which gives way (frontalis, to the galea). 0 as in the paper.

    Raises
    ------
    ParameterError
        If lines coincide or are parallel to the fibers, or a length is not positive.

    Examples
    --------
    >>> sheet = SheetMuscle([(-10, 40, 0), (10, 40, 0)], [(-10, 0, 0), (10, 0, 0)])
    >>> along, across = sheet.coordinates([[5.0, 10.0, 0.0]])
    >>> float(along[0]), float(across[0])
    (0.75, 0.5)
    """

    ignored = frozenset({"fronts"})
    folding = "its folds run straight across its fibers"

    attachment: Array
    insertion: Array
    length: float = 0.0
    width: float = 0.0
    thickness: float = 0.0
    recoil: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("recoil", self.recoil, 0.0, 10.0)
        for name in ("attachment", "insertion"):
            pair = vectors(name, getattr(self, name))
            if pair.shape != (2, 3):
                raise ParameterError(f"{name} must be a pair of points, received an array of shape {pair.shape}.")
            pair.setflags(write=False)
            self._set(**{name: pair})
        a, i = np.asarray(self.attachment), np.asarray(self.insertion)
        span, line = float(np.linalg.norm(i.mean(0) - a.mean(0))), float(np.linalg.norm(a[1] - a[0]))
        length, width = checked_size("length", self.length) or span, checked_size("width", self.width) or line
        thickness = checked_size("thickness", self.thickness) or max(length, width)
        self._set(length=length, width=width, thickness=thickness)
        if not np.min([self.length, self.width, self.thickness, span]) > 0.0:  # also for NaN
            raise ParameterError("a sheet muscle needs a positive length, width and thickness, and two distinct lines.")
        if np.linalg.norm(np.cross(a[1] - a[0], i.mean(0) - a.mean(0))) < 1e-6 * line * span or line == 0.0:
            raise ParameterError("the attachment line runs along the fibers; it must cross them.")

    @cached_property
    def _axes(self) -> tuple[Array, Array, Array, Array]:
        """Origin mAc, fiber (mAc to mIc), the direction across it in the sheet's plane, and the plane's normal."""
        a, i = np.asarray(self.attachment), np.asarray(self.insertion)
        fiber = unit(i.mean(0) - a.mean(0))
        line = a[1] - a[0]
        across = unit(line - (line @ fiber) * fiber)
        return a.mean(0), fiber, across, np.cross(across, fiber)

    def _plane(self, points: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """l, h and the distance from the sheet's plane."""
        origin, fiber, across, normal = self._axes
        offset = checked_points(points) - origin
        return offset @ fiber, np.abs(offset @ across), np.abs(offset @ normal)

    def _half_width(self, along: Array) -> Array:
        """Ws / 2 at each distance from the attachment line."""
        return np.full_like(along, 0.5 * self.width)

    def located(self, points: npt.ArrayLike) -> tuple[Array, Array, BoolArray]:
        """lambda = l / Ls and gamma = 2 h / Ws (Eq. 12) of (n, 3) points, and True in the wrinkling region: lambda_w <=
        lambda <= 1 and gamma <= 1, within the sheet's thickness.
        """
        along, across, away = self._plane(points)
        lam, gamma = equations.sheet_coordinates(along, across, self.length, 2.0 * self._half_width(along))
        inside = (lam >= self.wrinkles.start) & (lam <= 1.0) & (gamma <= 1.0) & (away <= self.thickness)
        return lam, gamma, inside

    @property
    def reach(self) -> tuple[Array, float]:
        """About the middle of the sheet, up to its corners, with recoil as far behind the attachment line, and at least
        to the end of the belly of one that swells.
        """
        origin, fiber, _, _ = self._axes
        half = 0.5 * self.length, float(self._half_width(np.array([0.0, self.length])).max()), self.thickness
        behind = self.length if self.recoil else 0.0
        belly = self.length * (0.5 - BELLY[0] + BELLY[1]) if self.swell else 0.0
        return origin + half[0] * fiber, max(float(np.linalg.norm(half)) + behind, belly)

    def envelope(self, points: npt.ArrayLike) -> Array:
        """At (Eq. 13)."""
        style, (lam, gamma, inside) = self.wrinkles, self.located(points)
        fade = equations.attenuation(equations.band(gamma, style.core, 1.0), style.falloff)
        fade = fade * self._tapered((lam - style.start) / (1.0 - style.start))
        return np.where(inside, fade, 0.0)

    def height(self, points: npt.ArrayLike, blunt: float = 0.0) -> Array:
        """H (Eqs. 4-6)."""
        start = self.wrinkles.start * self.length
        return self._profile(self._plane(points)[0], start, self.half_wavelength, blunt)

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """The direction of the fibers, towards the attachment line, for every point."""
        return np.tile(-self._axes[1], (len(checked_points(points)), 1))

    def force(self, points: npt.ArrayLike) -> Array:
        """``Theta1(lambda) Theta2(gamma)`` along the fibers; behind the attachment the recoil, with -lambda."""
        lam, gamma = self.coordinates(points)
        a, i = np.asarray(self.attachment), np.asarray(self.insertion)
        inserted = min(float(np.linalg.norm(i.mean(0) - a.mean(0))) / self.length, 1.0)
        near = self._plane(points)[2] <= self.thickness
        size = _longitudinal(lam, inserted)
        if self.recoil:
            size = size - self.recoil * _longitudinal(-lam, inserted)
        size = np.where(near, size * _lateral(gamma), 0.0)
        return size[:, None] * self.fold_direction(points)

    def bunched(self, points: npt.ArrayLike) -> Array:
        """As of a linear muscle, over the middle of the sheet."""
        origin, fiber, _, _ = self._axes
        return _belly(points, origin, self.length * fiber)

    @property
    def half_wavelength(self) -> float:
        """Half cycle u (Eq. 5 with Ls for R)."""
        return equations.half_cycle(self.length, self.wrinkles.start, self.wrinkles.count)


@dataclass(frozen=True, eq=False)
class TriangularMuscle(SheetMuscle):
    """A sheet whose lines of attachment and insertion have unequal widths, with straight fibers between them.

    Parameters
    ----------
    attachment, insertion : pair of (3,) array_like
        The end points of the two lines.
    length, width, thickness, recoil : float, optional
        As for :class:`SheetMuscle`; `width` is that of the attachment line.
    insertion_width : float, optional
        Width of the insertion line; default: its own length.

    Raises
    ------
    ParameterError
        As for :class:`SheetMuscle`, and if the fibers would meet before they end.

    Notes
    -----
    At the distance l from the attachment line the fan is ``W(l) = Wa + (Wi - Wa) l / li`` wide, li being the distance
    of the lines; ``lambda = l / Ls`` and ``gamma = 2 h / W(l)``, which is constant along a fiber. Lengthened, all
    fibers run through the focus at ``l = li Wa / (Wa - Wi)``; the pull is along them. With equal widths this is a
    sheet, with ``Wa = 0`` the plane section of a linear muscle. Paper A names triangular muscles as future work.

    Examples
    --------
    Twice as wide at its end as at its start; the point on the border there is pulled obliquely:

    >>> fan = TriangularMuscle([(-5, 40, 0), (5, 40, 0)], [(-10, 0, 0), (10, 0, 0)])
    >>> along, across = fan.coordinates([[10.0, 0.0, 0.0], [7.5, 20.0, 0.0]])
    >>> along.tolist(), across.tolist(), (fan.fold_direction([[10.0, 0.0, 0.0]]).round(3) + 0.0).tolist()
    ([1.0, 0.5], [1.0, 1.0], [[-0.124, 0.992, 0.0]])
    """

    insertion_width: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        ends = np.asarray(self.insertion)
        own = float(np.linalg.norm(ends[1] - ends[0]))
        self._set(insertion_width=checked_size("insertion_width", self.insertion_width) or own)
        if self.width + self._widening * self.length < 0.0:
            raise ParameterError(
                f"the fibers meet {-self.width / self._widening:g} from the attachment line; length must be at most "
                f"that, received {self.length!r}. A wider insertion moves their focus away."
            )

    @property
    def _widening(self) -> float:
        """dW / dl."""
        middle = np.asarray(self.insertion).mean(axis=0) - np.asarray(self.attachment).mean(axis=0)
        return (self.insertion_width - self.width) / float(np.linalg.norm(middle))

    def _half_width(self, along: Array) -> Array:
        # Never 0: at the focus gamma would be 0 / 0. Behind it there are no fibers.
        return np.maximum(0.5 * (self.width + self._widening * along), 1e-9 * self.length)

    @property
    def reach(self) -> tuple[Array, float]:
        """As for a sheet as wide as the wider end; behind the attachment line it may be wider still."""
        centre, radius = super().reach
        return centre, radius + (0.5 * abs(self._widening) * self.length if self.recoil else 0.0)

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """The direction of the fiber through each point, towards the attachment line."""
        origin, fiber, across, _ = self._axes
        offset = np.asarray(points, dtype=np.float64) - origin
        along, aside = self._plane(points)[0], offset @ across
        slope = 0.5 * self._widening * aside / self._half_width(along)
        return -unit(fiber + slope[:, None] * across)


@dataclass(frozen=True, eq=False)
class SphincterMuscle(Muscle):
    """A ring that squeezes the skin towards its centre (Eqs. 14-18).

    Parameters
    ----------
    centre : (3,) array_like
        The epicentre o.
    semi_major, semi_minor : float
        a along `lateral` and b along the vertical.
    normal, lateral : (3,) array_like
        The direction out of the face, and that of the major axis, pointing outwards (it is made orthogonal to
        `normal`).
    vertical : (3,) array_like, optional
        The side on which psi is positive; only its sign counts. Default: ``normal x lateral``.
    inner : float
        rw = a'/a in [0, 1): inner radius of the wrinkling region, relative to the ellipse.
    beta1, beta2 : float
        The wrinkling region spans -beta1 <= psi <= beta2, in (0, pi].
    dead_zone : float
        Below this relative radius the muscle does not pull.
    protrusion : float
        Push along `normal`, relative to the pull: lips that purse are pushed forward.
    thickness : float, optional
        How far in front of and behind its plane it reaches; default: semi_major.

    Notes
    -----
    Coordinates are (r, psi) in place of (lambda, gamma). Folds are radial; compression is measured along the angle.
    The attenuated bands have the width ``dr = (1 - core) (1 - rw) / 2`` (Eq. 18 with ac chosen so that they never
    overlap).

    Examples
    --------
    >>> ring = SphincterMuscle((0, 0, 0), 40.0, 30.0, normal=(0, 0, 1), lateral=(1, 0, 0))
    >>> r, psi = ring.coordinates([[20.0, 0.0, 5.0], [0.0, 30.0, 0.0]])
    >>> r.tolist(), psi.round(3).tolist()
    ([0.5, 1.0], [0.0, 1.571])
    """

    ignored = frozenset({"start", "fronts"})
    folding = "its folds are radial, from -beta1 to beta2"

    centre: Array
    semi_major: float
    semi_minor: float
    normal: Array
    lateral: Array
    vertical: Array = None  # type: ignore[assignment]  # derived from the others
    inner: float = 0.55
    beta1: float = 0.7
    beta2: float = 0.7
    dead_zone: float = 0.1
    protrusion: float = 0.0
    thickness: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        centre, normal, lateral = (vector(n, getattr(self, n)) for n in ("centre", "normal", "lateral"))
        normal = unit(normal)
        across = lateral - (lateral @ normal) * normal
        if not normal.any() or np.linalg.norm(across) <= 1e-9 * np.linalg.norm(lateral):
            raise ParameterError("normal and lateral must be two different directions of positive length.")
        lateral = unit(across)
        vertical = np.cross(normal, lateral)
        if self.vertical is not None and vertical @ vector("vertical", self.vertical) < 0.0:
            vertical = -vertical
        for name in ("semi_major", "semi_minor"):
            check_positive(name, getattr(self, name))
        thickness = checked_size("thickness", self.thickness) or float(self.semi_major)
        self._set(centre=centre, normal=normal, lateral=lateral, vertical=vertical, thickness=thickness)
        share, angle = (0.0, 1.0 - 1e-9), (0.0, np.pi)
        check_ranges(self, protrusion=(-1e6, 1e6), inner=share, dead_zone=share, beta1=angle, beta2=angle)
        if self.beta1 + self.beta2 == 0.0:
            raise ParameterError("beta1 + beta2 must be positive: the wrinkling region has no angle.")

    def _local(self, points: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """s, t and the distance from the muscle's plane."""
        offset = checked_points(points) - self.centre
        return (
            offset @ np.asarray(self.lateral),
            offset @ np.asarray(self.vertical),
            np.abs(offset @ np.asarray(self.normal)),
        )

    def located(self, points: npt.ArrayLike) -> tuple[Array, Array, BoolArray]:
        """The relative radius r (Eq. 14) and the signed angle psi of (n, 3) points, and True in the wrinkling region:
        -beta1 <= psi <= beta2 and rw <= r <= 1, within the muscle's thickness.
        """
        s, t, away = self._local(points)
        r, psi = equations.sphincter_coordinates(s, t, self.semi_major, self.semi_minor)
        around = (psi >= -self.beta1) & (psi <= self.beta2)
        return r, psi, around & (r >= self.inner) & (r <= 1.0) & (away <= self.thickness)

    @property
    def reach(self) -> tuple[Array, float]:
        """About the centre, up to the rims of the cylinder."""
        return self.centre, float(np.hypot(max(self.semi_major, self.semi_minor), self.thickness))

    def envelope(self, points: npt.ArrayLike) -> Array:
        """At on the inner and outer band (Eqs. 17-18)."""
        r, psi, inside = self.located(points)
        style = self.wrinkles
        fade = equations.ring_attenuation(r, self.inner, style.core, style.falloff)
        fade = fade * self._tapered((psi + self.beta1) / (self.beta1 + self.beta2))
        return np.where(inside, fade, 0.0)

    @property
    def _half_angle(self) -> float:
        """Half cycle u (Eq. 16), an angle."""
        return equations.half_cycle(self.beta1 + self.beta2, 0.0, self.wrinkles.count)

    def height(self, points: npt.ArrayLike, blunt: float = 0.0) -> Array:
        """H (Eqs. 15-16)."""
        return self._profile(self.coordinates(points)[1], -self.beta1, self._half_angle, blunt)

    def half_cycles(self, points: npt.ArrayLike) -> Array:
        """The arc that the half cycle spans at each point."""
        s, t, _ = self._local(points)
        return np.hypot(s, t) * self._half_angle

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """Unit directions along the angle, in the muscle's plane."""
        s, t, _ = self._local(points)
        return unit(s[:, None] * np.asarray(self.vertical) - t[:, None] * np.asarray(self.lateral))

    def force(self, points: npt.ArrayLike) -> Array:
        """Pull towards the centre in the muscle's plane, mostly along the minor axis, and the push along its normal.

        The pull falls from the dead zone to r = 1, the push from the centre.
        """
        r, _ = self.coordinates(points)
        s, t, away = self._local(points)
        near = away <= self.thickness
        pull = np.where(near & (r > self.dead_zone), _lateral((r - self.dead_zone) / (1.0 - self.dead_zone)), 0.0)
        push = np.where(near, self.protrusion * _lateral(r), 0.0)
        inwards = -unit(
            s[:, None] / self.semi_major**2 * self.lateral + t[:, None] / self.semi_minor**2 * self.vertical
        )
        return pull[:, None] * inwards + push[:, None] * self.normal

    @property
    def half_wavelength(self) -> float:
        """Half cycle u (Eq. 16) as an arc on the major axis' radius."""
        return self.semi_major * self._half_angle
