"""``facewrinkle play``: a recorded animation, with the wrinkles that its motion causes; and ``take``: its weights."""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass, replace
from io import StringIO
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import pyvista as pv
from cyclopts import Parameter

from ..anatomy.atlas import parse_weights
from ..animation.reading import read_animation
from ..animation.recorded import Recorded
from ..errors import ParameterError, check_range, check_whole, warn
from ..files import output_file, write_whole
from ..geometry.normals import vertex_areas
from ..plotting import Style, closeup, side_by_side, stacked
from ..rigging import Performer, Take, read_take
from ..rigging.takes import SUFFIXES as TAKES
from ..simulation import Refinement, Simulation
from .options import FaceOptions, FoldOptions, OutputOptions, Report, Whole, refuse
from .recorder import Clip, Recorder, Scenes


@Parameter(name="*")
@dataclass(frozen=True)
class TakeOptions:
    """How to read a take, where its file leaves that open.

    Parameters
    ----------
    take_fps
        Frames per second of a take without times, of frame numbers, and of time codes.
    full
        The number that stands for a weight of 1, such as 1, 5 or 100. Default: by the largest numbers.
    person
        Whose face, in a file that shows several.
    degrees
        The turn of the head is in degrees. Default: if it exceeds 2; otherwise it is in radians.
    """

    take_fps: float | None = None
    full: float | None = None
    person: Whole | None = None
    degrees: bool | None = None

    def read(self, file: Path) -> Take:
        """Return the take of a file."""
        return read_take(file, self.take_fps, full=self.full, person=self.person, degrees=self.degrees)


def play(
    file: Path,
    /,
    *,
    source: FaceOptions = FaceOptions(),
    mesh: str | None = None,
    animation: str | None = None,
    shapes: str | None = None,
    gain: str | None = None,
    options: TakeOptions = TakeOptions(),
    head: Annotated[bool, Parameter(negative="--no-head")] = True,
    speed: float = 1.0,
    max_level: Whole | None = None,
    moments: Whole = 5,
    folds: FoldOptions = FoldOptions(),
    output: OutputOptions = OutputOptions(),
) -> None:
    """Write pictures and a movie of a recorded animation, or of a face that performs a take.

    Parameters
    ----------
    file
        A glTF or USD file with an animation of blend shapes, bones or points, or a .vtkhdf time series: these contain
        the face. Or a take from a phone or tracker, performed by --face: a table or JSON of weights, as Live Link Face,
        MediaPipe, OpenFace and others write it.
    mesh
        Name of the face mesh in the file.
    animation
        Name of the animation in the file. Default: the first that moves the mesh.
    shapes
        Blend shapes of a glTF file and their weights, such as mouthSmile=0.8,jawOpen=0.3, in place of an animation.
    gain
        Factors for the weights of a take, such as mouthSmile=1.5,cheekPuff=2.
    head
        Turn the head as recorded in the take.
    speed
        Playback speed: 0.5 is half speed.
    max_level
        How many times a triangle may be split; 0 turns refinement off. Default: enough for most wrinkles.
    moments
        Number of pictures. The clip is split into as many equal parts, and each picture shows the deepest wrinkles of
        one.
    """
    report = Report(output.quiet)
    count = check_whole("moments", moments, 1, 100)
    step = 1.0 / check_range("fps", output.fps, 1.0, 100.0)
    speed = check_range("speed", speed, 1e-6, 1e6)
    styles = [output.style(view) for view in ("front", output.view or "cheeks")]
    if file.suffix.lower() in TAKES:
        refuse(f"is not for {file.name}, a take: leave it out.", mesh=mesh, animation=animation, shapes=shapes)
        take = options.read(file).gained({} if gain is None else parse_weights(gain))
        face, duration, names, time_step = source.load(report), take.duration / speed, take.names, None
        motion: Recorded | Performer = Performer(take, face, time_step=step, speed=speed, head=head)
    else:
        of_take = {"face": source.face, "identity": source.identity, "gain": gain, **asdict(options)}
        refuse(f"is for takes, and {file.name} has a face of its own: leave it out.", **of_take)
        rest, recorded = read_animation(
            file, mesh=mesh, animation=animation, shapes=None if shapes is None else parse_weights(shapes)
        )
        motion = recorded = recorded.played(speed)
        face = source.fitted(rest, report)
        duration, names, time_step = recorded.duration, recorded.names, step
    with report.waiting("Preparing the skin"):
        refinement = Refinement(max_level=max_level, coarsen=output.save_animation is None)
        if folds.folds == "printed":
            raise ParameterError(
                "wrinkles as printed are those of an expression (facewrinkle express): play with --folds paper or wave."
            )
        layers = folds.layers(face)
        simulation = Simulation(face, refinement, layers=layers, time_step=time_step, motion=motion)
    steps = max(int(np.ceil(duration / step - 1e-6)), 1)
    check_whole("the number of steps of the clip", steps, 1, 100_000, "Raise --speed.")
    recorder = Recorder(output.folder(file.stem, source.label), file.stem, output, report)
    played = Clip(face, simulation.run(steps), (1 + np.arange(steps)) * step, simulation)
    with Scenes(face) as scenes:
        deepest = _record(played, recorder, scenes, styles, count)
        _tell_smooth(file.name, deepest)
        _draw(deepest, recorder, scenes, styles[0])
    seconds = sum(simulation.seconds.values()) - simulation.seconds["precompute"]
    recorder.tabulate(
        file.name,
        {
            "shapes": str(len(names)),
            "clip": f"{duration:.2f} s, {steps} steps",
            "triangles": f"{face.mesh.n_cells} to {max(moment.frame.n_cells for moment in deepest)}",
            "deepest at": ", ".join(
                f"{moment.time:.2f} s ({abs(moment.frame['W'].min()):.2f} mm)" for moment in deepest
            ),
            "simulation": f"{1000.0 * seconds / steps:.1f} ms a frame",
        },
    )


