"""What a page is told: first, names of what sliders are for and all that it needs to know of a face; then, answers."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ..anatomy import Atlas, Face, Identity, JawMuscle, LinearMuscle, Muscle, SheetMuscle, SphincterMuscle
from ..anatomy.landmarks import NOT_ON_SKIN
from ..animation.action_units import units_of
from ..animation.recorded import Recorded
from ..errors import ParameterError, check_name
from ..files import bytes_of
from ..layers.patterns_on_skin.kinds import KINDS
from ..layers.wave_folds.layer import REGIONS
from ..plotting.web import cameras_of
from ..rigging import Take
from ..rigging.shapes import VISEMES
from ..rigging.tables import shapes_of_column
from ..session import Folds, Pattern, Session, Subject, Tear
from ..session.content import is_session
from ..session.parts import LONGEST, Anywhere, Camera, point_of, ranges
from ..session.session import START
from .document import Document
from .fields import FIELDS, colors, labels, probe
from .library import Library, opened
from .protocol import (
    FACE_ALONE,
    Change,
    Continue,
    Copy,
    Field,
    Kind,
    Message,
    Play,
    Pose,
    Probe,
    Redo,
    Reset,
    Save,
    Show,
    Stop,
    Undo,
)  # fmt: skip
from .saving import SLOW, Folder, Kept, Order, SavingProcess, save
from .server import Client, Server
from .stage import Stage

ROOM = 0.08
"""Distance of handles as seen from the front, in distances between the pupils."""


class Answers:
    """Answers to what pages ask of a studio.

    Parameters
    ----------
    library : Library
    document : Document
    stage : Stage
    folder : Folder or None
    kept : Kept
        The session that was found in the folder.
    changed : callable
        Called when stage and pages must look at the document again.
    """

    server: Server

    def __init__(
        self,
        library: Library,
        document: Document,
        stage: Stage,
        folder: Folder | None,
        kept: Kept,
        changed: Callable[[], None],
    ) -> None:
        self._library, self._document, self._stage = library, document, stage
        self._folder, self._kept, self._changed = folder, kept, changed
        self._saving, self.process, self._driver = False, SavingProcess(), ""
        self._meshes = threading.Lock()  # VTK that draws in one thread and reads in another may wait for ever

    # --- what a page is told -------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return what there is for pages: the newest frame, the document and its version, and photos."""
        stage = self._stage
        return {
            "shown": stage.shown,
            "version": self._document.version,
            "document": self._told_document,
            "photos": stage.photos,
        }

    def _told_document(self) -> dict[str, Any]:
        data = self._document.session.table()
        return {"data": data, "history": self._document.history, "handles": self._handles()}

    def _handles(self) -> dict[str, Any]:
        """Where patterns and tears are."""
        session, face = self._document.session, self._stage.face
        places: dict[str, dict[str, Anywhere]] = {
            "patterns": {name: entry.center for name, entry in session.patterns.items()},
            "tears": {name: entry.start for name, entry in session.tears.items()},
        }
        return {
            table: {name: _attached(np.array(point_of(place, face)), face) for name, place in named.items()}
            for table, named in places.items()
        }

    def greeting(self) -> dict[str, Any]:
        """Return what a page is told first: names, ranges, and the face."""
        return {
            "atlas": of_atlas(self._stage.face.atlas),
            "fields": {name: colors(name) for name in FIELDS},
            "folds": ranges(Folds),
            "patterns": {"kinds": list(KINDS), "numbers": ranges(Pattern)},
            "tears": ranges(Tear),
            "folder": "" if self._folder is None else str(self._folder.path),
            "kinds": {what: what in SLOW for what in get_args(Kind)},
            "regions": list(REGIONS),
            "earlier": self._kept.when,
            "driver": self._driver,
            **self.face(),
        }

    def face(self) -> dict[str, Any]:
        """All that a page is told of the face, and of those that are open."""
        face, shown, first = self._stage.face, self._stage.shown_face, self._library.source or "Built-in head"
        named = [each.name for each in fields(Identity)] if self._library.built_in(shown) else ["age"]
        return {
            "faces": {"names": list(self._library.names), "shown": shown, "first": first},
            "identity": named if face.landmarks else [],
            "handles": self._handles(),
            "closed": {} if face.muscles else {"Folds": "This surface has no muscles, and therefore no folds."},
            **of_face(face, self._library[shown].clip),
        }

    # --- what it asks for ----------------------------------------------------------------------

    async def handle(self, message: Message, client: Client) -> Any:
        """Do what a page asks for, and return the answer."""
        stage, document = self._stage, self._document
        match message:
            case Probe():
                return await asyncio.wrap_future(stage.ask(lambda: self.probed(message)))
            case Save():
                return await self._save(message.what, message.camera, client.shows)
            case Copy():
                return self.as_python(message.camera, client.shows)
            case Field():
                if message.name is not None:
                    check_name("field", message.name, FIELDS)
                client.shows = message
                stage.wanted_fields = set().union(*(each.shows.parts for each in self.server.clients))
            case Play():
                stage.play(message.on)
            case Pose():
                stage.go_to(message.time)
            case Show():
                self.show(message.name)
            case Stop() if self._saving:
                self.process.stop()
            case _:
                with stage.condition:
                    self._edit(document, message)
        self._changed()
        return None

    def live(self, weights: Mapping[str, float]) -> None:
        """Show weights by the names of the atlas, or of ARKit's shapes, on top of the document until the next ones."""
        self._stage.live(mixture_of_live(weights, self._stage.face))

    def driven(self, driver: str) -> None:
        """Tell pages, and whoever reads the terminal, what drives the face now; "" if nothing does."""
        self._driver = driver
        self.server.tell_all(lambda: {"is": "driver", "name": driver})
        print(f"{driver} drives the face." if driver else "Nothing drives the face any more.", flush=True)

    def _edit(self, document: Document, message: Message) -> None:
        """Do what changes the document."""
        match message:
            case Change():
                document.change(message.patches, message.gesture)
            case Undo():
                document.undo()
            case Redo():
                document.redo()
            case Reset():
                document.reset()
            case Continue():
                if message.on:
                    self._kept.resume()
                else:
                    self._kept.dismiss()
                self.server.tell_all(lambda: {"is": "earlier", "when": self._kept.when})

    def session(self, camera: Camera | None = None, shows: Field = FACE_ALONE) -> Session:
        """Return what is shown, seen by a camera: from the front, if there is none."""
        shown = self._stage.shown
        assert shown is not None
        seen = replace(
            self._document.session.look,
            view=camera or "front",
            field=shows.name or "",
            muscles=shows.muscles,
        )
        return self._document.session.changed(self._stage.face.atlas, time=min(shown.time, LONGEST), look=seen)

    def as_python(self, camera: Camera | None = None, shows: Field = FACE_ALONE) -> str:
        """Return a program that makes what is shown, and its picture by a camera."""
        session = self.session(camera, shows)
        return self._library.outside(session).as_python(self._library.subject_of(session))

    async def _save(self, what: str, camera: Camera, shows: Field) -> dict[str, str]:
        if self._saving:
            raise ParameterError("another file is being saved; wait until it is done.")
        stage, self._saving = self._stage, True
        self._tell("Saving", 0.0)
        try:
            if what in SLOW:  # by a process of its own, so that the face goes on meanwhile
                session = self.session(camera, shows)
                order = Order(what, session, Subject(stage.face, self._library[stage.shown_face].clip))
                name, content = await asyncio.to_thread(self.process.save, order, self._tell)
            else:
                name, content = await asyncio.wrap_future(stage.ask(lambda: self._saved_by_stage(what, camera, shows)))
        finally:
            self._saving = False
            self._tell("", 1.0)
        if self._folder is None:
            return {"download": self.server.offer(name, content), "name": name}
        return {"path": str(self._folder.write(name, content)), "name": name}

    def _saved_by_stage(self, what: str, camera: Camera, shows: Field) -> tuple[str, bytes]:
        with self._meshes:
            return save(what, self.session(camera, shows), self._stage, self._library)

    def _tell(self, what: str, share: float) -> None:
        """Tell all pages how far something is."""
        self.server.tell_all(lambda: {"is": "progress", "text": what, "share": round(share, 3)})

    def probed(self, asked: Probe) -> dict[str, Any]:
        """Return what is known at a place of the frame, on the thread of the stage."""
        stage, corners, shares = self._stage, list(asked.corners), np.array(asked.shares)
        assert stage.shown is not None
        parts = stage.parts
        if not shares.any():
            raise ParameterError(f"one of the three shares must be above 0, received {asked.shares}.")
        if asked.version != parts.version or max(corners) >= len(parts.origin):
            raise ParameterError("the mesh has changed. Click again.")
        frame, layers = stage.shown.frame, stage.shown.layers
        origin, shares = parts.origin[corners], shares / shares.sum()
        found = probe(frame, stage.face, layers, origin, shares)
        return found | {"names": labels(frame, layers)["family"]}

    def opened(self, folder: Path) -> dict[str, Any]:
        """Read what was dropped onto a page, a session, a face or a take, and show it; on a thread of its own."""
        files = list(folder.iterdir())
        if len(files) == 1 and is_session(content := bytes_of(files[0])):
            with self._stage.condition:
                self._kept.load(content)
            self._changed()
            return {"name": "", "said": []}
        try:
            with self._meshes:
                shown = self._document.session.face
                name, loaded = opened(folder, self._stage.face, self._tell, shown)
                name = self._library.add(name, loaded)
                self._kept.keep(name)
            self._tell("Preparing the skin", 1.0)
            self.show(name, fresh=True)
            self._stage.followed()
        finally:
            self._tell("", 1.0)
        return {"name": name, "said": list(loaded.said), "plays": loaded.subject.clip is not None}

    def show(self, name: str, fresh: bool = False) -> None:
        """Show a face that is open, a fresh one at rest. Places of the one before mean nothing on it, unless it is the
        same that performs a take; a clip brings its own length.
        """
        subject, now = self._library[name], self._library.parts_for(name)
        parts = ["timeline"]
        if not now["take"] or now["face"] != self._document.session.face:
            parts += ["identity", "landmarks", "patterns", "tears", "probes", *(["mixture", "gaze"] if fresh else [])]
        before = START if now["face"] else self._document.start
        start: dict[str, Any] = {part: getattr(before, part) for part in parts} | now
        if subject.clip is not None:
            start["timeline"] = replace(START.timeline, length=round(min(max(subject.clip.duration, 0.2), LONGEST), 2))
        with self._stage.condition:
            self._document.change([((part,), value) for part, value in start.items()])
        self._changed()


