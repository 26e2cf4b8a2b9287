"""``facewrinkle express``: pictures and a movie of an expression, or of a session; and ``demo``: those of the paper."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from ..anatomy import Face, default_face
from ..anatomy.atlas import load_atlas, read_atlas
from ..array_types import Image
from ..errors import ParameterError, check_range, check_whole
from ..export import output_folder
from ..layers.base import Layer
from ..plotting import Scene, Style, closeup, save_picture, side_by_side, stacked
from ..session import Session
from ..session.player import Player, pictured, scene_of
from ..simulation import Refinement, Simulation
from ..simulation.fold_layers import Folds, refinement_for
from .options import FaceOptions, FoldOptions, OutputOptions, Report, Whole, given, parse_mixture, refuse
from .recorder import Clip, Recorder, Scenes

EXPRESSIONS = ("paper_surprise", "frowning", "closing_eye", "stretching_mouth", "paper_fear")
"""Those of the paper."""

SIZE, FRAMES = 400, 24
"""Pixels of the pictures, and frames until an expression is held."""
TILE = 204
"""Pixels of a picture on the sheet of wrinkles and triangles."""
DEPTHS: dict[Folds, float] = {"printed": 1.0, "wave": 3.0}
"""The folds that are drawn, and how deep they are: the lines of the young, as captured people have them, are too faint
for small pictures.
"""

FIELDS = ("W", "epsilon", "lambda", "gamma", "muscle", "split_gamma", "level")
"""Arrays of a frame that are drawn in color."""


def express(
    name: str | None = None,
    /,
    *,
    session: Path | None = None,
    write_session: Path | None = None,
    source: FaceOptions = FaceOptions(),
    intensity: float = 1.0,
    frames: Whole = 100,
    max_level: Whole | None = None,
    gamma_c: float | None = None,
    samples: float | None = None,
    maps: Whole | None = None,
    folds: FoldOptions = FoldOptions(),
    output: OutputOptions = OutputOptions(),
) -> None:
    """Write pictures and a movie of an expression.

    Parameters
    ----------
    name
        An expression, action unit or muscle, or a mixture such as AU1=0.7+AU4. See `facewrinkle info`. The paper's
        surprise and fear, which move the brows alone, are paper_surprise and paper_fear.
    session
        Show a session (JSON) instead, with all that was set in the studio or in Python: its picture, movie and mesh.
    write_session
        Also write face, folds and expression as a session to this file.
    intensity
        How strong the expression is, 0 to 1.
    frames
        Frames from the relaxed face to the full expression; half as many lead back.
    max_level
        How many times a triangle may be split; 0 turns refinement off. Default: enough for most wrinkles.
    gamma_c
        Also split edges by the paper's criterion (Eq. 19): smaller values give more triangles. Default: 0.03 with
        --folds paper, 0.01 with --folds printed; otherwise triangles are split by --samples alone.
    samples
        Minimum number of vertices from bulge to furrow; 0 splits by Eq. 19 alone, as in the paper. Default: 4, or 0
        with --folds printed.
    maps
        Also bake the wrinkles into maps of this width, in texels, for the unrefined mesh: normals, heights, flush.
    """
    report = Report(output.quiet)
    check_range("fps", output.fps, 1.0, 100.0)
    if session is not None:
        own = name is not None or source != FaceOptions() or folds != FoldOptions()
        if own or intensity != 1.0 or frames != 100 or write_session is not None or maps is not None:
            raise ParameterError("--session has a face, folds and an expression: leave others out, or its own.")
        return show_session(session, output, report)
    if name is None:
        raise ParameterError("what shall the face do? Name an expression, such as surprise, or a --session.")
    if write_session is not None:
        session_of(name, intensity, source, folds, output).write(write_session)
    face = folds.face(source.load(report))
    mixture = parse_mixture(name, face.atlas)
    rates = face.atlas.contractions(mixture, intensity)
    performance = Performance(
        face=face,
        rates=rates,
        frames=frames,
        refinement=replace(
            refinement_for(folds.folds),
            **given(max_level=max_level, gamma_c=gamma_c, samples=samples),
            coarsen=output.save_animation is None,
        ),
        layers=folds.layers(face),
        size=output.pixels,
        view=output.view,
        clay=output.clay,
    )
    stem = re.sub(r"[^\w.=-]+", "_", name)[:100]  # the names of files must not become too long
    if maps is not None:
        from ..rigging.maps import bake_maps, check_map_size, write_maps  # a tenth of the time to start

        check_map_size(maps)
    folder = output.folder(stem, source.label)

    def bake() -> list[Path]:
        if maps is None:
            return []
        with report.waiting("Baking the maps"):
            baked = bake_maps(performance.face, mixture, intensity=intensity, size=maps, layers=performance.layers)
            return write_maps(baked, folder / stem)

    record(performance, folder, stem, report, output, bake=bake)


@dataclass(frozen=True, eq=False)
class Performance:
    """An expression that comes and goes before the camera.

    Attributes
    ----------
    face : Face
    rates : mapping of str to float
        Contraction rates by muscle.
    frames : int
        Steps from the relaxed face to the held expression; half as many return.
    refinement : Refinement
    layers : sequence of Layer, optional
        Default: those of a :class:`facewrinkle.Simulation`.
    size : tuple of int
        Of a picture, pixels.
    view : str, optional
        Of the close-up. Default: where the wrinkles are.
    clay : bool
        Show the face as clay.
    """

    face: Face
    rates: Mapping[str, float]
    frames: int = 100
    refinement: Refinement = field(default_factory=Refinement)
    layers: Sequence[Layer] | None = None
    size: tuple[int, int] = (800, 800)
    view: str | None = None
    clay: bool = False

    def __post_init__(self) -> None:
        check_whole("the number of frames", self.frames, 1, 1e9)
        Style(self.size, "front" if self.view is None else self.view)

    @property
    def steps(self) -> int:
        """Number of frames there and back."""
        return self.frames + (self.frames + 1) // 2

    def simulation(self) -> Simulation:
        """Return a simulation that has been asked for the expression."""
        simulation = Simulation(self.face, self.refinement, layers=self.layers)
        simulation.contract(self.rates)
        return simulation

    def bare(self) -> pv.PolyData:
        """Return the expression without wrinkles."""
        simulation = Simulation(self.face, Refinement(max_level=0), layers=[])
        simulation.contract(self.rates)
        *_, frame = simulation.run(self.frames)
        return frame

    def clip(self, simulation: Simulation) -> Clip:
        """Return the expression there and back."""

        def frames() -> Iterator[pv.PolyData]:
            yield from simulation.run(self.frames)
            simulation.relax()
            yield from simulation.run(self.steps - self.frames, ramp=0.8)

        times = (1.0 + np.arange(self.steps)) * simulation.motion.time_step
        return Clip(self.face, frames(), times, simulation)


@dataclass(frozen=True, eq=False)
class Peak:
    """The peak of a performance, with pictures of it.

    Attributes
    ----------
    frame : PolyData
    close : str
        View of the close-up.
    front, closeup : list of images
        Neutral, without wrinkles, with wrinkles, and with the edges of the triangles.
    """

    frame: pv.PolyData
    close: str
    front: list[Image]
    closeup: list[Image]


def record(
    performance: Performance,
    folder: Path,
    stem: str,
    report: Report,
    output: OutputOptions,
    *,
    fields: bool = True,
    scenes: Scenes | None = None,
    bake: Callable[[], list[Path]] | None = None,
) -> Peak:
    """Play a performance, write its files into a folder, print what came out, and return its peak.

    Scenes of the face that are given are drawn in, and stay open. `bake` writes further files, and returns them.
    """
    face = performance.face
    with report.waiting("Preparing the skin"):
        rehearsal = performance.simulation()  # refuses what cannot be played before anything is written
    recorder = Recorder(folder, stem, output, report)
    close = performance.view
    if close is None:
        *_, frame = rehearsal.run(15)  # enough to show where the wrinkles will be
        close = closeup(frame, face)
    simulation = performance.simulation()
    styles = [Style(performance.size, view, clay=performance.clay) for view in ("front", close)]
    peaks: list[pv.PolyData] = []

    def watch(number: int, frame: pv.PolyData) -> None:
        if number == performance.frames - 1:
            peaks.append(frame)

    with Scenes(face) if scenes is None else nullcontext(scenes) as scenes:
        clip = performance.clip(simulation)
        recorder.record(clip, lambda frame: scenes.begun(frame, *styles), watch)
        (peak,) = peaks
        recorder.save_mesh(peak, face)
        with report.waiting("Drawing"):
            shown = [face.mesh, performance.bare(), peak]
            rows = [[scenes.picture(frame, style) for frame in shown] for style in styles]
            for row, style, suffix in zip(rows, styles, ("", "_closeup"), strict=True):
                row.append(scenes.picture(peak, replace(style, wireframe=True)))
                recorder.save_picture(side_by_side(row), suffix)
            if fields:
                with Scene(face, replace(styles[0], scalars=FIELDS[0])) as colored:
                    for name in FIELDS:
                        colored.color_by(name)
                        recorder.save_picture(colored.picture(peak), f"_{name}")
    recorder.files += [] if bake is None else bake()
    seconds = sum(simulation.seconds.values()) - simulation.seconds["precompute"]
    milliseconds = 1000.0 * seconds / performance.steps
    recorder.tabulate(stem, _facts(face, peak) | {"simulation": f"{milliseconds:.1f} ms a frame", "close-up": close})
    return Peak(peak, close, *rows)


def _facts(face: Face, peak: pv.PolyData) -> dict[str, str]:
    """Return the rows of a table about the peak of an expression."""
    height = np.asarray(peak["W"])
    compression = np.max(peak["epsilon"], where=height != 0.0, initial=0.0)
    return {
        "triangles": f"{face.mesh.n_cells} to {peak.n_cells}",
        "highest bulge": f"{height.max():.2f} mm",
        "deepest furrow": f"{-height.min():.2f} mm",
        "largest compression": f"{compression:.2f}",
    }


# --- the expressions of the paper --------------------------------------------------------------------


def demo(*, out: Path = Path("output"), quiet: bool = False) -> None:
    """Write pictures and movies of the paper's five expressions, with folds as printed and as waves.

    Parameters
    ----------
    out
        Folder to write to.
    quiet
        Print only errors.
    """
    report = Report(quiet)
    folder = output_folder(out, make=False)
    face = default_face()
    for folds, depth in DEPTHS.items():
        meaning = "the paper's, as printed" if folds == "printed" else "waves, which are beyond the paper"
        report.say(f"\nFolds {folds!r}: {meaning}\n")
        options = FoldOptions(folds, depth)
        with Scenes(options.face(face)) as scenes:
            peaks = [perform(name, options, scenes, folder / folds, report) for name in EXPRESSIONS]
            sheet = save_picture(side_by_side([column(peak) for peak in peaks]), folder / f"{folds}.jpg")
            report.say(f"\n{sheet}: the five expressions, their wrinkles, and the triangles under them")
            if folds == "wave":
                rows = [_sides(face.mesh, scenes, "front"), *(_sides(peak.frame, scenes, peak.close) for peak in peaks)]
                sheet = save_picture(stacked(rows), folder / "contact_sheet.jpg")
                report.say(f"\n{sheet}: the neutral face and the five expressions from three sides")


def perform(
    expression: str, options: FoldOptions, scenes: Scenes, folder: Path, report: Report, movie: bool = True
) -> Peak:
    """Play an expression, write its files into a folder of its own, and return its peak."""
    face = scenes.face
    performance = Performance(
        face,
        face.atlas.contractions(expression),
        FRAMES,
        refinement_for(options.folds),
        options.layers(face),
        (SIZE, SIZE),
    )
    output = OutputOptions(movie=movie)
    return record(performance, folder / expression, expression, report, output, fields=False, scenes=scenes)


def column(peak: Peak) -> Image:
    """Return an expression on the sheet: from the front, its wrinkles, and the triangles under them."""
    from PIL import Image as Pillow

    pictures = map(Pillow.fromarray, (peak.front[2], *peak.closeup[2:]))
    return stacked([np.asarray(picture.resize((TILE, TILE), Pillow.Resampling.LANCZOS)) for picture in pictures])


def _sides(frame: pv.PolyData, scenes: Scenes, close: str) -> Image:
    """Return a frame from the front and from the side on which the close-up is."""
    sides = ("front", "left_three_quarter", "left_profile")
    views = [view.replace("left", "right") if close.startswith("right") else view for view in sides]
    return side_by_side([scenes.picture(frame, Style((SIZE, SIZE), view)) for view in views])


def show_session(path: Path, output: OutputOptions, report: Report) -> None:
    """Write the picture of a session, and what else was asked for: movie, mesh, series, animation."""
    session = Session.read(path)
    session = session.changed(look={**session.table()["look"], **_look(output)})
    recorder = Recorder(output.folder(path.stem), path.stem, output, report)
    subject = session.subject(report.progress)
    with report.waiting("Preparing the skin"):
        player = Player(session, subject)
        frame = player.settled()
        tears = player.arrived_tears(frame)
    with scene_of(session, subject.face) as scene:
        recorder.save_picture(pictured(scene, session, frame, tears, player.contractions))
    recorder.save_mesh(frame, subject.face, tears=tears)
    if output.movie:
        recorder.save_movie(lambda target: session.movie(target, subject, report.progress))
    if output.series:
        recorder.write_series([moment.frame for moment in session.frames(subject)], player.times)
    if output.save_animation is not None:
        recorder.named.append(session.animation(output.save_animation, subject, report.progress))
    recorder.tabulate(path.name, {"triangles": f"{subject.face.n_cells} to {frame.n_cells}"})


def _look(output: OutputOptions) -> dict[str, Any]:
    """Return what options change of the look of a session."""
    found = given(view=output.view, clay=output.clay or None)
    found |= {"size": output.pixels} if output.size != OutputOptions.size else {}
    return found | ({"fps": output.fps} if output.fps != OutputOptions.fps else {})


def session_of(name: str, intensity: float, source: FaceOptions, folds: FoldOptions, output: OutputOptions) -> Session:
    """Return the session of an expression with the options of a command."""
    why = "is not kept in a session: leave out --write-session, or fit the face first."
    refuse(why, landmarks=source.landmarks, units=source.units, texture=source.texture)
    if folds.folds != "wave" or folds.no_limit:
        raise ParameterError("a session has folds that are waves, within their limit: leave out --write-session.")
    session = source.session()
    atlas = read_atlas(session.atlas) if session.atlas else load_atlas()
    return session.changed(
        atlas,
        mixture=parse_mixture(name, atlas),
        intensity=intensity,
        folds=given(depth=folds.depth, density=folds.density, length=folds.length, seed=folds.seed, age=folds.age),
        look={"size": output.pixels, "fps": output.fps, **_look(output)},
    )
