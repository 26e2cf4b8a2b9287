"""Whom a session shows: a face, and what moves it in place of its muscles; and the files that they are read from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..anatomy import Atlas, Face, default_face, fit_face, read_face
from ..anatomy.atlas import read_atlas
from ..anatomy.face_file import SUFFIX
from ..animation.reading import read_animation
from ..animation.recorded import Recorded
from ..errors import FaceWrinkleError, ParameterError
from ..mesh.formats.reading import GLTF, USD
from ..motion.base import Motion
from ..progress import Progress
from ..rigging import Performer, Take, read_take
from .content import Content
from .parts import point_of

ANIMATED = (*GLTF, *USD, ".vtkhdf")
"""Endings of files that may hold a clip."""

MESHES = (".obj", ".off", ".ply", ".stl", ".vtp", ".vtk", SUFFIX, *ANIMATED)
"""Endings of files that may hold a face."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A face, and what moves it: nothing, a recording of its own, or a take that it performs.

    Attributes
    ----------
    face : Face
    clip : Recorded or Take, optional

    Examples
    --------
    >>> import facewrinkle as fw
    >>> fw.Session(identity={"jaw": 1.0}).subject().clip is None
    True
    """

    face: Face
    clip: Recorded | Take | None = None

    @property
    def steps(self) -> int:
        """Steps after which the skin has come to rest at a moment of what moves it."""
        return 30 if isinstance(self.clip, Take) else 1

    def motion(self) -> Motion | Recorded | None:
        """Return the motion of a simulation; None for the skin that muscles pull."""
        return Performer(self.clip, self.face) if isinstance(self.clip, Take) else self.clip

    def aged(self, person: Mapping[str, float]) -> Subject:
        """Return a subject that is not the built-in head at the age of a person.

        Raises
        ------
        ParameterError
            For other parameters of the identity, unless they are 0, and for a face that moves as recorded.
        """
        age = age_of(person)
        if not age:
            return self
        if isinstance(self.clip, Recorded):
            raise ParameterError("a recorded face is as old as it was recorded; its folds have an age.")
        return replace(self, face=self.face.aged(age))


def age_of(person: Mapping[str, float]) -> float:
    """Return the age of an identity; a ParameterError for other parameters, which only the built-in head has.

    Examples
    --------
    >>> age_of({"age": 0.5, "jaw": 0.0}), age_of({})
    (0.5, 0.0)
    """
    for name, value in person.items():
        if value and name != "age":
            raise ParameterError(
                f"only the built-in head becomes other people; this face has no {name!r}, only an age."
            )
    return person.get("age", 0.0)


def subject_of(content: Content, progress: Progress | None = None) -> Subject:
    """Return whom a session shows, by the files that it names."""
    atlas = read_atlas(content.atlas) if content.atlas else None
    if content.face:
        subject = read_subject(Path(content.face), atlas, progress=progress).aged(content.identity)
    else:
        subject = Subject(default_face(content.identity, atlas=atlas))
    if content.take:
        subject = replace(subject, clip=read_take(content.take))
    return moved(subject, content)


def moved(subject: Subject, content: Content) -> Subject:
    """Return a subject whose landmarks are where a session has them."""
    places = {name: point_of(place, subject.face) for name, place in content.landmarks.items()}
    return replace(subject, face=subject.face.with_landmarks(places)) if places else subject


def read_subject(
    file: Path,
    atlas: Atlas | None = None,
    landmarks: Path | None = None,
    *,
    progress: Progress | None = None,
    texture: Path | None = None,
) -> Subject:
    """Read a face, with the animation that its file holds.

    Raises
    ------
    FaceWrinkleError
        If the file cannot be read, or shows no face.
    """
    if file.suffix.lower() == SUFFIX:
        return Subject(read_face(file, atlas))
    clip, mesh = _clip_of(file)
    face = fit_face(file if mesh is None else mesh, landmarks, atlas=atlas, progress=progress, texture=texture)
    if clip is not None:
        clip.points_of(face)  # raises if it does not fit
    return Subject(face, clip)


def _clip_of(file: Path) -> tuple[Recorded | None, Any]:
    """Return the animation of a file and its mesh at rest, if it has one."""
    if file.suffix.lower() not in ANIMATED:
        return None, None
    try:
        mesh, clip = read_animation(file)
    except FaceWrinkleError:
        return None, None  # a mesh that does not move; what else is wrong with it shows when it is read as one
    return (clip, mesh) if clip.duration > 0.0 else (None, None)
