"""Files of a studio: pictures, movies, meshes, rigs and sessions, into one folder or as downloads."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import os
import pickle
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from ..anatomy.atlas import Atlas, atlas_text
from ..anatomy.face import Face
from ..anatomy.face_file import SUFFIX, read_face, write_face
from ..errors import FaceWrinkleError, OutputError, ParameterError
from ..export import write_mesh
from ..files import bytes_of, output_folder, write_whole
from ..plotting import save_picture
from ..progress import Progress
from ..session import Session, Subject
from ..session.player import Player, mixture_of, pictured, scene_of
from .document import Document
from .library import Library, Loaded, Tell, telling
from .stage import Stage

SLOW = ("rig", "maps", "movie", "animation")
"""Things that take long, and are made by a process of their own: drawing would let the face stand still meanwhile."""

SESSION = "session.json"
"""The file of the session in the folder of a studio."""

SOON = 0.5
"""Seconds after a change until the session is saved."""


def environment() -> dict[str, str]:
    """Return the environment of a process that imports this very package, wherever it is started.

    Examples
    --------
    >>> environment()["PYTHONPATH"].split(os.pathsep)[0] == str(Path(__file__).parents[2])
    True
    """
    paths = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": paths.rstrip(os.pathsep)}


class Folder:
    """The one folder that a page may have written to.

    Parameters
    ----------
    path : Path
        Made if it does not exist.
    """

    def __init__(self, path: Path) -> None:
        self.path = output_folder(path).resolve()

    def write(self, name: str, data: bytes) -> Path:
        """Write data under a name with a number, never over another file."""
        return write_whole(self.free(name), data)

    def free(self, name: str) -> Path:
        """Return the path of a name with the first number that is free."""
        stem, _, ending = name.partition(".")
        paths = (self.path / f"{stem}_{number}.{ending}" for number in itertools.count(1))
        return next(path for path in paths if not path.exists())


class Kept:
    """The session in the folder of a studio: saved soon after each change, and offered again at the next start.

    Parameters
    ----------
    folder : Folder or None
    document : Document
    library : Library
    complain : callable
        Called, on any thread, with a sentence when the session cannot be saved: once, until it can be again.

    Attributes
    ----------
    when : str
        Day and time of the session that was found at the start; "" if there was none, or it was resumed or dismissed.
    """

    def __init__(
        self, folder: Folder | None, document: Document, library: Library, complain: Callable[[str], None]
    ) -> None:
        self._folder, self._document, self._library, self._complain = folder, document, library, complain
        self._saved, self._failed = document.version, False
        self._faces: dict[str, str] = {}
        self._lock = threading.Lock()
        self._timer: threading.Timer | None = None
        self.when, self._found, self._own = "", b"", b""
        if folder is not None and (path := folder.path / SESSION).is_file():
            self._found = bytes_of(path, kept=False)
            self.when = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))

    def resume(self) -> None:
        """Take over the session that was found, as a step that can be undone.

        Raises
        ------
        ParameterError
            If it is no session, or needs a face that is not open.
        """
        if self.when:
            self.load(self._found)
            self.when, self._own = "", self._own or self._found

    def load(self, text: bytes) -> None:
        """Take over the session of a file, as a step that can be undone, with the face that was kept beside it."""
        known, names = self._library[""].face.atlas, {file: name for name, file in self._faces.items()}
        session = self._library.inside(Session.from_json(text, known))
        file = session.face
        if self._folder is not None and file.endswith(SUFFIX) and file not in {*names, *self._library.names}:
            path = self._folder.path / Path(file).name
            if path.is_file():
                names[file] = self._library.add(path.name, Loaded(Subject(read_face(path, known))))
                self._faces[names[file]] = path.name
        self._document.load(session.changed(known, face=names.get(file, file)))

    def keep(self, name: str) -> None:
        """Write a face that was opened beside the session, which would be of no use without it."""
        if self._folder is None or self._library[name].clip is not None:
            return
        try:
            path = write_face(self._library[name].face, self._folder.free(f"{Path(name).stem}{SUFFIX}"))
        except (OSError, OutputError) as problem:
            self._complain(f"The face could not be saved beside the session: {problem}")
        else:
            self._faces[name] = path.name

    def dismiss(self) -> None:
        """Leave the session that was found; it is kept under another name."""
        self.when = ""

    def changed(self) -> None:
        """Save the session soon."""
        if self._folder is not None and self._timer is None and self._saved != self._document.version:
            self._timer = threading.Timer(SOON, self.save)
            self._timer.daemon = True
            self._timer.start()

    def save(self) -> None:
        """Save the session if it was changed. A file that was not written here, nor resumed, gets another name."""
        self._timer = None
        if self._folder is None or not self._lock.acquire(timeout=5.0):
            return
        try:
            if self._saved != self._document.version:
                self._write(self._folder, self._document.version)
        except (OSError, OutputError) as problem:
            if not self._failed:
                self._complain(f"The session could not be saved: {problem}")
            self._failed = True
        finally:
            self._lock.release()

    def _write(self, folder: Folder, version: int) -> None:
        path = folder.path / SESSION
        session = self._library.outside(self._document.session)
        kept = self._faces.get(session.face, session.face)
        text = session.changed(self._library[""].face.atlas, face=kept).to_json().encode()
        if path.is_file() and bytes_of(path, kept=False) != self._own:
            path.replace(folder.free(SESSION))
        write_whole(path, text)
        self._own, self._saved, self._failed = text, version, False


@dataclasses.dataclass(frozen=True, eq=False)
class Order:
    """A file that takes long: what is asked for, and all that it is made of."""

    what: str
    session: Session
    subject: Subject


def save(what: str, session: Session, stage: Stage, library: Library) -> tuple[str, bytes]:
    """Return the name and the content of a file; on the thread of the stage.

    A face at rest is saved as the session makes it from the beginning, so that everybody who has the session, or its
    program, gets the same bytes.

    Parameters
    ----------
    what : str
        One of the kinds of `Save`, but none of `SLOW`.
    session : Session
    stage : Stage
    library : Library
    """
    shown, face = stage.shown, stage.face
    assert shown is not None
    if what == "session":
        return "session.json", library.outside(session).to_json().encode()
    if what == "atlas":
        return "atlas.toml", atlas_with(face, session).encode()
    with tempfile.TemporaryDirectory() as folder:
        if what == "face":
            path = write_face(face, Path(folder) / "scan.face")
            return path.name, path.read_bytes()
        frame, tears, rates = shown.frame, shown.tears, shown.rates
        if stage.settled and not stage.driven:
            player = Player(session, library.subject_of(session))
            frame, rates = player.settled(), player.contractions
            tears = player.arrived_tears(frame)
        if what == "glb":
            path = write_mesh(frame, Path(folder) / "face.glb", face, parts=True, tears=tears)
        else:
            path = Path(folder) / f"{what}.png"
            with scene_of(session, face) as scene:
                draw = partial(pictured, scene, session, frame, tears, rates)
                save_picture(draw() if what == "picture" else scene.cut_out(draw), path)
        return path.name, path.read_bytes()


def save_slowly(order: Order, tell: Tell) -> tuple[str, bytes]:
    """Return the name and the content of a file of `SLOW`.

    Parameters
    ----------
    order : Order
    tell : callable
        Told what is done, and the share of it.
    """
    with tempfile.TemporaryDirectory() as folder:
        match order.what:
            case "movie":
                path = order.session.movie(Path(folder) / "movie.mp4", order.subject, telling(tell))
            case "animation":
                path = order.session.animation(Path(folder) / "animation.glb", order.subject, telling(tell))
            case what:
                path = _rig(order.subject.face, Path(folder), what == "maps", telling(tell, "Rig: "))
        return path.name, path.read_bytes()


def _rig(face: Face, folder: Path, maps: bool, progress: Progress) -> Path:
    """Write ARKit's shapes of a face; with maps, all that plays them and the extension for Blender in one file."""
    from .. import rigging
    from ..rigging.write import write_extension

    if not face.muscles:
        raise ParameterError("a rig needs a face with muscles, and this surface has none.")
    if not maps:
        return rigging.write_rig(rigging.rig(face, level=1, progress=progress), folder / "rig.glb")
    made = rigging.rig(face, wrinkles="maps", progress=progress)
    layers = rigging.bake_layers(made, progress=progress)
    inside = folder / "maps"
    inside.mkdir()
    rigging.write_layers(layers, rigging.write_rig(made, inside / "rig.glb"))
    rigging.write_page(made, inside / "rig.html", layers)
    write_extension(inside / "facewrinkle-blender.zip")
    return Path(shutil.make_archive(str(inside), "zip", inside))


