"""Muscles that turn the mandible, a lid or an eyeball, or put out the tongue; turns of the skin with bones and lids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from ...array_types import Array
from ...checks import vector
from ...errors import ParameterError, check_name, check_range
from ...geometry import unit
from .base import WRINKLES, Muscle


@dataclass(frozen=True, eq=False)
class _Joint(Muscle):
    """A muscle that moves no skin by itself, but a bone, a lid, an eye or the tongue."""

    ignored = WRINKLES
    folding = "it does not fold the skin"


@dataclass(frozen=True, eq=False)
class JawMuscle(_Joint):
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
        super().__post_init__()
        self._set(hinge=vector("hinge", self.hinge), axis=unit(vector("axis", self.axis)))
        check_range("angle", self.angle, 0.0, 0.6)


@dataclass(frozen=True, eq=False)
class TongueMuscle(_Joint):
    """The muscle that puts out the tongue; it moves no skin.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> isinstance(fw.default_face().muscles["genioglossus"], TongueMuscle)
    True
    """


@dataclass(frozen=True, eq=False)
class _OfEye(_Joint):
    """A muscle of one eye, which goes with it and its lids wherever these are placed."""

    side: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side not in ("l", "r"):
            raise ParameterError(f"side must be 'l' or 'r', received {self.side!r}.")


@dataclass(frozen=True, eq=False)
class LidMuscle(_OfEye):
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

    share: float = 0.25

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("share", self.share, 0.0, 1.0)


TURNS = {"up": (0.0, 1.0), "down": (0.0, -1.0), "inwards": (-1.0, 0.0), "outwards": (1.0, 0.0)}
"""Directions of turns of an eye: outwards (to its own side), and up."""


@dataclass(frozen=True, eq=False)
class EyeMuscle(_OfEye):
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

    turn: str
    angle: float

    def __post_init__(self) -> None:
        super().__post_init__()
        check_name("turn", self.turn, TURNS)
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


@dataclass(frozen=True, eq=False)
class JointWeights:
    """Turn of each vertex with a bone or a lid at full contraction.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
    angles : ndarray, shape (k,)
        Turn about `axis`, radians; downwards positive.
    hold : ndarray, shape (k,)
        In [0, 1]: 1 on the stiff plates of the lids (tarsi), which follow exactly, falling to 0 in the skin around.
    centre, axis : ndarray, shape (3,)
    bone : bool
        True if a bone turns, and with it the anchors of the tethers; False for a lid, to whose plate the skin is
        tethered as well.
    yields : tuple of str
        Names of muscles whose contraction takes the place of this one's: a lid that closes does not follow the eye, and
        one that goes with the eye is not lifted more.

    Examples
    --------
    Two vertices 10 mm in front of an axis, of which the second follows by half, at half a contraction:

    >>> weights = JointWeights(np.array([1, 2]), np.array([0.4, 0.2]), np.zeros(2), np.zeros(3), np.array([1.0, 0, 0]))
    >>> weights.turned(np.array([[0.0, 0, 0], [0, 0, 10], [0, 0, 10]]), rate=0.5)[:, 1].round(1)
    array([-2., -1.])
    """

    vertices: npt.NDArray[np.int64]
    angles: Array
    hold: Array
    centre: Array
    axis: Array
    bone: bool = False
    yields: tuple[str, ...] = ()

    def turned(self, points: Array, rate: float) -> Array:
        """Displacement (k, 3) of the `vertices` at a contraction rate, for rest positions (n, 3) of all vertices."""
        return turned(points[self.vertices] - self.centre, self.axis, rate * self.angles)


def turned(vectors: Array, axis: Array, angles: Array) -> Array:
    """Change of vectors (k, 3) that turn by angles (k,) about a unit axis."""
    return np.asarray(Rotation.from_rotvec(np.outer(angles, axis)).apply(vectors) - vectors)
