"""A take: an expression that comes and goes before the camera, and the pictures of it at its height."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..errors import MissingPackageError, check_range, check_whole, warn
from ..export import movie_writer, write_series
from ..layers.muscle_wrinkles import MuscleWrinkles
from ..motion.base import Motion
from ..plotting import Image, Scene, closeup, picture, side_by_side
from ..plotting.views import Style
from ..simulation import Refinement, Simulation
from .common import Report

FIELDS = ("W", "epsilon", "lambda", "gamma", "muscle", "split_gamma", "level")


@dataclass(frozen=True, eq=False)
class Take:
    """What is played, and how it is drawn.

    Attributes
    ----------
    face : Face
    rates : mapping of str to float
        Contraction rates by muscle.
    frames : int
        Steps from the relaxed face to the held expression; half as many lead back.
    refinement : Refinement
    layer : MuscleWrinkles
    size : tuple of int
        Of a picture, pixels.
    view : str, optional
        Of the close-up; default: where the wrinkles are.
    fps : float
    """

    face: Face
    rates: Mapping[str, float]
    frames: int = 100
    refinement: Refinement = field(default_factory=Refinement)
    layer: MuscleWrinkles = field(default_factory=MuscleWrinkles)
    size: tuple[int, int] = (800, 800)
    view: str | None = None
    fps: float = 25.0

    def __post_init__(self) -> None:
        check_whole("the number of frames", self.frames, 1, 1e9)
        check_range("fps", self.fps, 1.0, 100.0)
        Style(self.size, "front" if self.view is None else self.view)

    @cached_property
    def close(self) -> str:
        """The view of the close-up: chosen after a quick rehearsal, where none was asked for."""
        if self.view is not None:
            return self.view
        *_, frame = self.simulation().run(15)
        return closeup(frame, self.face)

    @property
    def steps(self) -> int:
        """Number of frames there and back."""
        return self.frames + (self.frames + 1) // 2

    def simulation(self) -> Simulation:
        """A simulation that has been asked for the expression."""
        simulation = Simulation(self.face, self.refinement, [self.layer])
        simulation.contract(self.rates)
        return simulation

    def bare(self, motion: Motion | None = None) -> pv.PolyData:
        """The expression without wrinkles; with the motion of a simulation that is over, its skin is not made again."""
        simulation = Simulation(self.face, Refinement(max_level=0), layers=[], motion=motion)
        simulation.contract(self.rates)
        *_, frame = simulation.run(self.frames)
        return frame

    def shoot(
        self, simulation: Simulation, movie: Path | None, series: Path | None, report: Report
    ) -> tuple[pv.PolyData, list[Path]]:
        """Play the expression there and back, write it as it goes; returns the frame at its height, and the files.

        Without the packages for movies there is a notice in place of the movie.
        """
        peak: list[pv.PolyData] = []

        def played() -> Iterator[pv.PolyData]:
            for frame in simulation.run(self.frames):
                yield frame
            peak.append(frame)
            simulation.relax()
            yield from simulation.run(self.steps - self.frames, ramp=0.8)

        frames = report.progress(played(), "Frames", self.steps)
        styles = [Style(self.size, view) for view in ("front", self.close)] if movie is not None else []
        times = (1 + np.arange(self.steps)) * simulation.motion.time_step
        files = shot(frames, times, self.face, styles, self.fps, movie, series)
        return peak[0], files

    def panels(self, view: str, peak: pv.PolyData, bare: pv.PolyData) -> list[Image]:
        """Neutral, expression without wrinkles, with wrinkles, and its triangles."""
        with Scene(self.face, Style(self.size, view)) as scene:
            images = [scene.picture(frame) for frame in (self.face.mesh, bare, peak)]
        return [*images, picture(peak, self.face, Style(self.size, view, wireframe=True))]

    def fields(self, peak: pv.PolyData) -> Iterator[tuple[str, Image]]:
        """The fields in colour on the whole face, by name."""
        for name in FIELDS:
            yield name, picture(peak, self.face, Style(self.size, scalars=name))


def shot(
    frames: Iterator[pv.PolyData],
    times: np.ndarray,
    face: Face,
    styles: Sequence[Style],
    fps: float,
    movie: Path | None,
    series: Path | None,
) -> list[Path]:
    """Take all frames; those files that are named are written as they pass by, and returned."""
    with ExitStack() as stack:
        if movie is not None:
            frames = filmed(frames, movie, face, styles, fps, stack)
        if series is not None:
            write_series(map(face.with_parts, frames), times, series)
        else:
            for _ in frames:
                pass
    return [path for path in (movie, series) if path is not None and path.exists()]


def film(path: Path, fps: float, stack: ExitStack) -> Callable[[np.ndarray], None] | None:
    """What appends a picture to a movie; None, with a notice, without the packages for movies."""
    try:
        return stack.enter_context(movie_writer(path, fps))
    except MissingPackageError as missing:
        warn(f"no movie is written: {missing}")
        path.unlink(missing_ok=True)  # of an earlier run
        return None


def filmed(
    frames: Iterator[pv.PolyData], path: Path, face: Face, styles: Sequence[Style], fps: float, stack: ExitStack
) -> Iterator[pv.PolyData]:
    """The same frames; a picture in each style, side by side, is appended to a movie as they pass by."""
    append = film(path, fps, stack)
    if append is None:
        return frames
    scenes = [stack.enter_context(Scene(face, style)) for style in styles]

    def passing() -> Iterator[pv.PolyData]:
        for frame in frames:
            append(side_by_side([scene.picture(frame) for scene in scenes]))
            yield frame

    return passing()
