"""Patterns of wrinkles: on the forehead and the cheeks, between the brows and at the corners of the eyes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, get_args

import numpy as np

from ...array_types import Array
from ...errors import check_range, unknown_name
from .. import patterns
from .base import Waves

STYLES: Mapping[str, float] = {"arcs": 1.5, "m": 4.5, "broken": 9.0}
"""Styles of forehead wrinkles, and their beta."""


@dataclass(frozen=True, kw_only=True)
class Forehead(Waves):
    """Wrinkles across the forehead (see :func:`facewrinkle.layers.patterns.forehead`), `number` of them from the lower
    to the upper border.

    Attributes
    ----------
    style : {"arcs", "m", "broken"} or float
        A number is the paper's beta.
    sharpness : float
        The paper's alpha.
    bend : float
        Bend of the arcs: half the width of the region in the pattern's units; in the paper 2.5.
    start : float
        The pattern's x at the lower border; the paper's pictures have 2. The larger, the more even the wrinkles.
    number, spacing, furrows, variation, seed :
        See :class:`Waves`.

    Examples
    --------
    A spacing of 6 mm on a forehead 80 mm wide and 30 mm high, and the paper's styles:

    >>> Forehead(spacing=6.0).sized(np.array([80.0, 30.0])).number
    5.0
    >>> {style: Forehead(style=style).beta for style in ("arcs", "m", "broken")}
    {'arcs': 1.5, 'm': 4.5, 'broken': 9.0}
    """

    moving: ClassVar[bool] = True
    across_axis: ClassVar[int] = 1
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

    def cycled(self, share: float) -> float:
        """See :class:`Pattern`; from 0 to 4, as in the paper's Fig. 1, and back."""
        return float(2.0 - 2.0 * np.cos(2.0 * np.pi * share))

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        end = np.sqrt(self.start**2 + 2.0 * np.pi * self.number)
        return self.start + 0.5 * (uv[:, 1] + 1.0) * (end - self.start), self.bend * uv[:, 0]

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """See :class:`Waves`."""
        return patterns.forehead_phase(x, y, t, self.beta)

    def place_along(self, x: Array, y: Array, aspect: float) -> Array:
        """See :class:`Waves`."""
        return y / max(self.bend, 1e-12)


@dataclass(frozen=True, kw_only=True)
class Cheek(Waves):
    """Wrinkles in arcs about a point beside the region (see :func:`facewrinkle.layers.patterns.cheek`), `number` of
    them from the near to the far border.

    Attributes
    ----------
    radius : float
        Distance of that point from the near border, in widths of the region.
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

    def place_along(self, x: Array, y: Array, aspect: float) -> Array:
        """See :class:`Waves`."""
        return y / aspect


@dataclass(frozen=True, kw_only=True)
class Frown(Waves):
    """Upright lines (see :func:`facewrinkle.layers.patterns.frown`), `number` of them from side to side.

    Attributes
    ----------
    spread : float
        Change in the distance of the lines from the center to the upper border, as a share; in [0, 1).
    variant : {"fan", "paper"}
        "fan" spreads upwards, with a bulge in the middle; "paper" draws together, and is as printed.
    number, spacing, sharpness, furrows, variation, seed :
        See :class:`Waves`.

    Examples
    --------
    Distance of the right line from the middle at the lower border of the region, half way, and at the upper one:

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

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("spread", self.spread, 1e-3, 0.95)
        if self.variant not in get_args(patterns.Variant):
            raise unknown_name("variant of frown", self.variant, get_args(patterns.Variant))

    @property
    def beta(self) -> float:
        """The paper's parameter of distance, where y + t is 1 / spread in the center."""
        t = 1.0 / self.spread
        return (t if self.variant == "paper" else 1.0 / t) / (np.pi * self.number)

    def time(self, seconds: float) -> float:
        """See :class:`Pattern`."""
        return 1.0 / self.spread

    def cycled(self, share: float) -> float:
        """See :class:`Pattern`; the lines become more parallel, and spread again."""
        return float(self.time(0.0) * (1.25 - 0.25 * np.cos(2.0 * np.pi * share)))

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """See :class:`Waves`."""
        middle = 0.5 * np.pi if self.variant == "fan" else 0.0
        return patterns.frown_phase(x, y, t, self.beta, self.variant) + middle

    def place_along(self, x: Array, y: Array, aspect: float) -> Array:
        """See :class:`Waves`."""
        return y


@dataclass(frozen=True, kw_only=True)
class EyeCorner(Waves):
    """Wrinkles that fan out (see :func:`facewrinkle.layers.patterns.eye_corner`), `number` of them from the lower to
    the upper border in the middle of the region; the paper's t is the strength.

    Attributes
    ----------
    sharpness : float
        The largest t.
    decay : float
        They are exp(-decay) times as deep at the far border as at the near one.
    radius : float
        Distance from the near border to the point from which they fan out, in widths of the region.
    splay : float
        Curving apart outwards, in [0, 0.9]: at the far border the angle between them is 1 / (1 - splay) times as large.
        0 is straight, as printed.
    number, spacing, furrows, variation, seed :
        See :class:`Waves`.

    Examples
    --------
    Outwards the distance from one wrinkle to the next grows:

    >>> crows_feet = EyeCorner(number=4, decay=0.8, radius=0.5)
    >>> x, y = crows_feet.plane(np.array([[-1.0, 0.0], [1.0, 0.0]]), aspect=0.5)
    >>> across = crows_feet.wave_vector(x, y, 0.0, aspect=0.5)[1]
    >>> float((across[0] / across[1]).round(6))
    3.0
    """

    timed: ClassVar[bool] = False
    across_axis: ClassVar[int] = 1
    number: float = 4.0
    decay: float = 0.8
    radius: float = 0.15
    splay: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("decay", self.decay, 0.0, 20.0)
        check_range("radius", self.radius, 0.0, 1000.0)
        check_range("splay", self.splay, 0.0, 0.9)

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        return uv[:, 0] + 1.0 + 2.0 * self.radius, aspect * uv[:, 1]

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """See :class:`Waves`."""
        return patterns.eye_corner_phase(x, y, self.gammas(x, aspect))

    def gammas(self, x: Array, aspect: float) -> Array:
        """Return the paper's gamma at points: `number` in the middle, and 1 - splay of itself at the far border."""
        gamma = np.pi * self.number / np.arctan2(aspect, 1.0 + 2.0 * self.radius)
        return np.asarray(gamma * (1.0 - 0.5 * self.splay * (x - 2.0 * self.radius)))

    def place_along(self, x: Array, y: Array, aspect: float) -> Array:
        """See :class:`Waves`; the wrinkles differ less at their near ends, which are at the eye."""
        return 1.0 - 0.6 * (2.0 + 2.0 * self.radius - x)

    def heights(self, x: Array, y: Array, strength: float, sine: Array) -> Array:
        """See :class:`Waves`; the paper's t is the strength times the sharpness."""
        level = np.exp(-self.decay * (0.5 * np.hypot(x, y) - self.radius))
        return level * self.of_sine(-sine if self.furrows == "paper" else sine, strength)  # printed with a minus
