"""A session as a program of public calls."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..animation.recorded import Recorded
from ..rigging import Take
from .content import Content
from .parts import point_of
from .player import (
    TEAR_ARRIVES,
    TEAR_SPEED,
    TEAR_STAYS,
    fold_words,
    joined,
    mixture_of,
    pattern_words,
    view_of,
)
from .subject import Subject


def program_of(content: Content, subject: Subject) -> str:
    """Return a program that makes what a session shows at its time, and writes its picture.

    Examples
    --------
    >>> from facewrinkle.anatomy.fitting import default_face
    >>> print(program_of(Content(), Subject(default_face())).splitlines()[2])
    face = fw.default_face()
    """
    layers = list(_layers(content, subject))
    words = ", layers=layers" if layers else ""
    lines = ["import facewrinkle as fw", "", *_face(content, subject), *layers]
    if subject.clip is not None:
        lines += [
            f"sim = fw.Simulation(face, motion=motion{words})",
            f"for _ in range({subject.steps}):",
            f"    sim.motion.seek({content.time!r})",
            "    frame = sim.step()",
        ]
    else:
        lines.append(f"sim = fw.Simulation(face{words})")
        if any(content.gaze) and subject.face.eyes:
            lines.append(f"sim.look(yaw={content.gaze[0]!r}, pitch={content.gaze[1]!r})")
        lines.append(f"sim.express({joined(mixture_of(content, content.time))!r})")
        lines.append("frame = sim.settle()")
    lines += [*_tears(content, subject), *_probes(content, subject), *_picture(content, subject)]
    return "\n".join(lines) + "\n"


def _face(content: Content, subject: Subject) -> Iterator[str]:
    """Yield the lines of the face, and of what moves it."""
    path, atlas = content.face, ""
    person = {name: value for name, value in content.identity.items() if value}
    if content.atlas:
        yield f"atlas = fw.read_atlas({content.atlas!r})"
        atlas = "atlas=atlas"
    if isinstance(subject.clip, Recorded):
        yield f"mesh, motion = fw.read_animation({path!r})"
        yield f"face = fw.fit_face(mesh{', ' * bool(atlas)}{atlas})"
    elif path.lower().endswith(".face"):
        yield f"face = fw.read_face({path!r}{', atlas' * bool(atlas)})"
    elif path:
        yield f"face = fw.fit_face({path!r}{', ' * bool(atlas)}{atlas})"
    else:
        yield f"face = fw.default_face({', '.join(each for each in (repr(person) if person else '', atlas) if each)})"
    if path and "age" in person:
        yield f"face = face.aged({person['age']!r})"
    if content.landmarks:
        moved = {name: point_of(place, subject.face) for name, place in content.landmarks.items()}
        yield f"face = face.with_landmarks({moved!r})"
    if isinstance(subject.clip, Take):
        yield f"motion = fw.Performer(fw.read_take({content.take!r}), face)"


def _layers(content: Content, subject: Subject) -> Iterator[str]:
    """Yield the lines of layers, if they are not the usual ones."""
    words = _written(fold_words(content, subject.face))
    if words or content.patterns:
        yield f"layers = fw.fold_layers(face, 'wave'{words})"
    for name, entry in content.patterns.items():
        given = _written({"name": name, **pattern_words(entry, subject.face)})
        center = point_of(entry.center, subject.face)
        yield f"layers.append(fw.PatternLayer({entry.kind!r}, {center!r}{given}))"


def _tears(content: Content, subject: Subject) -> Iterator[str]:
    yield "tears = []"
    for entry in content.tears.values():
        flow = f"flow=fw.tears.Flow(c={TEAR_SPEED!r}, hold={TEAR_STAYS!r}), "
        flow += f"route=fw.tears.Route(length={entry.length!r})"
        start = point_of(entry.start, subject.face)
        yield f"tear = fw.SheddingTear(face, start={start!r}, width={entry.width!r}, begin=0.0, {flow})"
        yield f"tears.append(tear.surface({TEAR_ARRIVES!r}, on=frame))"


def _probes(content: Content, subject: Subject) -> Iterator[str]:
    """Yield the lines that print the numbers at probes."""
    if content.probes:
        places = {name: point_of(place, subject.face) for name, place in content.probes.items()}
        yield f"probes = {places!r}"
        yield f"values = fw.mesh.values_at(frame, {content.look.field or 'W'!r}, list(probes.values()))"
        yield "print(dict(zip(probes, values.tolist())))"


def _picture(content: Content, subject: Subject) -> Iterator[str]:
    look = content.look
    view, field = view_of(look, subject.face), f", scalars={look.field!r}" if look.field else ""
    place = repr(view) if isinstance(view, str) else f"fw.plotting.{view!r}"
    yield f"style = fw.plotting.Style({look.size!r}, {place}{field}{', clay=True' * look.clay})"
    yield "with fw.plotting.TearScene(face, style) as scene:"
    if look.muscles:
        yield "    scene.show_muscles(frame, dict(zip(sim.motion.names, sim.motion.rates)))"
    yield '    fw.plotting.save_picture(scene.picture(frame, tears), "picture.png")'


def _written(words: Mapping[str, Any]) -> str:
    """Return words as they follow other arguments of a call."""
    return "".join(f", {name}={value!r}" for name, value in words.items())