class Moment(NamedTuple):
    """A frame, its time, and the root mean square of the heights of its wrinkles in mm."""

    depth: float
    time: float
    frame: pv.PolyData


def _tell_smooth(name: str, deepest: list[Moment]) -> None:
    """Say so if there are no wrinkles in a file, none of more than 0.005 mm."""
    if max(float(np.ptp(moment.frame["W"])) for moment in deepest) < 0.005:
        warn(
            f"{name} shows no wrinkles: its motion compresses the skin of the face nowhere. Clips of bodies often "
            "carry the head along as one piece; give one in which the face moves, with blend shapes or facial bones."
        )


def _depth(frame: pv.PolyData) -> float:
    """Return the root mean square of the heights of wrinkles over the skin: the deepest alone cannot get deeper."""
    points, height = np.asarray(frame.points, np.float64), np.asarray(frame["W"])
    area = vertex_areas(points, np.asarray(frame.regular_faces))
    return float(np.sqrt(np.average(height**2, weights=area)))


def _record(clip: Clip, recorder: Recorder, scenes: Scenes, styles: list[Style], count: int) -> list[Moment]:
    """Play a clip, and return the moment of the deepest wrinkles in each of `count` equal parts of it."""
    steps = len(clip.times)
    deepest: dict[int, Moment] = {}

    def watch(number: int, frame: pv.PolyData) -> None:
        now, part = Moment(_depth(frame), float(clip.times[number]), frame), number * count // steps
        deepest[part] = max(deepest.get(part, now), now, key=lambda moment: moment.depth)

    recorder.record(clip, lambda frame: scenes.begun(frame, *styles), watch)
    return list(deepest.values())


def _draw(moments: list[Moment], recorder: Recorder, scenes: Scenes, front: Style) -> None:
    """Write pictures and meshes of moments, and one picture of all."""
    columns = []
    for _, when, frame in recorder.report.progress(moments, "Pictures", len(moments)):
        close = replace(front, view=recorder.output.view or closeup(frame, scenes.face))
        pair = [scenes.picture(frame, style) for style in (front, close)]
        recorder.save_picture(side_by_side(pair), f"_{when:.2f}s")
        recorder.save_mesh(frame, scenes.face, f"_{when:.2f}s")
        columns.append(stacked(pair))
    recorder.save_picture(side_by_side(columns))


def take(file: Path, /, *, options: TakeOptions = TakeOptions(), out: Path | None = None) -> None:
    """Print a take as a table: seconds, and weights from 0 to 1, by ARKit's names or by action units.

    Parameters
    ----------
    file
        A table or JSON of weights, as Live Link Face, MediaPipe, OpenFace and others write it.
    out
        CSV file to write to. Default: print it.
    """
    found, text = options.read(file), StringIO()
    header = ",".join(["time", *found.names])
    np.savetxt(text, np.column_stack([found.times, found.weights]), "%.6g", ",", header=header, comments="")
    if out is None:
        sys.stdout.write(text.getvalue())
        return
    write_whole(output_file(out, (".csv",)), text.getvalue())
