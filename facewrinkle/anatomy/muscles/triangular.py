"""Triangular muscles: fibres that fan out from a narrow end to a wide one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from ...array_types import Array
from ...errors import ParameterError, check_range
from .base import unit
from .skin_muscles import SheetMuscle


@dataclass(frozen=True, eq=False)
class TriangularMuscle(SheetMuscle):
    """A sheet whose lines of attachment and insertion have unequal widths, with straight fibres between them.

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
        As for :class:`SheetMuscle`, and if the fibres would meet before they end.

    Notes
    -----
    At the distance l from the attachment line the fan is ``W(l) = Wa + (Wi - Wa) l / li`` wide, li being the distance
    of the lines; ``lambda = l / Ls`` and ``gamma = 2 h / W(l)``, which is constant along a fibre. Lengthened, all
    fibres run through the focus at ``l = li Wa / (Wa - Wi)``; the pull is along them. With equal widths this is a
    sheet, with ``Wa = 0`` the plane section of a linear muscle. Paper A names triangular muscles as future work.

    Examples
    --------
    Twice as wide at its end as at its start; the point on the border there is pulled obliquely:

    >>> fan = TriangularMuscle([(-5, 40, 0), (5, 40, 0)], [(-10, 0, 0), (10, 0, 0)])
    >>> along, across = fan.coordinates([[10.0, 0.0, 0.0], [7.5, 20.0, 0.0]])
    >>> along.tolist(), across.tolist(), (fan.fold_direction([[10.0, 0.0, 0.0]]).round(3) + 0.0).tolist()
    ([1.0, 0.5], [1.0, 1.0], [[-0.124, 0.992, 0.0]])
    """

    LENGTHS: ClassVar[tuple[str, ...]] = (*SheetMuscle.LENGTHS, "insertion_width")

    insertion_width: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        ends = np.asarray(self.insertion)
        own = float(np.linalg.norm(ends[1] - ends[0]))
        self._set(insertion_width=check_range("insertion_width", self.insertion_width, 0.0, np.inf) or own)
        if self.width + self._widening * self.length < 0.0:
            raise ParameterError(
                f"the fibres meet {self._focus:g} from the attachment line; length must be at most that, received "
                f"{self.length!r}. A wider insertion moves their focus away."
            )

    @property
    def _widening(self) -> float:
        """dW / dl."""
        middle = np.asarray(self.insertion).mean(axis=0) - np.asarray(self.attachment).mean(axis=0)
        return (self.insertion_width - self.width) / float(np.linalg.norm(middle))

    @property
    def _focus(self) -> float:
        """l at which all fibres meet; negative behind the attachment, infinite for parallel ones."""
        return -self.width / self._widening if self._widening else np.inf

    def _half_width(self, along: Array) -> Array:
        # Never 0: at the focus gamma would be 0 / 0. Behind it there are no fibres.
        return np.maximum(0.5 * (self.width + self._widening * along), 1e-9 * self.length)

    @property
    def reach(self) -> tuple[Array, float]:
        """As for a sheet as wide as the wider end; behind the attachment line it may be wider still."""
        centre, radius = super().reach
        return centre, radius + (0.5 * abs(self._widening) * self.length if self.recoil else 0.0)

    def fold_direction(self, points: npt.ArrayLike) -> Array:
        """The direction of the fibre through each point, towards the attachment line."""
        origin, fibre, across, _ = self._axes
        offset = np.asarray(points, dtype=np.float64) - origin
        along, aside = self._plane(points)[0], offset @ across
        slope = 0.5 * self._widening * aside / self._half_width(along)
        return -unit(fibre + slope[:, None] * across)
