"""Files of a studio: pictures, movies, meshes, rigs and sessions, into one folder or as downloads."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import os
import pickle
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

from PIL import Image

from ..anatomy.atlas import Atlas
from ..anatomy.atlas_file import atlas_text
from ..anatomy.face import Face
from ..anatomy.face_file import write_face
from ..animation.recorded import Recorded
from ..errors import FaceWrinkleError, OutputError, ParameterError
from ..export import movie_writer, write_mesh
from ..export.animation import AnimationWriter
from ..files import output_folder, write_whole
from ..plotting import Style, TearScene
from ..rigging import Take
from .document import Document
from .library import Tell, telling
from .protocol import FACE_ALONE, Field
from .stage import Stage
from .wishes import FPS, PICTURE, Player, mixture_of, view_of

SLOW = ("rig", "movie", "animation")
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
        path = self.free(name)
        write_whole(path, data)
        return path

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
    complain : callable
        Called, on any thread, with a sentence when the session cannot be saved: once, until it can be again.

    Attributes
    ----------
    when : str
        Day and time of the session that was found at the start; "" if there was none, or it was resumed or dismissed.
    """

    def __init__(self, folder: Folder | None, document: Document, complain: Callable[[str], None]) -> None:
        self._folder, self._document, self._complain = folder, document, complain
        self._saved, self._failed = document.version, False
        self._lock = threading.Lock()
        self._timer: threading.Timer | None = None
        self.when, self._found, self._own = "", b"", b""
        if folder is not None and (path := folder.path / SESSION).is_file():
            self._found = path.read_bytes()
            self.when = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))

    def resume(self) -> None:
        """Take over the session that was found, as a step that can be undone.

        Raises
        ------
        ParameterError
            If it is no session, or needs a face that is not open.
        """
        if self.when:
            self._document.load(self._found)
            self.when, self._own = "", self._own or self._found

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
        path, text = folder.path / SESSION, self._document.text().encode()
        if path.is_file() and path.read_bytes() != self._own:
            path.replace(folder.free(SESSION))
        write_whole(path, text)
        self._own, self._saved, self._failed = text, version, False


@dataclasses.dataclass(frozen=True, eq=False)
class Order:
    """A file that takes long: what is asked for, and all that it is made of."""

    what: str
    camera: list[float]
    face: Face
    data: Mapping[str, Any]
    clip: Recorded | Take | None = None


def save(
    what: str, camera: list[float], stage: Stage, document: Document, shows: Field = FACE_ALONE
) -> tuple[str, bytes]:
    """Return the name and the content of a file; on the thread of the stage.

    Parameters
    ----------
    what : str
        One of the kinds of `Save`, but none of `SLOW`.
    camera : list of float
        Position and focal point, for pictures.
    stage : Stage
    document : Document
    shows : Field
        What a picture shows besides the face.
    """
    assert stage.shown is not None
    if what == "session":
        return "session.json", document.text().encode()
    if what == "atlas":
        return "atlas.toml", atlas_with(stage.face, document.data).encode()
    with tempfile.TemporaryDirectory() as folder:
        if what == "glb":
            path = Path(folder) / "face.glb"
            write_mesh(stage.shown.frame, path, stage.face, parts=True, tears=stage.shown.tears)
        elif what == "face":
            path = write_face(stage.face, Path(folder) / "scan.face")
        else:
            path = Path(folder) / "picture.png"
            style = Style(PICTURE, view_of(camera, stage.face), scalars=shows.name)
            with TearScene(stage.face, style) as scene:
                if shows.muscles:
                    scene.show_muscles(stage.shown.frame, stage.shown.rates)
                Image.fromarray(scene.picture(stage.shown.frame, stage.shown.tears)).save(path)
        return path.name, path.read_bytes()


def save_slowly(order: Order, tell: Tell) -> tuple[str, bytes]:
    """Return the name and the content of a file of `SLOW`.

    Parameters
    ----------
    order : Order
    tell : callable
        Told what is done, and the share of it.
    """
    if order.what == "rig":
        return save_rig(order.face, tell)
    movie = order.what == "movie"
    with tempfile.TemporaryDirectory() as folder:
        player = Player(order.face, order.data, order.clip, coarsen=movie)
        path = Path(folder) / ("movie.mp4" if movie else "animation.glb")
        (_movie if movie else _animation)(player, order, path, tell)
        return path.name, path.read_bytes()


def save_rig(face: Face, tell: Tell) -> tuple[str, bytes]:
    """Return the name and the content of a file with ARKit's blend shapes of a face; on any thread."""
    from ..rigging import rig, write_rig

    if not face.muscles:
        raise ParameterError("a rig needs a face with muscles, and this surface has none.")
    made = rig(face, level=1, progress=telling(tell, "Rig: "))
    with tempfile.TemporaryDirectory() as folder:
        return "rig.glb", write_rig(made, Path(folder) / "rig.glb").read_bytes()


def atlas_with(face: Face, data: Mapping[str, Any]) -> str:
    """Return the atlas of a face as TOML; saved mixtures, and what the sliders show as "studio", are expressions."""
    atlas = face.atlas
    mixture = mixture_of(data)
    mixtures = [*([("studio", mixture)] if mixture else []), *data["mixtures"].items()]
    expressions = dict(atlas.expressions)
    for name, weights in mixtures:
        rates = {muscle: round(rate, 6) for muscle, rate in atlas.contractions(weights).items()}
        expressions[_free_name(re.sub(r"\W+", "_", name), atlas, expressions)] = rates
    return atlas_text(dataclasses.replace(atlas, expressions=expressions) if mixtures else atlas)


def _free_name(name: str, atlas: Atlas, expressions: Collection[str]) -> str:
    """Return a name, with a number if it means something already: an expression, a unit or a muscle."""
    pairs = {muscle.removesuffix("_l").removesuffix("_r") for muscle in atlas.muscles}
    taken = {*expressions, *atlas.action_units, *atlas.muscles, *pairs}
    numbered = (f"{name}_{number}" for number in itertools.count(2))
    return name if name not in taken else next(each for each in numbered if each not in taken)


def _movie(player: Player, order: Order, path: Path, tell: Tell) -> None:
    style = Style((720, 720), view_of(order.camera, order.face))
    with TearScene(order.face, style) as scene, movie_writer(path, fps=FPS) as append:
        for moment in telling(tell)(player.moments(order.data), "Movie", len(player.times(order.data))):
            append(scene.picture(moment.frame, moment.tears))


def _animation(player: Player, order: Order, path: Path, tell: Tell) -> None:
    writer, times = AnimationWriter(order.face, path), player.times(order.data)
    for moment in telling(tell)(player.moments(order.data), "Animation", len(times)):
        writer.add(moment.frame)
    writer.write(times, player.simulation.forest)


class SavingProcess:
    """Makes files of `SLOW` in processes of their own, one at a time.

    A program that holds a studio need not be written for processes, as those of multiprocessing ask.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

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
        with subprocess.Popen(
            [sys.executable, "-c", f"from {__name__} import main; main()"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment(),
            start_new_session=True,  # Ctrl-C is for the studio, which ends the process by itself
        ) as self._process:  # fmt: skip
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
        raise FaceWrinkleError(f"the {order.what} was not made; see the terminal.")

    def stop(self) -> None:
        """End what is being made."""
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
