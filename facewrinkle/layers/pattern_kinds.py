"""The patterns in an artist's words: how many wrinkles, how sharp, in which style, on a region of any size.

Each kind lays the plane of its formula (:mod:`facewrinkle.layers.patterns`) on a region, whose own coordinates (u, v)
are -1 to 1 from border to border, and scales its relief to 1 from bulge to furrow (a dimple or pouch: 1 deep or high).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt
from scipy.special import i0  # of one number, much faster than NumPy's

from ..errors import ParameterError, check_range, check_whole, unknown_name
from . import _pattern_kernels as kernels
from . import patterns

Array = npt.NDArray[np.float64]
Furrows = Literal["sharp", "paper"]
Heights = Callable[[float, float, Array], None]
"""Adds the relief at a strength and a t to an array of heights."""

STYLES: Mapping[str, float] = {"arcs": 1.5, "m": 4.5, "broken": 9.0}
"""Styles of forehead wrinkles, and their beta."""
FURROWS: tuple[Furrows, ...] = ("sharp", "paper")


@dataclass(frozen=True, kw_only=True)
class Pattern:
    """What all kinds share: they are asked for places in a plane, and for heights there.

    A kind has `plane`, which maps (u, v) to its own (x, y), given the region's height over its width; `relief`, the
    height at a strength in [0, 1] and a t; `waves`, the gradient of its phase in (x, y); and `prepared`, a faster form
    of `relief` for places that do not change. `moving` tells whether its wavelengths change with t.
    """

    moving: ClassVar[bool] = False

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """The (x, y) of places (k, 2) in the region."""
        return uv[:, 0], uv[:, 1]

    def time(self, seconds: float) -> float:
        """The t of a moment, where none was asked for."""
        return 0.0

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """Heights (k,), 0 at strength 0."""
        raise NotImplementedError

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """Gradient of the phase along x and y."""
        raise NotImplementedError

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """The same as `relief`, times `weight`, added where told."""

        def heights(strength: float, t: float, out: Array) -> None:
            out[where] += weight * self.relief(x, y, strength, t, aspect)

        return heights


def _scale(strength: float, sharpness: float, furrows: Furrows) -> tuple[float, float, float]:
    """a, b and c of ``a + b exp(c s)``: :func:`patterns.sharpened`, or ``expm1(k s) / (2 sinh k)`` as in the paper."""
    if sharpness < 1e-6:
        return 0.0, 0.5 * strength, 0.0
    size = strength / (2.0 * np.sinh(sharpness))
    if furrows == "paper":
        return -size, size, sharpness
    return float(i0(sharpness)) * size, -size, -sharpness


def _shaped(s: Array, strength: float, sharpness: float, furrows: Furrows) -> Array:
    if furrows == "paper" and sharpness >= 1e-6:
        return np.asarray(strength * np.expm1(sharpness * s) / (2.0 * np.sinh(sharpness)))
    return strength * patterns.sharpened(s, sharpness)


def _check_shape(number: float, sharpness: float, furrows: Furrows) -> None:
    check_range("number", number, 0.1, 1000.0)
    check_range("sharpness", sharpness, 0.0, 20.0)
    if furrows not in FURROWS:
        raise unknown_name("kind of furrows", furrows, FURROWS)


@dataclass(frozen=True, kw_only=True)
class Forehead(Pattern):
    """Wrinkles across the forehead (see :func:`patterns.forehead`).

    Attributes
    ----------
    number : float
        Wrinkles from the lower to the upper border.
    style : {"arcs", "m", "broken"} or float
        Or the paper's beta.
    sharpness : float
        The paper's alpha.
    bend : float
        How much the arcs are bent: half the width of the region in the pattern's units; in the paper 2.5.
    start : float
        The pattern's x at the lower border; the paper's pictures have 2. The larger, the more even the wrinkles.
    furrows : {"sharp", "paper"}
        "paper" has sharp ridges and round valleys, as printed.
    """

    moving: ClassVar[bool] = True
    number: float = 4.0
    style: str | float = "m"
    sharpness: float = 1.2
    bend: float = 2.5
    start: float = 4.0
    furrows: Furrows = "sharp"

    def __post_init__(self) -> None:
        _check_shape(self.number, self.sharpness, self.furrows)
        check_range("start", self.start, 0.1, 100.0, "The pattern has to keep away from its origin.")
        check_range("bend", self.bend, 0.0, 100.0)
        if isinstance(self.style, str):
            if self.style not in STYLES:
                raise unknown_name("style", self.style, STYLES)
        else:
            check_range("style", self.style, 0.0, 100.0)

    @property
    def beta(self) -> float:
        """The paper's parameter of style."""
        return STYLES[self.style] if isinstance(self.style, str) else float(self.style)

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        end = np.sqrt(self.start**2 + 2.0 * np.pi * self.number)
        return self.start + 0.5 * (uv[:, 1] + 1.0) * (end - self.start), self.bend * uv[:, 0]

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        return _shaped(patterns.forehead_exponent(x, y, t, 1.0, self.beta), strength, self.sharpness, self.furrows)

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        th, beta = patterns.angle(x, y), self.beta
        swing = t * np.sin(th) - np.sin(beta * th)
        turn = -2.0 * swing * (t * np.cos(th) - beta * np.cos(beta * th)) / (x * x + y * y)
        sharper = 1.0 + 0.4 * self.sharpness
        return sharper * (2.0 * x - y * turn), sharper * (2.0 * y + x * turn)

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        th = patterns.angle(x, y)
        sine, swing = np.sin(th), np.sin(self.beta * th)
        phase = np.stack([x * x + y * y - swing**2, 2.0 * sine * swing, -(sine**2)])
        return _wave_heights(self, phase, where, weight)


