"""The simulation of a studio, on a thread of its own: it takes the newest wish, steps, and publishes what is seen.

It sleeps when nothing is asked and nothing moves. All that touches the simulation, and VTK, happens on this thread.
"""

from __future__ import annotations

import threading
import time
import traceback
import warnings
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..errors import FaceWrinkleError, FaceWrinkleWarning
from ..layers.base import Layer
from ..session import Session
from ..session.parts import point_of
from ..session.player import Player, layers_of, mixture_of
from ..session.session import START
from .document import Document
from .fields import colored
from .library import Library
from .protocol import FIBERS, Box, Part, small_normals
from .visible_parts import VisibleParts


@dataclass(frozen=True, eq=False)
class Shown:
    """A frame as it was published.

    Attributes
    ----------
    frame : PolyData
    session : Session
        What it shows.
    step : int
        Number of the frame, growing by one.
    parts : list of Part
    box : Box
    fields : dict of str to Part
    still : bool
        True if the face is at rest.
    time : float
        Of the timeline, s.
    layers : sequence of Layer
        Those that made its folds.
    tears : list of PolyData
    rates : dict of str to float
        Contractions of muscles.
    """

    frame: pv.PolyData
    session: Session
    step: int
    parts: list[Part]
    box: Box
    fields: dict[str, Part]
    still: bool
    time: float
    layers: Sequence[Layer]
    tears: list[pv.PolyData]
    rates: dict[str, float]


def differ(one: Session, other: Session, *parts: str) -> bool:
    """Return True if a part of two sessions is not the same."""
    return any(getattr(one, part) != getattr(other, part) for part in parts)