def of_atlas(atlas: Atlas) -> dict[str, Any]:
    """Return the names of expressions, action units and muscles, which have two sides, and what they contract."""
    units = {
        name: {"about": about, "sides": f"{name}L" in atlas.action_units}
        for name, about in atlas.action_unit_names.items()
    }
    pairs: dict[str, dict[str, Any]] = {}
    for name in atlas.muscles:
        stem = name[:-2] if name.endswith(("_l", "_r")) else name
        pairs[stem] = {"sides": name != stem, "about": atlas.muscles[name]["kind"]}
    moves = {name: list(atlas.contractions({name: 1.0})) for name in (*atlas.expressions, *units, *pairs)}
    return {"expressions": list(atlas.expressions), "units": units, "muscles": pairs, "moves": moves}


def of_face(face: Face, clip: Recorded | Take | None = None) -> dict[str, Any]:
    """Return what a page needs to know of a face: its size, views and landmarks, and which sliders do nothing on it."""
    return {
        **cameras_of(face),
        "unit": face.unit,
        "origin": face.frame.origin.tolist(),
        "landmarks": landmarks_of(face),
        "pulls": pulls_of(face),
        "report": list(face.report),
        "off": without_effect(face, clip),
        "clip": None if clip is None else clip.duration,
        "contracts": not isinstance(clip, Recorded),
    }


