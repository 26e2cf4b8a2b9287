"""``facewrinkle pattern``: pictures and a movie of a pattern on a face or any other surface."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..errors import ParameterError, check_range, check_whole
from ..geometry.interpolation import smoothstep
from ..layers.patterns_on_skin.layer import PatternLayer
from ..motion.base import Still
from ..plotting import closeup, picture, side_by_side
from ..plotting.views import View, surface_view, whole_view
from ..simulation import Refinement, Simulation
from .options import FaceOptions, OutputOptions, Report, Vector, Whole, given, parse_mixture, parse_numbers
from .recorder import Clip, Recorder, Scenes


def pattern(
    name: str,
    /,
    *,
    source: FaceOptions = FaceOptions(),
    center: Vector = None,
    up: Vector = None,
    extent: str | None = None,
    depth: float | None = None,
    number: float | None = None,
    sharpness: float | None = None,
    style: str | None = None,
    variation: float | None = None,
    seed: Whole | None = None,
    valid_share: float | None = None,
    t: float | None = None,
    cycle: float | None = None,
    strength: float = 1.0,
    expression: str | None = None,
    frames: Whole = 60,
    max_level: Whole | None = None,
    output: OutputOptions = OutputOptions(),
) -> None:
    """Write pictures and a movie of a pattern.

    Parameters
    ----------
    name
        forehead, eye_corner, cheek, frown, dimple or eye_pouch; on a face also one side, such as dimple_l.
    center
        Center of the pattern on a mesh that is not a face, such as 10,0,45, in mesh units; name the mesh with --face.
    up
        Up direction of the pattern. Default: 0,1,0.
    extent
        Width and height of the pattern, such as 60,30: with --center in mesh units, otherwise in distances between the
        pupils. Default: typical for faces, or with --center a tenth of the mesh from corner to corner.
    depth
        Depth from bulge to furrow, mm. Default: typical for faces, in proportion to the extent.
    number
        Number of wrinkles.
    sharpness
        Sharpness of the furrows.
    style
        Style of forehead wrinkles: arcs, m or broken.
    variation
        How much the wrinkles differ from each other, from 0 (not at all) to 1.
    seed
        Random seed of the variation.
    valid_share
        Share of the vertices that carry the pattern, chosen at random, up to 1.
    t
        The paper's t, where it sets the phase of the pattern. Default: typical for faces.
    cycle
        Seconds in which t runs through one cycle, as in the paper's Fig. 1.
    strength
        Maximum strength of the pattern, 0 to 1.
    expression
        An expression, or a mixture such as AU6=0.7,AU12: the pattern deepens as the skin under it is compressed.
    frames
        Frames until the pattern is deepest; as many lead back.
    max_level
        How many times a triangle may be split; 0 turns refinement off. Default: what the pattern needs.
    """
    report, fps = Report(output.quiet), check_range("fps", output.fps, 1.0, 100.0)
    output.style(output.view or "front")  # refuses an unknown one
    check_whole("the number of frames", frames, 2, 1e6)
    check_range("strength", strength, 0.0, 1.0)
    options = given(
        depth=depth,
        number=number,
        sharpness=sharpness,
        style=style,
        variation=variation,
        seed=seed,
        valid_share=valid_share,
        t=t,
        size=parse_numbers("extent", extent, (1, 2)),
        up=parse_numbers("up", up, (3,)),
    )
    if cycle is not None:
        check_range("cycle", cycle, 1e-3, 1e6, "It is in seconds.")
        if t is not None:
            raise ParameterError("--t and --cycle exclude each other: leave one of them out.")
    if expression is None:
        options["strength"] = _swelling(strength, frames, fps)
    elif center is None:
        options["strength"] = "skin"
    face, layers = _placed(name, source, parse_numbers("center", center, (3,)), options, report)
    if cycle is not None:
        _run(layers, cycle)
    rates = {} if expression is None else face.atlas.contractions(parse_mixture(expression, face.atlas), strength)
    motion = Still(face, 1.0 / fps) if expression is None else None
    refinement = Refinement(max_level=max_level, coarsen=output.save_animation is None)
    with report.waiting("Preparing the skin"):
        simulation = Simulation(face, refinement, layers=layers, motion=motion)
    stem = f"pattern_{name}"
    clip = Clip(face, _there_and_back(simulation, rates, frames), (1.0 + np.arange(2 * frames + 1)) / fps, simulation)
    _record(clip, simulation, Recorder(output.folder(stem, source.label), stem, output, report))


def _swelling(strength: float, frames: int, fps: float) -> Callable[[float], float]:
    """Return a strength that rises over the frames and falls again."""

    def at(seconds: float) -> float:
        step = min(max(round(seconds * fps) - 1, 0), 2 * frames)
        return strength * float(smoothstep(1.0 - abs(step - frames) / frames))

    return at


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
    name: str, source: FaceOptions, center: tuple[float, ...] | None, options: dict[str, Any], report: Report
) -> tuple[Face, list[PatternLayer]]:
    """Return the face, and the layers: by landmarks, or about a center on any surface."""
    if center is None:
        face = source.load(report, "name the middle of the pattern: --center X,Y,Z.")
        return face, PatternLayer.presets(name, face, **options)
    return source.load_surface("center"), [PatternLayer(name, center, **options)]


def _run(layers: list[PatternLayer], seconds: float) -> None:
    """Let patterns run through their cycle."""
    for layer in layers:
        if not layer.patterns[0].timed:
            raise ParameterError(
                f"the t of {layer.name} follows from its strength, which comes and goes by itself: leave --cycle out."
            )
        layer.t = lambda now, shown=layer.patterns[0]: shown.cycled(now / seconds)


def _record(clip: Clip, simulation: Simulation, recorder: Recorder) -> None:
    """Play a clip, write its files, and print what came out."""
    face, output = clip.face, recorder.output
    front = output.style("front")
    near = _close(face, simulation.layers) if output.view is None and not face.landmarks else output.view
    if not face.landmarks:
        front = replace(front, view=whole_view(replace(front, view=near or "front")))
    highest: list[pv.PolyData] = []

    def watch(_: int, frame: pv.PolyData) -> None:
        if not highest or np.abs(frame["W"]).max() >= np.abs(highest[0]["W"]).max():
            highest[:] = [frame]

    with Scenes(face) as scenes:
        recorder.record(clip, lambda frame: scenes.begun(frame, front), watch)
        (top,) = highest
        recorder.save_mesh(top, face)
        close = replace(front, view=near or closeup(top, face))
        for suffix, style in recorder.report.progress((("", front), ("_closeup", close)), "Pictures", 2):
            images = [scenes.picture(frame, style) for frame in (face.mesh, top)]
            images.append(picture(top, face, replace(style, wireframe=True)))
            recorder.save_picture(side_by_side(images), suffix)
    facts = {"triangles": f"{face.mesh.n_cells} to {top.n_cells}"}
    if not face.landmarks:
        facts["unit of the mesh"] = f"{face.unit:g} mm"
    for name, height in (("highest", top["W"].max()), ("deepest", -top["W"].min())):
        facts[name] = f"{height:.2f} mm" + ("" if face.unit == 1.0 else f" ({height / face.unit:.3g} units)")
    recorder.tabulate(recorder.stem, facts)


def _close(face: Face, layers: list[Any]) -> View:
    """Return a view of a pattern on a surface that is no face."""
    laid = layers[0].laid(face)
    return surface_view(face, laid.center.point, laid.center.normal, 2.0 * float(laid.half.max()))
