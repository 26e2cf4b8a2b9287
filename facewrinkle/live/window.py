"""The studio: a page in the browser on a face that is simulated here."""

from __future__ import annotations

import asyncio
import contextlib
import json
import shlex
import time
import webbrowser
from collections.abc import Mapping
from copy import deepcopy
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..anatomy.fitting import default_face
from ..anatomy.identity import Identity
from ..arguments import checked
from ..errors import FaceWrinkleError, MissingPackageError, OutputError, ParameterError, check_whole
from ..layers.patterns_on_skin.kinds import KINDS
from .coloured_fields import FIELDS, check_field, colours, labels, probe
from .document import FOLDS, LONGEST, PATTERN, START, TEAR, Document
from .greeting import handles_of, mixture_of_live, of_atlas, of_face
from .library import COMPANIONS, MESHES, Library, Tell, opened
from .looking import Look, to_look_at
from .saving import KINDS as KINDS_OF_FILES
from .saving import SLOW, Folder, save, save_rig
from .stage import Stage
from .wishes import as_command, as_python

if TYPE_CHECKING:
    from .widget import StudioWidget

READY = 120.0
"""Seconds that the first frame may take; compiling is part of it."""


class Studio:
    """A face in the browser, live. :func:`facewrinkle.studio` makes one.

    Attributes
    ----------
    url : str
        Address of the page, with the key of this studio.
    face : Face

    Examples
    --------
    >>> import facewrinkle as fw
    >>> with Studio(fw.default_face(), browser=False) as studio:
    ...     studio.rates = {"AU12": 0.5}
    ...     frame = studio.frame()
    >>> frame.n_points > 2000
    True
    """

    def __init__(
        self,
        face: Face,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        save_to: Path | None = None,
        browser: bool = True,
        source: str | None = None,
        frame: pv.PolyData | None = None,
    ) -> None:
        try:
            from .server import Server
        except ImportError:
            raise MissingPackageError(
                "the studio needs the package aiohttp, which is not installed. pip install 'facewrinkle[studio]'"
            ) from None
        self._library = Library(face)
        self._document = Document(face.atlas, lambda: self._library.names)
        self._folder = Folder(save_to)
        self._source = source
        stage = Stage if frame is None else partial(Look, frame)
        self._stage = stage(self._library, self._document)
        self._server = Server(self._handle, self._state, self._greeting, self._opened, host, port)
        self._autosaved, self._saving = -1, False
        self._server.start()
        self._stage.listeners.append(self._server.wake)
        self._stage.listeners.append(self._autosave)
        self._stage.faces.append(lambda: self._server.tell_all({"is": "face", **self._face()}))
        self._stage.complaints.append(lambda text: self._server.tell_all({"is": "error", "id": 0, "text": text}))
        self._stage.start()
        try:
            self._first()
        except BaseException:
            self.close()
            raise
        if browser:
            with contextlib.suppress(webbrowser.Error):
                webbrowser.open(self.url)

    def _first(self) -> None:
        deadline = time.monotonic() + READY
        with self._stage.condition:
            while self._stage.shown is None and self._stage.is_alive() and time.monotonic() < deadline:
                self._stage.condition.wait(0.2)
        if self._stage.shown is None:
            raise FaceWrinkleError("the face could not be simulated; make a Simulation of it to see why.")

    def __repr__(self) -> str:
        return f"Studio({self.face!r}, {len(self._server.clients)} pages)"

    # --- from Python ---------------------------------------------------------------------------

    @property
    def url(self) -> str:
        """Address of the page."""
        return self._server.url

    @property
    def face(self) -> Face:
        """The face that is shown."""
        return self._stage.face

    @property
    def rates(self) -> dict[str, float]:
        """Weights of expressions, action units and muscles as the sliders have them; may be set.

        Raises
        ------
        UnknownNameError, ParameterError
            For names and weights that the face does not have.
        """
        return dict(self._document.data["mixture"])

    @rates.setter
    def rates(self, weights: Mapping[str, float]) -> None:
        self.change(mixture=dict(weights))

    @property
    def document(self) -> dict[str, Any]:
        """All that is set, as plain data: a copy."""
        result: dict[str, Any] = json.loads(self._document.text())
        return result

    def change(self, **parts: Any) -> None:
        """Set parts of the document, such as ``folds={"depth": 2.0}``, as one step of undo."""
        with self._stage.condition:
            self._document.change([((name,), value) for name, value in parts.items()])
        self._changed()

    def undo(self) -> bool:
        """Take the last step back; return False if there is none."""
        with self._stage.condition:
            done = self._document.undo()
        self._changed()
        return done

    def redo(self) -> bool:
        """Do the last step that was taken back again."""
        with self._stage.condition:
            done = self._document.redo()
        self._changed()
        return done

    def frame(self, settled: bool = True, timeout: float = 30.0) -> pv.PolyData:
        """Return the frame that is shown: a copy.

        Parameters
        ----------
        settled : bool
            Wait until the face has come to rest with all that was asked for.
        timeout : float
            Seconds to wait at most.

        Raises
        ------
        FaceWrinkleError
            If the face still moves then, as it does while the timeline plays.
        """
        deadline = time.monotonic() + timeout
        with self._stage.condition:
            while settled and not self._settled():
                if time.monotonic() > deadline or not self._stage.is_alive():
                    raise FaceWrinkleError(f"the face still moves after {timeout:g} s. Take settled=False.")
                self._stage.condition.wait(0.1)
            assert self._stage.shown is not None
            return self._stage.shown.frame.copy()

    def _settled(self) -> bool:
        shown = self._stage.shown
        return shown is not None and shown.still and not self._stage.busy

    def widget(self, height: int = 520) -> StudioWidget:
        """Return the view and the sliders as a widget, to be shown in a notebook; what changes there changes here.

        Parameters
        ----------
        height : int
            Pixels, 200 to 4000.

        Raises
        ------
        MissingPackageError
            Without the package anywidget.
        """
        check_whole("height", height, 200, 4000)
        try:
            from .widget import StudioWidget
        except ImportError:
            raise MissingPackageError(
                "the widget needs the package anywidget, which is not installed. pip install 'facewrinkle[studio]'"
            ) from None
        return StudioWidget(self._server, height)

    def as_python(self) -> str:
        """Return a program that makes what is shown, as the page copies it."""
        return self._copied("python")

    def wait(self) -> None:
        """Wait until the studio is closed, or Ctrl-C."""
        while self._stage.is_alive():
            self._stage.join(0.5)

    def close(self) -> None:
        """Disconnect all pages, and stop."""
        self._stage.close()
        self._server.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --- for the server ------------------------------------------------------------------------

    def _changed(self) -> None:
        self._stage.wake()
        self._server.wake()

    def _state(self) -> dict[str, Any]:
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

    def _greeting(self) -> dict[str, Any]:
        return {
            "atlas": of_atlas(self._stage.face.atlas),
            "fields": {name: colours(name) for name in FIELDS},
            "folds": FOLDS,
            "patterns": {"kinds": list(KINDS), "numbers": PATTERN},
            "tears": TEAR,
            "folder": str(self._folder.path) if self._folder.path else "",
            "kinds": list(KINDS_OF_FILES),
            "endings": [*MESHES, ".face", *COMPANIONS],
            **self._face(),
        }

    def _face(self) -> dict[str, Any]:
        """All that a page is told of the face, and of those that are open."""
        face, shown = self._stage.face, self._stage.shown_face
        built_in = not shown and self._library[""].face.template is None and not self._source
        return {
            "faces": {"names": list(self._library.names), "shown": shown, "first": self._source or "Built-in head"},
            "identity": sorted(Identity.__dataclass_fields__) if built_in and face.landmarks else [],
            **of_face(face, self._library[shown].clip),
        }

    def _opened(self, folder: Path, names: list[str]) -> dict[str, Any]:
        """Read what was dropped onto a page, and show it; on a thread of its own."""

        tell = self._teller()
        try:
            name, loaded = opened(folder, names, self._library[""].face.atlas, tell)
        finally:
            tell("", 1.0)
        name = self._library.add(name, loaded)
        self._show(name)
        return {"name": name, "said": list(loaded.said)}

    def _show(self, name: str) -> None:
        """Show a face that is open. Places of the one before mean nothing on it; a clip brings its own length."""
        start = deepcopy({part: START[part] for part in ("identity", "landmarks", "patterns", "tears", "timeline")})
        clip = self._library[name].clip
        if clip is not None:
            start["timeline"]["length"] = min(max(clip.duration, 0.2), LONGEST)
        with self._stage.condition:
            self._document.change([((part,), value) for part, value in {"face": name, **start}.items()])
        self._changed()

    async def _handle(self, command: str, arguments: dict[str, Any], client: Any) -> Any:
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
            clients = self._server.clients
            stage.wanted_fields = {each.field for each in clients if each.field is not None}
        elif command == "play":
            stage.play(arguments["on"])
        elif command == "pose":
            stage.go_to(arguments["time"])
        elif command == "show":
            self._show(arguments["name"])
        elif command == "live":
            stage.live(mixture_of_live(arguments["weights"], stage.face))
        elif command == "copy":
            return self._copied(arguments["what"])
        elif command == "probe":
            return await asyncio.wrap_future(stage.ask(lambda: self._probed(**arguments)))
        elif command == "save":
            return await self._save(**arguments)
        self._changed()
        return None

    def _copied(self, what: str) -> str:
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
            if what in SLOW:  # does not draw, so that the face goes on meanwhile
                face, data = stage.face, self._document.data
                name, content = await asyncio.to_thread(save_rig, face, data, tell)
            else:
                job = stage.ask(lambda: save(what, camera, stage, self._document, tell))
                name, content = await asyncio.wrap_future(job)
        finally:
            self._saving = False
            tell("", 1.0)
        return self._saved(name, content)

    def _teller(self) -> Tell:
        """Return a function that tells all pages how far something is, in few messages."""
        last: tuple[str, int] | None = None

        def tell(what: str, share: float) -> None:
            nonlocal last
            if (what, int(40 * share)) != last:
                last = what, int(40 * share)
                self._server.tell_all({"is": "progress", "text": what, "share": round(share, 3)})

        return tell

    def _probed(self, corners: list[int], shares: list[float], version: int) -> dict[str, Any]:
        stage = self._stage
        assert stage.shown is not None
        parts = stage.parts
        if version != parts.last or max(corners) >= len(parts.origin):
            raise ParameterError("the mesh has changed since. Click again.")
        frame, layers = stage.shown.frame, stage.layers
        origin = parts.origin[corners]
        found = probe(frame, stage.face, layers, int(origin[int(np.argmax(shares))]))
        rest = np.asarray(frame.point_data.get("rest", frame.points))
        found["rest"] = [float(x) for x in np.array(shares) / sum(shares) @ rest[origin]]
        return found | {"names": labels(frame, layers)["family"]}

    def _saved(self, name: str, data: bytes) -> dict[str, str]:
        if self._folder.path is None:
            return {"download": self._server.offer(name, data), "name": name}
        return {"path": str(self._folder.write(name, data)), "name": name}

    def _autosave(self) -> None:
        """Write the session into the folder, when the face has come to rest."""
        shown = self._stage.shown
        if self._folder.path is None or shown is None or not shown.still or self._autosaved == self._document.version:
            return
        first, self._autosaved = self._autosaved < 0, self._document.version
        if not first:
            with contextlib.suppress(OutputError):
                self._folder.write("session.json", self._document.text().encode(), anew=False)


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