class Stage(threading.Thread):
    """The thread of a simulation.

    Parameters
    ----------
    library : Library
        Faces that a document may ask for.
    document : Document
        Changed by others under :attr:`condition`, which is notified.

    Attributes
    ----------
    shown : Shown or None
        The newest frame.
    listeners : list of callable
        Called on this thread after each frame.
    tell_face : callable
        Called on this thread when another face, or one with other landmarks, is shown.
    complain : callable
        Called on this thread with a sentence about what could not be done.
    parts : VisibleParts
        The present parts; for jobs.
    closed : bool
        True once the thread has ended, or is to end; under the condition.
    photos : tuple
        A number that grows when they change, and the photos of the present face as files, by the names of parts.
    """

    time_step = 0.02
    """Seconds from frame to frame."""

    def __init__(self, library: Library, document: Document) -> None:
        super().__init__(name="facewrinkle studio", daemon=True)
        self.library = library
        self.face = face = library.subject_of(document.session).face
        self.document = document
        self.condition = threading.Condition()
        self.listeners: list[Callable[[], None]] = []
        self.tell_face: Callable[[], None] = lambda: None
        self.complain: Callable[[str], None] = lambda text: None
        self.wanted_fields: set[str] = set()
        self.shown: Shown | None = None
        self.photos: tuple[int, dict[str, bytes]] = (0, {})
        self._photographed: list[np.ndarray | None] = []
        self._jobs: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self.closed = False
        self._live: dict[str, float] = {}
        self._playing, self._time = False, 0.0
        self._seen = -1
        self._applied = START
        self._player: Player | None = None
        self.parts = VisibleParts(face)
        self._steps, self._quiet, self._awake = 0, 0, True
        self._calls, self._heard = 0, 0
        self._clock = 0.0

    # --- from other threads --------------------------------------------------------------------

    def wake(self) -> None:
        """Look at the document again."""
        with self.condition:
            self._awake = True
            self._calls += 1
            self.condition.notify_all()

    def ask(self, job: Callable[[], Any]) -> Future[Any]:
        """Run a function on this thread between two steps; the future has what it returns."""
        future: Future[Any] = Future()
        with self.condition:
            if self.closed:
                future.set_exception(FaceWrinkleError("the studio is closed."))
            else:
                self._jobs.append((job, future))
                self.condition.notify_all()
        return future

    def live(self, weights: Mapping[str, float]) -> None:
        """Show a mixture on top of the document until the next one; an empty one ends that."""
        self._live = dict(weights)
        self.wake()

    def play(self, on: bool) -> None:
        """Let the timeline run, or stop it."""
        with self.condition:
            self._playing = on
            self.wake()

    def go_to(self, seconds: float) -> None:
        """Show a time of the timeline."""
        with self.condition:
            self._time = seconds
            self.wake()

    def followed(self, seconds: float = 60.0) -> None:
        """Wait until the document is shown, not longer than so many seconds."""
        with self.condition:
            self.condition.wait_for(lambda: self.closed or self._seen == self.document.version, seconds)

    def close(self) -> None:
        """End the thread."""
        with self.condition:
            self.closed = True
            self.condition.notify_all()
        if self.is_alive() and threading.current_thread() is not self:
            self.join(30.0)

    # --- on this thread ------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """True if something was asked that is not shown yet; under the condition."""
        return self._awake or bool(self._jobs) or self._seen != self.document.version

    @property
    def settled(self) -> bool:
        """True if the face is at rest with all that was asked for; under the condition."""
        return self.shown is not None and self.shown.still and not self.busy

    @property
    def driven(self) -> bool:
        """True while weights come from elsewhere than the document."""
        return bool(self._live)

    @property
    def shown_face(self) -> str:
        """Name of the face that is shown."""
        return self._applied.take or self._applied.face

    def run(self) -> None:
        """Work until closed."""
        try:
            self._work()
        finally:
            with self.condition:
                self.closed = True
                while self._jobs:
                    self._jobs.popleft()[1].cancel()
                self.condition.notify_all()

    def _work(self) -> None:
        due = time.monotonic()
        while True:
            with self.condition:
                while not (self.closed or self._jobs or self._awake):
                    self.condition.wait()
                    due = time.monotonic()
                if self.closed:
                    return
                job = self._jobs.popleft() if self._jobs else None
                session, version = self.document.session, self.document.version
                live, playing, self._heard = self._live, self._playing, self._calls
            if job is not None:
                self._do(*job)
                continue
            try:
                if not self._apply(session, version):
                    continue
                if (early := due - time.monotonic()) > 0.0:
                    with self.condition:
                        self.condition.wait(early)  # a job or a wish may come in between, and is served first
                    if time.monotonic() < due:
                        continue
                late = time.monotonic() - due
                due += self.time_step + late
                self._step(session, live, playing, late)
            except Exception:
                if self.shown is None:
                    raise
                self._begin_anew(version)

    def _begin_anew(self, version: int) -> None:
        """Tell of an error that nobody foresaw, and make another simulation with the next version of the document."""
        traceback.print_exc()
        self.complain("An internal error stopped the simulation (see the terminal). It restarts with the next change.")
        self._player, self._seen = None, -1
        with self.condition:
            self._awake = self.document.version != version

    def _do(self, job: Callable[[], Any], future: Future[Any]) -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(job())
        except BaseException as error:
            future.set_exception(error)

    def _apply(self, session: Session, version: int) -> bool:
        """Bring face, layers and tears in step with the document; return False if that cannot be. They then stay as
        they were, and the document takes the step back.
        """
        if version == self._seen:
            return True
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FaceWrinkleWarning)
                self._follow(session)
        except FaceWrinkleError as error:
            if self.shown is None:
                raise
            self.complain(str(error))
            with self.condition:
                if self.document.version == version and not self.document.refuse():
                    raise
            return False
        self._seen, self._applied = version, session
        return True

    def _follow(self, session: Session) -> None:
        """Make what a session asks for, all of it, and only then take it in place of what there is."""
        applied, player = self._applied, self._player
        if player is None or differ(applied, session, "face", "take", "identity", "landmarks"):
            subject = self.library.subject_of(session)
            player, parts = Player(session, subject), VisibleParts(subject.face)
            player.crying = player.tears_of(session.tears, self._clock)
            self._take_face(subject.face, player, parts, session)
            return
        tears = player.tears_of(session.tears, self._clock)
        if differ(applied, session, "folds", "regions", "patterns"):
            player.simulation.use_layers(layers_of(session, self.face))  # the last that may fail; the present ones stay
        player.crying = tears

    def _take_face(self, face: Face, player: Player, parts: VisibleParts, session: Session) -> None:
        """Show another face."""
        before = self._player
        if player.clip is None and before is not None and not differ(self._applied, session, "face", "take"):
            player.rates = {muscle: rate for muscle, rate in before.rates.items() if muscle in face.muscles}
        self.face, self._player, self.time_step = face, player, float(player.simulation.motion.time_step)
        self.parts = parts
        pictures = [face.texture, *(part.texture for part in face.parts.values())]
        if [id(each) for each in pictures] != [id(each) for each in self._photographed] or not self.photos[0]:
            self._photographed = pictures  # held, so that no other picture gets the same id
            self.photos = self.photos[0] + 1, parts.photos()
        self._applied = session
        self.tell_face()

    def _step(self, session: Session, live: Mapping[str, float], playing: bool, late: float) -> None:
        player, timeline = self._player, session.timeline
        assert player is not None
        with self.condition:
            if playing:
                self._time += self.time_step + late  # in real time, with fewer frames where they take longer
            if self._time > timeline.length:  # it may have become shorter, too
                self._time = 0.0 if playing and timeline.loop else timeline.length
                self._playing = self._playing and timeline.loop
        frame = player.step({**mixture_of(session, self._time), **live}, session.gaze, self._time)
        arrived = player.arrived and not player.cries(self._clock)
        self._clock += self.time_step
        moved = self._moved(frame)
        self._quiet = 0 if moved > 2e-3 or not arrived or playing else self._quiet + 1  # mm
        still = self._quiet >= 6  # steps
        parts = self.parts.at(frame, exact=still)
        tears, layers = player.tears(frame, self._clock), player.simulation.layers
        parts += [self._tear_part(name, tear) for name, tear in tears.items()]
        if session.probes:
            places = {name: point_of(place, self.face) for name, place in session.probes.items()}
            parts.append(self.parts.pins(frame, places))
        fields = {name: colored(frame, name, self.parts, layers) for name in sorted(self.wanted_fields - {FIBERS})}
        if FIBERS in self.wanted_fields:
            fields[FIBERS] = self.parts.fibers(frame, player.contractions)
        self._steps += 1
        box, surfaces = self.parts.box, list(tears.values())
        shown = Shown(
            frame, session, self._steps, parts, box, fields, still, self._time, layers, surfaces, player.contractions
        )
        with self.condition:
            self.shown = shown
            self._awake = not still or self._calls != self._heard  # nobody who called during the step waits for ever
            if still:
                self._quiet = 0
            self.condition.notify_all()
        for tell in self.listeners:
            tell()

    def _moved(self, frame: pv.PolyData) -> float:
        if self.shown is None or self.shown.frame.n_points != frame.n_points:
            return np.inf
        before, now = np.asarray(self.shown.frame.points), np.asarray(frame.points)
        return float(np.abs(now - before).max()) * self.face.unit

    def _tear_part(self, name: str, tear: pv.PolyData) -> Part:
        arrays: dict[str, np.ndarray] = {
            "index": np.ascontiguousarray(tear.regular_faces, np.uint32).ravel(),
            "position": self.parts.box.quantized(np.asarray(tear.points, np.float64)),
            "normal": small_normals(np.asarray(tear.point_data["Normals"])),
            "under": small_normals(np.asarray(tear.point_data["under"])),
            "thickness": np.asarray(tear.point_data["thickness"], np.float32),
        }
        return Part(f"tear {name}", "tear", arrays)
