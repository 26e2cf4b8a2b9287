"""Answers to what a page asks for."""

from __future__ import annotations

import asyncio
import shlex
import threading
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from ..anatomy.face import Face
from ..anatomy.identity import Identity
from ..errors import ParameterError
from ..layers.patterns_on_skin.kinds import KINDS
from .clients import Client
from .coloured_fields import FIELDS, check_field, colours, labels
from .document import FOLDS, LONGEST, PATTERN, REGIONS, START, TEAR, Document
from .greeting import handles_of, mixture_of_live, of_atlas, of_face
from .keeping import Kept
from .library import COMPANIONS, MESHES, Library, Tell, opened
from .probing import probe
from .saving import KINDS as KINDS_OF_FILES
from .saving import SLOW, Folder, Order, save
from .saving_process import SavingProcess
from .server import Server
from .stage import Stage
from .wishes import as_command, as_python


class Answers:
    """Answers to what pages ask of a studio.

    Parameters
    ----------
    library : Library
    document : Document
    stage : Stage
    folder : Folder
    kept : Kept
        The session that was found in the folder.
    source : str or None
        The path of the face of the start.
    changed : callable
        Called when stage and pages must look at the document again.
    """

    server: Server

    def __init__(
        self,
        library: Library,
        document: Document,
        stage: Stage,
        folder: Folder,
        kept: Kept,
        source: str | None,
        changed: Callable[[], None],
    ) -> None:
        self._library, self._document, self._stage = library, document, stage
        self._folder, self._kept, self._source, self._changed = folder, kept, source, changed
        self._saving, self.process = False, SavingProcess()
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
        data = self._document.data
        return {"data": data, "history": self._document.history, "handles": handles_of(data, self._stage.face)}

    def greeting(self) -> dict[str, Any]:
        """Return what a page is told first: names, ranges, and the face."""
        return {
            "atlas": of_atlas(self._stage.face.atlas),
            "fields": {name: colours(name) for name in FIELDS},
            "folds": FOLDS,
            "patterns": {"kinds": list(KINDS), "numbers": PATTERN},
            "tears": TEAR,
            "folder": str(self._folder.path) if self._folder.path else "",
            "kinds": list(KINDS_OF_FILES),
            "regions": list(REGIONS),
            "earlier": self._kept.when,
            "endings": [*MESHES, ".face", *COMPANIONS],
            **self.face(),
        }

    def face(self) -> dict[str, Any]:
        """All that a page is told of the face, and of those that are open."""
        face, shown = self._stage.face, self._stage.shown_face
        built_in = not shown and self._library[""].face.template is None and not self._source
        return {
            "faces": {"names": list(self._library.names), "shown": shown, "first": self._source or "Built-in head"},
            "identity": sorted(Identity.__dataclass_fields__) if built_in and face.landmarks else [],
            "closed": self._closed(face),
            **of_face(face, self._library[shown].clip),
        }

    def _closed(self, face: Face) -> dict[str, str]:
        """Return the tabs that do nothing on a face, and why."""
        if self._stage.looks:
            return dict.fromkeys(("Folds", "Patterns", "Tears"), "A frame is looked at as it is.")
        return {} if face.muscles else {"Folds": "This surface has no muscles, and so no folds of its own."}

    # --- what it asks for ----------------------------------------------------------------------

    async def handle(self, command: str, arguments: dict[str, Any], client: Client) -> Any:
        """Do what a page asks for, and return the answer."""
        stage = self._stage
        if command == "change":
            with stage.condition:
                self._document.change(arguments["patches"], arguments["gesture"])
        elif command in ("undo", "redo", "reset"):
            with stage.condition:
                getattr(self._document, command)()
        elif command == "load":
            with stage.condition:
                self._document.load(arguments["text"])
        elif command == "field":
            client.field = check_field(arguments["name"])
            clients = self.server.clients
            stage.wanted_fields = {each.field for each in clients if each.field is not None}
        elif command == "play":
            stage.play(arguments["on"])
        elif command == "pose":
            stage.go_to(arguments["time"])
        elif command == "show":
            self.show(arguments["name"])
        elif command == "live":
            stage.live(mixture_of_live(arguments["weights"], stage.face))
        elif command == "copy":
            return self.copied(arguments["what"])
        elif command == "probe":
            return await asyncio.wrap_future(stage.ask(lambda: self.probed(**arguments)))
        elif command == "save":
            return await self._save(**arguments)
        elif command == "continue":
            with stage.condition:
                if arguments["on"]:
                    self._kept.resume(self._document)
                else:
                    self._kept.dismiss()
            self.server.tell_all({"is": "earlier", "when": self._kept.when})
        self._changed()
        return None

    def copied(self, what: str) -> str:
        """Return a program ("python") or a command ("command") that makes what is shown."""
        data = self._document.data
        source = data["face"] or self._source
        if what in ("python", "command") and self._library[data["face"]].clip is not None:
            command = f"facewrinkle play {shlex.quote(data['face'])}"
            return _clip_as_python(data["face"]) if what == "python" else command
        if what == "python":
            return as_python(data, self._stage.face, _source_of(source))
        if what == "command":
            command, missing = as_command(data, source)
            return command + (f"\n# left out, as no option says it: {', '.join(missing)}" if missing else "")
        raise ParameterError(f"what is copied must be python or command, received {what!r}.")

    async def _save(self, what: str, camera: list[float]) -> dict[str, str]:
        if self._saving:
            raise ParameterError("another file is being written; wait for it.")
        stage, tell, self._saving = self._stage, self._teller(), True
        tell("Saving", 0.0)
        try:
            if what in SLOW:  # by a process of its own, so that the face goes on meanwhile
                clip = self._library[stage.shown_face].clip
                order = Order(what, camera, stage.face, self._document.data, clip)
                name, content = await asyncio.to_thread(self.process.save, order, tell)
            else:
                name, content = await asyncio.wrap_future(stage.ask(lambda: self._saved_by_stage(what, camera)))
        finally:
            self._saving = False
            tell("", 1.0)
        return self._saved(name, content)

    def _saved_by_stage(self, what: str, camera: list[float]) -> tuple[str, bytes]:
        with self._meshes:
            return save(what, camera, self._stage, self._document)

    def _teller(self) -> Tell:
        """Return a function that tells all pages how far something is, in few messages."""
        last: tuple[str, int] | None = None

        def tell(what: str, share: float) -> None:
            nonlocal last
            if (what, int(40 * share)) != last:
                last = what, int(40 * share)
                self.server.tell_all({"is": "progress", "text": what, "share": round(share, 3)})

        return tell

    def probed(self, corners: list[int], shares: list[float], version: int) -> dict[str, Any]:
        """Return what is known at a place of the frame, on the thread of the stage."""
        stage = self._stage
        assert stage.shown is not None
        parts = stage.parts
        if version != parts.last or max(corners) >= len(parts.origin):
            raise ParameterError("the mesh has changed since. Click again.")
        frame, layers = stage.shown.frame, stage.layers
        if layers is not stage.shown.layers:  # they have made no frame yet
            raise ParameterError("the face has changed since. Click again.")
        origin = parts.origin[corners]
        found = probe(frame, stage.face, layers, int(origin[int(np.argmax(shares))]))
        rest = np.asarray(frame.point_data.get("rest", frame.points))
        found["rest"] = [float(x) for x in np.array(shares) / sum(shares) @ rest[origin]]
        return found | {"names": labels(frame, layers)["family"]}

    def _saved(self, name: str, data: bytes) -> dict[str, str]:
        if self._folder.path is None:
            return {"download": self.server.offer(name, data), "name": name}
        return {"path": str(self._folder.write(name, data)), "name": name}

    def opened(self, folder: Path, names: list[str]) -> dict[str, Any]:
        """Read what was dropped onto a page, and show it; on a thread of its own."""

        tell = self._teller()
        try:
            with self._meshes:
                name, loaded = opened(folder, names, self._library[""].face.atlas, tell)
        finally:
            tell("", 1.0)
        name = self._library.add(name, loaded)
        self.show(name)
        return {"name": name, "said": list(loaded.said)}

    def show(self, name: str) -> None:
        """Show a face that is open. Places of the one before mean nothing on it; a clip brings its own length."""
        start = deepcopy({part: START[part] for part in ("identity", "landmarks", "patterns", "tears", "timeline")})
        clip = self._library[name].clip
        if clip is not None:
            start["timeline"]["length"] = min(max(clip.duration, 0.2), LONGEST)
        with self._stage.condition:
            self._document.change([((part,), value) for part, value in {"face": name, **start}.items()])
        self._changed()


def _source_of(path: str | None) -> str:
    if path is None:
        return "fw.default_face()"
    return f"fw.{'read_face' if path.endswith('.face') else 'fit_face'}({path!r})"


def _clip_as_python(path: str) -> str:
    lines = [
        "import facewrinkle as fw",
        f"mesh, recorded = fw.read_animation({path!r})",
        "face = fw.fit_face(mesh)",
        "sim = fw.Simulation(face, motion=recorded)",
        "frames = list(sim.run(round(recorded.duration / 0.02)))",
    ]
    return "\n".join(lines) + "\n"
