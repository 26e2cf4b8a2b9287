"""The motion of a face that performs a take: its muscles contract as the shapes ask, and the skin follows and folds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..anatomy.face import Face
from ..array_types import Array
from ..errors import ParameterError, check_range, warn
from ..motion.base import Undriven
from ..motion.skin import Skin
from .modelled import Movements
from .poses import CLEARING, contractions_of, share_of_side
from .shapes import Shape, shapes_of
from .takes import Take

PIVOT = np.array([0.0, -0.6, -1.3])
"""Place about which a head turns, [left, up, forward] from between the eyes, in distances between the pupils."""

SHOWN = 0.02
"""Shapes that a face cannot make and whose weight stays below this are not worth a word."""


class Performer(Undriven):
    """A motion that makes a face perform a take, in place of a linear mixture of blend shapes.

    At each time the muscles of all shapes contract as strongly as the weights say, those that several shapes ask for as
    the strongest says; the skin moves as in any simulation, with its contacts. What no muscle does (the jaw forward or
    aside, cheeks puffed, lips rolled in or sealed) is added to that, and cleared of teeth and of the other lip.

    Parameters
    ----------
    take : Take
        Of :func:`facewrinkle.read_take`.
    face : Face
        With muscles.
    time_step : float
        Seconds per step.
    speed : float
        Seconds of the take in one second.
    head : bool
        Turn the head as the take says.

    Attributes
    ----------
    left_out : dict of str to str
        Shapes of the take that the face cannot make, with the reason.

    Raises
    ------
    ParameterError
        If the face can make none of the shapes.

    Warns
    -----
    FaceWrinkleWarning
        For shapes that the take shows and the face cannot make.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> take = fw.Take(("browInnerUp",), np.array([0.0, 0.3]), np.array([[0.0], [1.0]]))
    >>> sim = fw.Simulation(face, motion=Performer(take, face))
    >>> *_, frame = sim.run(20)
    >>> float(np.ptp(frame["W"])) > 0.5
    True
    """

    def __init__(
        self,
        take: Take,
        face: Face,
        time_step: float = 0.02,
        speed: float = 1.0,
        head: bool = True,
    ) -> None:
        self.take, self.face, self.head = take, face, head and take.head is not None
        self.speed = check_range("speed", speed, 1e-6, 1e6)
        used = [name for name, most in zip(take.names, take.weights.max(axis=0), strict=True) if most > 0.0]
        shapes, self.left_out = shapes_of("+".join(used or take.names), face)
        shown = [n for n in self.left_out if take.weights[:, take.names.index(n)].max() > SHOWN]
        if shown:
            reasons = "; ".join(dict.fromkeys(self.left_out[name] for name in shown))
            warn(f"{len(shown)} shapes of the take are left out ({reasons}): {', '.join(shown)}.")
        self._skin = Skin(face, time_step)
        self.time_step, self.points = self._skin.time_step, self._skin.points
        self.names = self._skin.names
        self._movements = Movements(face)
        self._contractions = {
            name: contractions_of(self._skin, face, shape, 0.0 if shape.beyond else 1.0)  # correctives have none
            for name, shape in shapes.items()
        }
        self._ways, self._thrusts = self._modelled(shapes)
        modelled = self._ways or "mouthClose" in shapes
        self._clearing = Skin(face, CLEARING) if modelled else None
        self.reset()

    def _modelled(self, shapes: dict[str, Shape]) -> tuple[dict[str, Array], dict[str, Array]]:
        """Return the displacements (n, 3) and the motions of the mandible (4, 4) that are not muscles', by shape."""
        ways: dict[str, Array] = {}
        thrusts: dict[str, Array] = {}
        for name, shape in shapes.items():
            for movement, weight in shape.modelled.items():
                if movement == "seal":
                    continue
                own = weight * share_of_side(self.face, self.face.points, shape.side)
                ways[name] = ways.get(name, 0.0) + own * self._movements.of(movement)
                thrust = self._movements.mandible(movement) - np.eye(4)
                if thrust.any():
                    thrusts[name] = thrusts.get(name, 0.0) + weight * thrust
        return ways, thrusts

    def reset(self) -> None:
        """See :class:`facewrinkle.Motion`."""
        self._skin.reset()
        self._steps = 0
        self.rates, self.pose, self.mandible = self._skin.rates, self._pose(0.0), None

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """Return the present rates; raise a ParameterError if others are asked for."""
        if rates:
            raise ParameterError(
                f"this face performs a take, which contracts its muscles; asked for were {', '.join(map(str, rates))}. "
                "Leave motion out to contract them yourself."
            )
        return self.rates

    def step(self) -> Array:
        """See :class:`facewrinkle.Motion`; the first step leads to the time `time_step`."""
        self._steps += 1
        time = self._steps * self.time_step * self.speed
        weights = self.take.at(time)
        self._skin.set_rates(np.max([weights[name] * own for name, own in self._contractions.items()], axis=0))
        moved = self._skin.step()
        self.rates = self._skin.rates
        moved = self._added(moved, weights)
        self.mandible = None
        if self._thrusts:
            self.mandible = np.eye(4) + sum(weights[name] * thrust for name, thrust in self._thrusts.items())
        self.pose = self._pose(time)
        if self.pose is None:
            return moved
        return np.asarray(moved @ self.pose[:3, :3].T + self.face.unit * self.pose[:3, 3])

    def _added(self, moved: Array, weights: Mapping[str, float]) -> Array:
        """Return positions (n, 3), mm, with what is modelled besides."""
        way = np.zeros_like(moved)
        for name, own in self._ways.items():
            way += weights[name] * own
        closing = weights["mouthClose"] if "mouthClose" in self._contractions else 0.0
        if closing > 0.0:
            # A corrective of as much weight as that of the open jaw closes the lips, whatever that weight is.
            share = closing / max(closing, weights.get("jawOpen", 0.0))
            parted = (moved - self.points) / self.face.unit + way
            way += share * self._movements.seal(parted)
        if self._clearing is None or not way.any():
            return moved
        self._clearing.set_rates(self.rates)
        return self.points + self._clearing.cleared(moved + self.face.unit * way - self.points)

    def _pose(self, time: float) -> Array | None:
        """Return the matrix (4, 4) of the head at a time, in the unit of the face."""
        if not self.head:
            return None
        frame, out = self.face.frame, np.eye(4)
        pivot = frame.origin + PIVOT @ frame.axes * frame.pupil_distance
        out[:3, :3] = frame.axes.T @ self.take.turn(time) @ frame.axes
        out[:3, 3] = pivot - out[:3, :3] @ pivot
        return out
