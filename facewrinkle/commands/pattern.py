"""``facewrinkle pattern``: pictures and a movie of a pattern on a face or any other surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..anatomy.fitting import surface
from ..errors import ParameterError, check_range, check_whole
from ..geometry.smoothstep import smoothstep
from ..layers.patterns_on_skin.layer import PatternLayer
from ..motion.base import Still
from ..plotting import closeup, picture, side_by_side
from ..plotting.views import Style, View
from ..simulation import Refinement, Simulation
from .options import FaceOptions, OutputOptions
from .parsing import Vector, Whole, WholeOrNone, parse_mixture, parse_numbers, parse_units
from .recorder import Clip, Recorder, Scenes
from .report import Report


def pattern(
    name: str,
    /,
    *,
    source: FaceOptions | None = None,
    centre: Vector = None,
    up: Vector = None,
    extent: str | None = None,
    depth: float | None = None,
    number: float | None = None,
    spacing: float | None = None,
    sharpness: float | None = None,
    style: str | None = None,
    variation: float | None = None,
    seed: WholeOrNone = None,
    strength: float = 1.0,
    expression: str | None = None,
    frames: Whole = 60,
    max_level: WholeOrNone = None,
    output: OutputOptions | None = None,
) -> None:
    """Write pictures and a movie of a pattern.

    Parameters
    ----------
    name
        forehead, eye_corner, cheek, frown, dimple or eye_pouch; on a face also one side, such as dimple_l.
    centre
        Middle of the pattern on a mesh that is no face, such as 10,0,45; name the mesh with --face.
    up
        Direction that is up for the pattern. Default: 0,1,0.
    extent
        Width and height of the pattern, such as 60,30: with --centre in the unit of the mesh, otherwise in distances
        between the pupils. Default: as on most faces, or with --centre a tenth of the mesh from corner to corner.
    depth
        Depth from bulge to furrow, mm. Default: as on most faces, in proportion to the extent.
    number
        Number of wrinkles.
    spacing
        Distance from wrinkle to wrinkle, mm, in place of --number.
    sharpness
        Sharpness of the furrows.
    style
        Style of forehead wrinkles: arcs, m or broken.
    variation
        How much the wrinkles differ from each other, 0 (all even) to 1.
    seed
        Seed of the variation: another number makes other wrinkles.
    strength
        How strong the pattern becomes, 0 to 1.
    expression
        An expression, or a mixture such as AU6=0.7,AU12: the more it compresses the skin, the deeper the pattern.
    frames
        Frames until the pattern is at its deepest; as many lead back.
    max_level
        How often a triangle may be split; 0 turns refinement off. Default: what the pattern needs.
    """
    output, source = output or OutputOptions(), source or FaceOptions()
    report, fps = Report(output.quiet), check_range("fps", output.fps, 1.0, 100.0)
    Style(output.pixels, output.view or "front")  # refuses an unknown one
    check_whole("the number of frames", frames, 2, 1e6)
    check_range("strength", strength, 0.0, 1.0)
    if number is not None and spacing is not None:
        raise ParameterError("--number and --spacing exclude each other: leave one of them out.")
    options: dict[str, Any] = {"depth": depth, "number": number, "spacing": spacing, "sharpness": sharpness}
    options |= {"style": style, "variation": variation, "seed": seed}
    options |= {"size": parse_numbers("extent", extent, (1, 2)), "up": parse_numbers("up", up, (3,))}
    options = {option: value for option, value in options.items() if value is not None}
    if expression is None:
        options["strength"] = _Swell(strength, frames, fps)
    elif centre is None:
        options["strength"] = "skin"
    face, layers = _placed(name, source, parse_numbers("centre", centre, (3,)), options, report)
    rates = {} if expression is None else face.atlas.contractions(parse_mixture(expression, face.atlas), strength)
    motion = Still(face, 1.0 / fps) if expression is None else None
    refinement = Refinement(max_level=max_level, coarsen=output.save_animation is None)
    with report.waiting("Preparing the skin"):
        simulation = Simulation(face, refinement, layers, motion=motion)
    stem = f"pattern_{name}"
    clip = Clip(face, _there_and_back(simulation, rates, frames), (1.0 + np.arange(2 * frames + 1)) / fps, simulation)
    _record(clip, simulation, Recorder(output.folder(stem, source.label), stem, output, report))


@dataclass(frozen=True)
class _Swell:
    """A strength that rises over the frames and falls again."""

    strength: float
    frames: int
    fps: float

    def __call__(self, seconds: float) -> float:
        step = min(max(round(seconds * self.fps) - 1, 0), 2 * self.frames)
        return self.strength * float(smoothstep(1.0 - abs(step - self.frames) / self.frames))


def _there_and_back(simulation: Simulation, rates: dict[str, float], frames: int) -> Iterator[pv.PolyData]:
    """Yield the frames of a pattern that comes out and goes: by itself, or with the muscles that contract."""
    if not rates:
        for _ in range(2 * frames + 1):
            yield simulation.step()
        return
    simulation.contract(rates)
    yield from simulation.run(frames)
    simulation.relax()
    yield from simulation.run(frames + 1, ramp=0.8)


def _placed(
    name: str, source: FaceOptions, centre: tuple[float, ...] | None, options: dict[str, Any], report: Report
) -> tuple[Face, list[PatternLayer]]:
    """Return the face, and the layers: by landmarks, or about a centre on any surface."""
    if centre is None:
        face = source.load(report)
        return face, PatternLayer.presets(name, face, **options)
    if source.face is None:
        raise ParameterError("--centre belongs to a mesh: name it with --face.")
    if source.landmarks is not None:
        raise ParameterError("--centre and --landmarks exclude each other: landmarks place the pattern by themselves.")
    face = surface(source.face, parse_units(source.units) or "mm", source.texture)
    return face, [PatternLayer(name, centre, **options)]


def _record(clip: Clip, simulation: Simulation, recorder: Recorder) -> None:
    """Play a clip, write its files, and print what came out."""
    face, output = clip.face, recorder.output
    front = Style(output.pixels)
    highest: list[pv.PolyData] = []

    def watch(_: int, frame: pv.PolyData) -> None:
        if not highest or np.abs(frame["W"]).max() >= np.abs(highest[0]["W"]).max():
            highest[:] = [frame]

    with Scenes(face) as scenes:
        recorder.record(clip, lambda frame: scenes.begun(frame, front), watch)
        (top,) = highest
        recorder.save_mesh(top, face)
        close = replace(front, view=_close(face, top, output.view, simulation.layers))
        for suffix, style in recorder.report.progress((("", front), ("_closeup", close)), "Pictures", 2):
            images = [scenes.picture(frame, style) for frame in (face.mesh, top)]
            images.append(picture(top, face, replace(style, wireframe=True)))
            recorder.save_picture(side_by_side(images), suffix)
    recorder.tabulate(
        recorder.stem,
        {
            "triangles": f"{face.mesh.n_cells} → {top.n_cells}",
            "highest": f"{top['W'].max():.2f} mm",
            "deepest": f"{-top['W'].min():.2f} mm",
        },
    )


def _close(face: Face, frame: pv.PolyData, view: str | None, layers: list[Any]) -> str | View:
    """Return the view that was asked for, or else one of the pattern."""
    if view is not None:
        return view
    if face.landmarks:
        return closeup(frame, face)
    normal = face.frame.axes @ layers[0].laid(face).centre.normal
    sideways = float(np.hypot(normal[0], normal[2]))
    return View((float(normal[0]), float(normal[1]), float(normal[2])) if sideways > 0.1 else (0.0, 0.8, 0.6))
