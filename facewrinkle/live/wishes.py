"""The wishes of a document to a simulation: layers, rates of muscles and tears; a simulation that follows them."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..animation.playback import Playback
from ..animation.recorded import Recorded
from ..errors import FaceWrinkleError
from ..geometry.interpolation import smoothstep
from ..layers.base import Layer
from ..layers.patterns_on_skin.layer import PatternLayer
from ..layers.patterns_on_skin.presets import table
from ..layers.patterns_on_skin.region import check_size
from ..layers.wave_folds.amounts import SIDES
from ..plotting.views import VIEW_ANGLE, VIEWS, View
from ..rigging import Performer, Take
from ..simulation import Refinement, Simulation
from ..simulation.fold_layers import fold_layers
from ..tears import Flow, Route, SheddingTear
from .document import START
from .protocol import FACE_ALONE, Field

EASE, EASED = 0.35, 2e-3
"""Share of the way to the rates asked for that muscles go in a step, and the rest that they take at once."""

TEAR_SPEED, TEAR_STAYS = 24.0, 1e6
"""Speed of a tear, mm/s, and the seconds for which it stays."""

PICTURE = 1200, 1200
"""Width and height of a picture, pixels."""

FPS = 25.0
"""Pictures of a movie in a second."""

LENGTH, ARRIVED = 2.4, 1.2
"""Seconds of a movie without keys, and when the face, at rest at its beginning, shows what the sliders show."""


def layers_of(data: Mapping[str, Any], face: Face) -> list[Layer]:
    """Return the layers of folds and patterns that a document asks for."""
    layers = fold_layers(face, "wave", **fold_words(data, face))
    for name, entry in data["patterns"].items():
        layers.append(PatternLayer(entry["kind"], entry["center"], name=name, **pattern_words(entry, face)))
    return layers


def fold_words(data: Mapping[str, Any], face: Face) -> dict[str, Any]:
    """Return the words of :func:`fold_layers` for the folds of a document, where they are not the usual ones."""
    words = {name: value for name, value in data["folds"].items() if value != START["folds"][name]}
    words |= {"age": max(words["age"], face.age)} if "age" in words else {}
    amount = {side: words.pop(side) for side in SIDES if side in words}
    amount |= {name: factor for name, factor in data["regions"].items() if factor != 1.0}
    return words | ({"amount": amount} if amount else {})


def pattern_words(entry: Mapping[str, Any], face: Face) -> dict[str, Any]:
    """Return the words of :class:`facewrinkle.PatternLayer` for an entry: it looks as the preset of its kind.

    The size of the entry is its width, mm; on the subject's right a pattern is mirrored.
    """
    preset, axes = table()[entry["kind"]], face.frame.axes
    right = bool((np.array(entry["center"]) - face.frame.origin) @ axes[0] < 0.0)
    width, height = check_size(preset["size"])
    up = np.array(preset.get("up", [0.0, 1.0, 0.0])) * [-1.0 if right else 1.0, 1.0, 1.0] @ axes
    size = entry["size"] / face.unit
    return {
        "up": tuple(round(float(x), 6) for x in up),
        "size": (round(float(size), 6), round(float(size * height / width), 6)),
        "depth": entry["depth"],
        "strength": entry["strength"],
        "mirrored": right,
        **preset["parameters"],
    }


def tear_of(entry: Mapping[str, Any], face: Face) -> SheddingTear:
    """Return the tear of an entry of a document."""
    return SheddingTear(
        face, start=entry["start"], width=entry["width"], begin=0.0,
        flow=Flow(c=TEAR_SPEED, hold=TEAR_STAYS), route=Route(length=entry["length"]),
    )  # fmt: skip


def run_time(tear: SheddingTear) -> float:
    """Seconds until a tear has arrived."""
    return float(max(tear.length - tear.s, 0.0) / tear.c)


def eased(rates: Mapping[str, float], target: Mapping[str, float]) -> dict[str, float]:
    """Return rates nearer to a target.

    Examples
    --------
    >>> eased({"jaw": 0.0}, {"jaw": 1.0}), eased({"jaw": 0.001}, {})
    ({'jaw': 0.35}, {})
    """
    out = {}
    for name in [*rates, *(name for name in target if name not in rates)]:
        now, asked = rates.get(name, 0.0), target.get(name, 0.0)
        rate = asked if abs(asked - now) < EASED else now + EASE * (asked - now)
        if rate:
            out[name] = rate
    return out


def mixture_of(data: Mapping[str, Any], time: float | None = None) -> dict[str, float]:
    """Return the weights by name that a document asks for; with a time, s, those of its timeline go on top."""
    weights = {name: data["intensity"] * weight for name, weight in data["mixture"].items()}
    if time is not None:
        for key in data["timeline"]["keys"].values():
            weight = key["weight"] * envelope(time, key)
            weights[key["unit"]] = max(weights.get(key["unit"], 0.0), weight)
    return {name: weight for name, weight in weights.items() if weight > 0.0}


def envelope(time: float, key: Mapping[str, float]) -> float:
    """Return the share of an event at a time: 0 at its onset, 1 from apex to offset, and 0 again at its end.

    Examples
    --------
    >>> key = {"onset": 1.0, "apex": 2.0, "offset": 3.0, "end": 5.0}
    >>> [envelope(t, key) for t in (0.5, 1.5, 2.5, 4.0, 6.0)]
    [0.0, 0.5, 1.0, 0.5, 0.0]
    """
    if not key["onset"] <= time <= key["end"]:
        return 0.0
    rise = (time - key["onset"]) / (key["apex"] - key["onset"]) if time < key["apex"] else 1.0
    fall = (key["end"] - time) / (key["end"] - key["offset"]) if time > key["offset"] else 1.0
    return float(smoothstep(min(rise, fall)))


def rates_of(mixture: Mapping[str, float], face: Face) -> dict[str, float]:
    """Return contraction rates of muscles; those that the face does not have are left out."""
    return {name: rate for name, rate in face.atlas.contractions(mixture).items() if name in face.muscles}


def view_of(camera: Sequence[float], face: Face) -> View:
    """Return the view of an upright camera, by its position and focal point.

    Raises
    ------
    ParameterError
        For one that looks nowhere, or straight up or down.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> round(view_of([0.0, 0.0, 1100.0, 0.0, 0.0, 0.0], fw.default_face()).height, 2)
    4.54
    """
    position, focus = np.reshape(camera, (2, 3))
    axes, size = face.frame.axes, face.frame.pupil_distance
    distance = float(np.linalg.norm(position - focus))
    direction, offset = axes @ (position - focus) / (distance or 1.0), axes @ (focus - face.frame.origin) / size
    height = 2.0 * np.tan(np.radians(VIEW_ANGLE / 2.0)) * distance / size
    x, y, z, u, v, w, height = (round(float(number), 6) + 0.0 for number in (*direction, *offset, height))
    return View((x, y, z), None, (u, v, w), height)


def as_python(
    data: Mapping[str, Any],
    face: Face,
    path: str = "",
    clip: bool = False,
    time: float = 0.0,
    view: View = VIEWS["front"],
    shows: Field = FACE_ALONE,
) -> str:
    """Return a program that makes what a document shows at a time, and writes its picture.

    Parameters
    ----------
    data : dict
        A document.
    face : Face
    path : str
        File of the face; "" is the built-in head.
    clip : bool
        True if the file is a recorded clip.
    time : float
        Of the timeline or the clip, s.
    view : View
    shows : Field
        What is shown besides the face.

    Examples
    --------
    >>> from facewrinkle.anatomy.fitting import default_face
    >>> print(as_python({**START, "mixture": {"AU12L": 0.5, "AU12R": 0.5}}, default_face()).splitlines()[4])
    sim.express({'AU12': 0.5})
    """
    layers = _written_layers(data, face)
    words = ", layers=layers" if layers else ""
    lines = ["import facewrinkle as fw", "", *_written_face(data, path, clip), *layers]
    if clip:
        lines += [
            f"sim = fw.Simulation(face, motion=recorded{words})",
            f"sim.motion.seek({time!r})",
            "frame = sim.step()",
        ]
    else:
        lines.append(f"sim = fw.Simulation(face{words})")
        if any(data["gaze"]):
            lines.append(f"sim.look(yaw={data['gaze'][0]!r}, pitch={data['gaze'][1]!r})")
        lines.append(f"sim.express({_joined(mixture_of(data, time))!r})")
        lines.append("frame = sim.settle()")
    lines.append("tears = []")
    for entry in data["tears"].values():
        flow = f"flow=fw.tears.Flow(c={TEAR_SPEED!r}, hold=60.0), route=fw.tears.Route(length={entry['length']!r})"
        lines.append(f"tear = fw.SheddingTear(face, start={entry['start']!r}, width={entry['width']!r}, {flow})")
        lines.append("tears.append(tear.surface(60.0, on=frame))")
    if data["probes"]:
        lines += [
            f"probes = {data['probes']!r}",
            "rest = frame.copy()",
            "rest.points = frame['rest']",
            "near = [rest.find_closest_point(place) for place in probes.values()]",
            f"print(dict(zip(probes, frame[{shows.name or 'W'!r}][near].tolist())))",
        ]
    field = f", scalars={shows.name!r}" if shows.name else ""
    lines += [
        f"style = fw.plotting.Style({PICTURE!r}, fw.plotting.{view!r}{field})",
        "with fw.plotting.TearScene(face, style) as scene:",
    ]
    if shows.muscles:
        lines.append("    scene.show_muscles(frame, dict(zip(sim.motion.names, sim.motion.rates)))")
    lines.append('    fw.plotting.save_picture(scene.picture(frame, tears), "picture.png")')
    return "\n".join(lines) + "\n"


def _written_face(data: Mapping[str, Any], path: str, clip: bool) -> list[str]:
    person = {name: value for name, value in data["identity"].items() if value}
    if person and not data["face"]:
        lines = [f"face = fw.default_face({person!r})"]
    elif clip:
        lines = [f"mesh, recorded = fw.read_animation({path!r})", "face = fw.fit_face(mesh)"]
    elif path:
        lines = [f"face = fw.{'read_face' if path.endswith('.face') else 'fit_face'}({path!r})"]
    else:
        lines = ["face = fw.default_face()"]
    if data["landmarks"]:
        lines.append(f"face = fw.refit_face(face, {data['landmarks']!r})")
    return lines


def _written_layers(data: Mapping[str, Any], face: Face) -> list[str]:
    """Return the lines of layers, if they are not the usual ones."""
    words = _written(fold_words(data, face))
    lines = [f"layers = fw.fold_layers(face, 'wave'{words})"]
    for name, entry in data["patterns"].items():
        given = _written({"name": name, **pattern_words(entry, face)})
        lines.append(f"layers.append(fw.PatternLayer({entry['kind']!r}, {entry['center']!r}{given}))")
    return lines if words or data["patterns"] else []


def _written(words: Mapping[str, Any]) -> str:
    """Return words as they follow other arguments of a call."""
    return "".join(f", {name}={value!r}" for name, value in words.items())


def _joined(mixture: Mapping[str, float]) -> dict[str, float]:
    """Return a mixture with both sides of a unit or muscle under one name where their weights are equal."""
    out: dict[str, float] = {}
    others = {"L": "R", "R": "L", "_l": "_r", "_r": "_l"}
    for name, weight in mixture.items():
        side = next((side for side in others if name.endswith(side)), "")
        stem = name.removesuffix(side)
        alike = side and mixture.get(stem + others[side]) == weight
        out[stem if alike else name] = round(weight, 6)
    return out


class Moment(NamedTuple):
    """A frame, its time in s, and the tears on it."""

    frame: pv.PolyData
    time: float
    tears: list[pv.PolyData]


Crying = Mapping[str, tuple[Any, SheddingTear, float]]
"""Tears by name: the entry of the document that each was made of, and the second at which it begins."""


class Player:
    """A simulation that follows a document, step by step.

    Parameters
    ----------
    face : Face
    data : dict
        A document.
    clip : Recorded or Take, optional
        What moves the face in place of the document.
    coarsen : bool
        Let triangles that were split merge again.

    Attributes
    ----------
    simulation : Simulation
    clip : Recorded, Take or None
    rates : dict of str to float
        Contractions of muscles, as they are now.
    arrived : bool
        True if the muscles contract as they were asked to.
    crying : dict
        What :meth:`tears_of` returned, for the tears that there are now.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> data = {**START, "mixture": {"AU26": 1.0}}
    >>> player = Player(fw.default_face(), data)
    >>> next(player.moments(data)).time, len(player.times(data))
    (0.04, 60)
    """

    def __init__(
        self, face: Face, data: Mapping[str, Any], clip: Recorded | Take | None = None, coarsen: bool = True
    ) -> None:
        self.face, self.clip = face, clip
        motion = Performer(clip, face) if isinstance(clip, Take) else clip
        self.simulation = Simulation(face, Refinement(coarsen=coarsen), layers=layers_of(data, face), motion=motion)
        self.rates: dict[str, float] = {}
        self.arrived = True
        self.crying: Crying = {}

    def step(self, weights: Mapping[str, float], gaze: Sequence[float], time: float) -> pv.PolyData:
        """Return the next frame, on the way to a mixture and a gaze; or that of a time of the clip, s."""
        motion = self.simulation.motion
        if isinstance(motion, Playback | Performer):
            motion.seek(time)
        else:
            target = rates_of(weights, self.face)
            self.rates = eased(self.rates, target)
            self.arrived = self.rates == {name: rate for name, rate in target.items() if rate}
            if self.face.eyes:
                self.simulation.look(*gaze)
            self.simulation.contract(self.rates)  # later, as it may turn the eyes, too
        return self.simulation.step()

    def tears_of(self, entries: Mapping[str, Any], now: float = 0.0) -> Crying:
        """Return the tears of a document; those that are new begin so many seconds from now as they say."""
        going = {name: known for name, known in self.crying.items() if entries.get(name) == known[0]}
        return {
            name: going.get(name) or (entry, tear_of(entry, self.face), now + entry["begin"])
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

    def cries(self, now: float) -> bool:
        """Return True if a tear has not arrived yet."""
        return any(now < begin + run_time(tear) for _, tear, begin in self.crying.values())

    def times(self, data: Mapping[str, Any]) -> list[float]:
        """Return the seconds of all pictures of a movie of a document."""
        length = data["timeline"]["length"] if self._timed(data) else LENGTH
        return [(number + 1) / FPS for number in range(max(round(FPS * length), 1))]

    def _timed(self, data: Mapping[str, Any]) -> bool:
        return bool(data["timeline"]["keys"]) or isinstance(self.simulation.motion, Playback | Performer)

    def moments(self, data: Mapping[str, Any]) -> Iterator[Moment]:
        """Play a document from its beginning: its timeline, or without keys from rest to what the sliders show."""
        self.crying = self.tears_of(data["tears"])
        steps = max(round(1.0 / (FPS * self.simulation.motion.time_step)), 1)
        for time in self.times(data):
            weights = mixture_of(data, time)
            if not self._timed(data):
                weights = {name: weight * float(smoothstep(time / ARRIVED)) for name, weight in weights.items()}
            for _ in range(1 if isinstance(self.simulation.motion, Playback) else steps):
                frame = self.step(weights, data["gaze"], time)
            yield Moment(frame, time, list(self.tears(frame, time).values()))
