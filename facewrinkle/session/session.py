"""A session: all that can be wished of a face, as one document that is checked, written, read and played."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyvista as pv

from ..animation.recorded import Recorded
from ..array_types import Image
from ..export import movie_writer
from ..export.animation import AnimationWriter
from ..progress import Progress
from ..rigging import Take
from .content import Content
from .parts import point_of
from .player import (
    TEAR_ARRIVES,
    TEAR_SPEED,
    TEAR_STAYS,
    Moment,
    Player,
    fold_words,
    joined,
    mixture_of,
    pattern_words,
    pictured,
    scene_of,
    view_of,
)
from .subject import Subject, subject_of


@dataclass(frozen=True)
class Session(Content):
    """All that can be wished of a face: who it is, what folds it, what it does, and how it is seen.

    A session is what the studio edits, and what ``facewrinkle express --session`` reads. It is checked when it is made,
    and does not change: :meth:`changed` returns another one.

    Parameters
    ----------
    face : str
        A mesh, an animation that moves one, or a .face file. Default: the built-in head.
    atlas : str
        A TOML file with muscles, action units and expressions of one's own.
    take : str
        A recording of a phone or a tracker, which the face performs in place of `mixture`.
    identity : dict of str to float
        Of the built-in head, see :class:`facewrinkle.Identity`.
    landmarks : dict
        Landmarks that are elsewhere than they were found, each a :class:`Place` or three numbers.
    mixture : dict of str to float
        Weights of expressions, action units and muscles.
    mixtures : dict of str to dict
        Expressions of one's own: mixtures by name.
    intensity : float
        Factor for `mixture`.
    gaze : tuple of float
        Degrees to the subject's left, and upwards.
    folds : Folds
    regions : dict of str to float
        Factors for the depth of folds in a region, such as ``{"forehead": 2.0}``.
    patterns : dict of str to Pattern
    tears : dict of str to Tear
    probes : dict
        Places whose numbers are told.
    timeline : Timeline
    time : float
        The moment of the timeline, or of a recording, that pictures show, s.
    look : Look
    known : Atlas, optional
        The names that mixtures may have. Default: those of `atlas`, and `mixtures`.

    Raises
    ------
    ParameterError, UnknownNameError
        For what is not allowed.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> session = fw.Session(mixture={"AU12": 0.8}, regions={"crow's feet": 2.0}, identity={"age": 0.5})
    >>> frame = session.frame()
    >>> bool(frame["W"].min() < -0.2), fw.Session.from_json(session.to_json()) == session
    (True, True)
    >>> session.changed(mixture={"AU12": 2.0})
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: mixture.AU12 must be at most 1, received 2.0.
    """

    def as_python(self, subject: Subject | None = None) -> str:
        """Return a program of public calls that makes :meth:`frame` and :meth:`picture`, and writes the picture.

        Examples
        --------
        >>> print(Session(mixture={"AU12L": 0.5, "AU12R": 0.5}).as_python().splitlines()[4])
        sim.express({'AU12': 0.5})
        """
        return program_of(self, subject or self.subject())

    # --- what it shows -------------------------------------------------------------------------

    def subject(self, progress: Progress | None = None) -> Subject:
        """Return the face, and what moves it. It takes a while for a scan: give it to the other methods."""
        return subject_of(self, progress)

    def frame(self, subject: Subject | None = None) -> pv.PolyData:
        """Return the face that has come to rest with all that is wished at :attr:`time`; see
        :meth:`facewrinkle.Simulation.step`.
        """
        return Player(self, subject or self.subject()).settled()

    def frames(self, subject: Subject | None = None) -> Iterator[Moment]:
        """Yield the moments of a movie: the timeline or the recording from its beginning, or without keys from rest to
        what is wished. Each has its frame, its time in s, and the surfaces of the tears.

        Examples
        --------
        >>> session = Session(mixture={"AU26": 1.0}, look={"fps": 2.0})
        >>> [round(moment.time, 1) for moment in session.frames()]
        [0.5, 1.0, 1.5, 2.0, 2.5]
        """
        yield from Player(self, subject or self.subject()).moments()

    def picture(self, subject: Subject | None = None) -> Image:
        """Return the picture of :meth:`frame`: ndarray of uint8, shape (height, width, 3)."""
        player = Player(self, subject or self.subject())
        frame = player.settled()
        with scene_of(self, player.face) as scene:
            return pictured(scene, self, frame, player.arrived_tears(frame), player.contractions)

    def movie(self, path: str | Path, subject: Subject | None = None, progress: Progress | None = None) -> Path:
        """Write the movie of :meth:`frames` to an .mp4 or .gif file.

        Raises
        ------
        MissingPackageError
            Without the packages of the extra ``export``.
        """
        player = Player(self, subject or self.subject())
        with scene_of(self, player.face) as scene, movie_writer(path, fps=self.look.fps) as append:
            for moment in _shown(progress, player, "Movie"):
                append(pictured(scene, self, moment.frame, moment.tears, player.contractions))
        return Path(path)

    def animation(self, path: str | Path, subject: Subject | None = None, progress: Progress | None = None) -> Path:
        """Write :meth:`frames` as an animation, a .glb, .gltf or .usd file."""
        player = Player(self, subject or self.subject(), coarsen=False)
        writer = AnimationWriter(player.face, path)
        for moment in _shown(progress, player, "Animation"):
            writer.add(moment.frame)
        writer.write(player.times, player.simulation.forest)
        return Path(path)


def _shown(progress: Progress | None, player: Player, what: str) -> Iterable[Moment]:
    """Return the moments of a player, with progress."""
    return player.moments() if progress is None else progress(player.moments(), what, len(player.times))


START = Session()
"""A session in which nothing is set."""


# --- the program of a session ---------------------------------------------------------------------


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