def _wave_heights(kind: Any, phase: Array, where: npt.NDArray[np.int64], weight: Array) -> Heights:
    def fill(t: float, full: Array) -> None:
        kernels.waves(weight, phase, float(t), *_scale(1.0, kind.sharpness, kind.furrows), full)

    return _proportional(fill, where)


def _proportional(fill: Callable[[float, Array], None], where: npt.NDArray[np.int64]) -> Heights:
    """Waves are proportional to their strength: as long as t stays, `fill` computes them once."""
    full, last = np.empty(len(where)), [np.nan]

    def heights(strength: float, t: float, out: Array) -> None:
        if t != last[0]:
            fill(t, full)
            last[0] = t
        kernels.add(where, full, strength, out)

    return heights


@dataclass(frozen=True, kw_only=True)
class Cheek(Pattern):
    """Wrinkles in arcs about a place beside the region (see :func:`patterns.cheek`).

    Attributes
    ----------
    number : float
        Wrinkles from the near to the far border.
    sharpness : float
        Of the furrows; 0 is the paper's plain sine.
    radius : float
        Distance of the place about which they bend from the near border, in widths of the region.
    furrows : {"sharp", "paper"}
    """

    number: float = 3.0
    sharpness: float = 1.0
    radius: float = 0.5
    furrows: Furrows = "sharp"

    def __post_init__(self) -> None:
        _check_shape(self.number, self.sharpness, self.furrows)
        check_range("radius", self.radius, 0.0, 1000.0)

    @property
    def beta(self) -> float:
        """The paper's parameter of number."""
        return float(np.pi * self.number)

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        return uv[:, 0] + 1.0 + 2.0 * self.radius, aspect * uv[:, 1]

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        sine = patterns.cheek(x, y, t - self.beta * 2.0 * self.radius, 1.0, self.beta)
        return _shaped(sine, strength, self.sharpness, self.furrows)

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        steep = self.beta * (1.0 + 0.4 * self.sharpness) / np.maximum(np.hypot(x, y), 1e-12)
        return steep * x, steep * y

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        r = np.hypot(x, y)
        phase = np.stack([self.beta * (r - 2.0 * self.radius), np.ones_like(r), np.zeros_like(r)])
        return _wave_heights(self, phase, where, weight)


