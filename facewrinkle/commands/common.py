"""What the commands share: options that choose a face and what is written, names and mixtures, and reports."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

import pyvista as pv
from cyclopts import Parameter
from rich.console import Console
from rich.progress import track
from rich.table import Table

from ..anatomy.atlas import Atlas, load_atlas, read_atlas
from ..anatomy.face import Face
from ..anatomy.face_file import SUFFIX, read_face
from ..errors import ParameterError, UnknownNameError, unknown_name
from ..export import write_mesh
from ..export.meshes import companion_files
from .interrupts import interruptible

T = TypeVar("T")


@Parameter(name="*")
@dataclass(frozen=True)
class FaceOptions:
    """Which face.

    Parameters
    ----------
    face
        A mesh of a face: OBJ, PLY, STL, glTF or a VTK format; or a .face file of `facewrinkle fit`. Default: the
        built-in head.
    landmarks
        JSON file with the coordinates of landmarks of --face. Default: found by its shape.
    units
        Unit of --face: um, mm, cm, dm, m, in, or millimetres per unit. Default: from the distance between the eyes.
    identity
        Whose face the built-in head has: parameters from -1 to 1, such as jaw=0.5,age=1. See facewrinkle.Identity.
    atlas
        TOML file with other muscles, action units and expressions.
    texture
        Photo that lies on --face. Default: the image that the file names or holds.
    """

    face: Path | None = None
    landmarks: Path | None = None
    units: str | None = None
    identity: str | None = None
    atlas: Path | None = None
    texture: Path | None = None

    def load(self, report: Report | None = None) -> Face:
        """The face; an error where an option makes no sense without another. `report` shows how the search goes on."""
        from ..anatomy.fitting import default_face, fit_face

        atlas = read_atlas(self.atlas) if self.atlas else load_atlas()
        if self.face is not None and self.identity is not None:
            raise ParameterError("--identity changes the built-in head: leave out --face, or --identity.")
        if self.face is not None and self.face.suffix == SUFFIX:
            for name in ("landmarks", "units", "texture"):
                if getattr(self, name) is not None:
                    raise ParameterError(f"{self.face.name} has its own {name}: leave out --{name}.")
            return read_face(self.face, atlas)
        if self.face is not None:
            progress = None if report is None else report.search
            return fit_face(self.face, self.landmarks, units_of(self.units), atlas, progress, self.texture)
        for name in ("landmarks", "units", "texture"):
            if getattr(self, name) is not None:
                raise ParameterError(f"--{name} belongs to a mesh: name it with --face.")
        return default_face(person(self.identity) if self.identity is not None else None, atlas=atlas)


@Parameter(name="*")
@dataclass(frozen=True)
class OutputOptions:
    """What is written.

    Parameters
    ----------
    size
        Pixels of each picture: 800, or 800x600.
    view
        View of the close-ups. Default: where the wrinkles are.
    fps
        Pictures in a second of the movie.
    movie
        Write a movie.
    series
        Write all frames as a time series (VTKHDF), which ParaView plays.
    save_mesh
        Write the wrinkled mesh with its texture, too: glb or gltf (with eyes and teeth), obj or ply; and tears, in
        ply as a file of their own.
    out
        Folder to write to. Default: output/NAME.
    quiet
        Print nothing but errors.
    """

    size: str = "800"
    view: str | None = None
    fps: float = 25.0
    movie: bool = True
    series: bool = True
    save_mesh: Literal["glb", "gltf", "obj", "ply"] | None = None
    out: Path | None = None
    quiet: bool = False

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height of a picture."""
        return size_of(self.size)

    def folder(self, name: str) -> Path:
        """Where the files go, if nothing else was asked for: output/NAME."""
        return self.out or Path("output") / name

    def files(self, path: Path) -> tuple[Path | None, Path | None]:
        """The movie and the time series, where they were asked for; `path` is without ending."""
        movie, series = (path.with_name(f"{path.name}{ending}") for ending in (".mp4", ".vtkhdf"))
        return movie if self.movie else None, series if self.series else None

    def mesh_of(self, frame: pv.PolyData, face: Face, path: Path, tears: Sequence[pv.PolyData] = ()) -> list[Path]:
        """Write the mesh of a moment, if that was asked for; `path` is without ending. Returns what was written."""
        if self.save_mesh is None:
            return []
        file = path.with_name(f"{path.name}.{self.save_mesh}")
        beside = companion_files(file, textured=face.texture is not None, tears=bool(tears))
        return [write_mesh(frame, file, face, parts=True, tears=tears), *beside]


