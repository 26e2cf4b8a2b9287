"""Kinds of patterns by name, and those that are not waves: dimples, eye pouches, and functions of one's own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from ...array_types import Array
from ...errors import ParameterError, check_name, check_positive, check_range, check_ranges, check_whole, unknown_name
from .. import patterns
from .wrinkles import Cheek, EyeCorner, Forehead, Frown, Pattern

HANG = 1.2
"""By how much flesh hangs into a dimple from above: 0 leaves it round, from 1.8 on its bottom would fold."""


@dataclass(frozen=True, kw_only=True)
class Dimple(Pattern):
    """A pit (see :func:`facewrinkle.layers.patterns.dimple`); its t falls from infinity to `sharpest` as the strength
    rises. Flesh hangs into it: above, its wall is gentle, and below, steep.

    Attributes
    ----------
    sharpest : float
        The paper's t at full strength: 0.01 is a pin prick, 1 a shallow bowl.

    Examples
    --------
    From the middle to the border, a bowl and a pin prick:

    >>> x, y = np.linspace(0.0, 1.0, 5), np.zeros(5)
    >>> for sharpest in (1.0, 0.01):
    ...     print(Dimple(sharpest=sharpest).relief(x, y, strength=1.0, t=0.0, aspect=1.0).round(2).tolist())
    [-1.0, -0.91, -0.68, -0.36, 0.0]
    [-1.0, -0.57, -0.29, -0.12, 0.0]
    """

    timed: ClassVar[bool] = False
    sharpest: float = 0.1

    def __post_init__(self) -> None:
        check_range("sharpest", self.sharpest, 1e-6, 1e6, "It is the t of the paper's dimple at full strength.")

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        t = patterns.dimple_time(strength, self.sharpest)
        if not np.isfinite(t):
            return np.zeros_like(x)
        y = y - HANG * y**2 * np.maximum(1.0 - x**2 - y**2, 0.0)
        pit = patterns.dimple(x, y, t) - patterns.dimple(1.0, 0.0, t)
        return np.asarray(np.minimum(pit, 0.0) / np.log1p(1.0 / self.sharpest))

    def wave_vector(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        r = np.hypot(x, y)
        steep = 2.0 / np.maximum(r, np.sqrt(self.sharpest))
        away = r > 1e-12
        return steep * np.divide(x, r, out=np.ones_like(x), where=away), steep * np.divide(
            y, r, out=0.0 * y, where=away
        )


CREASE_ABOVE, CREASE_BELOW, CREASE_ROUND = 0.22, 0.3, 0.06
"""Extent of the walls of a pouch's crease upwards and downwards, and of its round bottom, in half heights of the
region.
"""


@dataclass(frozen=True, kw_only=True)
class EyePouch(Pattern):
    """A pouch of skin that trembles (see :func:`facewrinkle.layers.patterns.eye_pouch`).

    Attributes
    ----------
    number : tuple of float
        Bumps across and up the region.
    gamma : int
        The paper's height: even for bumps that stick out; the larger, the narrower.
    trembling : float
        Share of the height that trembles: 0 is a pouch that keeps still, 1 the paper's, which runs along.
    frequency : float
        Frequency of the trembling, Hz.
    alpha, beta : float
        Cycles that the bumps run along x and y in each period: the style of the trembling.
    crease : float
        Depth of the furrow in which the pouch ends below, as a share of its height; 0 is the paper's soft edge.
    crease_at : float
        Distance of the furrow below the middle, in half heights of the region.

    Examples
    --------
    Height of the middle at the start, and half a period later, when the trembling part is down:

    >>> middle = np.zeros(1)
    >>> for trembling in (1.0, 0.3, 0.0):
    ...     pouch = EyePouch(trembling=trembling, frequency=5.0)
    ...     print(*(pouch.relief(middle, middle, 1.0, pouch.time(seconds), 1.0).round(2) for seconds in (0.0, 0.1)))
    [1.] [0.]
    [1.] [0.7]
    [1.] [1.]
    """

    number: tuple[float, float] = (1.0, 0.6)
    gamma: int = 2
    trembling: float = 1.0
    frequency: float = 6.0
    alpha: float = 1.0
    beta: float = 0.0
    crease: float = 0.0
    crease_at: float = 0.4

    def __post_init__(self) -> None:
        if np.shape(self.number) != (2,):
            raise ParameterError(f"number must be two numbers of bumps, across and up, received {self.number!r}.")
        for bumps in self.number:
            check_range("number", bumps, 0.05, 1000.0)
        check_whole("gamma", self.gamma, 1, 64)
        check_ranges(
            self,
            trembling=(0.0, 1.0),
            frequency=(0.0, 1e6),
            alpha=(-1e3, 1e3),
            beta=(-1e3, 1e3),
            crease=(0.0, 1.0, "It is a share of the height."),
            crease_at=(-1.0, 1.0),
        )

    def plane(self, uv: Array, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        return np.pi * self.number[0] * uv[:, 0], np.pi * self.number[1] * uv[:, 1]

    def time(self, seconds: float) -> float:
        """See :class:`Pattern`."""
        return 2.0 * np.pi * self.frequency * seconds

    def relief(self, x: Array, y: Array, strength: float, t: float, aspect: float) -> Array:
        """See :class:`Pattern`."""
        still, running = (
            patterns.eye_pouch(x, y, 1.0, self.alpha * now, self.beta * now, self.gamma) for now in (0.0, t)
        )  # at the formula's t of 1, by which its height is divided
        bumps = ((1.0 - self.trembling) * still + self.trembling * running) / 2.0**self.gamma
        above, furrow = self._edge(y)
        return np.asarray(strength * (above * bumps - furrow))

    def _edge(self, y: Array) -> tuple[Array | float, Array | float]:
        """The remaining share of the bumps, which fall steeply to the crease, and the depth of the crease, which is
        steep above and runs out slowly below.
        """
        if self.crease == 0.0:
            return 1.0, 0.0
        d = y / (np.pi * self.number[1]) + self.crease_at
        away = np.sqrt(d * d + CREASE_ROUND**2) - CREASE_ROUND
        above = 0.5 * (1.0 + d / (away + CREASE_ROUND))
        width = CREASE_BELOW + (CREASE_ABOVE - CREASE_BELOW) * above
        return above * -np.expm1(-away / CREASE_ABOVE), self.crease * np.exp(-away / width)

    def wave_vector(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
        """See :class:`Pattern`."""
        sharper = np.sqrt(self.gamma)
        across, up = np.full_like(x, sharper), np.full_like(y, sharper)
        if self.crease > 0.0:
            d = np.abs(y / (np.pi * self.number[1]) + self.crease_at)
            up[d < 2.0 * CREASE_BELOW] = 0.5 / (CREASE_ABOVE * self.number[1])
        return across, up


@dataclass(frozen=True, kw_only=True)
class Custom(Pattern):
    """Any function f(x, y, t), 0 where it leaves the skin alone.

    Attributes
    ----------
    function : callable
        x and y run from -1 to 1.
    finest : float
        Half the wavelength of its finest detail, in these coordinates: the mesh is refined accordingly.

    Examples
    --------
    A scar, a tenth of the region wide, for which the mesh is refined:

    >>> import facewrinkle as fw
    >>> scar = Custom(function=lambda x, y, t: -np.exp(-((x + y) / 0.1) ** 2), finest=0.1)
    >>> face = fw.default_face()
    >>> layer = fw.PatternLayer(scar, face.landmarks["forehead_mid"], size=20.0, depth=0.8)
    >>> frame = fw.Simulation(face, layers=[layer], motion=fw.Still(face)).step()
    >>> round(float(frame["W"].min()), 1)
    -0.8
    """

    function: patterns.PatternFunction
    finest: float = 0.25

    def __post_init__(self) -> None:
        check_positive("finest", self.finest)

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

    def wave_vector(self, x: Array, y: Array, t: float, aspect: float) -> tuple[Array, Array]:
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


def pattern_of(
    what: str | Pattern | patterns.PatternFunction, parameters: Mapping[str, Any], seed: int | None = None
) -> Pattern:
    """Return a pattern by name with its parameters, a pattern as it is, or that of a function of x, y and t.

    `seed` is passed to patterns that have one.

    Raises
    ------
    UnknownNameError
        For an unknown pattern or parameter.

    Examples
    --------
    >>> pattern_of("forehead", {"number": 3, "style": "m"}).beta
    4.5
    """
    if isinstance(what, Pattern):
        if parameters:
            raise ParameterError(f"a Pattern takes no more parameters, received {', '.join(parameters)}.")
        return what
    if callable(what):
        kind: type[Pattern] = Custom
        parameters = {"function": what, **parameters}
    elif isinstance(what, str) and what in KINDS:
        kind = KINDS[what]
    else:
        raise unknown_name("pattern", what, KINDS)
    known = [field.name for field in fields(kind)]
    for name in parameters:
        check_name(f"parameter of {kind.__name__}", name, known)
    if seed is not None and "seed" in known:
        parameters = {"seed": seed, **parameters}
    return kind(**parameters)