@dataclass(frozen=True, kw_only=True)
class Frown(Pattern):
    """Upright lines (see :func:`patterns.frown`).

    Attributes
    ----------
    number : float
        Wrinkles from side to side.
    sharpness : float
        Of the furrows; 0 is the paper's plain sine.
    spread : float
        How much the distance of the lines changes from the centre to the upper border, as a share; in [0, 1).
    variant : {"fan", "paper"}
        "fan" spreads upwards, "paper" draws together.
    offset : float
        Phase in the middle, radians: pi/2 has a bulge there, which is symmetric; 0 as printed.
    furrows : {"sharp", "paper"}
    """

    moving: ClassVar[bool] = True
    number: float = 2.0
    sharpness: float = 1.2
    spread: float = 0.3
    variant: patterns.Variant = "fan"
    offset: float = np.pi / 2
    furrows: Furrows = "sharp"

    def __post_init__(self) -> None:
        _check_shape(self.number, self.sharpness, self.furrows)
        check_range("spread", self.spread, 1e-3, 0.95)
        check_range("offset", self.offset, -1e3, 1e3)
        if self.variant not in patterns.VARIANTS:
            raise unknown_name("variant of frown", self.variant, patterns.VARIANTS)

    @property
    def beta(self) -> float:
        """The paper's parameter of distance, where y + t is 1 / spread in the centre."""
        t = 1.0 / self.spread
        return (t if self.variant == "paper" else 1.0 / t) / (np.pi * self.number)

    def time(self, seconds: float) -> float:
        """See :class:`Pattern`."""
        return 1.0 / self.spread

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        sine = patterns.frown(x, y, t, 1.0, self.beta, self.variant, self.offset)
        return _shaped(sine, strength, self.sharpness, self.furrows)

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        sharper = 1.0 + 0.4 * self.sharpness
        if self.variant == "paper":
            return sharper * (y + t) / self.beta, sharper * x / self.beta
        return sharper / (self.beta * (y + t)), -sharper * x / (self.beta * (y + t) ** 2)

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        if self.variant == "paper":
            phase = np.stack([x * y / self.beta + self.offset, x / self.beta, np.zeros_like(x)])
            return _wave_heights(self, phase, where, weight)

        def fill(t: float, full: Array) -> None:  # no polynomial in t
            full[:] = weight * self.relief(x, y, 1.0, t, aspect)

        return _proportional(fill, where)


@dataclass(frozen=True, kw_only=True)
class EyeCorner(Pattern):
    """Wrinkles that fan out (see :func:`patterns.eye_corner`); its t is the strength.

    Attributes
    ----------
    number : float
        Wrinkles from the lower to the upper border in the middle of the region.
    sharpness : float
        The largest t.
    decay : float
        How much shallower they are at the far border, as a power of e.
    radius : float
        Distance of the place from which they fan out from the near border, in widths of the region.
    gamma : int, optional
        The paper's number in the half circle; default: as `number` says. Above a radius of 0 any will do.
    furrows : {"sharp", "paper"}
        "paper" has sharp ridges and round valleys, as printed.
    """

    number: float = 4.0
    sharpness: float = 1.2
    decay: float = 0.8
    radius: float = 0.15
    gamma: float | None = None
    furrows: Furrows = "sharp"

    def __post_init__(self) -> None:
        _check_shape(self.number, self.sharpness, self.furrows)
        check_range("decay", self.decay, 0.0, 20.0)
        check_range("radius", self.radius, -0.5, 1000.0)
        if self.gamma is not None:
            check_range("gamma", self.gamma, 0.1, 1000.0)

    def gamma_of(self, aspect: float) -> float:
        """The paper's gamma on a region of this height over width."""
        if self.gamma is not None:
            return self.gamma
        return float(np.pi * self.number / np.arctan2(aspect, 1.0 + 2.0 * self.radius))

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        return uv[:, 0] + 1.0 + 2.0 * self.radius, aspect * uv[:, 1]

    def _amplitude(self, x: Array, y: Array) -> Array:
        return np.asarray(np.exp(-0.5 * self.decay * (np.hypot(x, y) - 2.0 * self.radius)))

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        k, gamma = self.sharpness, self.gamma_of(aspect)
        if self.furrows == "paper" and k >= 1e-6:
            beta, alpha = -0.5 * self.decay, np.exp(self.decay * self.radius)
            return patterns.eye_corner_relief(x, y, strength * k, alpha, beta, gamma) / (2.0 * np.sinh(k))
        sine = patterns.fan(x, y, gamma)
        return _rising(self._amplitude(x, y), sine, strength, k)

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        turn = self.gamma_of(aspect) * (1.0 + 0.4 * self.sharpness) / np.maximum(x * x + y * y, 1e-12)
        return -turn * y, turn * x

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        sine, share, k = patterns.fan(x, y, self.gamma_of(aspect)), weight * self._amplitude(x, y), self.sharpness
        scratch = np.empty(len(where))

        def heights(strength: float, t: float, out: Array) -> None:
            if k < 1e-6:
                shape = 0.0, 0.5 * strength, 0.0
            else:
                size = 0.5 / np.sinh(k)
                shape = float(i0(strength * k)) * size, -size, -strength * k
                if self.furrows == "paper":
                    shape = -size, size, -strength * k
            if strength > 0.0:
                kernels.standing(where, share, sine, *shape, scratch, out)

        return heights


