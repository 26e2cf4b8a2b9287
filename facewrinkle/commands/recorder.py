"""The recorder behind the commands that play something: movie, time series, pictures and meshes of a clip."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..array_types import Image
from ..errors import MissingPackageError, warn
from ..export import movie_writer, write_series
from ..export.animation import SUFFIXES, AnimationWriter
from ..export.meshes import HELD, write_mesh_files
from ..files import output_file, output_folder, output_target, remove_stale
from ..plotting import Scene, save_picture, side_by_side
from ..plotting.views import Style, height_of
from ..simulation import Simulation
from ..tears.presets import Tear
from .options import OutputOptions, Report, removed_rows

Drawing = Callable[[], Image]
"""A picture that is being drawn: waits for it, and returns it."""


def beside(drawings: Iterable[Drawing]) -> Drawing:
    """Return a function that waits for pictures that are being drawn, and returns them side by side."""
    begun = list(drawings)
    return lambda: side_by_side([picture() for picture in begun])


@dataclass(frozen=True, eq=False)
class Clip:
    """A clip of a face, to be played once.

    Attributes
    ----------
    face : Face
    frames : iterator of PolyData
        Each made when it is its turn.
    times : ndarray, shape (t,)
        Of the frames, s.
    simulation : Simulation, optional
        What makes the frames; needed for animated export.
    tears : sequence of Tear
        On the frames; for animated export.
    """

    face: Face
    frames: Iterator[pv.PolyData]
    times: np.ndarray
    simulation: Simulation | None = None
    tears: Sequence[Tear] = ()


class Recorder:
    """A recorder that plays a clip and writes the files that were asked for.

    Parameters
    ----------
    folder : Path
    stem : str
        Beginning of the names of all files.
    output : OutputOptions
    report : Report

    Attributes
    ----------
    files : list of Path
        All that has been written, but what `output` names itself.
    named : list of Path
        The files of an animation that `output` names.
    """

    def __init__(self, folder: Path, stem: str, output: OutputOptions, report: Report) -> None:
        self.folder, self.stem = output_folder(folder, make=False), stem
        self.output, self.report = output, report
        self.files: list[Path] = []
        self.named: list[Path] = []
        if output.save_animation is not None:
            output_file(output.save_animation, SUFFIXES)  # refuses other formats before anything is played
        asked = {"png": True, "mp4": output.movie, "vtkhdf": output.series, output.save_mesh: output.save_mesh}
        for ending in (ending for ending, wanted in asked.items() if wanted):
            output_target(self._path(f".{ending}"))  # nor must any be what was read

    def record(
        self, clip: Clip, draw: Callable[[pv.PolyData], Drawing], watch: Callable[[int, pv.PolyData], None]
    ) -> None:
        """Play a clip; its movie and its time series are written as the frames pass by.

        Without the packages for movies a warning takes the place of the movie.

        Parameters
        ----------
        clip : Clip
        draw : callable
            Begins the picture of a frame in the movie, and returns a function that waits for it. Meanwhile the frame
            is written, and the next one made.
        watch : callable
            Called with the number of each frame and the frame, to keep those that pictures are made of.
        """
        output = self.output
        animation = (
            None
            if output.save_animation is None
            else AnimationWriter(clip.face, output.save_animation, output.animation_error)
        )
        with ExitStack() as stack:
            append = self._open_movie(stack) if self.output.movie else None
            frames = self._passing(clip, draw, watch, append, animation)
            if self.output.series:
                self.files.append(write_series(map(clip.face.with_parts, frames), clip.times, self._path(".vtkhdf")))
            else:
                deque(frames, maxlen=0)
        if append is not None:
            self.files.append(self._path(".mp4"))
        if animation is not None and clip.simulation is not None:
            with self.report.waiting("Writing the animation"):
                self.named += animation.write(clip.times, clip.simulation.forest, clip.tears)

    def _passing(
        self,
        clip: Clip,
        draw: Callable[[pv.PolyData], Drawing],
        watch: Callable[[int, pv.PolyData], None],
        append: Callable[[np.ndarray], None] | None,
        animation: AnimationWriter | None,
    ) -> Iterator[pv.PolyData]:
        """Yield the frames of a clip after they were watched and drawn."""
        drawing: Drawing | None = None
        for number, frame in enumerate(self.report.progress(clip.frames, "Frames", len(clip.times))):
            watch(number, frame)
            if animation is not None:
                animation.add(frame)
            if append is not None:
                if drawing is not None:
                    append(drawing())
                drawing = draw(frame)
            yield frame
        if append is not None and drawing is not None:
            append(drawing())

    def _open_movie(self, stack: ExitStack) -> Callable[[np.ndarray], None] | None:
        """Return a function that appends a picture to the movie; None, with a warning, without the packages for it."""
        path = self._path(".mp4")
        try:
            return stack.enter_context(movie_writer(path, fps=self.output.fps))
        except MissingPackageError as missing:
            self._without_movie(missing)
            return None

    def save_movie(self, write: Callable[[Path], Path]) -> None:
        """Write a movie by a function; without the packages for movies a warning takes its place."""
        try:
            self.files.append(write(self._path(".mp4")))
        except MissingPackageError as missing:
            self._without_movie(missing)

    def _without_movie(self, missing: MissingPackageError) -> None:
        warn(f"no movie is written: {missing}")
        self._path(".mp4").unlink(missing_ok=True)  # of an earlier run

    def write_series(self, frames: Iterable[pv.PolyData], times: Iterable[float], suffix: str = "") -> None:
        """Write a time series of frames that are there."""
        self.files.append(write_series(frames, times, self._path(f"{suffix}.vtkhdf")))

    def save_picture(self, image: Image, suffix: str = "") -> None:
        """Write a picture."""
        self.files.append(save_picture(image, self._path(f"{suffix}.png")))

    def save_mesh(self, frame: pv.PolyData, face: Face, suffix: str = "", tears: Sequence[pv.PolyData] = ()) -> None:
        """Write the mesh of a moment, if that was asked for."""
        if self.output.save_mesh is None:
            return
        path = self._path(f"{suffix}.{self.output.save_mesh}")
        self.files += write_mesh_files(frame, path, face, parts=True, tears=tears)

    def tabulate(self, title: str, rows: Mapping[str, str]) -> None:
        """Print what came out, and the names of all files; remove those of the last run that were not written anew."""
        files = {f"files in {self.folder}": [path.name for path in self.files], "animation": [*map(str, self.named)]}
        written = {where: "\n".join(sorted(names)) for where, names in files.items() if names}
        stale = remove_stale(self.folder / f".{self.stem}.files", self.files)
        held = {f"{self.output.save_mesh} holds": HELD} if self.output.save_mesh in ("obj", "ply") else {}
        self.report.table(title, {**rows, **held, **written, **removed_rows(stale)})

    def _path(self, ending: str) -> Path:
        return self.folder / f"{self.stem}{ending}"


class Scenes(ExitStack):
    """Scenes of a face, one for each style, built when it is first drawn in; use it in a `with` statement.

    Parameters
    ----------
    face : Face
    """

    def __init__(self, face: Face) -> None:
        super().__init__()
        self.face = face
        self._scene = cache(lambda style: self.enter_context(Scene(self.face, style)))
        self._last: tuple[tuple[Style, ...], pv.PolyData, Drawing] | None = None

    def picture(self, frame: pv.PolyData, style: Style) -> Image:
        """Return the picture of a frame."""
        return self._scene(style).picture(frame)

    def begun(self, frame: pv.PolyData, *styles: Style) -> Drawing:
        """Begin pictures of a frame, and return a function that waits for them and returns them side by side.

        For movies: a frame that nobody could tell from the last one that was drawn is not drawn again.
        """
        finest = min(height_of(self.face, style) / style.size[1] for style in styles)
        # An edge between black and white that moves less changes a color by one of its 256 steps. (Where a hair passes
        # a sample, some 20 pixels of a picture change by more.)
        if self._last is not None and self._last[0] == styles and _alike(frame, self._last[1], finest / 256.0):
            return self._last[2]
        drawing = cache(beside(self._scene(style).begun(frame) for style in styles))
        self._last = styles, frame.copy(), drawing  # frames may be filled again
        return drawing


def _alike(frame: pv.PolyData, other: pv.PolyData, distance: float) -> bool:
    """Return True if nothing of a frame is farther than a distance from where it is in another.

    Where eyes, jaw, head and parts are is in the fields; what turns by an angle moves by no more than the size of the
    mesh times that.
    """
    if frame.n_points != other.n_points or not np.array_equal(frame.faces, other.faces):
        return False
    if frame.field_data.keys() != other.field_data.keys():
        return False
    pairs = [(np.asarray(values), np.asarray(other.field_data[name])) for name, values in frame.field_data.items()]
    return np.allclose(frame.points, other.points, rtol=0.0, atol=distance) and all(
        np.allclose(one, two, rtol=0.0, atol=distance / frame.length, equal_nan=True)
        if one.shape == two.shape and one.dtype.kind != "U"
        else np.array_equal(one, two)
        for one, two in pairs
    )