def without_effect(face: Face, clip: Recorded | Take | None = None) -> dict[str, str]:
    """Return the names of expressions, action units and muscles that do nothing on a face, or "gaze", and why."""
    atlas = face.atlas
    off: dict[str, str] = {}
    stems = [name[:-2] if name.endswith(("_l", "_r")) else name for name in atlas.muscles]
    everything = [*atlas.expressions, *atlas.action_unit_names, *dict.fromkeys(stems), "gaze"]
    if clip is not None:
        return dict.fromkeys(everything, "a recorded animation moves this face")
    if not face.muscles:
        return dict.fromkeys(everything, "this surface has no muscles")
    if not face.mouth_opens:
        off |= dict.fromkeys(("AU19", "AU26", "AU27", "genioglossus", "jaw"), "the mouth of this face has no opening")
    if not face.eyelid_openings:
        why = "the lids of this face have no opening"
        off |= dict.fromkeys(("AU5", "AU7", "AU43", "AU45", "AU46", "levator_palpebrae", "gaze"), why)
    if not face.eyes:
        off["gaze"] = "this face has no eyes"
    return off


def landmarks_of(face: Face) -> dict[str, dict[str, Any]]:
    """Return the landmarks on the skin, each with the vertex that it goes along with, and how sure it is."""
    found = {}
    for name, place in face.landmarks.items():
        if name not in NOT_ON_SKIN:
            found[name] = {
                "place": np.round(place, 4).tolist(),
                **_attached(place, face),
                "confidence": None if name not in face.confidences else round(face.confidences[name], 2),
                "estimated": name in face.estimated,
            }
    return found


