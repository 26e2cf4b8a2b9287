"""Files of a studio: pictures, movies, meshes, rigs and sessions, into one folder or as downloads."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import re
import tempfile
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from PIL import Image

from ..anatomy.atlas import Atlas
from ..anatomy.atlas_file import atlas_text
from ..anatomy.face import Face
from ..anatomy.face_file import write_face
from ..errors import OutputError, ParameterError
from ..export import movie_writer, write_mesh
from ..export.animation import AnimationWriter
from ..files import not_written, written
from ..motion.recorded import Recorded
from ..plotting import Style, TearScene
from .document import Document
from .library import Tell
from .playing import FPS, Played
from .stage import Stage
from .wishes import mixture_of

T = TypeVar("T")

WIDTH, HEIGHT = 1200, 1200
"""Pixels of a picture."""

FILM = 720
"""Pixels of each side of a movie."""

KINDS = ("picture", "movie", "glb", "animation", "rig", "face", "atlas", "session")
"""Things that can be saved."""

SLOW = ("rig", "movie", "animation")
"""Things that take long, and are made by a process of their own."""

MOST = 10_000
"""Files of one name and different numbers."""

OWN_EXPRESSION = "studio"
"""Name of the expression that the sliders make in an atlas."""


class Folder:
    """The one folder that a page may have written to.

    Parameters
    ----------
    path : Path or None
        Made if it does not exist.
    """

    def __init__(self, path: Path | None) -> None:
        self.path = None if path is None else path.resolve()
        if self.path is not None:
            try:
                self.path.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise OutputError(f"cannot make the folder {str(path)!r}: {error.strerror}.") from None

    def write(self, name: str, data: bytes, anew: bool = True) -> Path:
        """Write data under a name; with `anew`, never over another file: the name gets a number."""
        assert self.path is not None
        if not re.fullmatch(r"[a-z]+\.[a-z0-9]+", name):
            raise OutputError(f"the studio writes files with plain names, received {name!r}.")
        path = self._claimed(name) if anew else self.path / name
        try:
            with written(path) as whole:
                whole.write_bytes(data)
        except OutputError:
            if anew:
                path.unlink(missing_ok=True)
            raise
        return path

    def set_aside(self, name: str) -> Path:
        """Give a file another name, with a number, whatever is in it."""
        assert self.path is not None
        path = self._claimed(name)
        try:
            return (self.path / name).replace(path)
        except OSError as problem:
            path.unlink(missing_ok=True)
            raise not_written(path, problem) from None

    def _claimed(self, name: str) -> Path:
        """Make an empty file under a name with the first number that is free."""
        assert self.path is not None
        stem, _, ending = name.partition(".")
        try:
            for number in range(1, MOST):
                path = self.path / f"{stem}_{number}.{ending}"
                with contextlib.suppress(FileExistsError):
                    path.touch(exist_ok=False)
                    return path
        except OSError as problem:
            raise not_written(path, problem) from None
        raise OutputError(f"there are {MOST} files of the name {name} in {str(self.path)!r} already.")


@dataclasses.dataclass(frozen=True, eq=False)
class Order:
    """A file that takes long: what is asked for, and all that it is made of."""

    what: str
    camera: list[float]
    face: Face
    data: Mapping[str, Any]
    clip: Recorded | None = None


def save(what: str, camera: list[float], stage: Stage, document: Document) -> tuple[str, bytes]:
    """Return the name and the content of a file; on the thread of the stage.

    Parameters
    ----------
    what : str
        One of `KINDS`, but none of `SLOW`.
    camera : list of float
        Position, focal point and upward direction, for pictures.
    stage : Stage
    document : Document
    """
    if what not in KINDS:
        raise ParameterError(f"what is saved must be one of {', '.join(KINDS)}, received {what!r}.")
    assert stage.shown is not None
    data = document.data
    if what == "session":
        return "session.json", document.text().encode()
    if what == "atlas":
        return "atlas.toml", atlas_with(stage.face, data).encode()
    with tempfile.TemporaryDirectory() as folder:
        if what == "glb":
            path = Path(folder) / "face.glb"
            write_mesh(stage.shown.frame, path, stage.face, parts=True, tears=stage.tears)
        elif what == "face":
            path = write_face(stage.face, Path(folder) / "scan.face")
        else:
            path = Path(folder) / "picture.png"
            with _scene(stage.face, camera, WIDTH, HEIGHT) as scene:
                Image.fromarray(scene.picture(stage.shown.frame, stage.tears)).save(path)
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
        played = Played(order.face, order.data, order.clip, coarsen=movie)
        path = Path(folder) / ("movie.mp4" if movie else "animation.glb")
        (_movie if movie else _animation)(played, path, order.camera, tell)
        return path.name, path.read_bytes()


def save_rig(face: Face, tell: Tell) -> tuple[str, bytes]:
    """Return the name and the content of a file with ARKit's blend shapes of a face; on any thread."""
    from ..rigging import rig, write_rig

    def progress(items: Iterable[T], what: str, total: int) -> Iterator[T]:
        return _told(items, total, f"Rig: {what}", tell)

    if not face.muscles:
        raise ParameterError("a rig needs a face with muscles, and this surface has none.")
    made = rig(face, level=1, progress=progress)
    with tempfile.TemporaryDirectory() as folder:
        return "rig.glb", write_rig(made, Path(folder) / "rig.glb").read_bytes()


def atlas_with(face: Face, data: Mapping[str, Any]) -> str:
    """Return the atlas of a face as TOML, with saved mixtures, and what the sliders show, as expressions."""
    atlas = face.atlas
    mixture = mixture_of(data)
    mixtures = [*([(OWN_EXPRESSION, mixture)] if mixture else []), *data["mixtures"].items()]
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


def _scene(face: Face, camera: list[float], width: int, height: int) -> TearScene:
    scene = TearScene(face, Style((width, height)))
    view = scene.plotter.camera
    view.position, view.focal_point, view.up = np.array(camera).reshape(3, 3)
    scene.plotter.renderer.ResetCameraClippingRange()
    return scene


def _movie(played: Played, path: Path, camera: list[float], tell: Tell) -> None:
    with _scene(played.face, camera, FILM, FILM) as scene, movie_writer(path, FPS) as append:
        for moment in _told(played, played.count, "Movie", tell):
            append(scene.picture(moment.frame, moment.tears))


def _animation(played: Played, path: Path, camera: list[float], tell: Tell) -> None:
    writer = AnimationWriter(played.face, path)
    for moment in _told(played, played.count, "Animation", tell):
        writer.add(moment.frame)
    writer.write(played.times, played.simulation.forest)


def _told(items: Iterable[T], count: int, what: str, tell: Tell) -> Iterator[T]:
    """Yield items, and tell how many have been."""
    tell(what, 0.0)
    for number, item in enumerate(items):
        tell(what, number / max(count, 1))
        yield item
