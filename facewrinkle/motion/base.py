"""What a motion is: something that moves the base mesh, step by step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..errors import ParameterError, check_range

Array = npt.NDArray[np.float64]


class Motion(Protocol):
    """A motion hands out the base mesh of one moment after the other.

    Attributes
    ----------
    names : tuple of str
        The face's muscles if their contraction drives the motion; empty if nothing does.
    rates : ndarray, shape (k,)
        Present contraction rates, in the order of `names`.
    points : ndarray, shape (n, 3)
        The base mesh at rest, mm.
    time_step : float
        Seconds per step.

    A motion that also moves the head as a whole may tell so: its `pose` is a matrix (4, 4) in the unit of the face's
    mesh, or None. What is drawn beside the skin goes with it. One that no muscles drive may tell where the eyes look:
    its `gazes` are unit vectors (3,) by side ("l", "r"), of the head at rest; and where parts beside the skin are: its
    `parts` are points (k, 3) by name in the unit of the mesh, NaN for those that are carried along.

    Examples
    --------
    A head that nods, a motion of one's own:

    >>> class Nod:
    ...     names, rates, time_step = (), np.empty(0), 0.02
    ...     def __init__(self, face):
    ...         self.points, self.steps = face.points * face.unit, 0
    ...     def reset(self):
    ...         self.steps = 0
    ...     def step(self):
    ...         self.steps += 1
    ...         return self.points - [0.0, 10.0 * np.sin(self.steps * self.time_step), 0.0]
    ...     def rates_of(self, rates):
    ...         return self.rates
    ...     def set_rates(self, rates):
    ...         pass
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> *_, frame = fw.Simulation(face, layers=[], motion=Nod(face)).run(50)
    >>> round(float((frame.points[: len(face.points)] - face.points)[:, 1].max()), 2)
    -8.41
    """

    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def rates(self) -> Array: ...
    @property
    def points(self) -> Array: ...
    @property
    def time_step(self) -> float: ...

    def reset(self) -> None:
        """Back to the beginning: at time 0, with all rates 0."""

    def step(self) -> Array:
        """Advance by one time step; returns the positions (n, 3) in mm, which the caller does not change."""

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """Contraction rates (k,) by name, checked; those not named are 0."""

    def set_rates(self, rates: Array) -> None:
        """Set the contraction rates (k,), without checks."""


class Undriven:
    """What motions have in common that no muscle drives.

    Examples
    --------
    Skin that swells needs points, a time step, and these two methods:

    >>> class Swelling(Undriven):
    ...     time_step = 0.02
    ...     def __init__(self, face):
    ...         self.points, self.normals, self.thickness = face.points * face.unit, face.tissue.normals, 0.0
    ...     def reset(self):
    ...         self.thickness = 0.0
    ...     def step(self):
    ...         self.thickness += 0.1
    ...         return self.points + self.thickness * self.normals
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> sim = fw.Simulation(face, layers=[], motion=Swelling(face))
    >>> moved = sim.step().points[: len(face.points)] - face.points
    >>> float(np.linalg.norm(moved, axis=1).max().round(3))
    0.1
    >>> sim.contract({"corrugator_l": 1.0})
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: this surface is moved by a Swelling, and no muscle of it can be ...
    """

    names: tuple[str, ...] = ()
    rates: Array = np.empty(0)

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """No rates; a ParameterError if some are asked for."""
        if rates:
            raise ParameterError(
                f"this surface is moved by a {type(self).__name__}, and no muscle of it can be contracted; asked for "
                f"were {', '.join(map(str, rates))}. Leave motion out to have the muscles of a face move its skin."
            )
        return np.empty(0)

    def set_rates(self, rates: Array) -> None:
        """Nothing to set."""


class Still(Undriven):
    """A surface that does not move; layers can still be laid on it.

    Parameters
    ----------
    face : Face
    time_step : float
        Seconds per step.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> bool((Still(face).step() == face.points).all())
    True
    """

    def __init__(self, face: Face, time_step: float = 0.02) -> None:
        self.points = face.points * face.unit
        self.time_step = check_range("time_step", time_step, 1e-9, 1e9)

    def reset(self) -> None:
        """See :class:`Motion`."""

    def step(self) -> Array:
        """See :class:`Motion`."""
        return self.points
