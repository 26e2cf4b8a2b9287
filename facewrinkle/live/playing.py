"""The motion that a document asks for, played from its beginning: for movies and animations."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import pyvista as pv

from ..anatomy.face import Face
from ..errors import FaceWrinkleError
from ..geometry.smoothstep import smoothstep
from ..motion.recorded import Recorded
from ..simulation import Refinement, Simulation
from .library import Scrubbed
from .wishes import eased, layers_of, mixture_of, rates_of, run_time, tear_of

FPS = 25.0
"""Pictures a second."""

LENGTH, ARRIVED = 2.4, 1.2
"""Seconds of a movie without keys, and when the face, at rest at its beginning, shows what the sliders show."""


class Moment(NamedTuple):
    """A frame, its time in s, and the tears on it."""

    frame: pv.PolyData
    time: float
    tears: list[pv.PolyData]


class Played:
    """The motion that a document asks for, from its beginning.

    Parameters
    ----------
    face : Face
    data : dict
        A document.
    clip : Recorded, optional
        What moves the face in place of its muscles.
    coarsen : bool
        Let triangles that were split merge again.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> from facewrinkle.live.document import START
    >>> played = Played(fw.default_face(), {**START, "mixture": {"AU26": 1.0}})
    >>> next(iter(played)).time, played.count
    (0.04, 60)
    """

    def __init__(self, face: Face, data: Mapping[str, Any], clip: Recorded | None = None, coarsen: bool = True) -> None:
        self.face, self.data = face, data
        motion = None if clip is None else Scrubbed(clip, face)
        self.simulation = Simulation(face, Refinement(coarsen=coarsen), layers_of(data, face), motion=motion)
        timeline = data["timeline"]
        self._timed = bool(timeline["keys"]) or clip is not None
        self.count = max(round(FPS * (timeline["length"] if self._timed else LENGTH)), 1)

    @property
    def times(self) -> list[float]:
        """Seconds of all frames."""
        return [(number + 1) / FPS for number in range(self.count)]

    def __iter__(self) -> Iterator[Moment]:
        simulation, data = self.simulation, self.data
        motion = simulation.motion
        tears = [(tear_of(entry, self.face), entry["begin"]) for entry in data["tears"].values()]
        rates: dict[str, float] = {}
        steps = max(round(1.0 / (FPS * motion.time_step)), 1)
        for time in self.times:
            if isinstance(motion, Scrubbed):
                motion.time = time
                frame = simulation.step()
            else:
                weights = mixture_of(data, time if self._timed else None)
                if not self._timed:
                    weights = {name: weight * float(smoothstep(time / ARRIVED)) for name, weight in weights.items()}
                target = rates_of(weights, self.face)
                if self.face.eyes:
                    simulation.look(*data["gaze"])
                for _ in range(steps):
                    rates = eased(rates, target)
                    simulation.contract(rates)
                    frame = simulation.step()
            drops = []
            for tear, begin in tears:
                if time >= begin:
                    with contextlib.suppress(FaceWrinkleError):
                        drops.append(tear.surface(min(time - begin, run_time(tear)), on=frame))
            yield Moment(frame, time, drops)
