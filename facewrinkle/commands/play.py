"""``facewrinkle play``: a recorded animation with the wrinkles that its motion folds."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyvista as pv

from ..anatomy.fitting import fit_face
from ..errors import ParameterError, check_range, check_whole, warn
from ..export import output_folder
from ..layers.muscle_wrinkles import MuscleWrinkles
from ..motion.animation import read_animation
from ..plotting import closeup, picture, save_picture, side_by_side, stacked
from ..plotting.views import Style
from ..simulation import Refinement, Simulation
from .common import OutputOptions, Report, units_of
from .recorder import shot

LONGEST = 100_000
"""Steps; a clip of more is a mistake in its speed or in --fps."""

SMOOTH = 0.005
"""Wrinkles less deep than this are none, in mm."""


def play(
    file: Path,
    /,
    *,
    landmarks: Path | None = None,
    units: str | None = None,
    texture: Path | None = None,
    mesh: str | None = None,
    animation: str | None = None,
    speed: float = 1.0,
    max_level: int | None = None,
    depth: float = 1.0,
    moments: int = 5,
    follow: bool = False,
    output: OutputOptions | None = None,
) -> None:
    """Write pictures, a movie and a time series of a recorded animation.

    Parameters
    ----------
    file
        .glb, .gltf or USD with an animation of blend shapes, bones or points, or a .vtkhdf time series.
    landmarks
        JSON file with the coordinates of the landmarks of the face at rest.
    units
        Unit of the file: um, mm, cm, dm, m, in, or millimetres per unit. Default: from the distance between the eyes.
    texture
        Photo that lies on the face. Default: the image that the file holds.
    mesh
        Which mesh of the file.
    animation
        Which animation of the file. Default: the first that moves the mesh.
    speed
        Seconds of the animation in one second.
    max_level
        How often triangles may be split; 0 turns refinement off.
    depth
        Multiplies the depth of the wrinkles.
    moments
        Number of pictures at most, of the moments when wrinkles are deepest.
    follow
        Let the camera go with a head that turns.
    """
    begin, output = time.perf_counter(), output or OutputOptions()
    report = Report(output.quiet)
    count = check_whole("moments", moments, 1, 100)
    step = 1.0 / check_range("fps", output.fps, 1.0, 100.0)
    styles = [Style(output.pixels, view, follow=follow) for view in ("front", output.view or "cheeks")]
    rest, recorded = read_animation(file, mesh, animation)
    recorded = recorded.played(speed)
    face = fit_face(rest, landmarks, units_of(units), progress=report.search, texture=texture)
    with report.waiting("Preparing the skin"):
        layers = [MuscleWrinkles(depth=depth)]
        simulation = Simulation(face, Refinement(max_level=max_level), layers, step, motion=recorded)
    steps = max(int(np.ceil(recorded.duration / step - 1e-6)), 1)
    if steps > LONGEST:
        raise ParameterError(f"the clip would have {steps} steps, at most {LONGEST} are allowed. Raise --speed.")
    folder = output_folder(output.folder(file.stem), make=False)
    peaks: list[Peak] = []
    frames = report.progress(_watched(simulation, steps, count, peaks), "Frames", steps)
    times = (1 + np.arange(steps)) * step
    columns, files = [], shot(frames, times, face, styles, output.fps, *output.files(folder / file.stem))
    if max(map(_depth, peaks)) < SMOOTH:
        warn(
            f"{file.name} shows no wrinkles: its motion compresses the skin of the face nowhere. Clips of bodies often "
            "carry the head along as one piece; give one in which the face moves, with blend shapes or facial bones."
        )
    for _, when, frame in report.progress(iter(peaks), "Pictures", len(peaks)):
        close = Style(output.pixels, output.view or closeup(frame, face), follow=follow)
        pair = [picture(frame, face, style) for style in (styles[0], close)]
        files.append(save_picture(side_by_side(pair), folder / f"{file.stem}_{when:.2f}s.png"))
        files += output.mesh_of(frame, face, folder / f"{file.stem}_{when:.2f}s")
        columns.append(stacked(pair))
    files.append(save_picture(side_by_side(columns), folder / f"{file.stem}.png"))
    seconds = sum(simulation.seconds.values()) - simulation.seconds["precompute"]
    report.table(
        file.name,
        {
            "shapes": str(len(recorded.names)),
            "clip": f"{recorded.duration:.2f} s, {steps} steps",
            "triangles": f"{face.mesh.n_cells} → {max(frame.n_cells for *_, frame in peaks)}",
            "deepest at": ", ".join(f"{when:.2f} s ({relief:.2f} mm)" for relief, when, _ in peaks),
            "simulation": f"{1000.0 * seconds / steps:.1f} ms a frame",
            f"files in {folder}": "\n".join(sorted(path.name for path in files)),
        },
    )
    report.say(f"{time.perf_counter() - begin:.1f} s")


Peak = tuple[float, float, pv.PolyData]
"""From the deepest furrow to the highest bulge in mm, the time, and the frame."""


def _watched(simulation: Simulation, steps: int, count: int, peaks: list[Peak]) -> Iterator[pv.PolyData]:
    """The frames of a simulation; when they are through, `peaks` holds those where the wrinkles were deepest, in order:
    at most `count`, and one at least.
    """
    before, last, rising = -1.0, None, True
    for frame in simulation.run(steps):
        now = float(np.ptp(frame["W"]))
        if last is not None and rising and now < before:
            peaks.append(last)
        rising = now > before or (rising and now == before)
        before, last = now, (now, simulation.time, frame)
        peaks[:] = sorted(sorted(peaks, key=_depth)[-count:], key=_moment)
        yield frame
    if last is not None and (rising or not peaks):
        peaks.append(last)
    peaks[:] = sorted(sorted(peaks, key=_depth)[-count:], key=_moment)


def _depth(peak: Peak) -> float:
    return peak[0]


def _moment(peak: Peak) -> float:
    return peak[1]