def _rising(amplitude: Array, sine: Array, strength: float, k: float) -> Array:
    """``sharpened`` with a sharpness that rises with the strength, at the scale of the largest."""
    if k < 1e-6:
        return 0.5 * strength * amplitude * sine
    return np.asarray(amplitude * (np.i0(strength * k) - np.exp(-strength * k * sine)) / (2.0 * np.sinh(k)))


@dataclass(frozen=True, kw_only=True)
class Dimple(Pattern):
    """A pit (see :func:`patterns.dimple`); its t falls from infinity to `sharpest` as the strength rises.

    Attributes
    ----------
    sharpest : float
        The paper's t at full strength: 0.01 is a pin prick, 1 a shallow bowl.
    """

    sharpest: float = 0.1

    def __post_init__(self) -> None:
        check_range("sharpest", self.sharpest, 1e-6, 1e6, "It is the t of the paper's dimple at full strength.")

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        return patterns.dimple_relief(x, y, strength, self.sharpest)

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        r = np.hypot(x, y)
        steep = 2.0 / np.maximum(r, np.sqrt(self.sharpest))
        away = r > 1e-12
        return steep * np.divide(x, r, out=np.ones_like(x), where=away), steep * np.divide(
            y, r, out=0.0 * y, where=away
        )

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        square, full = np.minimum(x * x + y * y, 1.0), np.log1p(1.0 / self.sharpest)

        def heights(strength: float, t: float, out: Array) -> None:
            if strength > 0.0:
                kernels.dent(where, weight, square, patterns.dimple_time(strength, self.sharpest), 1.0 / full, out)

        return heights


