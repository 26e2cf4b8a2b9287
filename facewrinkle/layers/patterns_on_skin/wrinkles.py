"""Patterns, and those that are waves: wrinkles on the forehead and the cheeks, between the brows and beside the eyes.

Each kind lays the plane of its formula (:mod:`facewrinkle.layers.patterns`) on a region, whose own coordinates (u, v)
run from -1 to 1 between its borders, and scales its relief to 1 from bulge to furrow (a dimple or pouch: 1 deep or
high).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, get_args

import numpy as np
from scipy.special import i0  # of one number, much faster than NumPy's

from ...array_types import Array
from ...errors import check_name, check_positive, check_range, check_ranges, check_whole
from ...geometry import smoothstep
from .. import patterns


@dataclass(frozen=True, kw_only=True)
class Pattern:
    """A pattern: a plane, and heights over it.

    A kind has `plane`, which maps (u, v) to its own (x, y), given the region's height over its width (`aspect`);
    `relief`, the height at a strength in [0, 1] and a t; and `wave_vector`, the gradient of its phase. `moving` is
    True if its wavelengths change with t, `timed` if it has a t other than its strength.

    Examples
    --------
    A kind of one's own needs a relief and a wave vector:

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, kw_only=True)
    ... class Grooves(Pattern):
    ...     number: float = 6.0
    ...     def relief(self, x, y, strength, t, aspect):
    ...         return 0.5 * strength * np.cos(np.pi * self.number * x)
    ...     def wave_vector(self, x, y, t, aspect):
    ...         return np.full_like(x, np.pi * self.number), np.zeros_like(y)
    >>> import numpy as np, facewrinkle as fw
    >>> face = fw.default_face()
    >>> layer = fw.PatternLayer(Grooves(), face.landmarks["forehead_mid"], size=30.0, depth=0.5)
    >>> frame = fw.Simulation(face, layers=[layer], motion=fw.Still(face)).step()
    >>> round(float(np.ptp(frame["W"])), 1)
    0.5
    """

    moving: ClassVar[bool] = False
    timed: ClassVar[bool] = True

    def sized(self, size: Array) -> Pattern:
        """Return the pattern for a region of this width and height, mm."""
        return self

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """Return the (x, y) of points (k, 2) in the region."""
        return uv[:, 0], uv[:, 1]

    def time(self, seconds: float) -> float:
        """Return the t at a time, where the user gave none."""
        return 0.0

    def cycled(self, share: float) -> float:
        """Return the t at a share of a running cycle, after which the pattern is as it was."""
        return 2.0 * np.pi * share

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """Return heights (k,), 0 at strength 0."""
        raise NotImplementedError

    def wave_vector(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """Return the gradient of the phase along x and y: 2 pi over the wavelength of the finest detail."""
        raise NotImplementedError


def natural_variation(phase: Array, along: Array, amount: float, seed: int) -> tuple[Array, Array]:
    """Return the phase that natural variation adds to waves, and the share of their height that it leaves.

    A wrinkle is a furrow, where the sine of the phase is -1, and half a wave on both sides of it. Each has its own
    random numbers, drawn by seed and number, so that they are the same on every mesh and in every frame.

    Parameters
    ----------
    phase : ndarray, shape (k,)
        Phase of the waves, radians.
    along : ndarray, shape (k,)
        Place along the wrinkles, -1 to 1 from border to border.
    amount : float
        In [0, 1].
    seed : int

    Returns
    -------
    shift : ndarray, shape (k,)
        Radians.
    share : ndarray, shape (k,)

    Examples
    --------
    >>> shift, share = natural_variation(np.array([-0.5 * np.pi, 1.5 * np.pi]), np.zeros(2), 0.5, seed=1)
    >>> bool(shift[0] != shift[1]), bool((share > 0.5).all() and (share <= 1.0).all())
    (True, True)
    >>> [part.tolist() for part in natural_variation(np.zeros(1), np.zeros(1), 0.0, seed=1)]
    [[0.0], [1.0]]
    """
    distinct = 64  # wrinkles, after which they repeat
    drawn = np.random.default_rng(seed).random((distinct, 8))
    number = phase / (2.0 * np.pi) + 0.25
    first = np.floor(number)
    blend = smoothstep(number - first)
    shift, share = np.zeros_like(along), np.zeros_like(along)
    # The most, in radians, that place, slant, bend and waviness of a wrinkle shift its phase. Their sum must be below
    # 2.09, or neighbors could meet: between them the shift changes by up to twice it, at up to 1.5 times the mean rate.
    shifts = (0.5, 0.5, 0.6, 0.3)
    for k, part in ((first, 1.0 - blend), (first + 1.0, blend)):
        own = drawn[k.astype(np.int64) % distinct].T
        signed = 2.0 * own[:4] - 1.0
        bends = np.stack([np.ones_like(along), along, along**2, np.sin(4.0 * along + 2.0 * np.pi * own[4])])
        shift += part * np.einsum("i,ik,ik->k", shifts, signed, bends)
        share += part * _depth_along(along, own[5:], amount)
    return amount * shift, share


def _depth_along(along: Array, own: Array, amount: float) -> Array:
    """Depth along a wrinkle as a share: it may be shallower than others, and begin and end within the region.

    The depth takes the square of a random number: most wrinkles are nearly as deep as they can be.
    """
    deep = 1.0 - amount * 0.65 * own[0] ** 2  # of the depth it lacks 0.65 at most
    # The most that is lacking at each end, and the length over which an end fades, as shares of half the region.
    shorter, fade = 0.8, 0.6
    begins, ends = amount * shorter * own[1], amount * shorter * own[2]
    rises = 1.0 - amount * (1.0 - smoothstep((along + 1.0 - begins) / fade))
    falls = 1.0 - amount * (1.0 - smoothstep((1.0 - ends - along) / fade))
    return np.asarray(deep * rises * falls)


Furrows = Literal["sharp", "paper"]

SMALLEST_NUMBER, LARGEST_NUMBER = 0.1, 1000.0
"""The fewest and the most wrinkles from border to border."""


@dataclass(frozen=True, kw_only=True)
class Waves(Pattern):
    """Waves that follow one another over the region: wrinkles.

    Attributes
    ----------
    number : float
        Wrinkles from border to border.
    spacing : float, optional
        Distance from wrinkle to wrinkle, mm, in place of their number; where they fan out, in the middle of the region.
    sharpness : float
        Sharpness of the furrows; 0 is a plain sine.
    furrows : {"sharp", "paper"}
        "paper" has sharp ridges and round valleys, as printed.
    variation : float
        Differences of the wrinkles in length, depth, distance and bend, in [0, 1]; 0 is the paper's even pattern.
    seed : int
        Seed of the variation.

    Notes
    -----
    `across_axis` is 0 if the wrinkles follow each other across the region, 1 if they do so upwards.
    """

    across_axis: ClassVar[int] = 0
    number: float = 3.0
    spacing: float | None = None
    sharpness: float = 1.2
    furrows: Furrows = "sharp"
    variation: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        check_ranges(
            self,
            number=(SMALLEST_NUMBER, LARGEST_NUMBER),
            sharpness=(0.0, 20.0),
            variation=(0.0, 1.0, "0 is the paper's even pattern."),
        )
        check_name("kind of furrows", self.furrows, get_args(Furrows))
        check_whole("seed", self.seed, 0, 2**63)
        if self.spacing is not None:
            check_positive("spacing", self.spacing, "It is the distance from wrinkle to wrinkle, mm.")

    def sized(self, size: Array) -> Waves:
        """See :class:`Pattern`."""
        if self.spacing is None:
            return self
        length, narrowest = float(size[self.across_axis]), float(size[self.across_axis]) / LARGEST_NUMBER
        remedy = f"The region is {length:.3g} mm long across the wrinkles."
        check_range("spacing", self.spacing, narrowest, length / SMALLEST_NUMBER, remedy)
        return replace(self, number=length / self.spacing, spacing=None)

    def phase(self, x: Array, y: Array, t: float, aspect: float) -> Array:
        """Return the phase of the waves, radians: furrows are where its sine is -1."""
        raise NotImplementedError

    def place_along(self, x: Array, y: Array, aspect: float) -> Array:
        """Return the place along the wrinkles, -1 to 1 from border to border."""
        raise NotImplementedError

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`.

        Like the marks of age, natural variation belongs to the points of the skin: waves that move with time run
        through it.
        """
        phase = self.phase(x, y, t, aspect)
        if self.variation == 0.0:
            return self.heights(x, y, strength, np.sin(phase))
        still = self.phase(x, y, self.time(0.0), aspect)
        shift, share = natural_variation(still, self.place_along(x, y, aspect), self.variation, self.seed)
        return share * self.heights(x, y, strength, np.sin(phase + shift))

    def heights(self, x: Array, y: Array, strength: float, sine: Array) -> Array:
        """Return the heights (k,) of waves, given the sine of their phase."""
        return strength * self.of_sine(sine)

    def of_sine(self, sine: Array, strength: float = 1.0) -> Array:
        """Return a sine as a wave of this sharpness, 1 from bulge to furrow at the full strength.

        ``(exp(k sin) - 1) / (2 sinh(sharpness))`` with k the strength times the sharpness; where the furrows are to be
        sharp, upside down, and 0 on average. At the sharpness 0 it is half the sine.
        """
        k = strength * self.sharpness
        if self.sharpness < 1e-6:
            return 0.5 * strength * sine
        height = np.expm1(k * sine) if self.furrows == "paper" else i0(k) - np.exp(-k * sine)
        return np.asarray(height / (2.0 * np.sinh(self.sharpness)))

    def wave_vector(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        step = 1e-5  # over which the slope of the phase is measured
        finer = (1.0 + 0.4 * self.sharpness) * (1.0 + 0.1 * self.variation) / (2.0 * step)

        def rise(dx: float, dy: float) -> Array:
            ahead, behind = self.phase(x + dx, y + dy, t, aspect), self.phase(x - dx, y - dy, t, aspect)
            return np.remainder(ahead - behind + np.pi, 2.0 * np.pi) - np.pi  # an angle may jump by whole turns

        return finer * rise(step, 0.0), finer * rise(0.0, step)


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
        check_ranges(self, start=(0.1, 100.0, "The pattern has to keep away from its origin."), bend=(0.0, 100.0))
        if isinstance(self.style, str):
            check_name("style", self.style, STYLES)
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
        check_name("variant of frown", self.variant, get_args(patterns.Variant))

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
        check_ranges(self, decay=(0.0, 20.0), radius=(0.0, 1000.0), splay=(0.0, 0.9))

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
