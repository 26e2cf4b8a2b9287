"""Faces, recorded clips and takes that a studio can show, by name, and the files that are dropped onto a page."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..anatomy import Face, Identity, default_face, load_head
from ..anatomy.identity import head_of
from ..errors import FaceWrinkleWarning, ParameterError
from ..files import inside_only
from ..progress import Progress
from ..rigging import Performer, read_take
from ..rigging.takes import SUFFIXES as TAKES
from ..session import Place, Session, Subject
from ..session.content import placed
from ..session.parts import Point
from ..session.subject import MESHES, age_of, moved, read_subject

Tell = Callable[[str, float], None]
"""Called with what is being done, and the share of it that is done."""


@dataclass(frozen=True, eq=False)
class Loaded:
    """What was opened: a face, and what moves it; for a take, the name of the face that performs it."""

    subject: Subject
    said: tuple[str, ...] = ()
    performer: str | None = None


class Library:
    """Faces by name; "" is the one that a studio was opened with.

    Parameters
    ----------
    face : Face
    source : str
        The file of the face; "" for the built-in head.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> library = Library(fw.default_face())
    >>> library.add("scan.obj", Loaded(Subject(fw.default_face()))), list(library.names)
    ('scan.obj', ['', 'scan.obj'])
    """

    def __init__(self, face: Face, source: str = "") -> None:
        self.source = source
        self._loaded: dict[str, Loaded] = {"": Loaded(Subject(face))}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all."""
        return tuple(self._loaded)

    def __getitem__(self, name: str) -> Subject:
        if name not in self._loaded:
            raise ParameterError(f"the face {name[:64]!r} is not open. Open its file first.")
        return self._loaded[name].subject

    def add(self, name: str, loaded: Loaded) -> str:
        """Keep a face, under a name that is not taken, and return that name; in one thread at a time."""
        taken, number = name, 2
        while taken in self._loaded:
            taken, number = f"{name} ({number})", number + 1
        self._loaded = {**self._loaded, taken: loaded}
        return taken

    def parts_for(self, name: str) -> dict[str, str]:
        """Return the parts of a session that shows what was opened under a name."""
        performer = self._loaded[name].performer if name in self._loaded else None
        return {"face": name, "take": ""} if performer is None else {"face": performer, "take": name}

    def subject_of(self, session: Session) -> Subject:
        """Return whom a session shows: by name, with its identity and the landmarks that were moved."""
        subject = replace(self[session.face], clip=self[session.take or session.face].clip)
        if not self.built_in(session.face):
            subject = subject.aged(session.identity)
        elif any(session.identity.values()):
            subject = replace(subject, face=default_face(session.identity, atlas=subject.face.atlas))
        return moved(subject, session)

    def built_in(self, name: str) -> bool:
        """Return whether a face is the built-in head, which becomes other people."""
        face = self[name].face
        return not name and not self.source and np.array_equal(face.points, load_head().points)

    def accepted(self, session: Session) -> Session:
        """Return a session with its places on triangles, of the face that it shows.

        Raises
        ------
        ParameterError
            If a face is not open, or a scan should become another person.
        """
        face, person = self[session.face].face, session.identity
        self[session.take or session.face]
        built_in = self.built_in(session.face)
        if not built_in:
            age_of(person)

        def attach(point: Point) -> Place:
            own = self[session.face]
            points = head_of(Identity(**person)).points if built_in else own.aged(person).face.points
            return Place.of(point, points, face.triangles)

        return placed(session, attach, face.atlas)

    def outside(self, session: Session) -> Session:
        """Return a session as files have it, with the file of the first face in place of its name."""
        return session if session.face else session.changed(self[""].face.atlas, face=self.source)

    def inside(self, session: Session) -> Session:
        """Return the session of a file, with the name of the first face in place of its file."""
        return session if session.face != self.source else session.changed(self[""].face.atlas, face="")


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


def opened(folder: Path, shown: Face, tell: Tell, name: str = "") -> tuple[str, Loaded]:
    """Read the face or the clip among the files of a folder, or a take for the face that is shown, which has a name;
    return the name of the file and what was read.

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
    pictures = [each for each in files if each.suffix.lower() in (".png", ".jpg", ".jpeg")]
    named = any(each.suffix.lower() == ".mtl" for each in files) or file.suffix.lower() not in (".obj", ".ply")
    texture = pictures[0] if len(pictures) == 1 and not named else None
    tell(f"Reading {file.name}", 0.0)
    performer = name if file.suffix.lower() in TAKES else None
    with inside_only(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", FaceWrinkleWarning)
        if performer is None:
            landmarks = next(iter(held), None)
            subject = read_subject(file, shown.atlas, landmarks, progress=telling(tell), texture=texture)
        else:
            take = read_take(file)
            subject = Subject(shown, take)
            Performer(take, shown)  # raises if the face can make nothing of it, and warns of what it cannot
    return file.name, Loaded(subject, tuple(dict.fromkeys(str(each.message) for each in caught)), performer)
