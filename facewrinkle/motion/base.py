"""The interface of a motion, which moves the base mesh step by step, and what is common to motions without muscles."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

import numpy as np

from ..anatomy.face import Face
from ..array_types import Array
from ..checks import plain_and_finite
from ..errors import ParameterError, check_range, type_of

NONE_BY_NAME: Mapping[str, Array] = MappingProxyType({})
"""Gazes and parts of a motion that has none of its own."""


class Motion(Protocol):
    """A motion hands out the positions of the base mesh, one time step after the other.

    To write one of your own, derive it from :class:`facewrinkle.motion.base.Undriven`, which has all of these members
    except `points`, `time_step`, `reset` and `step`.

    Attributes
    ----------
    names : tuple of str
        The face's muscles if their contraction drives the motion; empty otherwise.
    rates : ndarray, shape (k,)
        Present contraction rates, in the order of `names`.
    points : ndarray, shape (n, 3)
        The base mesh at rest, mm.
    time_step : float
        Seconds per step.
    pose : ndarray, shape (4, 4), or None
        The matrix that has moved the head as a whole since rest, in the unit of the face's mesh; None if it has not
        moved. Eyes, teeth and hair go along with it.
    gazes : mapping of str to ndarray, shape (3,)
        Unit directions in which the eyes of the head at rest look, by side ("l", "r"). Sides that are left out look
        straight ahead, or where their muscles turn them.
    parts : mapping of str to ndarray, shape (k, 3)
        Points of parts beside the skin, by name, in the unit of the mesh; NaN for points that go along with the face,
        as do all parts that are left out.
    mandible : ndarray, shape (4, 4), or None
        The matrix that has moved the mandible since rest, beyond what its muscles do, in the unit of the mesh.

    Examples
    --------
    A head that nods:

    >>> from facewrinkle.motion.base import Undriven
    >>> class Nod(Undriven):
    ...     def __init__(self, face):
    ...         self.points, self.time_step, self.steps = face.points_mm, 0.02, 0
    ...     def reset(self):
    ...         self.steps = 0
    ...     def step(self):
    ...         self.steps += 1
    ...         return self.points - [0.0, 10.0 * np.sin(self.steps * self.time_step), 0.0]
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
    @property
    def pose(self) -> Array | None: ...
    @property
    def gazes(self) -> Mapping[str, Array]: ...
    @property
    def parts(self) -> Mapping[str, Array]: ...
    @property
    def mandible(self) -> Array | None: ...

    def reset(self) -> None:
        """Go back to the beginning: to time 0, with all rates 0."""

    def step(self) -> Array:
        """Advance by one time step and return the positions (n, 3) in mm, which the caller must not change."""

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """Return contraction rates (k,) by name, checked; muscles that are not named get 0."""

    def set_rates(self, rates: Array) -> None:
        """Set the contraction rates (k,), without checks."""


def check_motion(motion: Motion, face: Face) -> None:
    """Raise a ParameterError unless an object is a motion, and one of this face.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> check_motion("nod", fw.default_face())
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: a motion must have names, rates, ...; the str that was given lacks names, ...
    """
    members = [name for name in vars(Motion) if not name.startswith("_")]
    lacking = [name for name in members if not hasattr(motion, name)]
    if lacking:
        raise ParameterError(
            f"a motion must have {', '.join(members)}; the {type(motion).__name__} that was given lacks "
            f"{', '.join(lacking)}. Derive it from facewrinkle.motion.base.Undriven, which has all that a motion "
            "without muscles needs, except points, time_step, reset and step."
        )
    if motion.points.shape != face.points.shape:
        raise ParameterError(
            f"the motion moves {len(motion.points)} points, the face has {len(face.points)}. Make it from this face."
        )
    if motion.names not in ((), tuple(face.muscles)):
        raise ParameterError(
            f"the motion must be driven by all {len(face.muscles)} muscles of the face, in their order, or by none; "
            f"its names are {', '.join(motion.names[:8])}. Make it from this face."
        )


def stepped(motion: Motion) -> Array:
    """Advance a motion by one time step, and return the positions (n, 3), mm.

    A motion may be anyone's, and loops in machine code trust the lengths of arrays: a ParameterError names it for
    positions of another shape, or that are no finite numbers.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> class Shrinking(Still):
    ...     def step(self):
    ...         return self.points[:-1]
    >>> stepped(Shrinking(fw.default_face()))
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: step() of a motion (Shrinking) must return positions of the shape (2321, 3), ...
    """
    called = f"positions that step() of a motion ({type(motion).__name__}) returns"
    points, shape = plain_and_finite(called, motion.step()), motion.points.shape
    if points.shape != shape:
        raise ParameterError(
            f"step() of a motion ({type(motion).__name__}) must return positions of the shape {shape}, received "
            f"{points.shape}."
        )
    return points


class Undriven:
    """Base class of motions that no muscle drives: it has all members of a :class:`facewrinkle.Motion` except
    `points`, `time_step`, `reset` and `step`.

    Examples
    --------
    Skin that swells:

    >>> class Swelling(Undriven):
    ...     time_step = 0.02
    ...     def __init__(self, face):
    ...         self.points, self.normals, self.thickness = face.points_mm, face.tissue.normals, 0.0
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
    pose: Array | None = None
    gazes: Mapping[str, Array] = NONE_BY_NAME
    parts: Mapping[str, Array] = NONE_BY_NAME
    mandible: Array | None = None

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """Return no rates; raise a ParameterError if some are asked for."""
        if rates:
            raise ParameterError(
                f"this surface is moved by {type_of(self)}, and no muscle of it can be contracted; asked for "
                f"were {', '.join(map(str, rates))}. Muscles move the skin of a face, one with landmarks (fit_face), "
                "where motion is left out."
            )
        return np.empty(0)

    def set_rates(self, rates: Array) -> None:
        """Do nothing: there are no rates to set."""


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
        self.points = face.points_mm
        self.time_step = check_range("time_step", time_step, 1e-9, 1e9)

    def reset(self) -> None:
        """See :class:`Motion`."""

    def step(self) -> Array:
        """See :class:`Motion`."""
        return self.points