def pulls_of(face: Face) -> dict[str, dict[str, Any]]:
    """Return handles of the muscles that pull at the skin: the vertex that each goes along with, and the way of a full
    pull.

    Muscles that end at one place, as at the corner of the mouth, have their handles a part of the way along their
    fibers, so that each can be taken. A sphincter is pulled from its side towards its centre, and the jaw down.
    """
    found: dict[str, dict[str, Any]] = {}
    normals = face.normals
    front, taken = face.frame.axes[:2].T, np.empty((0, 2))  # room is what there is seen from the front
    for name, muscle in face.muscles.items():
        ends = _pull(muscle, face)
        if ends is None:
            continue
        begin, way = ends
        # Along the fibers, from the insertion: the first with room is taken.
        shares = [0.0] if isinstance(muscle, JawMuscle) else [0.2, 0.35, 0.5, 0.05, 0.65, 0.8]
        places = [_on_skin(begin + share * way, face, normals) for share in shares]
        room = [np.linalg.norm(taken - place @ front, axis=1).min(initial=np.inf) for _, place in places]
        enough = [k for k, apart in enumerate(room) if apart > ROOM * face.frame.pupil_distance]
        vertex, place = places[enough[0] if enough else int(np.argmax(room))]
        taken = np.vstack([taken, place @ front])
        offset = np.round(place - face.points[vertex], 4).tolist()
        found[name] = {"vertex": vertex, "offset": offset, "pull": np.round(way, 4).tolist()}
    return found


def _pull(muscle: Muscle, face: Face) -> tuple[np.ndarray, np.ndarray] | None:
    """The place at which a muscle moves the skin, and its way; None for one that does not."""
    if isinstance(muscle, SphincterMuscle):
        return muscle.centre + muscle.semi_major * muscle.lateral, -muscle.semi_major * muscle.lateral
    if isinstance(muscle, LinearMuscle | SheetMuscle):
        begin, end = (np.reshape(x, (-1, 3)).mean(axis=0) for x in (muscle.insertion, muscle.attachment))
        return begin, end - begin
    if isinstance(muscle, JawMuscle) and "menton" in face.landmarks:
        return face.landmarks["menton"], -0.5 * face.frame.pupil_distance * face.frame.axes[1]
    return None


def _on_skin(place: np.ndarray, face: Face, normals: np.ndarray) -> tuple[int, np.ndarray]:
    """The vertex nearest to a place, and the place moved onto the skin there; linings of lips and lids are no skin."""
    outwards = face.points - (face.frame.origin - face.frame.pupil_distance * face.frame.axes[2])
    lining = (outwards * normals).sum(axis=1) < 0.0
    vertex = int(np.argmin(np.where(lining, np.inf, np.linalg.norm(face.points - place, axis=1))))
    away = place - face.points[vertex]
    return vertex, face.points[vertex] + away - (away @ normals[vertex]) * normals[vertex]


def _attached(place: np.ndarray, face: Face) -> dict[str, Any]:
    """The vertex that a place goes along with, and how far from it the place is."""
    vertex = int(np.argmin(np.linalg.norm(face.points - place, axis=1)))
    return {"vertex": vertex, "offset": np.round(place - face.points[vertex], 4).tolist()}


def mixture_of_live(weights: Mapping[str, float], face: Face) -> dict[str, float]:
    """Return a mixture of names of the atlas, given these or names of shapes that takes may have."""
    known = (*face.atlas.action_units, *face.atlas.muscles, *face.atlas.expressions)
    mixture = {name: weight for name, weight in weights.items() if name in known}
    shapes = {name: weight for name, weight in weights.items() if name not in known}
    for name, weight in shapes.items():
        for shape in shapes_of_column(name):
            spoken = VISEMES[shape].units if shape in VISEMES else {shape: 1.0} if shape in known else {}
            for unit, share in spoken.items():
                mixture[unit] = max(mixture.get(unit, 0.0), share * weight)
    for side in ("l", "r"):
        for unit, weight in units_of(shapes, side).items():
            sided = f"{unit}{side.upper()}"
            name = sided if sided in face.atlas.action_units else unit
            if name in face.atlas.action_units:
                mixture[name] = max(mixture.get(name, 0.0), weight)
    if weights and not mixture and not units_of(dict.fromkeys(shapes, 1.0)):
        raise ParameterError("none of the names is an expression, an action unit, a muscle or a shape.")
    return mixture
