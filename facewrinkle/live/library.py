"""Faces, recorded clips and takes that a studio can show, by name, and the files that are dropped onto a page."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..anatomy.face import Face
from ..anatomy.face_file import read_face
from ..anatomy.fitting import default_face, fit_face, refitted
from ..anatomy.identity import Identity
from ..animation.reading import read_animation
from ..animation.recorded import Recorded
from ..errors import FaceWrinkleError, FaceWrinkleWarning, ParameterError
from ..files import inside_only
from ..mesh.formats.reading import GLTF, USD
from ..progress import Progress
from ..rigging import Performer, Take, read_take

ANIMATED = (*GLTF, *USD, ".vtkhdf")
"""Endings of files that may hold a clip."""

MESHES = (".obj", ".off", ".ply", ".stl", ".vtp", ".vtk", ".face", *ANIMATED)
"""Endings of files that may hold a face."""

TAKES = (".csv", ".tsv", ".txt")
"""Endings of files that hold a take."""

Tell = Callable[[str, float], None]
"""Called with what is being done, and the share of it that is done."""


@dataclass(frozen=True, eq=False)
class Loaded:
    """A face, and what moves it: a recording of its own, or a take that it performs."""

    face: Face
    clip: Recorded | Take | None = None
    said: tuple[str, ...] = ()


class Library:
    """Faces by name; "" is the one that a studio was opened with.

    Parameters
    ----------
    face : Face

    Examples
    --------
    >>> import facewrinkle as fw
    >>> library = Library(fw.default_face())
    >>> library.add("scan.obj", Loaded(fw.default_face())), list(library.names)
    ('scan.obj', ['', 'scan.obj'])
    """

    def __init__(self, face: Face) -> None:
        self._loaded: dict[str, Loaded] = {"": Loaded(face)}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all."""
        return tuple(self._loaded)

    def __getitem__(self, name: str) -> Loaded:
        if name not in self._loaded:
            raise ParameterError(f"the face {name!r} is not open. Open its file first.")
        return self._loaded[name]

    def add(self, name: str, loaded: Loaded) -> str:
        """Keep a face, under a name that is not taken, and return that name; in one thread at a time."""
        taken, number = name, 2
        while taken in self._loaded:
            taken, number = f"{name} ({number})", number + 1
        self._loaded = {**self._loaded, taken: loaded}
        return taken

    def face_of(self, data: Mapping[str, Any]) -> Face:
        """Return the face that a document asks for: its name, its identity and the landmarks that were moved."""
        face = self[data["face"]].face
        person = {name: value for name, value in data["identity"].items() if value}
        if person and not data["face"]:
            face = default_face(Identity(**person), atlas=face.atlas)
        return refitted(face, data["landmarks"]) if data["landmarks"] else face


def telling(tell: Tell, before: str = "") -> Progress:
    """Return progress that tells what is being done, after some words, and the share of it.

    Examples
    --------
    >>> list(telling(print, "Rig: ")("ab", "Shapes", 2))
    Rig: Shapes 0.0
    Rig: Shapes 0.5
    Rig: Shapes 1.0
    ['a', 'b']
    """

    def progress(items: Iterable[Any], what: str, total: int) -> Iterator[Any]:
        tell(before + what, 0.0)
        for number, item in enumerate(items, start=1):
            yield item
            tell(before + what, number / total)

    return progress


def opened(folder: Path, shown: Face, tell: Tell) -> tuple[str, Loaded]:
    """Read the face or the clip among the files of a folder, or a take for the face that is shown; return its name and
    what was read.

    Raises
    ------
    ParameterError
        If there is not one file of a face or a take.
    FaceWrinkleError
        If it cannot be read, or shows no face.
    """
    files = sorted(folder.iterdir())
    main = [file for file in files if file.suffix.lower() in (*MESHES, *TAKES)]
    if len(main) != 1:
        raise ParameterError(
            f"drop one face file ({', '.join(MESHES)}), together with its materials and textures, or one take "
            f"({', '.join(TAKES)}); "
            f"received {', '.join(file.name for file in files)}."
        )
    file = main[0]
    landmarks = next((each for each in files if each.suffix.lower() == ".json"), None)
    pictures = [each for each in files if each.suffix.lower() in (".png", ".jpg", ".jpeg")]
    named = any(each.suffix.lower() == ".mtl" for each in files) or file.suffix.lower() not in (".obj", ".ply")
    texture = pictures[0] if len(pictures) == 1 and not named else None
    tell(f"Reading {file.name}", 0.0)
    with inside_only(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", FaceWrinkleWarning)
        if file.suffix.lower() == ".face":
            loaded = Loaded(read_face(file, shown.atlas))
        elif file.suffix.lower() in TAKES:
            take = read_take(file)
            Performer(take, shown)  # raises if the face can make nothing of it, and warns of what it cannot make
            loaded = Loaded(shown, take)
        else:
            clip, mesh = _clip_of(file)
            search, source = telling(tell), file if mesh is None else mesh
            face = fit_face(source, landmarks, atlas=shown.atlas, progress=search, texture=texture)
            if clip is not None:
                clip.points_of(face)  # raises if it does not fit
            loaded = Loaded(face, clip)
    said = tuple(dict.fromkeys(str(each.message) for each in caught))
    return file.name, Loaded(loaded.face, loaded.clip, said)


def _clip_of(file: Path) -> tuple[Recorded | None, Any]:
    """Return the animation of a file and its mesh at rest, if it has one."""
    if file.suffix.lower() not in ANIMATED:
        return None, None
    try:
        mesh, clip = read_animation(file)
    except FaceWrinkleError:
        return None, None  # a mesh that does not move; what else is wrong with it shows when it is read as one
    return (clip, mesh) if clip.duration > 0.0 else (None, None)
