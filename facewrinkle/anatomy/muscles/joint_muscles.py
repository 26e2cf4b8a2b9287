"""Muscles that turn the mandible, a lid or an eyeball, and the skin with it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from ...array_types import Array
from ...checks import vector
from ...errors import ParameterError, check_range, unknown_name
from .base import Muscle, unit


@dataclass(frozen=True, eq=False)
class JawMuscle(Muscle):
    """The depressors of the mandible, which turns about its hinge.

    Parameters
    ----------
    hinge, axis : (3,) array_like
        A point on the hinge, and the direction of the hinge about which a positive turn opens the mouth.
    angle : float
        Turn at full contraction, radians.

    Examples
    --------
    A jaw that opens wider, and takes the skin with it:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> jaw = face.muscles["jaw"]
    >>> wide = face.with_muscles({"jaw": jaw.replaced(angle=1.2 * jaw.angle)})
    >>> float((wide.joint_weights["jaw"].angles.max() / face.joint_weights["jaw"].angles.max()).round(9))
    1.2
    """

    hinge: Array
    axis: Array
    angle: float

    def __post_init__(self) -> None:
        self._check_common()
        object.__setattr__(self, "hinge", vector("hinge", self.hinge))
        object.__setattr__(self, "axis", unit(vector("axis", self.axis)))
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

    Examples
    --------
    A levator that turns the lid back over the ball by half the angle that closes the eye:

    >>> import facewrinkle as fw
    >>> weights = fw.default_face().with_muscles({"levator_palpebrae_l": LidMuscle("l", share=0.5)}).joint_weights
    >>> lifting, closing = weights["levator_palpebrae_l"], weights["orbicularis_oculi_l"]
    >>> float((lifting.angles.min() / closing.angles.max()).round(9))
    -0.5
    """

    side: str
    share: float = 0.25

    def __post_init__(self) -> None:
        self._check_common()
        if self.side not in ("l", "r"):
            raise ParameterError(f"side must be 'l' or 'r', received {self.side!r}.")
        check_range("share", self.share, 0.0, 1.0)

    def transformed(self, rotation: npt.ArrayLike, scale: float = 1.0, translation: npt.ArrayLike = (0, 0, 0)) -> Self:
        """The same muscle, or that of the other side if `rotation` mirrors: it goes with the lids."""
        if np.linalg.det(np.asarray(rotation, dtype=np.float64)) > 0.0:
            return self
        return dataclasses.replace(self, side="r" if self.side == "l" else "l")


TURNS = {"up": (0.0, 1.0), "down": (0.0, -1.0), "inwards": (-1.0, 0.0), "outwards": (1.0, 0.0)}
"""Directions of turns of an eye: outwards (to its own side), and up."""


@dataclass(frozen=True, eq=False)
class EyeMuscle(Muscle):
    """A straight muscle of the eye, which turns the eyeball; the lids follow.

    Parameters
    ----------
    side : {"l", "r"}
    turn : {"up", "down", "inwards", "outwards"}
    angle : float
        Turn at full contraction, radians.

    Examples
    --------
    Contraction rates of a muscle in an eye that looks up, and in one that looks down:

    >>> superior = EyeMuscle("l", "up", angle=0.8)
    >>> superior.rate(outwards=0.0, up=0.2), superior.rate(outwards=0.0, up=-0.2)
    (0.25, 0.0)
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
        """Return the muscle's contraction rate, in [0, 1], in an eye that is turned by these angles, radians.

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
        """The same muscle, or that of the other side if `rotation` mirrors: it goes with the eye."""
        if np.linalg.det(np.asarray(rotation, dtype=np.float64)) > 0.0:
            return self
        return dataclasses.replace(self, side="r" if self.side == "l" else "l")
