"""Patterns that are waves: wrinkles of the forehead, the cheeks, a frown and the corners of the eyes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
import numpy.typing as npt
from scipy.special import i0  # of one number, much faster than NumPy's

from ...errors import ParameterError, check_positive, check_range, check_whole, unknown_name
from .. import patterns
from ..base import Array
from . import _kernels as kernels
from .base import Heights, Pattern
from .variation import natural

Furrows = Literal["sharp", "paper"]

STYLES: Mapping[str, float] = {"arcs": 1.5, "m": 4.5, "broken": 9.0}
"""Styles of forehead wrinkles, and their beta."""
FURROWS: tuple[Furrows, ...] = ("sharp", "paper")
SMALLEST_NUMBER, LARGEST_NUMBER = 0.1, 1000.0
FLAT = 1e-6
"""Below this sharpness waves are plain sines."""


@dataclass(frozen=True, kw_only=True)
class Waves(Pattern):
    """What wrinkles share.

    Attributes
    ----------
    number : float
        Wrinkles from border to border.
    spacing : float, optional
        From wrinkle to wrinkle, mm, in place of their number; where they fan out, in the middle of the region.
    sharpness : float
        Of the furrows; 0 is a plain sine.
    furrows : {"sharp", "paper"}
        "paper" has sharp ridges and round valleys, as printed.
    variation : float
        How much the wrinkles differ in length, depth, distance and bend, in [0, 1]; 0 is the paper's even pattern.
    seed : int
        Of the variation.

    Notes
    -----
    `across` tells whether the wrinkles follow each other across (0) or up (1) the region.
    """

    across: ClassVar[int] = 0
    number: float = 3.0
    spacing: float | None = None
    sharpness: float = 1.2
    furrows: Furrows = "sharp"
    variation: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        check_range("number", self.number, SMALLEST_NUMBER, LARGEST_NUMBER)
        check_range("sharpness", self.sharpness, 0.0, 20.0)
        if self.furrows not in FURROWS:
            raise unknown_name("kind of furrows", self.furrows, FURROWS)
        check_range("variation", self.variation, 0.0, 1.0, "0 is the paper's even pattern.")
        check_whole("seed", self.seed, 0, 2**63)
        if self.spacing is not None:
            check_positive("spacing", self.spacing, "It is the distance from wrinkle to wrinkle, mm.")

    def sized(self, size: Array) -> Waves:
        """See :class:`Pattern`."""
        if self.spacing is None:
            return self
        length, narrowest = float(size[self.across]), float(size[self.across]) / LARGEST_NUMBER
        remedy = f"The region is {length:.3g} mm long across the wrinkles."
        check_range("spacing", self.spacing, narrowest, length / SMALLEST_NUMBER, remedy)
        return replace(self, number=length / self.spacing, spacing=None)

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """Phase of the waves, radians: furrows are where its sine is -1."""
        raise NotImplementedError

    def along(self, x: Array, y: Array, aspect: float) -> Array:
        """Place along the wrinkles, -1 to 1 from border to border."""
        raise NotImplementedError

    def varied(self, x: Array, y: Array, aspect: float) -> tuple[Array | float, Array | float]:
        """What natural variation adds to the phase, and the share of the height that it leaves.

        It belongs to the places, like the history of a skin: waves that run on in time run through it.
        """
        if self.variation == 0.0:
            return 0.0, 1.0
        phase = self.phase(x, y, self.time(0.0), aspect)
        return natural(phase, self.along(x, y, aspect), self.variation, self.seed)

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        shift, share = self.varied(x, y, aspect)
        sine, k = np.sin(self.phase(x, y, t, aspect) + shift), self.sharpness
        if self.furrows == "paper" and k >= FLAT:
            return np.asarray(share * strength * np.expm1(k * sine) / (2.0 * np.sinh(k)))
        return np.asarray(share * strength * patterns.sharpened(sine, k))

    def waves(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        wx, wy = self.phase_slope(x, y, t, aspect)
        finer = (1.0 + 0.4 * self.sharpness) * (1.0 + 0.1 * self.variation)
        return finer * wx, finer * wy

    def phase_slope(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """Gradient of the phase, without variation."""
        raise NotImplementedError

    def _waves_of(
        self, phase: Array, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array
    ) -> Heights:
        """Heights whose phase is the polynomial in t with these coefficients (3, k)."""
        shift, share = self.varied(x, y, aspect)
        phase[0] += shift
        weight = weight * share

        def fill(t: float, full: Array) -> None:
            kernels.waves(weight, phase, float(t), *_scale(self.sharpness, self.furrows), full)

        return _proportional(fill, where)


def _scale(sharpness: float, furrows: Furrows) -> tuple[float, float, float]:
    """a, b and c of ``a + b exp(c s)``: :func:`patterns.sharpened`, or ``expm1(k s) / (2 sinh k)`` as in the paper."""
    if sharpness < FLAT:
        return 0.0, 0.5, 0.0
    size = 0.5 / np.sinh(sharpness)
    if furrows == "paper":
        return -size, size, sharpness
    return float(i0(sharpness)) * size, -size, -sharpness


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
class Forehead(Waves):
    """Wrinkles across the forehead (see :func:`patterns.forehead`), `number` of them from the lower to the upper
    border.

    Attributes
    ----------
    style : {"arcs", "m", "broken"} or float
        Or the paper's beta.
    sharpness : float
        The paper's alpha.
    bend : float
        How much the arcs are bent: half the width of the region in the pattern's units; in the paper 2.5.
    start : float
        The pattern's x at the lower border; the paper's pictures have 2. The larger, the more even the wrinkles.
    number, spacing, furrows, variation, seed :
        See :class:`Waves`.

    Examples
    --------
    Distances in millimetres in place of a number, on a forehead 80 mm wide and 30 mm high, and the paper's styles:

    >>> Forehead(spacing=6.0).sized(np.array([80.0, 30.0])).number
    5.0
    >>> {style: Forehead(style=style).beta for style in ("arcs", "m", "broken")}
    {'arcs': 1.5, 'm': 4.5, 'broken': 9.0}
    """

    moving: ClassVar[bool] = True
    across: ClassVar[int] = 1
    number: float = 4.0
    style: str | float = "m"
    bend: float = 2.5
    start: float = 4.0

    def __post_init__(self) -> None:
        super().__post_init__()
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

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """See :class:`Waves`."""
        return patterns.forehead_phase(x, y, t, self.beta)

    def along(self, x: Array, y: Array, aspect: float) -> Array:
        """See :class:`Waves`."""
        return y / max(self.bend, 1e-12)

    def phase_slope(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Waves`."""
        th, beta = patterns.angle(x, y), self.beta
        swing = t * np.sin(th) - np.sin(beta * th)
        turn = -2.0 * swing * (t * np.cos(th) - beta * np.cos(beta * th)) / (x * x + y * y)
        return 2.0 * x - y * turn, 2.0 * y + x * turn

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        th = patterns.angle(x, y)
        sine, swing = np.sin(th), np.sin(self.beta * th)
        phase = np.stack([x * x + y * y - swing**2, 2.0 * sine * swing, -(sine**2)])
        return self._waves_of(phase, x, y, aspect, where, weight)


