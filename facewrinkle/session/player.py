"""What plays a session: the layers, muscles and tears that it asks for, in a simulation that follows it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..animation.playback import Playback
from ..array_types import Image
from ..errors import FaceWrinkleError
from ..geometry.interpolation import smoothstep
from ..layers.base import Layer
from ..layers.patterns_on_skin.layer import PatternLayer
from ..layers.patterns_on_skin.presets import table
from ..layers.patterns_on_skin.region import check_size
from ..layers.wave_folds.layer import SIDES
from ..plotting import TearScene
from ..plotting.views import VIEW_ANGLE, Style, View
from ..rigging import Performer
from ..simulation import Refinement, Simulation
from ..simulation.fold_layers import fold_layers
from ..tears import Flow, Route, SheddingTear
from .content import Content
from .parts import Folds, Key, Look, Pattern, Tear, point_of
from .subject import Subject

TEAR_SPEED, TEAR_STAYS = 24.0, 1e6
"""Speed of a tear, mm/s, and the seconds for which it stays."""

TEAR_ARRIVES = 60.0
"""Seconds after which every tear has arrived."""


def layers_of(content: Content, face: Face) -> list[Layer]:
    """Return the layers of folds and patterns that a session asks for."""
    patterns = (
        PatternLayer(entry.kind, point_of(entry.center, face), name=name, **pattern_words(entry, face))
        for name, entry in content.patterns.items()
    )
    return [*fold_layers(face, "wave", **fold_words(content, face)), *patterns]


def fold_words(content: Content, face: Face) -> dict[str, Any]:
    """Return the words of :func:`fold_layers` for the folds of a session, where they are not the usual ones."""
    usual = vars(Folds())
    words = {name: value for name, value in vars(content.folds).items() if value != usual[name]}
    words |= {"age": max(words["age"], face.age)} if "age" in words else {}
    amount = {side: words.pop(side) for side in SIDES if side in words}
    amount |= {name: factor for name, factor in content.regions.items() if factor != 1.0}
    return words | ({"amount": amount} if amount else {})


def pattern_words(entry: Pattern, face: Face) -> dict[str, Any]:
    """Return the words of :class:`facewrinkle.PatternLayer` for a pattern: it looks as the preset of its kind.

    The size of the entry is its width, mm; on the subject's right a pattern is mirrored.
    """
    preset, axes = table()[entry.kind], face.frame.axes
    right = bool((np.array(point_of(entry.center, face)) - face.frame.origin) @ axes[0] < 0.0)
    width, height = check_size(preset["size"])
    up = np.array(preset.get("up", [0.0, 1.0, 0.0])) * [-1.0 if right else 1.0, 1.0, 1.0] @ axes
    size = entry.size / face.unit
    return {
        "up": tuple(round(float(x), 6) for x in up),
        "size": (round(float(size), 6), round(float(size * height / width), 6)),
        "depth": entry.depth,
        "strength": entry.strength,
        "mirrored": right,
        **preset["parameters"],
    }


def tear_of(entry: Tear, face: Face) -> SheddingTear:
    """Return a tear of a session."""
    return SheddingTear(
        face, start=point_of(entry.start, face), width=entry.width, begin=0.0,
        flow=Flow(c=TEAR_SPEED, hold=TEAR_STAYS), route=Route(length=entry.length),
    )  # fmt: skip


def run_time(tear: SheddingTear) -> float:
    """Seconds until a tear has arrived."""
    return float(max(tear.length - tear.s, 0.0) / tear.c)


def eased(rates: Mapping[str, float], target: Mapping[str, float]) -> dict[str, float]:
    """Return rates nearer to a target, by a share of the way that a muscle goes in a step, or there at last.

    Examples
    --------
    >>> eased({"jaw": 0.0}, {"jaw": 1.0}), eased({"jaw": 0.001}, {})
    ({'jaw': 0.35}, {})
    """
    out = {}
    for name in [*rates, *(name for name in target if name not in rates)]:
        now, asked = rates.get(name, 0.0), target.get(name, 0.0)
        rate = asked if abs(asked - now) < 2e-3 else now + 0.35 * (asked - now)
        if rate:
            out[name] = rate
    return out


def mixture_of(content: Content, time: float | None = None) -> dict[str, float]:
    """Return the weights by name that a session asks for; with a time, s, those of its timeline go on top."""
    weights = {name: content.intensity * weight for name, weight in content.mixture.items()}
    if time is not None:
        for key in content.timeline.keys.values():
            weights[key.unit] = max(weights.get(key.unit, 0.0), key.weight * envelope(time, key))
    return {name: weight for name, weight in weights.items() if weight > 0.0}


def envelope(time: float, key: Key) -> float:
    """Return the share of an event at a time: 0 at its onset, 1 from apex to offset, and 0 again at its end.

    Examples
    --------
    >>> key = Key("AU12", 1.0, onset=1.0, apex=2.0, offset=3.0, end=5.0)
    >>> [envelope(t, key) for t in (0.5, 1.5, 2.5, 4.0, 6.0)]
    [0.0, 0.5, 1.0, 0.5, 0.0]
    """
    if not key.onset <= time <= key.end:
        return 0.0
    rise = (time - key.onset) / (key.apex - key.onset) if time < key.apex else 1.0
    fall = (key.end - time) / (key.end - key.offset) if time > key.offset else 1.0
    return float(smoothstep(min(rise, fall)))


def joined(mixture: Mapping[str, float]) -> dict[str, float]:
    """Return a mixture with both sides of a unit or muscle under one name where their weights are equal.

    Examples
    --------
    >>> joined({"AU12L": 0.5, "AU12R": 0.5, "corrugator_l": 0.2})
    {'AU12': 0.5, 'corrugator_l': 0.2}
    """
    out: dict[str, float] = {}
    others = {"L": "R", "R": "L", "_l": "_r", "_r": "_l"}
    for name, weight in mixture.items():
        side = next((side for side in others if name.endswith(side)), "")
        stem = name.removesuffix(side)
        alike = side and mixture.get(stem + others[side]) == weight
        out[stem if alike else name] = round(weight, 6)
    return out


def view_of(look: Look, face: Face) -> str | View:
    """Return the view of a look: its name, or that of an upright camera by its position and focal point.

    Raises
    ------
    ParameterError
        For a camera that looks nowhere, or straight up or down.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> view = view_of(Look(view=(0.0, 0.0, 1100.0, 0.0, 0.0, 0.0)), fw.default_face())
    >>> round(view.height, 2)
    4.54
    """
    if isinstance(look.view, str):
        return look.view
    position, focus = np.reshape(look.view, (2, 3))
    axes, size = face.frame.axes, face.frame.pupil_distance
    distance = float(np.linalg.norm(position - focus))
    direction, offset = axes @ (position - focus) / (distance or 1.0), axes @ (focus - face.frame.origin) / size
    height = 2.0 * np.tan(np.radians(VIEW_ANGLE / 2.0)) * distance / size
    x, y, z, u, v, w, height = (round(float(number), 6) + 0.0 for number in (*direction, *offset, height))
    return View((x, y, z), None, (u, v, w), height)


def scene_of(content: Content, face: Face) -> TearScene:
    """Return the scene of a session's pictures; it must be closed."""
    look = content.look
    return TearScene(face, Style(look.size, view_of(look, face), scalars=look.field or None, clay=look.clay))


