"""``facewrinkle tear``: pictures, a movie and time series of a face that cries."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..errors import ParameterError, check_range, check_whole
from ..export import output_folder, write_series
from ..plotting import Image, save_picture, side_by_side
from ..plotting.views import Style
from ..plotting.wet import TearScene
from ..simulation import Simulation
from ..tears.presets import PRESETS, Tear, preset, surfaces
from .common import FaceOptions, OutputOptions, Report, mixture
from .recorder import film, shot

Kind = Literal["dripping", "shedding", "one_tear", "weeping", "joy"]
MOMENTS = 4
"""Pictures in a row, as in the paper's Figs. 11 and 12."""


def tear(
    kind: Kind,
    /,
    *,
    source: FaceOptions | None = None,
    expression: str | None = None,
    intensity: float = 0.8,
    speed: float | None = None,
    roughness: float | None = None,
    seed: int = 0,
    seconds: float = 4.0,
    plain: bool = False,
    output: OutputOptions | None = None,
) -> None:
    """Write pictures, a movie and time series of a face that cries.

    Parameters
    ----------
    kind
        Tears that drip or are shed, as in the paper; or one tear, weeping, tears of joy.
    expression
        An expression, action unit or muscle, or a mixture such as AU1=0.7,AU4. Default: one that goes with the tears.
    intensity
        How strong the expression is, 0 to 1.
    speed
        Of tears that are shed, mm/s.
    roughness
        Of the skin, 0 to 1: how much water it holds back.
    seed
        Another number, other tears.
    seconds
        Length of the movie.
    plain
        Draw the tears of the movie without refraction: quicker.
    """
    begin, output, stem = time.perf_counter(), output or OutputOptions(), f"tear_{kind}"
    report, folder = Report(output.quiet), output_folder(output.folder(stem), make=False)
    face = (source or FaceOptions()).load(report)
    rates = face.atlas.contractions(mixture(expression or PRESETS[kind].expression, face.atlas), intensity)
    given = {name: value for name, value in (("c", speed), ("roughness", roughness)) if value is not None}
    if given and kind == "dripping":
        raise ParameterError("--speed and --roughness belong to tears that are shed; those that drip fall freely.")
    if speed is not None:
        check_range("speed", speed, 1e-6, 1e9)
    seconds, fps = check_range("seconds", seconds, 0.1, 1e4), check_range("fps", output.fps, 1.0, 100.0)
    frames = check_whole("seconds times fps", round(seconds * fps), MOMENTS, 1e6)
    style = Style(output.pixels, output.view or "cheeks")
    with report.waiting("Letting tears run"):
        play = Play(face, rates, preset(kind, face, seed, **given), frames, fps)
    files = play.record(folder / stem, style, report, output, plain=plain)
    report.table(
        stem,
        {
            "tears": f"{len(play.tears)}, {play.triangles} triangles at most",
            "tears alone": f"{1000.0 * play.seconds / frames:.1f} ms a frame",
            f"files in {folder}": "\n".join(sorted(path.name for path in files)),
        },
    )
    report.say(f"{time.perf_counter() - begin:.1f} s")


@dataclass(eq=False)
class Play:
    """A face that makes an expression and cries.

    Attributes
    ----------
    face : Face
    rates : dict of str to float
    tears : list of Tear
    frames : int
    fps : float
    """

    face: Face
    rates: dict[str, float]
    tears: list[Tear]
    frames: int
    fps: float

    def __post_init__(self) -> None:
        self.seconds, self.triangles = 0.0, 0

    @cached_property
    def times(self) -> list[float]:
        """Of the frames, s."""
        return [i / self.fps for i in range(self.frames)]

    def moments(self) -> list[int]:
        """Frames that show most of the tears: evenly spread over the time in which there are some."""
        wet = [i for i, t in enumerate(self.times) if any(tear.begin <= t <= tear.end for tear in self.tears)]
        return [wet[round(k)] for k in np.linspace(0.1, 0.95, MOMENTS) * (len(wet) - 1)]

    def played(self) -> Iterator[tuple[pv.PolyData, list[pv.PolyData]]]:
        """Frames, and the tears on them."""
        simulation = Simulation(self.face)
        simulation.contract(self.rates)
        for t, frame in zip(self.times, simulation.run(self.frames, ramp=0.3), strict=True):
            begin = time.perf_counter()
            tears = surfaces(self.tears, t, frame)
            self.seconds += time.perf_counter() - begin
            self.triangles = max(self.triangles, sum(tear.n_cells for tear in tears))
            yield frame, tears

    def record(self, path: Path, style: Style, report: Report, output: OutputOptions, *, plain: bool) -> list[Path]:
        """Play it, and write what belongs to it; returns the files, whose names begin as that of `path`."""
        files: list[Path] = []
        shown: list[tuple[float, pv.PolyData]] = []
        rows: list[list[Image]] = [[], []]
        clip, cache = output.files(path)
        with ExitStack() as stack:
            append = film(clip, self.fps, stack) if clip is not None else None
            quick = [stack.enter_context(TearScene(self.face, one, not plain)) for one in _both(style)]
            still = [stack.enter_context(TearScene(self.face, one)) for one in _both(style)] if plain else quick

            def passing() -> Iterator[pv.PolyData]:
                moments = self.moments()
                for i, (frame, tears) in enumerate(report.progress(self.played(), "Frames", self.frames)):
                    if cache is not None and tears:
                        shown.append((self.times[i], pv.merge(tears) if len(tears) > 1 else tears[0]))
                    if append is not None:
                        append(side_by_side([scene.picture(frame, tears) for scene in quick]))
                    if i in moments:
                        for row, scene in zip(rows, still, strict=True):
                            row.extend([scene.picture(frame, tears)] * moments.count(i))
                    if i == moments[-1]:
                        files.extend(output.mesh_of(frame, self.face, path, tears))
                    yield frame

            files += shot(passing(), np.array(self.times), self.face, (), self.fps, None, cache)
        if clip is not None and append is not None:
            files.append(clip)
        if shown:
            times, meshes = zip(*shown, strict=True)
            files.append(write_series(meshes, times, path.with_name(f"{path.name}_tears.vtkhdf")))
        for row, suffix in zip(rows, ("", "_closeup"), strict=True):
            files.append(save_picture(side_by_side(row), path.with_name(f"{path.name}{suffix}.png")))
        return files


def _both(style: Style) -> tuple[Style, Style]:
    return Style(style.size), style
