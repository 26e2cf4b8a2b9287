"""What commands share: options that choose a face and what is written, words as values, and the report of a command."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Timer
from typing import Annotated, Any, Literal

import numpy as np
import pyvista as pv
from cyclopts import Parameter
from rich.console import Console
from rich.table import Column, Table

from ..anatomy.atlas import Atlas, parse_weights, read_atlas
from ..anatomy.face import Face
from ..anatomy.face_file import SUFFIX, read_face
from ..anatomy.fitting import default_face, fit_face, millimeters, surface, unit_by_size
from ..errors import LandmarkError, ParameterError, UnknownNameError
from ..layers.base import Layer
from ..plotting.views import Style
from ..progress import SHORTEST, bar_or_lines
from ..session import Session, Subject
from ..session.subject import age_of
from ..simulation.fold_layers import Folds, fold_layers, with_printed_muscles


class Report:
    """Lines and tables of a command on stdout, and its progress on stderr; nothing when quiet."""

    def __init__(self, quiet: bool) -> None:
        self.quiet = quiet
        self.console = Console(quiet=quiet, highlight=False, markup=False, emoji=False)  # names may have brackets
        if quiet:
            warnings.simplefilter("ignore")

    def say(self, *what: Any) -> None:
        """Print a line, or a table."""
        self.console.print(*what, soft_wrap=True)

    def table(self, title: str, rows: Mapping[str, str]) -> None:
        """Print names and values."""
        columns = Column(overflow="fold"), Column(overflow="fold")  # paths are told whole
        table = Table(*columns, title=title, show_header=False, title_justify="left", title_style="bold", box=None)
        for name, value in rows.items():
            table.add_row(name, value)
        self.console.print(table)

    @contextmanager
    def waiting(self, what: str) -> Iterator[None]:
        """Show what takes a while: on a terminal until it is done, in a log by a line after some seconds."""
        console = Console(stderr=True)
        if self.quiet or console.is_terminal:
            with nullcontext() if self.quiet else console.status(f"{what} ..."):
                yield
            return
        late = Timer(SHORTEST, print, [f"{what} ..."], {"file": sys.stderr, "flush": True})
        late.daemon = True
        late.start()
        try:
            yield
        finally:
            late.cancel()

    def progress(self, items: Iterable[Any], what: str, total: int) -> Iterable[Any]:
        """Return the items, with a bar on a terminal, and lines now and then in a log."""
        return items if self.quiet else bar_or_lines(items, what, total)


def face_facts(face: Face) -> dict[str, str]:
    """Return the rows of a table about a fitted face."""
    measured = [value for name, value in face.confidences.items() if name not in face.estimated]
    facts = {"likeness to a face": "unknown" if face.likeness is None else f"{face.likeness:.2f}"}
    facts["landmarks"] = f"{len(face.landmarks)}, estimated: {', '.join(face.estimated) or 'none'}"
    if measured:
        facts["confidence of detected landmarks"] = f"{min(measured):.2f} to {max(measured):.2f}"
    return facts | {"unit": f"{face.unit:.4g} mm", "distance between the pupils": f"{face.frame.pupil_distance:.4g}"}


def removed_rows(stale: Sequence[Path]) -> dict[str, str]:
    """Return the row of a table that names what :func:`facewrinkle.files.remove_stale` removed, if anything.

    Examples
    --------
    >>> removed_rows([Path("output/head/rig/head.html")])
    {'removed, of an earlier run': 'head.html'}
    """
    folders, most = {path.parent for path in stale}, 8
    names = [path.name if len(folders) == 1 else f"{path.parent.name}/{path.name}" for path in stale]
    more = f"\nand {len(names) - most} more" if len(names) > most else ""
    return {"removed, of an earlier run": "\n".join(names[:most]) + more} if stale else {}


def parse_mixture(text: str, atlas: Atlas) -> dict[str, float]:
    """Return weights by name, from "surprise", "AU12" or "AU1=0.7+AU4"; see :func:`parse_weights`.

    Raises
    ------
    UnknownNameError
        For a name that is no expression, action unit, muscle or pair of muscles.

    Examples
    --------
    >>> from facewrinkle.anatomy.atlas import load_atlas
    >>> parse_mixture("AU1=0.7 + AU4", load_atlas())
    {'AU1': 0.7, 'AU4': 1.0}
    """
    weights = parse_weights(text)
    for name in weights:
        try:
            atlas.resolve(name, "expression, action unit or muscle")
        except UnknownNameError as problem:
            raise UnknownNameError(f"{problem} All of them: facewrinkle info.") from None
    return weights


def whole_number(kind: Any, tokens: Sequence[Any]) -> int:
    """Return a whole number; 2.5 is refused, and not rounded.

    Examples
    --------
    >>> whole_number(int, ["100"])
    100
    """
    text = str(getattr(tokens[0], "value", tokens[0]))
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"a whole number is needed, received {text!r}.") from None


Vector = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
"""Numbers with commas between, of which the first may be negative."""

Whole = Annotated[int, Parameter(converter=whole_number)]


def parse_size(text: str) -> tuple[int, int]:
    """Return width and height, from "800" or "800x600".

    Examples
    --------
    >>> parse_size("640"), parse_size("800x600")
    ((640, 640), (800, 600))
    """
    try:
        numbers = [int(number) for number in text.lower().split("x")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        raise ParameterError(f"the size must be pixels such as 800 or 800x600, received {text!r}.")
    return numbers[0], numbers[-1]


def parse_numbers(name: str, text: str | None, counts: tuple[int, ...]) -> tuple[float, ...] | None:
    """Return numbers from "1,2,3", of which there must be one of `counts`; one number stands for (1, 2) of them.

    Examples
    --------
    >>> parse_numbers("center", "10,0,45", (3,)), parse_numbers("extent", "60", (1, 2))
    ((10.0, 0.0, 45.0), (60.0, 60.0))
    """
    if text is None:
        return None
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in counts:
        raise ParameterError(f"--{name} must be {counts[-1]} numbers with commas between, received {text!r}.")
    return numbers * 2 if counts == (1, 2) and len(numbers) == 1 else numbers


def given(**options: Any) -> dict[str, Any]:
    """Return the options that were given, those that are not None."""
    return {name: value for name, value in options.items() if value is not None}


def refuse(why: str, **options: Any) -> None:
    """Raise a ParameterError for options that were given, those that are not None, with the name of the first.

    Examples
    --------
    >>> refuse("goes with --cycle: add that.", t=0.5)
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: --t goes with --cycle: add that.
    """
    for name in given(**options):
        raise ParameterError(f"--{name.replace('_', '-')} {why}")


@Parameter(name="*")
@dataclass(frozen=True)
class FaceOptions:
    """The face.

    Parameters
    ----------
    face
        A mesh of a face: OBJ, OFF, PLY, STL, glTF, USD or a VTK format; a .face file from `facewrinkle fit`; or a
        session (JSON), for the face in it, with its landmarks, identity and atlas. Default: the built-in head.
    landmarks
        JSON file with landmark coordinates for --face. Default: all are detected.
    units
        Unit of --face: um, mm, cm, dm, m, in, or millimeters per unit. Default: from the distance between the eyes, or
        from the size of a mesh that is not a face.
    identity
        Another person's face on the built-in head: parameters from -1 to 1, such as jaw=0.5,age=1. See
        facewrinkle.Identity. Any other face has one of them: age, from 0 (as it is) to 1.
    atlas
        TOML file with your own muscles, action units and expressions.
    texture
        Skin texture of --face. Default: the image that the file references or contains.
    """

    face: Path | None = None
    landmarks: Path | None = None
    units: float | str | None = None
    identity: str | None = None
    atlas: Path | None = None
    texture: Path | None = None

    @property
    def label(self) -> str:
        """Name of the face and its identity for folders; "" for the built-in head."""
        names = [] if self.face is None else [self.face.stem]
        if self.identity is not None:
            names.append(re.sub(r"[^\w.=-]+", "_", self.identity)[:100])
        return "_".join(names)

    def of(self, face: Path | None) -> FaceOptions:
        """Return the same options for a face that a command may also name without --face."""
        if face is not None and self.face is not None:
            raise ParameterError("the face is named twice: leave out --face.")
        return self if face is None else replace(self, face=face)

    @property
    def _person(self) -> dict[str, float]:
        return {} if self.identity is None else parse_weights(self.identity, usual=None)

    def session(self) -> Session:
        """Return the session of the face alone: its files, identity and moved landmarks."""
        if self.face is not None and self.face.suffix.lower() == ".json":
            refuse(
                f"is not for {self.face.name}, a session with its own: leave it out.", **vars(replace(self, face=None))
            )
            kept = Session.read(self.face)
        else:
            kept = Session(face=str(self.face or ""), atlas=str(self.atlas or ""), identity=self._person)
        if kept.face:
            age_of(kept.identity)  # before the mesh is read, which takes long
        face, atlas = (str(Path(file).absolute()) if file else "" for file in (kept.face, kept.atlas))
        return Session(face=face, atlas=atlas, identity=kept.identity, landmarks=kept.landmarks)

    def fitted(self, mesh: Path | pv.PolyData, report: Report | None = None) -> Face:
        """Return the face of a mesh; `report` shows the progress of the search."""
        progress = None if report is None else report.progress
        return fit_face(
            mesh, self.landmarks, units=self.units, atlas=self._own_atlas, progress=progress, texture=self.texture
        )

    @property
    def _own_atlas(self) -> Atlas | None:
        return None if self.atlas is None else read_atlas(self.atlas)

    def load(self, report: Report | None = None, otherwise: str | None = None) -> Face:
        """Return the face; an error for options that do not go together.

        `report` shows the progress of the search; `otherwise` is what to do with a mesh that is no face.
        """
        of_mesh = {"landmarks": self.landmarks, "units": self.units, "texture": self.texture}
        person = self._person
        if self.face is None:
            refuse("belongs to a mesh: name it with --face.", **of_mesh)
            return default_face(person, atlas=self._own_atlas)
        age_of(person)  # before the mesh is read, which takes long
        if self.face.suffix.lower() == ".json":
            return self.session().subject(None if report is None else report.progress).face
        if self.face.suffix == SUFFIX:
            refuse(f"is not for {self.face.name}, which has its own: leave it out.", **of_mesh)
            return Subject(read_face(self.face, self._own_atlas)).aged(person).face
        try:
            return Subject(self.fitted(self.face, report)).aged(person).face
        except LandmarkError as problem:
            if otherwise is None or self.landmarks is not None:
                raise
            raise LandmarkError(f"{problem} If {self.face.name} is not a face, {otherwise}") from None

    def load_surface(self, place: str, size: float | None = None) -> Face:
        """Return the mesh as a surface that is no face.

        `place` is the option that names a place on it. Without --units, the mesh is of a `size` from corner to corner,
        mm, or its unit goes with its size.
        """
        if self.face is None:
            raise ParameterError(f"--{place} belongs to a mesh: name it with --face.")
        of_face = {"landmarks": self.landmarks, "identity": self.identity, "atlas": self.atlas}
        refuse(f"needs a face, --{place} to a mesh that is none: leave out one of them.", **of_face)
        found = surface(self.face, "mm" if self.units is None else self.units, texture=self.texture)
        own = float(np.linalg.norm(np.ptp(found.points, axis=0)))
        unit = millimeters(unit_by_size(own)) if size is None else size / own
        return replace(found, unit=unit) if self.units is None else found


@Parameter(name="*")
@dataclass(frozen=True)
class FoldOptions:
    """The folds of the skin.

    Parameters
    ----------
    folds
        wave: folds grow where the skin is compressed. paper: the wrinkle formula of Zhang, Sim and Tan with its
        failures fixed, and anatomical creases. printed: their 23 muscles, and wrinkles by the formula as printed.
    depth
        Depth factor for all folds; depth is limited by the length of the skin.
    density
        Factor for the number of lines, for waves. Default: 1.
    length
        Factor for the length of the lines, 0.5 to 2, for waves. Default: 1.
    seed
        Random seed: each whole number gives another person's lines, for waves. Default: 0.
    age
        Lines at rest, from 0 (none) to 1, for waves. Default: those of the face.
    no_limit
        Allow folds deeper than the length of the skin permits.
    """

    folds: Folds = "wave"
    depth: float = 1.0
    density: float | None = None
    length: float | None = None
    seed: Whole | None = None
    age: float | None = None
    no_limit: bool = False

    def face(self, face: Face) -> Face:
        """Return the face that has these folds: one with other muscles for those as printed."""
        return with_printed_muscles(face) if self.folds == "printed" else face

    def layers(self, face: Face) -> list[Layer]:
        """Return the layers of folds of a face; an error for options that do not go together."""
        waves = given(density=self.density, length=self.length, seed=self.seed, age=self.age)
        if self.folds != "wave":
            refuse("belongs to folds that are waves: add --folds wave, or leave it out.", **waves)
        if self.folds == "printed" and (self.depth != 1.0 or self.no_limit):
            raise ParameterError("printed wrinkles have no --depth and no limit: leave these options out.")
        return fold_layers(face, self.folds, depth=self.depth, inextensible=not self.no_limit, **waves)


@Parameter(name="*")
@dataclass(frozen=True)
class OutputOptions:
    """The output.

    Parameters
    ----------
    size
        Size of each picture in pixels: 800, or 800x600.
    view
        View of the close-ups, such as forehead or left_eye. Default: where the wrinkles or tears are.
    clay
        Show the face as clay, without colors, brows and lashes.
    fps
        Frames per second of the movie.
    movie
        Write a movie.
    series
        Also write all frames as a time series (VTKHDF) for ParaView, up to 1 MB per frame.
    save_mesh
        Also write the wrinkled mesh with its texture and tears: as glb or gltf (with eyes and teeth), obj, or ply
        (tears in a second file).
    save_animation
        Also write the animation to this file, with a fixed mesh: .glb, .gltf or .usd (a few morph targets, with eyes
        and teeth), or .pc2 (a point cache of the skin, beside an .obj).
    animation_error
        Maximum position error in a .glb or .usd, mm.
    out
        Folder to write to. Default: output/NAME, or output/FACE/NAME for --face and --identity.
    quiet
        Print only errors.
    """

    size: str = "800"
    view: str | None = None
    clay: bool = False
    fps: float = 25.0
    movie: Annotated[bool, Parameter(negative="--no-movie")] = True
    series: bool = False
    save_mesh: Literal["glb", "gltf", "obj", "ply"] | None = None
    save_animation: Path | None = None
    animation_error: float = 0.1
    out: Path | None = None
    quiet: bool = False

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height of a picture."""
        return parse_size(self.size)

    def style(self, view: str) -> Style:
        """Return the style of a picture; a view that is unknown is refused."""
        return Style(self.pixels, view, clay=self.clay)

    def folder(self, name: str, face: str = "") -> Path:
        """Return the folder that was asked for, or else output/FACE/NAME; without FACE for the built-in head."""
        return self.out or Path("output") / face / name