@dataclass(frozen=True, kw_only=True)
class Cheek(Waves):
    """Wrinkles in arcs about a place beside the region (see :func:`patterns.cheek`), `number` of them from the near to
    the far border.

    Attributes
    ----------
    radius : float
        Distance of the place about which they bend from the near border, in widths of the region.
    number, spacing, sharpness, furrows, variation, seed :
        See :class:`Waves`.

    Examples
    --------
    Across two wrinkles from border to border: bulges stand out 0.38, furrows are 0.62 deep and narrower.

    >>> cheek = Cheek(number=2)
    >>> x, y = cheek.plane(np.stack([np.linspace(-1, 1, 9), np.zeros(9)], axis=1), aspect=1.0)
    >>> cheek.relief(x, y, strength=1.0, t=0.0, aspect=1.0).round(2).tolist()
    [0.11, 0.38, 0.11, -0.62, 0.11, 0.38, 0.11, -0.62, 0.11]
    """

    sharpness: float = 1.0
    radius: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("radius", self.radius, 0.0, 1000.0)

    @property
    def beta(self) -> float:
        """The paper's parameter of number."""
        return float(np.pi * self.number)

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        return uv[:, 0] + 1.0 + 2.0 * self.radius, aspect * uv[:, 1]

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """See :class:`Waves`."""
        return patterns.cheek_phase(x, y, t - self.beta * 2.0 * self.radius, self.beta)

    def along(self, x: Array, y: Array, aspect: float) -> Array:
        """See :class:`Waves`."""
        return y / aspect

    def phase_slope(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Waves`."""
        steep = self.beta / np.maximum(np.hypot(x, y), 1e-12)
        return steep * x, steep * y

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        phase = np.stack([self.phase(x, y, 0.0, aspect), np.ones_like(x), np.zeros_like(x)])
        return self._waves_of(phase, x, y, aspect, where, weight)


@dataclass(frozen=True, kw_only=True)
class Frown(Waves):
    """Upright lines (see :func:`patterns.frown`), `number` of them from side to side.

    Attributes
    ----------
    spread : float
        How much the distance of the lines changes from the centre to the upper border, as a share; in [0, 1).
    variant : {"fan", "paper"}
        "fan" spreads upwards, "paper" draws together.
    offset : float
        Phase in the middle, radians: pi/2 has a bulge there, which is symmetric; 0 as printed.
    number, spacing, sharpness, furrows, variation, seed :
        See :class:`Waves`.

    Examples
    --------
    How far the right line is from the middle, at the lower border of the region, half way, and at the upper one:

    >>> frown, side = Frown(number=2, spread=0.3), np.linspace(0.0, 1.0, 101)
    >>> for height in (-1.0, 0.0, 1.0):
    ...     across = frown.relief(side, np.full(101, height), 1.0, frown.time(0.0), 1.0)
    ...     print(side[across.argmin()].round(2))
    0.35
    0.5
    0.65
    """

    moving: ClassVar[bool] = True
    number: float = 2.0
    spread: float = 0.3
    variant: patterns.Variant = "fan"
    offset: float = np.pi / 2

    def __post_init__(self) -> None:
        super().__post_init__()
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

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """See :class:`Waves`."""
        return patterns.frown_phase(x, y, t, self.beta, self.variant) + self.offset

    def along(self, x: Array, y: Array, aspect: float) -> Array:
        """See :class:`Waves`."""
        return y

    def phase_slope(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Waves`."""
        if self.variant == "paper":
            return (y + t) / self.beta, x / self.beta
        return 1.0 / (self.beta * (y + t)), -x / (self.beta * (y + t) ** 2)

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        if self.variant == "paper":
            phase = np.stack([x * y / self.beta + self.offset, x / self.beta, np.zeros_like(x)])
            return self._waves_of(phase, x, y, aspect, where, weight)
        shift, share = self.varied(x, y, aspect)
        waves = np.zeros((3, len(x)))

        def fill(t: float, full: Array) -> None:  # no polynomial in t
            waves[0] = self.phase(x, y, t, aspect) + shift
            kernels.waves(weight * share, waves, 0.0, *_scale(self.sharpness, self.furrows), full)

        return _proportional(fill, where)


@dataclass(frozen=True, kw_only=True)
class EyeCorner(Waves):
    """Wrinkles that fan out (see :func:`patterns.eye_corner`), `number` of them from the lower to the upper border in
    the middle of the region; the paper's t is the strength.

    Attributes
    ----------
    sharpness : float
        The largest t.
    decay : float
        How much shallower they are at the far border, as a power of e.
    radius : float
        Distance of the place from which they fan out from the near border, in widths of the region.
    gamma : int, optional
        The paper's number in the half circle; default: as `number` says. At a radius below 0 it has to be even.
    splay : float
        How much they curve apart outwards, in [0, 0.9]: the share by which the angle between them would be smaller
        without. 0 is straight, as printed.
    number, spacing, furrows, variation, seed :
        See :class:`Waves`.

    Examples
    --------
    Outwards the wrinkles grow shallower, and the distance from one to the next grows:

    >>> crows_feet = EyeCorner(number=4, decay=0.8, radius=0.5)
    >>> x, y = crows_feet.plane(np.array([[-1.0, 0.0], [1.0, 0.0]]), aspect=0.5)
    >>> crows_feet.amplitude(x, y).round(2)
    array([1.  , 0.45])
    >>> across = crows_feet.phase_slope(x, y, 0.0, aspect=0.5)[1]
    >>> float((across[0] / across[1]).round(9))
    3.0
    """

    timed: ClassVar[bool] = False
    across: ClassVar[int] = 1
    number: float = 4.0
    decay: float = 0.8
    radius: float = 0.15
    gamma: float | None = None
    splay: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("decay", self.decay, 0.0, 20.0)
        check_range("radius", self.radius, -0.5, 1000.0)
        if self.gamma is not None:
            check_range("gamma", self.gamma, 0.1, 1000.0)
        check_range("splay", self.splay, 0.0, 0.9)
        if self.splay > 0.0 and self.radius < 0.0:
            raise ParameterError(
                f"wrinkles that curve apart (splay={self.splay:g}) must begin outside the region, or the surface would "
                f"tear: radius must be 0 or more, received {self.radius:g}. Use splay=0, or a larger radius."
            )

    def gamma_of(self, aspect: float) -> float:
        """The paper's gamma on a region of this height over width."""
        if self.gamma is not None:
            return self.gamma
        gamma = float(np.pi * self.number / np.arctan2(aspect, 1.0 + 2.0 * self.radius))
        return gamma if self.radius >= 0.0 else max(2.0 * round(0.5 * gamma), 2.0)

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        return uv[:, 0] + 1.0 + 2.0 * self.radius, aspect * uv[:, 1]

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """See :class:`Waves`."""
        straight = patterns.eye_corner_phase(x, y, self.gamma_of(aspect))
        return straight if self.splay == 0.0 else self._closer(x) * straight

    def _closer(self, x: Array) -> Array:
        """What is left of the angle: 1 at the near border, 1 - splay at the far one."""
        return 1.0 - 0.5 * self.splay * (x - 2.0 * self.radius)

    def along(self, x: Array, y: Array, aspect: float) -> Array:
        """See :class:`Waves`; they differ less in where they begin, which is at the eye."""
        return 1.0 - 0.6 * (2.0 + 2.0 * self.radius - x)

    def phase_slope(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Waves`."""
        gamma, closer = self.gamma_of(aspect), self._closer(x)
        turn = gamma * closer / np.maximum(x * x + y * y, 1e-12)
        return -turn * y - 0.5 * self.splay * gamma * patterns.angle(x, y), turn * x

    def amplitude(self, x: Array, y: Array) -> Array:
        """The decay from 1 at the near border, in the middle."""
        return np.asarray(np.exp(-0.5 * self.decay * (np.hypot(x, y) - 2.0 * self.radius)))

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        shift, share = self.varied(x, y, aspect)
        sine = np.sin(self.phase(x, y, t, aspect) + shift)
        a, b, c = self._rising(strength)
        return np.asarray(
            share * self.amplitude(x, y) * (b * sine if self.sharpness < FLAT else a + b * np.exp(c * sine))
        )

    def _rising(self, strength: float) -> tuple[float, float, float]:
        """As `_scale`, with a sharpness that rises with the strength, at the scale of the largest."""
        k = self.sharpness
        if k < FLAT:
            return 0.0, 0.5 * strength, 0.0
        size = 0.5 / np.sinh(k)
        if self.furrows == "paper":
            return -size, size, -strength * k
        return float(i0(strength * k)) * size, -size, -strength * k

    def prepared(self, x: Array, y: Array, aspect: float, where: npt.NDArray[np.int64], weight: Array) -> Heights:
        """See :class:`Pattern`."""
        shift, share = self.varied(x, y, aspect)
        sine = np.sin(self.phase(x, y, 0.0, aspect) + shift)
        full = weight * share * self.amplitude(x, y)
        scratch = np.empty(len(where))

        def heights(strength: float, t: float, out: Array) -> None:
            if strength > 0.0:
                kernels.standing(where, full, sine, *self._rising(strength), scratch, out)

        return heights