def units_of(text: str | None) -> str | float | None:
    """The name of a unit, or the millimetres in it.

    Examples
    --------
    >>> units_of("cm"), units_of("10")
    ('cm', 10.0)
    """
    try:
        return text if text is None else float(text)
    except ValueError:
        return text


def person(text: str) -> dict[str, float]:
    """Parameters of an identity by name from "jaw=0.5,age=1".

    Examples
    --------
    >>> person("jaw=0.5, age=1")
    {'jaw': 0.5, 'age': 1.0}
    """
    found: dict[str, float] = {}
    for part in text.split(","):
        name, _, value = (piece.strip() for piece in part.partition("="))
        try:
            found[name] = float(value)
        except ValueError:
            raise ParameterError(f"the identity must be like jaw=0.5,age=1; received {part.strip()!r}.") from None
    return found


def mixture(text: str, atlas: Atlas) -> dict[str, float]:
    """Weights by name from "surprise", "AU12" or "AU1=0.7,AU4".

    Raises
    ------
    UnknownNameError
        For a name that is no expression, action unit, muscle or pair of muscles.
    ParameterError
        For a weight that is no number.

    Examples
    --------
    >>> mixture("AU1=0.7, AU4", load_atlas())
    {'AU1': 0.7, 'AU4': 1.0}
    """
    weights: dict[str, float] = {}
    for part in text.split(","):
        name, equals, weight = (piece.strip() for piece in part.partition("="))
        try:
            weights[name] = float(weight) if equals else 1.0
        except ValueError:
            raise ParameterError(f"the weight of {name} must be a number, received {weight!r}.") from None
        try:
            atlas.resolve(name)
        except UnknownNameError:
            pairs = dict.fromkeys(muscle.removesuffix("_l").removesuffix("_r") for muscle in atlas.muscles)
            known = [*atlas.expressions, *atlas.action_units, *pairs, *atlas.muscles]
            problem = unknown_name("expression, action unit or muscle", name, known)
            raise UnknownNameError(f"{problem} All of them: facewrinkle info.") from None
    return weights


def size_of(text: str) -> tuple[int, int]:
    """Width and height from "800" or "800x600".

    Examples
    --------
    >>> size_of("640"), size_of("800x600")
    ((640, 640), (800, 600))
    """
    try:
        numbers = [int(number) for number in text.lower().split("x")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        raise ParameterError(f"the size must be pixels such as 800 or 800x600, received {text!r}.")
    return numbers[0], numbers[-1]


def facts_of(face: Face) -> dict[str, str]:
    """What is known of a fitted face, for a table."""
    measured = [value for name, value in face.confidences.items() if name not in face.estimated]
    facts = {"likeness to a face": "not known" if face.likeness is None else f"{face.likeness:.2f}"}
    facts["landmarks"] = f"{len(face.landmarks)}, estimated: {', '.join(face.estimated) or 'none'}"
    if measured:
        facts["confidence of measured ones"] = f"{min(measured):.2f} to {max(measured):.2f}"
    return facts | {"unit": f"{face.unit:.4g} mm", "distance between the pupils": f"{face.frame.pupil_distance:.4g}"}


class Report:
    """What a command says on stdout, and its progress on stderr; nothing when quiet."""

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
        table = Table(title=title, show_header=False, title_justify="left", title_style="bold", box=None)
        for name, value in rows.items():
            table.add_row(name, value)
        self.console.print(table)

    def waiting(self, what: str) -> AbstractContextManager[object]:
        """Say what takes a while, until it is done, where there is a terminal to show it."""
        console = Console(stderr=True)
        return nullcontext() if self.quiet or not console.is_terminal else console.status(f"{what} ...")

    def search(self, steps: Iterable[T], count: int) -> Iterator[T]:
        """The steps of a search for a face, with a bar."""
        return self.progress(iter(steps), "Finding the face", count)

    def progress(self, items: Iterator[T], what: str, total: int) -> Iterator[T]:
        """The items, with a bar while they are taken where there is a terminal to show it."""
        console = Console(stderr=True)
        if self.quiet or not console.is_terminal:
            return interruptible(items)
        return interruptible(iter(track(items, what, total, console=console, transient=True)))
