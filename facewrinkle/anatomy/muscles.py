"""The three kinds of muscle: where they reach, which way they pull, and how the skin over them folds.

Everything here is a function of rest positions, in the unit of the mesh that the muscle was placed on, and is computed
once per vertex. Angles are in radians. Paper: Zhang, Sim, Tan, Eqs. 1-2 (linear), 12-13 (sheet), 14-18 (sphincter).
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, Self

import numpy as np
import numpy.typing as npt

from ..errors import ParameterError, check_range, unknown_name
from ..geometry import profile
from ..geometry.blending import smoothstep

Array = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
Fronts = Literal["straight", "round"]

FRONTS: tuple[Fronts, ...] = ("straight", "round")


def _vector(name: str, value: npt.ArrayLike) -> Array:
    try:
        vector = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        vector = np.empty(0)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ParameterError(f"{name} must be three finite coordinates, received {value!r}.")
    vector.setflags(write=False)
    return vector


def _points(points: npt.ArrayLike) -> Array:
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ParameterError(f"points must have the shape (n, 3), received {array.shape}.")
    return array


def _unit(vectors: Array) -> Array:
    """Unit vectors; zero where the length is zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)


@dataclass(frozen=True, eq=False)
class Wrinkles:
    """How the skin over a muscle folds.

    Parameters
    ----------
    count : int
        Number of furrows nw across the wrinkling region.
    start : float
        lambda_w in [0, 1): where along the muscle the region starts. Not used by sphincters.
    depth : float
        kappa, the furrow depth factor k0 at full contraction, mm. From bulge to furrow a wrinkle measures
        ``k0 2^alpha sin(pi epsilon / 2)``.
    alpha : float
        Shape exponent, >= 0: 1 is soft, 4 very sharp.
    core : float
        In [0, 1]: share of the half width (or of half the ring, for a sphincter) without lateral attenuation.
    ends : {"continuous", "paper"}
        See :func:`facewrinkle.geometry.profile.phase`.
    falloff : {"paper", "smoothstep"}
        See :func:`facewrinkle.geometry.profile.attenuation`.
    fronts : {"straight", "round"}
        Whether the furrows of a linear muscle run straight across its central fibre, as in the paper, or as arcs about
        its attachment, everywhere across the compression that is measured.
    taper : float
        In [0, 1]: share of the region's length in which the furrows grow shallower towards its first and last one. 0 as
        in the paper: all are alike.

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
    ends: profile.Ends = "continuous"
    falloff: profile.Falloff = "paper"
    fronts: Fronts = "straight"
    taper: float = 0.0

    def __post_init__(self) -> None:
        profile.half_cycle(1.0, self.start, self.count)
        profile.phase(0.0, 0.0, 1.0, self.alpha, self.ends)
        profile.attenuation(0.0, self.falloff)
        check_range("depth", self.depth, 0.0, 1e6)
        check_range("core", self.core, 0.0, 1.0)
        check_range("taper", self.taper, 0.0, 1.0)
        if self.fronts not in FRONTS:
            raise ParameterError(f"fronts must be one of {', '.join(FRONTS)}, received {self.fronts!r}.")


@dataclass(frozen=True, eq=False)
class Muscle:
    """What all kinds share. By itself it neither pulls the skin nor folds it: :class:`LinearMuscle`,
    :class:`SheetMuscle` and :class:`SphincterMuscle` do; the others move a bone or a lid.
    """

    wrinkles: Wrinkles = field(default_factory=Wrinkles, kw_only=True)
    strength: float = field(default=1.0, kw_only=True)
    """Force at full contraction, relative to that of the other muscles."""
    normal_share: float = field(default=1.0, kw_only=True)
    """Share of the pull along the skin's normal that reaches the skin."""
    folds: Muscle | None = field(default=None, kw_only=True)
    """Where the skin folds elsewhere than over the muscle, or not across its fibres: the muscle-like region on which
    the wrinkles are laid instead. None, as in the paper: over the muscle and across its fibres.
    """

    def _check_common(self) -> None:
        check_range("strength", self.strength, 0.0, 1e6)
        check_range("normal_share", self.normal_share, 0.0, 1.0)

    @property
    def fold_pattern(self) -> Muscle:
        """The region on which this muscle's wrinkles are laid: `folds`, or the muscle itself."""
        return self.folds or self

    def coordinates(self, points: npt.ArrayLike) -> tuple[Array, Array]:
        """The muscle's two coordinates of (n, 3) points."""
        n = len(_points(points))
        return np.zeros(n), np.zeros(n)

    def wrinkling_region(self, points: npt.ArrayLike) -> BoolArray:
        """Whether each of (n, 3) points lies in the wrinkling region."""
        return np.zeros(len(_points(points)), dtype=bool)

    def envelope(self, points: npt.ArrayLike) -> Array:
        """The lateral attenuation At of (n, 3) points; exactly 0 outside the wrinkling region."""
        return np.zeros(len(_points(points)))

    def unit_amplitude(self, points: npt.ArrayLike) -> Array:
        """``H At`` at k0 = 1 for (n, 3) points; exactly 0 outside the wrinkling region (Eq. 3)."""
        fade = self.envelope(points)
        return np.where(fade > 0.0, self.height(points) * fade, 0.0)

    def height(self, points: npt.ArrayLike) -> Array:
        """H at k0 = 1, periodic along the muscle."""
        return np.zeros(len(_points(points)))

    def half_cycles(self, points: npt.ArrayLike) -> Array:
        """Half cycle u at (n, 3) points, as a length."""
        return np.full(len(_points(points)), self.half_wavelength)

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """Unit directions (n, 3) across the folds, along which compression is measured."""
        return np.zeros_like(_points(points))

    def force(self, points: npt.ArrayLike) -> Array:
        """Pull (n, 3) at full contraction and strength 1; 0 outside the area of influence."""
        return np.zeros_like(_points(points))

    @property
    def half_wavelength(self) -> float:
        """Half cycle u as a length (for a sphincter: along its outer border, where it is longest); infinite without
        folds.
        """
        return float("inf")

    def transformed(self, rotation: npt.ArrayLike, scale: float = 1.0, translation: npt.ArrayLike = (0, 0, 0)) -> Self:
        """The muscle after ``x -> scale * rotation @ x + translation``; `rotation` may mirror."""
        raise NotImplementedError

    def replaced(self, **changes: object) -> Self:
        """A copy with other values.

        Names of :class:`Wrinkles` (count, depth, alpha, ...) are accepted too; they change the wrinkles where they are
        laid, on `folds` if there are any.
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
        reach = 0.5 * self.wrinkles.taper
        return smoothstep(np.minimum(place, 1.0 - place) / reach) if reach > 0.0 else np.ones_like(place)

    def _profile(self, distance: Array, start: float, u: float) -> Array:
        """H at k0 = 1 of points at `distance` along the muscle."""
        style = self.wrinkles
        w = profile.phase(distance, start, u, style.alpha, style.ends)
        return profile.shape(w, u, 1.0, style.alpha)


def _longitudinal(along: Array, insertion: float) -> Array:
    """Theta1: rises to 1 at the insertion, falls to 0 at lambda = 1; 0 outside [0, 1]."""
    rising = np.cos((1.0 - along / insertion) * (0.5 * np.pi))
    if insertion < 1.0:
        falling = np.cos((along - insertion) / (1.0 - insertion) * (0.5 * np.pi))
        rising = np.where(along <= insertion, rising, falling)
    return np.where((along >= 0.0) & (along <= 1.0), rising, 0.0)


def _lateral(across: Array) -> Array:
    """Theta2: 1 on the central fibre, 0 from the border on."""
    return np.where(across <= 1.0, np.cos(np.minimum(across, 1.0) * (0.5 * np.pi)), 0.0)


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

    def __post_init__(self) -> None:
        self._check_common()
        for name in ("attachment", "insertion"):
            object.__setattr__(self, name, _vector(name, getattr(self, name)))
        if not 0.0 < self.max_angle < 0.5 * np.pi:
            raise ParameterError(f"max_angle must lie in (0, pi/2) radians, received {self.max_angle!r}.")
        if self.length == 0.0:
            raise ParameterError("attachment and insertion coincide; a muscle needs a direction.")
        if not self.radius >= self.length * (1.0 - 1e-12):
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
        offset = _points(points) - self.attachment
        fibre = np.subtract(self.insertion, self.attachment) / self.length
        along = offset @ fibre
        across = np.linalg.norm(offset - along[:, None] * fibre, axis=1)
        return along, np.arctan2(across, along), offset

    def coordinates(self, points: npt.ArrayLike) -> tuple[Array, Array]:
        """lambda = l / R and gamma = phi_i / phi (Eq. 2) of (n, 3) points."""
        along, angle, _ = self._polar(points)
        return along / self.radius, angle / self.max_angle

    def wrinkling_region(self, points: npt.ArrayLike) -> BoolArray:
        """lambda_w <= lambda <= 1 and gamma <= 1, in front of the attachment; where furrows are round, with r / R for
        lambda.
        """
        along, angle, offset = self._polar(points)
        lam = self._towards_folds(along, offset) / self.radius
        return (lam >= self.wrinkles.start) & (lam <= 1.0) & (angle <= self.max_angle) & (along > 0.0)

    def envelope(self, points: npt.ArrayLike) -> Array:
        """At (Eq. 11)."""
        along, angle, offset = self._polar(points)
        style, lam = self.wrinkles, self._towards_folds(along, offset) / self.radius
        fade = profile.attenuation(profile.band(angle, style.core * self.max_angle, self.max_angle), style.falloff)
        fade = fade * self._tapered((lam - style.start) / (1.0 - style.start))
        return np.where(self.wrinkling_region(points), fade, 0.0)

    def height(self, points: npt.ArrayLike) -> Array:
        """H (Eqs. 4-6)."""
        along, _, offset = self._polar(points)
        distance = self._towards_folds(along, offset)
        return self._profile(distance, self.wrinkles.start * self.radius, self.half_wavelength)

    def _towards_folds(self, along: Array, offset: Array) -> Array:
        """What the furrows are lines of equal values of: l, or the distance r from the attachment."""
        return along if self.wrinkles.fronts == "straight" else np.linalg.norm(offset, axis=1)

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """Unit directions towards the attachment."""
        return -_unit(self._polar(points)[2])

    def force(self, points: npt.ArrayLike) -> Array:
        """``Theta1(lambda) Theta2(gamma)`` towards the attachment."""
        lam, gamma = self.coordinates(points)
        size = _longitudinal(lam, min(self.length / self.radius, 1.0)) * _lateral(gamma)
        return size[:, None] * self.fold_direction(points)

    @property
    def half_wavelength(self) -> float:
        """Half cycle u (Eq. 5)."""
        return profile.half_cycle(self.radius, self.wrinkles.start, self.wrinkles.count)

    def transformed(self, rotation: npt.ArrayLike, scale: float = 1.0, translation: npt.ArrayLike = (0, 0, 0)) -> Self:
        """The muscle after ``x -> scale * rotation @ x + translation``."""
        matrix, shift = scale * np.asarray(rotation), np.asarray(translation)
        return dataclasses.replace(
            self,
            folds=self.folds and self.folds.transformed(rotation, scale, translation),
            attachment=matrix @ self.attachment + shift,
            insertion=matrix @ self.insertion + shift,
            radius=self.radius * scale,
        )


@dataclass(frozen=True, eq=False)
class SheetMuscle(Muscle):
    """Parallel fibres over a rectangle that pull towards a line on the bone (Eqs. 12-13).

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

    Raises
    ------
    ParameterError
        If lines coincide or are parallel to the fibres, or a length is not positive.

    Examples
    --------
    >>> sheet = SheetMuscle([(-10, 40, 0), (10, 40, 0)], [(-10, 0, 0), (10, 0, 0)])
    >>> along, across = sheet.coordinates([[5.0, 10.0, 0.0]])
    >>> float(along[0]), float(across[0])
    (0.75, 0.5)
    """

    attachment: Array
    insertion: Array
    length: float = 0.0
    width: float = 0.0
    thickness: float = 0.0

    def __post_init__(self) -> None:
        self._check_common()
        for name in ("attachment", "insertion"):
            pair = np.array([_vector(name, p) for p in np.atleast_1d(np.asarray(getattr(self, name), dtype=object))])
            if pair.shape != (2, 3):
                raise ParameterError(f"{name} must be a pair of points, received an array of shape {pair.shape}.")
            pair.setflags(write=False)
            object.__setattr__(self, name, pair)
        a, i = np.asarray(self.attachment), np.asarray(self.insertion)
        span, line = float(np.linalg.norm(i.mean(0) - a.mean(0))), float(np.linalg.norm(a[1] - a[0]))
        object.__setattr__(self, "length", check_range("length", self.length, 0.0, np.inf) or span)
        object.__setattr__(self, "width", check_range("width", self.width, 0.0, np.inf) or line)
        object.__setattr__(self, "thickness", float(self.thickness or max(self.length, self.width)))
        if not np.min([self.length, self.width, self.thickness, span]) > 0.0:  # also for NaN
            raise ParameterError("a sheet muscle needs a positive length, width and thickness, and two distinct lines.")
        if np.linalg.norm(np.cross(a[1] - a[0], i.mean(0) - a.mean(0))) < 1e-6 * line * span or line == 0.0:
            raise ParameterError("the attachment line runs along the fibres; it has to cross them.")

    @cached_property
    def _axes(self) -> tuple[Array, Array, Array, Array]:
        """Origin mAc, fibre (mAc to mIc), the direction across it in the sheet's plane, and the plane's normal."""
        a, i = np.asarray(self.attachment), np.asarray(self.insertion)
        fibre = _unit(i.mean(0) - a.mean(0))
        line = a[1] - a[0]
        across = _unit(line - (line @ fibre) * fibre)
        return a.mean(0), fibre, across, np.cross(across, fibre)

    def _plane(self, points: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """l, h and the distance from the sheet's plane."""
        origin, fibre, across, normal = self._axes
        offset = _points(points) - origin
        return offset @ fibre, np.abs(offset @ across), np.abs(offset @ normal)

    def coordinates(self, points: npt.ArrayLike) -> tuple[Array, Array]:
        """lambda = l / Ls and gamma = 2 h / Ws (Eq. 12) of (n, 3) points."""
        along, across, _ = self._plane(points)
        return along / self.length, 2.0 * across / self.width

    def wrinkling_region(self, points: npt.ArrayLike) -> BoolArray:
        """lambda_w <= lambda <= 1 and gamma <= 1, within the sheet's thickness."""
        lam, gamma = self.coordinates(points)
        near = self._plane(points)[2] <= self.thickness
        return (lam >= self.wrinkles.start) & (lam <= 1.0) & (gamma <= 1.0) & near

    def envelope(self, points: npt.ArrayLike) -> Array:
        """At (Eq. 13)."""
        along, across, _ = self._plane(points)
        style, half = self.wrinkles, 0.5 * self.width
        fade = profile.attenuation(profile.band(across, style.core * half, half), style.falloff)
        fade = fade * self._tapered((along / self.length - style.start) / (1.0 - style.start))
        return np.where(self.wrinkling_region(points), fade, 0.0)

    def height(self, points: npt.ArrayLike) -> Array:
        """H (Eqs. 4-6)."""
        return self._profile(self._plane(points)[0], self.wrinkles.start * self.length, self.half_wavelength)

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """The direction of the fibres, towards the attachment line, for every point."""
        return np.tile(-self._axes[1], (len(_points(points)), 1))

    def force(self, points: npt.ArrayLike) -> Array:
        """``Theta1(lambda) Theta2(gamma)`` along the fibres."""
        lam, gamma = self.coordinates(points)
        a, i = np.asarray(self.attachment), np.asarray(self.insertion)
        inserted = min(float(np.linalg.norm(i.mean(0) - a.mean(0))) / self.length, 1.0)
        near = self._plane(points)[2] <= self.thickness
        size = np.where(near, _longitudinal(lam, inserted) * _lateral(gamma), 0.0)
        return size[:, None] * self.fold_direction(points)

    @property
    def half_wavelength(self) -> float:
        """Half cycle u (Eq. 5 with Ls for R)."""
        return profile.half_cycle(self.length, self.wrinkles.start, self.wrinkles.count)

    def transformed(self, rotation: npt.ArrayLike, scale: float = 1.0, translation: npt.ArrayLike = (0, 0, 0)) -> Self:
        """The muscle after ``x -> scale * rotation @ x + translation``."""
        matrix, shift = scale * np.asarray(rotation), np.asarray(translation)
        return dataclasses.replace(
            self,
            folds=self.folds and self.folds.transformed(rotation, scale, translation),
            attachment=np.asarray(self.attachment) @ matrix.T + shift,
            insertion=np.asarray(self.insertion) @ matrix.T + shift,
            length=self.length * scale,
            width=self.width * scale,
            thickness=self.thickness * scale,
        )


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
        self._check_common()
        centre, normal, lateral = (_vector(n, getattr(self, n)) for n in ("centre", "normal", "lateral"))
        normal = _unit(normal)
        across = lateral - (lateral @ normal) * normal
        if not normal.any() or np.linalg.norm(across) <= 1e-9 * np.linalg.norm(lateral):
            raise ParameterError("normal and lateral must be two different directions of positive length.")
        lateral = _unit(across)
        vertical = np.cross(normal, lateral)
        if self.vertical is not None and vertical @ _vector("vertical", self.vertical) < 0.0:
            vertical = -vertical
        for name, value in (
            ("centre", centre),
            ("normal", normal),
            ("lateral", lateral),
            ("vertical", vertical),
        ):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "thickness", float(self.thickness or self.semi_major))
        if not np.min([self.semi_major, self.semi_minor, self.thickness]) > 0.0:  # also for NaN
            raise ParameterError("semi_major, semi_minor and thickness must be positive.")
        check_range("inner", self.inner, 0.0, 1.0 - 1e-9)
        check_range("dead_zone", self.dead_zone, 0.0, 1.0 - 1e-9)
        check_range("beta1", self.beta1, 0.0, np.pi)
        check_range("beta2", self.beta2, 0.0, np.pi)
        if self.beta1 + self.beta2 == 0.0:
            raise ParameterError("beta1 + beta2 must be positive: the wrinkling region has no angle.")

    def _local(self, points: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """s, t and the distance from the muscle's plane."""
        offset = _points(points) - self.centre
        return (
            offset @ np.asarray(self.lateral),
            offset @ np.asarray(self.vertical),
            np.abs(offset @ np.asarray(self.normal)),
        )

    def coordinates(self, points: npt.ArrayLike) -> tuple[Array, Array]:
        """The relative radius r (Eq. 14) and the signed angle psi of (n, 3) points."""
        s, t, _ = self._local(points)
        return np.hypot(s / self.semi_major, t / self.semi_minor), np.arctan2(t, s)

    def wrinkling_region(self, points: npt.ArrayLike) -> BoolArray:
        """-beta1 <= psi <= beta2 and rw <= r <= 1, within the muscle's thickness."""
        r, psi = self.coordinates(points)
        near = self._local(points)[2] <= self.thickness
        return (psi >= -self.beta1) & (psi <= self.beta2) & (r >= self.inner) & (r <= 1.0) & near

    def envelope(self, points: npt.ArrayLike) -> Array:
        """At on the inner and outer band (Eqs. 17-18)."""
        r, psi = self.coordinates(points)
        style = self.wrinkles
        width = 0.5 * (1.0 - style.core) * (1.0 - self.inner)
        fade = profile.attenuation(profile.band(-r, -self.inner - width, -self.inner), style.falloff)
        fade = fade * profile.attenuation(profile.band(r, 1.0 - width, 1.0), style.falloff)
        fade = fade * self._tapered((psi + self.beta1) / (self.beta1 + self.beta2))
        return np.where(self.wrinkling_region(points), fade, 0.0)

    @property
    def _half_angle(self) -> float:
        """Half cycle u (Eq. 16), an angle."""
        return profile.half_cycle(self.beta1 + self.beta2, 0.0, self.wrinkles.count)

    def height(self, points: npt.ArrayLike) -> Array:
        """H (Eqs. 15-16)."""
        return self._profile(self.coordinates(points)[1], -self.beta1, self._half_angle)

    def half_cycles(self, points: npt.ArrayLike) -> Array:
        """The arc that the half cycle spans at each point."""
        s, t, _ = self._local(points)
        return np.hypot(s, t) * self._half_angle

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """Unit directions along the angle, in the muscle's plane."""
        s, t, _ = self._local(points)
        return _unit(s[:, None] * np.asarray(self.vertical) - t[:, None] * np.asarray(self.lateral))

    def force(self, points: npt.ArrayLike) -> Array:
        """Pull towards the centre in the muscle's plane, mostly along the minor axis, and the push along its normal.

        The pull falls from the dead zone to r = 1, the push from the centre.
        """
        r, _ = self.coordinates(points)
        s, t, away = self._local(points)
        inside = (r < 1.0) & (away <= self.thickness)
        pull = np.where(inside & (r > self.dead_zone), _lateral((r - self.dead_zone) / (1.0 - self.dead_zone)), 0.0)
        push = np.where(inside, self.protrusion * _lateral(r), 0.0)
        inwards = -_unit(
            s[:, None] / self.semi_major**2 * self.lateral + t[:, None] / self.semi_minor**2 * self.vertical
        )
        return pull[:, None] * inwards + push[:, None] * self.normal

    @property
    def half_wavelength(self) -> float:
        """Half cycle u (Eq. 16) as an arc on the major axis' radius."""
        return self.semi_major * self._half_angle

    def transformed(self, rotation: npt.ArrayLike, scale: float = 1.0, translation: npt.ArrayLike = (0, 0, 0)) -> Self:
        """The muscle after ``x -> scale * rotation @ x + translation``."""
        turn = np.asarray(rotation, dtype=np.float64)
        return dataclasses.replace(
            self,
            folds=self.folds and self.folds.transformed(rotation, scale, translation),
            centre=scale * turn @ self.centre + np.asarray(translation),
            normal=turn @ self.normal,
            lateral=turn @ self.lateral,
            vertical=turn @ self.vertical,
            semi_major=self.semi_major * scale,
            semi_minor=self.semi_minor * scale,
            thickness=self.thickness * scale,
        )


@dataclass(frozen=True, eq=False)
class JawMuscle(Muscle):
    """The depressors of the mandible, which turns about its hinge.

    Parameters
    ----------
    hinge, axis : (3,) array_like
        A point on the hinge, and its direction such that a positive turn opens the mouth.
    angle : float
        Turn at full contraction, radians.
    """

    hinge: Array
    axis: Array
    angle: float

    def __post_init__(self) -> None:
        self._check_common()
        object.__setattr__(self, "hinge", _vector("hinge", self.hinge))
        object.__setattr__(self, "axis", _unit(_vector("axis", self.axis)))
        check_range("angle", self.angle, 0.0, 0.6)

    def transformed(self, rotation: npt.ArrayLike, scale: float = 1.0, translation: npt.ArrayLike = (0, 0, 0)) -> Self:
        """The muscle after ``x -> scale * rotation @ x + translation``."""
        turn = np.asarray(rotation, dtype=np.float64)
        return dataclasses.replace(
            self,
            hinge=scale * turn @ self.hinge + np.asarray(translation),
            axis=np.linalg.det(turn) * turn @ self.axis,
        )


@dataclass(frozen=True, eq=False)
class LidMuscle(Muscle):
    """The levator of the upper lid, which turns back over the eyeball and opens the eye wide.

    Parameters
    ----------
    side : {"l", "r"}
    share : float
        Turn at full contraction, relative to that of closing the eye.
    """

    side: str
    share: float = 0.25

    def __post_init__(self) -> None:
        self._check_common()
        if self.side not in ("l", "r"):
            raise ParameterError(f"side must be 'l' or 'r', received {self.side!r}.")
        check_range("share", self.share, 0.0, 1.0)

    def transformed(self, rotation: npt.ArrayLike, scale: float = 1.0, translation: npt.ArrayLike = (0, 0, 0)) -> Self:
        """The muscle itself, or that of the other side if `rotation` mirrors: it goes with the lids."""
        if np.linalg.det(np.asarray(rotation, dtype=np.float64)) > 0.0:
            return self
        return dataclasses.replace(self, side="r" if self.side == "l" else "l")


TURNS = {"up": (0.0, 1.0), "down": (0.0, -1.0), "inwards": (-1.0, 0.0), "outwards": (1.0, 0.0)}
"""Turns of an eye: shares of its angle outwards (to its own side) and upwards."""


@dataclass(frozen=True, eq=False)
class EyeMuscle(Muscle):
    """A straight muscle of the eye, which turns the eyeball; the lids follow.

    Parameters
    ----------
    side : {"l", "r"}
    turn : {"up", "down", "inwards", "outwards"}
    angle : float
        Turn at full contraction, radians.
    """

    side: str
    turn: str
    angle: float

    def __post_init__(self) -> None:
        self._check_common()
        if self.side not in ("l", "r"):
            raise ParameterError(f"side must be 'l' or 'r', received {self.side!r}.")
        if self.turn not in TURNS:
            raise unknown_name("turn", self.turn, TURNS)
        check_range("angle", self.angle, 1e-6, 1.0)

    def rate(self, outwards: float, up: float) -> float:
        """Its contraction rate, in [0, 1], in an eye that is turned by these angles, radians.

        Raises
        ------
        ParameterError
            If the eye is turned farther than the muscle can.
        """
        aside, above = TURNS[self.turn]
        rate = (aside * outwards + above * up) / self.angle
        if rate > 1.0 + 1e-9:
            raise ParameterError(
                f"an eye turns {self.turn} by {np.degrees(self.angle):.3g} degrees at most, asked for were "
                f"{np.degrees(rate * self.angle):.3g}. Turn the head instead."
            )
        return min(max(rate, 0.0), 1.0)

    def transformed(self, rotation: npt.ArrayLike, scale: float = 1.0, translation: npt.ArrayLike = (0, 0, 0)) -> Self:
        """The muscle itself, or that of the other side if `rotation` mirrors: it goes with the eye."""
        if np.linalg.det(np.asarray(rotation, dtype=np.float64)) > 0.0:
            return self
        return dataclasses.replace(self, side="r" if self.side == "l" else "l")
