"""``facewrinkle pattern``: pictures, a movie and a time series of a pattern on a face or any other surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..anatomy.fitting import surface
from ..errors import ParameterError, check_range, check_whole
from ..export import output_folder
from ..geometry.smoothstep import smoothstep
from ..layers.patterns_on_skin.layer import PatternLayer
from ..motion.base import Still
from ..plotting import closeup, picture, save_picture, side_by_side
from ..plotting.views import Style, View
from ..simulation import Refinement, Simulation
from .common import FaceOptions, OutputOptions, Report, mixture, units_of
from .recorder import shot


def pattern(
    name: str,
    /,
    *,
    source: FaceOptions | None = None,
    centre: str | None = None,
    up: str | None = None,
    extent: str | None = None,
    depth: float | None = None,
    number: float | None = None,
    spacing: float | None = None,
    sharpness: float | None = None,
    style: str | None = None,
    variation: float | None = None,
    seed: int | None = None,
    strength: float = 1.0,
    expression: str | None = None,
    frames: int = 60,
    max_level: int | None = None,
    output: OutputOptions | None = None,
) -> None:
    """Write pictures, a movie and a time series of a pattern.

    Parameters
    ----------
    name
        forehead, eye_corner, cheek, frown, dimple or eye_pouch; on a face also one side of it, such as dimple_l.
    centre
        Middle of the pattern on any surface, such as 10,0,45: where --face has no landmarks.
    up
        Direction that is up in the pattern. Default: 0,1,0.
    extent
        Width and height of the pattern, such as 60,30: in the unit of the mesh with --centre, else in distances between
        the pupils.
    depth
        From bulge to furrow, mm.
    number
        How many wrinkles.
    spacing
        From wrinkle to wrinkle, mm, in place of their number.
    sharpness
        Of the furrows.
    style
        Of forehead wrinkles: arcs, m or broken.
    variation
        How much the wrinkles differ from each other, 0 (all even) to 1.
    seed
        Of the variation: other wrinkles for each.
    strength
        How strong the pattern becomes, 0 to 1.
    expression
        An expression that brings the pattern out as it compresses the skin, or a mixture such as AU6=0.7,AU12.
    frames
        Frames until the pattern is out; as many lead back.
    max_level
        How often triangles may be split. Default: as often as the pattern needs.
    """
    output = output or OutputOptions()
    report, fps = Report(output.quiet), check_range("fps", output.fps, 1.0, 100.0)
    Style(output.pixels, output.view or "front")  # refuses an unknown one
    check_whole("the number of frames", frames, 2, 1e6)
    check_range("strength", strength, 0.0, 1.0)
    if number is not None and spacing is not None:
        raise ParameterError("--number and --spacing exclude each other: leave one of them out.")
    words: dict[str, Any] = {"depth": depth, "number": number, "spacing": spacing, "sharpness": sharpness}
    words |= {"style": style, "variation": variation, "seed": seed}
    words |= {"size": _numbers("extent", extent, (1, 2)), "up": _numbers("up", up, (3,))}
    words = {word: value for word, value in words.items() if value is not None}
    if expression is None:
        words["strength"] = _Rise(strength, frames, fps)
    elif centre is None:
        words["strength"] = "skin"
    face, layers = _placed(name, source or FaceOptions(), _numbers("centre", centre, (3,)), words, report)
    rates = {} if expression is None else face.atlas.contractions(mixture(expression, face.atlas), strength)
    motion = Still(face, 1.0 / fps) if expression is None else None
    refinement = Refinement() if max_level is None else Refinement(max_level=max_level)
    with report.waiting("Preparing the skin"):
        show = _Show(Simulation(face, refinement, layers, motion=motion), rates, frames, fps)
    stem = f"pattern_{name}"
    _record(show, output_folder(output.folder(stem), make=False), stem, report, output)


@dataclass(frozen=True)
class _Rise:
    """A strength that rises over the frames and falls again."""

    strength: float
    frames: int
    fps: float

    def __call__(self, seconds: float) -> float:
        step = min(max(round(seconds * self.fps) - 1, 0), 2 * self.frames)
        return self.strength * float(smoothstep(1.0 - abs(step - self.frames) / self.frames))


@dataclass(frozen=True, eq=False)
class _Show:
    """What is played."""

    simulation: Simulation
    rates: dict[str, float]
    frames: int
    fps: float

    def play(self) -> Iterator[pv.PolyData]:
        """There and back."""
        self.simulation.reset()
        if not self.rates:
            for _ in range(2 * self.frames + 1):
                yield self.simulation.step()
            return
        self.simulation.contract(self.rates)
        yield from self.simulation.run(self.frames)
        self.simulation.relax()
        yield from self.simulation.run(self.frames + 1, ramp=0.8)

    def times(self) -> np.ndarray:
        """Seconds of the frames."""
        return (1.0 + np.arange(2 * self.frames + 1)) / self.fps


def _placed(
    name: str, source: FaceOptions, centre: tuple[float, ...] | None, words: dict[str, Any], report: Report
) -> tuple[Face, list[PatternLayer]]:
    """The face and the layers: by landmarks, or about a centre on any surface."""
    if centre is None:
        face = source.load(report)
        return face, PatternLayer.presets(name, face, **words)
    if source.face is None:
        raise ParameterError("--centre belongs to a mesh: name it with --face.")
    if source.landmarks is not None:
        raise ParameterError("--centre and --landmarks exclude each other: landmarks place the pattern by themselves.")
    face = surface(source.face, units_of(source.units) or "mm", source.texture)
    if "size" not in words:
        raise ParameterError("--centre needs --extent: width and height of the pattern in the unit of the mesh.")
    return face, [PatternLayer(name, centre, **words)]


def _numbers(name: str, text: str | None, counts: tuple[int, ...]) -> tuple[float, ...] | None:
    """Numbers from "1,2,3"."""
    if text is None:
        return None
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in counts:
        raise ParameterError(f"--{name} must be {counts[-1]} numbers with commas between, received {text!r}.")
    return numbers * 2 if counts == (1, 2) and len(numbers) == 1 else numbers


def _record(show: _Show, folder: Path, stem: str, report: Report, output: OutputOptions) -> None:
    """Play, write what belongs to it, and say what came out."""
    face, style = show.simulation.face, Style(output.pixels)
    peak: list[pv.PolyData] = []

    def played() -> Iterator[pv.PolyData]:
        for frame in report.progress(show.play(), "Frames", 2 * show.frames + 1):
            if not peak or np.abs(frame["W"]).max() >= np.abs(peak[0]["W"]).max():
                peak[:] = [frame]
            yield frame

    files = shot(played(), show.times(), face, [style], show.fps, *output.files(folder / stem))
    top = peak[0]
    files += output.mesh_of(top, face, folder / stem)
    views = [("", "front"), ("_closeup", _close(face, top, output.view, show.simulation.layers))]
    for suffix, where in report.progress(iter(views), "Pictures", len(views)):
        shots = [picture(frame, face, Style(style.size, where)) for frame in (face.mesh, top)]
        shots.append(picture(top, face, Style(style.size, where, wireframe=True)))
        files.append(save_picture(side_by_side(shots), folder / f"{stem}{suffix}.png"))
    report.table(
        stem,
        {
            "triangles": f"{face.mesh.n_cells} → {top.n_cells}",
            "highest": f"{top['W'].max():.2f} mm",
            "deepest": f"{-top['W'].min():.2f} mm",
            f"files in {folder}": "\n".join(sorted(path.name for path in files)),
        },
    )


def _close(face: Face, frame: pv.PolyData, view: str | None, layers: list[Any]) -> str | View:
    """The view that was asked for, or one of where the pattern is."""
    if view is not None:
        return view
    if face.landmarks:
        return closeup(frame, face)
    normal = face.frame.axes @ layers[0].laid(face).centre.normal
    sideways = float(np.hypot(normal[0], normal[2]))
    return View((float(normal[0]), float(normal[1]), float(normal[2])) if sideways > 0.1 else (0.0, 0.8, 0.6))