def atlas_with(face: Face, session: Session) -> str:
    """Return the atlas of a face as TOML; saved mixtures, and what the sliders show as "studio", are expressions."""
    atlas, mixture = face.atlas, mixture_of(session)
    for name, weights in [*([("studio", mixture)] if mixture else []), *session.mixtures.items()]:
        atlas = atlas.with_expressions({_free_name(re.sub(r"\W+", "_", name), atlas): weights})
    return atlas_text(atlas)


def _free_name(name: str, atlas: Atlas) -> str:
    """Return a name, with a number if it means something already: an expression, a unit or a muscle."""
    taken = {*atlas.expressions, *atlas.unit_and_muscle_names}
    numbered = (f"{name}_{number}" for number in itertools.count(2))
    return name if name not in taken else next(each for each in numbered if each not in taken)


class SavingProcess:
    """Makes files of `SLOW` in processes of their own, one at a time.

    A program that holds a studio need not be written for processes, as those of multiprocessing ask.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False

    def save(self, order: Order, tell: Tell) -> tuple[str, bytes]:
        """Return the name and the content of a file.

        Parameters
        ----------
        order : Order
        tell : callable
            Told what is done, and the share of it.

        Raises
        ------
        FaceWrinkleError
            If it cannot be made, or :meth:`stop` was called.
        """
        try:
            with subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import main; main()"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment(),
                start_new_session=True,  # Ctrl-C is for the studio, which ends the process by itself
            ) as self._process:  # fmt: skip
                if self._stopped:  # before it began
                    self._process.kill()
                assert self._process.stdin is not None
                assert self._process.stdout is not None
                with contextlib.suppress(EOFError, OSError, pickle.UnpicklingError):  # it has ended
                    pickle.dump(order, self._process.stdin)
                    self._process.stdin.close()
                    while (message := pickle.load(self._process.stdout))[0] == "progress":
                        tell(*message[1:])
                    if message[0] == "file":
                        name, content = message[1:]
                        return name, content
                    raise FaceWrinkleError(message[1])
            raise FaceWrinkleError(f"the {order.what} was not made{'' if self._stopped else '; see the terminal'}.")
        finally:
            self._stopped = False

    def stop(self) -> None:
        """End what is being made."""
        self._stopped = True
        if self._process is not None:
            self._process.kill()


def main() -> None:
    """Make the file of the order that comes in, and send it out, after messages that tell how far it is."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print, in C too, is no message

    def send(*message: Any) -> None:
        pickle.dump(message, out)
        out.flush()

    try:
        order = pickle.load(sys.stdin.buffer)
        send("file", *save_slowly(order, lambda what, share: send("progress", what, share)))
    except FaceWrinkleError as problem:
        send("problem", str(problem))
