"""Files of a studio: pictures, meshes and sessions, into one folder or as downloads."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from ..errors import OutputError, ParameterError
from ..export import write_mesh
from ..plotting import Style, TearScene
from .document import Document
from .stage import Stage

WIDTH, HEIGHT = 1200, 1200
"""Pixels of a picture."""

KINDS = ("picture", "glb", "session")
"""Things that can be saved."""

MOST = 10_000
"""Files of one name and different numbers."""


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
        if not re.fullmatch(r"[a-z]+\.[a-z]+", name):
            raise OutputError(f"the studio writes files with plain names, received {name!r}.")
        stem, _, ending = name.partition(".")
        try:
            for number in range(1, MOST):
                path = self.path / (f"{stem}_{number}.{ending}" if anew else name)
                try:
                    with path.open("xb" if anew else "wb") as file:
                        file.write(data)
                    return path
                except FileExistsError:
                    continue
        except OSError as error:
            raise OutputError(f"cannot write {str(path)!r}: {error.strerror}.") from None
        raise OutputError(f"there are {MOST} files of the name {name} in {str(self.path)!r} already.")


def save(what: str, camera: list[float], stage: Stage, document: Document) -> tuple[str, bytes]:
    """Return the name and the content of a file; on the thread of the stage.

    Parameters
    ----------
    what : str
        One of `KINDS`.
    camera : list of float
        Position, focal point and upward direction, for a picture.
    """
    if what not in KINDS:
        raise ParameterError(f"what is saved must be one of {', '.join(KINDS)}, received {what!r}.")
    assert stage.shown is not None
    if what == "session":
        return "session.json", document.text().encode()
    frame, tears = stage.shown.frame, stage.tears
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / ("face.glb" if what == "glb" else "picture.png")
        if what == "glb":
            write_mesh(frame, path, stage.face, parts=True, tears=tears)
        else:
            with TearScene(stage.face, Style((WIDTH, HEIGHT))) as scene:
                place, focus, up = np.array(camera).reshape(3, 3)
                view = scene.plotter.camera
                view.position, view.focal_point, view.up = place, focus, up
                scene.plotter.renderer.ResetCameraClippingRange()
                Image.fromarray(scene.picture(frame, tears)).save(path)
        return path.name, path.read_bytes()
