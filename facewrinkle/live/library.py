"""Faces, recorded clips and takes that a studio can show, by name, and the files that are dropped onto a page."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..anatomy.face import Face
from ..anatomy.face_file import read_face
from ..anatomy.fitting import default_face, fit_face, refit_face
from ..anatomy.head import load_head
from ..anatomy.identity import Identity, head_of
from ..animation.reading import read_animation
from ..animation.recorded import Recorded
from ..array_types import Array, IntArray
from ..errors import FaceWrinkleError, FaceWrinkleWarning, ParameterError
from ..files import inside_only
from ..geometry.closest_point import closest
from ..mesh.formats.reading import GLTF, USD
from ..progress import Progress
from ..rigging import Performer, Take, read_take
from ..rigging.takes import SUFFIXES as TAKES

ANIMATED = (*GLTF, *USD, ".vtkhdf")
"""Endings of files that may hold a clip."""

MESHES = (".obj", ".off", ".ply", ".stl", ".vtp", ".vtk", ".face", *ANIMATED)
"""Endings of files that may hold a face."""

PLACES = {"patterns": "center", "tears": "start", "probes": "", "landmarks": ""}
"""Parts of a document that hold places on the face, and the keys under which their entries do."""

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
        face, person = self[data["face"]].face, _person(data)
        if person != Identity():
            face = default_face(person, atlas=face.atlas)
        return refit_face(face, data["landmarks"]) if data["landmarks"] else face

    def carried(self, before: Mapping[str, Any], after: Mapping[str, Any], parts: Collection[str]) -> dict[str, Any]:
        """Return the parts of a document, of those named, whose places are others on the person after a change: each
        stays at the same numbers of the same triangle, and as far from it as it was.

        Raises
        ------
        ParameterError
            If a scan should become another person.
        """
        one, other = _person(before), _person(after)
        if other != Identity() and (self[""].face.triangles.shape != load_head().triangles.shape):
            raise ParameterError(
                "only the built-in head becomes other people; the studio was opened with another face."
            )
        parts = [name for name in PLACES if name in parts and after[name]]
        if before["face"] or after["face"] or one == other or not parts:
            return {}
        (here, triangles), there = self._surface(one), self._surface(other)[0]

        def carry(place: Sequence[float]) -> list[float]:
            triangle, shares, _ = closest(here, triangles, np.array(place, np.float64))
            corners = triangles[triangle]
            return (np.array(place) + shares @ (there[corners] - here[corners])).tolist()

        return {part: {name: _at(entry, PLACES[part], carry) for name, entry in after[part].items()} for part in parts}

    def _surface(self, person: Identity) -> tuple[Array, IntArray]:
        """Points and triangles of the face of the start, or of a person in its place."""
        face = self[""].face
        return (face.points, face.triangles) if person == Identity() else (head_of(person).points, face.triangles)


def _person(data: Mapping[str, Any]) -> Identity:
    """The person that a document asks for; the mean one stands for the face of the start, and for all others."""
    return (
        Identity() if data["face"] else Identity(**{name: value for name, value in data["identity"].items() if value})
    )


def _at(entry: Any, key: str, carry: Callable[[Sequence[float]], list[float]]) -> Any:
    """Return an entry with its place, or the place that it is, moved."""
    return {**entry, key: carry(entry[key])} if key else carry(entry)


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
    held = [file for file in files if file.suffix.lower() == ".json"]  # a take, or the landmarks of a mesh
    main = [file for file in files if file not in held and file.suffix.lower() in (*MESHES, *TAKES)] or held
    if len(main) != 1:
        raise ParameterError(
            f"drop one face file ({', '.join(MESHES)}), together with its materials and textures, or one take "
            f"({', '.join(TAKES)}); "
            f"received {', '.join(file.name for file in files)}."
        )
    file = main[0]
    landmarks = next(iter(held), None)
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