@dataclass(frozen=True, kw_only=True)
class EyePouch(Pattern):
    """Skin that trembles (see :func:`patterns.eye_pouch`).

    Attributes
    ----------
    number : tuple of float
        Bumps across and up the region.
    gamma : int
        The paper's height: even for bumps that stick out; the larger, the narrower.
    trembling : float
        Share of the height that trembles: 0 is a pouch that keeps still, 1 the paper's, which runs along.
    frequency : float
        Of the trembling, Hz.
    alpha, beta : float
        Share of it along the two axes, in turns: the style of the trembling.
    """

    number: tuple[float, float] = (1.0, 0.6)
    gamma: int = 2
    trembling: float = 1.0
    frequency: float = 6.0
    alpha: float = 1.0
    beta: float = 0.0

    def __post_init__(self) -> None:
        if np.shape(self.number) != (2,):
            raise ParameterError(f"number must be two numbers of bumps, across and up, received {self.number!r}.")
        for bumps in self.number:
            check_range("number", bumps, 0.05, 1000.0)
        check_whole("gamma", self.gamma, 1, 64)
        check_range("trembling", self.trembling, 0.0, 1.0)
        check_range("frequency", self.frequency, 0.0, 1e6)
        check_range("alpha", self.alpha, -1e3, 1e3)
        check_range("beta", self.beta, -1e3, 1e3)

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        return np.pi * self.number[0] * uv[:, 0], np.pi * self.number[1] * uv[:, 1]

    def time(self, seconds: float) -> float:
        """See :class:`Pattern`."""
        return 2.0 * np.pi * self.frequency * seconds

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        still, running = (patterns.eye_pouch_relief(x, y, now, self.alpha, self.beta, self.gamma) for now in (0.0, t))
        return strength * ((1.0 - self.trembling) * still + self.trembling * running)

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        sharper = np.sqrt(self.gamma)
        return np.full_like(x, sharper), np.full_like(y, sharper)

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        turns = np.stack([np.cos(x), np.sin(x), np.cos(y), np.sin(y)], axis=1)

        def heights(strength: float, t: float, out: Array) -> None:
            for share, now in ((1.0 - self.trembling, 0.0), (self.trembling, t)):
                a, b = self.alpha * now, self.beta * now
                shift = np.cos(a), np.sin(a), np.cos(b), np.sin(b)
                if share > 0.0:
                    kernels.pouch(where, weight, turns, *shift, self.gamma, share * strength, out)

        return heights


@dataclass(frozen=True, kw_only=True)
class Custom(Pattern):
    """Any function f(x, y, t), 0 where it does nothing; x and y run from -1 to 1 times `extent`.

    Attributes
    ----------
    function : callable
    extent : tuple of float
    finest : float
        Half the wavelength of its finest detail, in its own coordinates: the mesh is refined accordingly.
    """

    function: patterns.Function
    extent: tuple[float, float] = (1.0, 1.0)
    finest: float = 0.25

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise ParameterError(
                f"a pattern must have a name or be a function of x, y and t, received {self.function!r}."
            )
        check_range("finest", self.finest, 1e-9, np.inf)
        for half in self.extent:
            check_range("extent", half, 1e-9, np.inf)

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        return self.extent[0] * uv[:, 0], self.extent[1] * uv[:, 1]

    def time(self, seconds: float) -> float:
        """See :class:`Pattern`."""
        return seconds

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        heights = np.asarray(self.function(x, y, t), dtype=np.float64)
        if heights.shape != x.shape or not np.isfinite(heights).all():
            raise ParameterError(
                f"the pattern's function must give one finite height per place, here {x.shape}; received "
                f"{heights.shape} with {int(np.sum(~np.isfinite(heights)))} that are not finite."
            )
        return strength * heights

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        return np.full_like(x, np.pi / self.finest), np.full_like(y, np.pi / self.finest)


KINDS: Mapping[str, type[Pattern]] = {
    "forehead": Forehead,
    "eye_corner": EyeCorner,
    "cheek": Cheek,
    "frown": Frown,
    "dimple": Dimple,
    "eye_pouch": EyePouch,
}
"""The paper's patterns by name."""


def pattern_of(what: str | Pattern | patterns.Function, words: Mapping[str, Any]) -> Pattern:
    """A pattern by name with its words, a pattern as it is, or a function of x, y and t.

    Raises
    ------
    UnknownNameError
        For an unknown pattern or word.

    Examples
    --------
    >>> pattern_of("forehead", {"number": 3, "style": "m"}).beta
    4.5
    """
    if isinstance(what, Pattern):
        if words:
            raise ParameterError(f"a pattern that is ready takes no more words, received {', '.join(words)}.")
        return what
    if callable(what):
        kind: type[Pattern] = Custom
        words = {"function": what, **words}
    elif what in KINDS:
        kind = KINDS[what]
    else:
        raise unknown_name("pattern", what, KINDS)
    for word in words:
        if word not in kind.__dataclass_fields__:
            raise unknown_name(f"word of {kind.__name__}", word, kind.__dataclass_fields__)
    return kind(**words)