def pictured(
    scene: TearScene, content: Content, frame: pv.PolyData, tears: Iterable[pv.PolyData], rates: Mapping[str, float]
) -> Image:
    """Return the picture of a frame, with the muscles if the session shows them."""
    if content.look.muscles:
        scene.show_muscles(frame, rates)
    return scene.picture(frame, tears)


class Moment(NamedTuple):
    """A frame, its time in s, and the tears on it.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> isinstance(next(fw.Session(mixture={"AU12": 1.0}).frames()), Moment)
    True
    """

    frame: pv.PolyData
    time: float
    tears: list[pv.PolyData]


Crying = Mapping[str, tuple[Tear, SheddingTear, float]]
"""Tears by name: the entry of the session that each was made of, and the second at which it begins."""


class Player:
    """A simulation that follows a session, step by step.

    Parameters
    ----------
    content : Content
    subject : Subject
    coarsen : bool
        Let triangles that were split merge again.

    Attributes
    ----------
    simulation : Simulation
    rates : dict of str to float
        Contractions of muscles, as they are now.
    arrived : bool
        True if the muscles contract as they were asked to.
    crying : dict
        What :meth:`tears_of` returned, for the tears that there are now.

    Examples
    --------
    >>> from facewrinkle.session.subject import subject_of
    >>> content = Content(mixture={"AU26": 1.0})
    >>> player = Player(content, subject_of(content))
    >>> next(player.moments()).time, len(player.times)
    (0.04, 60)
    """

    def __init__(self, content: Content, subject: Subject, coarsen: bool = True) -> None:
        self.content, self._subject, self.face, self.clip = content, subject, subject.face, subject.clip
        self.simulation = Simulation(
            self.face, Refinement(coarsen=coarsen), layers=layers_of(content, self.face), motion=subject.motion()
        )
        self.rates: dict[str, float] = {}
        self.arrived = True
        self.crying: Crying = self.tears_of(content.tears)

    @property
    def contractions(self) -> dict[str, float]:
        """Contractions of the muscles by name, as the simulation has them."""
        motion = self.simulation.motion
        return dict(zip(motion.names, motion.rates.tolist(), strict=True))

    def settled(self) -> pv.PolyData:
        """Return the frame that has come to rest at the time of the session, from a face at rest."""
        simulation, content = self.simulation, self.content
        if isinstance(simulation.motion, Playback | Performer):
            for _ in range(self._subject.steps):
                simulation.motion.seek(content.time)
                frame = simulation.step()
            return frame
        if any(content.gaze) and self.face.eyes:
            simulation.look(*content.gaze)
        mixture = joined(mixture_of(content, content.time))
        simulation.contract(self.known_rates(mixture))
        return simulation.settle()

    def known_rates(self, mixture: Mapping[str, float]) -> dict[str, float]:
        """Return contraction rates of muscles; those that the face does not have are left out."""
        rates = self.face.atlas.contractions(mixture)
        return {name: rate for name, rate in rates.items() if name in self.face.muscles}

    def step(self, weights: Mapping[str, float], gaze: Sequence[float], time: float) -> pv.PolyData:
        """Return the next frame, on the way to a mixture and a gaze; or that of a time of the clip, s."""
        motion = self.simulation.motion
        if isinstance(motion, Playback | Performer):
            motion.seek(time)
        else:
            target = self.known_rates(weights)
            self.rates = eased(self.rates, target)
            self.arrived = self.rates == {name: rate for name, rate in target.items() if rate}
            if self.face.eyes:
                self.simulation.look(*gaze)
            self.simulation.contract(self.rates)  # later, as it may turn the eyes, too
        return self.simulation.step()

    def tears_of(self, entries: Mapping[str, Tear], now: float = 0.0) -> Crying:
        """Return the tears of a session; those that are new begin so many seconds from now as they say."""
        going = {} if not hasattr(self, "crying") else self.crying
        return {
            name: going[name]
            if name in going and going[name][0] == entry
            else (entry, tear_of(entry, self.face), now + entry.begin)
            for name, entry in entries.items()
        }

    def tears(self, frame: pv.PolyData, now: float) -> dict[str, pv.PolyData]:
        """Return the surfaces of the tears on a frame, by name."""
        found = {}
        for name, (_, tear, begin) in self.crying.items():
            if now >= begin:
                with contextlib.suppress(FaceWrinkleError):
                    found[name] = tear.surface(min(now - begin, run_time(tear)), on=frame)
        return found

    def arrived_tears(self, frame: pv.PolyData) -> list[pv.PolyData]:
        """Return the surfaces of the tears on a frame, each at its end."""
        return [tear.surface(TEAR_ARRIVES, on=frame) for _, tear, _ in self.crying.values()]

    def cries(self, now: float) -> bool:
        """Return True if a tear has not arrived yet."""
        return any(now < begin + run_time(tear) for _, tear, begin in self.crying.values())

    @property
    def times(self) -> list[float]:
        """The seconds of all pictures of a movie."""
        length = self.content.timeline.length if self._timed else 2.4  # s
        fps = self.content.look.fps
        return [(number + 1) / fps for number in range(max(round(fps * length), 1))]

    @property
    def _timed(self) -> bool:
        return bool(self.content.timeline.keys) or isinstance(self.simulation.motion, Playback | Performer)

    def moments(self) -> Iterator[Moment]:
        """Play a session from its beginning: its timeline, or without keys from rest to what is wished."""
        content, motion = self.content, self.simulation.motion
        steps = max(round(1.0 / (content.look.fps * motion.time_step)), 1)
        for time in self.times:
            weights = mixture_of(content, time)
            if not self._timed:  # the face shows what is wished from the middle on
                weights = {name: weight * float(smoothstep(time / 1.2)) for name, weight in weights.items()}
            for _ in range(1 if isinstance(motion, Playback) else steps):
                frame = self.step(weights, content.gaze, time)
            yield Moment(frame, time, list(self.tears(frame, time).values()))
