"""``facewrinkle tear``: pictures and a movie of a face that cries."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
import pyvista as pv
from cyclopts import Parameter

from ..anatomy.face import Face
from ..array_types import Image
from ..errors import ParameterError, check_range, check_whole
from ..export import output_folder
from ..plotting import TearScene, side_by_side
from ..plotting.views import Style, View, surface_view, whole_view
from ..simulation import Refinement, Simulation
from ..tears import SheddingTear
from ..tears.presets import PRESETS, Tear, dripping, preset, shedding, surfaces
from .options import FaceOptions, OutputOptions, Report, Whole, given, parse_mixture, parse_numbers, refuse
from .recorder import Clip, Drawing, Recorder, beside

Kind = Literal["dripping", "shedding", "one_tear", "weeping", "joy"]

HEAD_SIZE = 420.0
"""Size of the built-in head from corner to corner, mm."""

MOMENTS = 4
"""Pictures in a row, as in the paper's Figs. 11 and 12."""


def tear(
    kind: Kind,
    /,
    *,
    source: FaceOptions = FaceOptions(),
    start: Annotated[list[str] | None, Parameter(allow_leading_hyphen=True)] = None,
    expression: str | None = None,
    intensity: float = 0.8,
    speed: float | None = None,
    roughness: float | None = None,
    head: Literal["round", "extruded"] | None = None,
    reveal: Literal["length", "height"] | None = None,
    seed: Whole = 0,
    seconds: float = 4.0,
    output: OutputOptions = OutputOptions(),
) -> None:
    """Write pictures and a movie of a crying face.

    Parameters
    ----------
    kind
        Tears that drip or run down, as in the paper; or one tear, weeping, tears of joy.
    start
        A point where tears start on a mesh that is not a face, such as 10,0,45, in mesh units; repeat it for the other
        eye. Without --units, the mesh is taken to be as large as a head.
    expression
        An expression, action unit or muscle, or a mixture such as AU1=0.7+AU4. Default: one that suits the tears.
    intensity
        How strong the expression is, 0 to 1.
    speed
        Speed of tears that run down, mm/s.
    roughness
        Roughness of the skin, 0 to 1: rougher skin holds back more water.
    head
        Head of tears that run down: round, by a formula, or extruded and smoothed as in the paper. Default: round.
    reveal
        What grows at a constant rate as they run: their length, or the height that they cover, as in the paper.
        Default: length.
    seed
        Random seed of the tears.
    seconds
        Length of the movie.
    """
    stem = f"tear_{kind}"
    folder = output.folder(stem, source.label)
    report = Report(output.quiet)
    output_folder(folder, make=False)  # to be refused before the face is made
    running = given(c=speed, roughness=roughness, head=head, by=reveal)
    if kind == "dripping":
        why = "belongs to tears that run down; those that drip fall freely: leave it out."
        refuse(why, speed=speed, roughness=roughness, head=head, reveal=reveal)
    if speed is not None:
        check_range("speed", speed, 1e-6, 1e9)
    seconds, fps = check_range("seconds", seconds, 0.1, 1e4), check_range("fps", output.fps, 1.0, 100.0)
    frames = check_whole("seconds times fps", round(seconds * fps), MOMENTS, 1e6)
    style = output.style(output.view or "cheeks")
    places = [parse_numbers("start", place, (3,)) for place in start or ()]
    if places and expression is not None:
        raise ParameterError("--expression belongs to a face, --start to a mesh that is none: leave out one of them.")
    if places:
        face = source.load_surface("start", HEAD_SIZE)
    else:
        face = source.load(report, "name a place from which tears come: --start X,Y,Z.")
    mixture = {} if places else parse_mixture(expression or PRESETS[kind].expression, face.atlas)
    rates = face.atlas.contractions(mixture, intensity)
    with report.waiting("Letting tears run"):
        tears = _tears_from(places, kind, face, seed, running) if places else preset(kind, face, seed=seed, **running)
        crying = Crying(face, rates, tears, np.arange(frames) / fps, output.save_animation is None)
    if places and output.view is None:
        style = replace(style, view=_close(face, places, tears))
    recorder = Recorder(folder, stem, output, report)
    _record(crying, recorder, style)
    unit = {} if face.landmarks else {"unit of the mesh": f"{face.unit:.4g} mm"}
    recorder.tabulate(stem, {"tears": str(len(tears)), **unit})