@checked
def studio(
    face: Face | pv.PolyData | None = None,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    save_to: str | Path | None = None,
    browser: bool = True,
) -> Studio:
    """Open a face in the browser, with a slider for each expression, action unit and muscle.

    Parameters
    ----------
    face : Face or PolyData, optional
        Default: the built-in head. A frame of a simulation, or any other surface, is looked at as it is: its
        fields can be shown and read, and nothing moves.
    host : str
        Address to listen at. Others than 127.0.0.1 let everybody in the network who knows the address with its key
        use the studio.
    port : int
        0 is any that is free.
    save_to : path, optional
        The one folder that the page may write to, with the session saved by itself. Default: what is saved is
        downloaded.
    browser : bool
        Open the browser; if not, open :attr:`Studio.url` yourself.

    Returns
    -------
    Studio
        With `rates`, `frame()`, `wait()` and `close()`; it also closes at the end of a `with` statement.

    Raises
    ------
    MissingPackageError
        Without the package aiohttp.
    ParameterError
        For a port that is in use, and for anything but a face and a surface.
    MeshError
        For a surface without triangles.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> with fw.studio(fw.default_face(), browser=False) as window:
    ...     window.rates = {"AU1": 1.0, "AU2": 1.0}
    ...     frame = window.frame()
    >>> bool(frame["W"].min() < -0.2)
    True
    """
    frame = None
    if isinstance(face, pv.PolyData):
        frame = to_look_at(face)
        face = Face.without_anatomy(frame, 1.0)
    folder = None if save_to is None else Path(save_to)
    return Studio(face or default_face(), host=host, port=port, save_to=folder, browser=browser, frame=frame)