def _tears_from(places: Sequence[Any], kind: Kind, face: Face, seed: int, running: dict[str, Any]) -> list[Tear]:
    """Return tears of a preset from places: the first of one side of the face that runs, and the first that drips."""
    tears: list[Tear] = []
    for number, place in enumerate(places):
        runs = [run for run in PRESETS[kind].runs if run.side == "lr"[number % 2]] or PRESETS[kind].runs
        for drips in (False, True):
            run = next((run for run in runs if run.drips == drips), None)
            if run is None:
                continue
            own = {} if drips else {**running, "seed": seed + number}
            tears.append((dripping if drips else shedding)(face, place, {**run.options, **own}))
    return tears


def _close(face: Face, places: Sequence[Any], tears: list[Tear]) -> View:
    """Return a view of the first tear that runs on a surface, from in front of the place that it comes from."""
    place = np.asarray(places[0], dtype=np.float64)
    first = next((tear for tear in tears if isinstance(tear, SheddingTear)), None)
    seen = place[None] if first is None else first.path.points
    normals = face.normals
    out = normals[np.linalg.norm(face.points - place, axis=1).argmin()]
    height = max(float(np.ptp(seen, axis=0).max()), 0.1 * HEAD_SIZE / face.unit)
    return surface_view(face, 0.5 * (seen.min(axis=0) + seen.max(axis=0)), out, height)


@dataclass(eq=False)
class Crying:
    """A face that makes an expression and cries.

    Attributes
    ----------
    face : Face
    rates : dict of str to float
        Contraction rates by muscle.
    tears : list of Tear
    times : ndarray, shape (t,)
        Of the frames, s.
    coarsen : bool
        Whether triangles that are finer than needed are taken back.
    now : list of PolyData
        Surfaces of the tears on the frame that was played last.
    """

    face: Face
    rates: dict[str, float]
    tears: list[Tear]
    times: np.ndarray
    coarsen: bool = True

    def __post_init__(self) -> None:
        self.now: list[pv.PolyData] = []

    def moments(self) -> list[int]:
        """Return numbers of frames that show most of the tears: evenly spread over the time in which there are some."""
        wet = [i for i, t in enumerate(self.times) if any(tear.begin <= t <= tear.end for tear in self.tears)]
        return [wet[round(k)] for k in np.linspace(0.1, 0.95, MOMENTS) * (len(wet) - 1)]

    def clip(self) -> Clip:
        """Return the clip, whose frames have the tears in `now`."""
        simulation = Simulation(self.face, Refinement(coarsen=self.coarsen))
        return Clip(self.face, self._frames(simulation), self.times, simulation, self.tears)

    def _frames(self, simulation: Simulation) -> Iterator[pv.PolyData]:
        simulation.contract(self.rates)
        for t, frame in zip(self.times, simulation.run(len(self.times), ramp=0.3), strict=True):
            self.now = surfaces(self.tears, float(t), frame)
            yield frame


def _record(crying: Crying, recorder: Recorder, close: Style) -> None:
    """Play a face that cries, and write its files."""
    face, moments = crying.face, crying.moments()
    styles = replace(close, view="front") if face.landmarks else replace(close, view=whole_view(close)), close
    series: list[tuple[float, pv.PolyData]] = []
    rows: list[list[Image]] = [[], []]
    with ExitStack() as stack:
        scenes = [stack.enter_context(TearScene(face, style)) for style in styles]

        def draw(frame: pv.PolyData) -> Drawing:
            return beside(scene.begun(frame, crying.now) for scene in scenes)

        def watch(number: int, frame: pv.PolyData) -> None:
            if recorder.output.series and crying.now:
                merged = pv.merge(crying.now, merge_points=False) if len(crying.now) > 1 else crying.now[0]
                series.append((crying.times[number], merged))
            if number in moments:
                for row, scene in zip(rows, scenes, strict=True):
                    row.extend([scene.picture(frame, crying.now)] * moments.count(number))
            if number == moments[-1]:
                recorder.save_mesh(frame, face, tears=crying.now)

        recorder.record(crying.clip(), draw, watch)
    if series:
        times, meshes = zip(*series, strict=True)
        recorder.write_series(meshes, times, "_tears")
    for row, suffix in zip(rows, ("", "_closeup"), strict=True):
        recorder.save_picture(side_by_side(row), suffix)
