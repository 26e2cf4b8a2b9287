"""``facewrinkle express``: pictures, a movie and a time series of an expression."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..export import output_folder
from ..layers.muscle_wrinkles import MuscleWrinkles
from ..plotting import save_picture, side_by_side
from ..simulation import Refinement
from .common import FaceOptions, OutputOptions, Report, mixture
from .recorder import Take


def express(
    name: str,
    /,
    *,
    source: FaceOptions | None = None,
    intensity: float = 1.0,
    frames: int = 100,
    max_level: int | None = None,
    gamma_c: float | None = None,
    samples: float | None = None,
    depth: float = 1.0,
    alpha: float | None = None,
    count: int | None = None,
    compression: Literal["gradient", "edges"] = "gradient",
    ends: Literal["continuous", "paper"] | None = None,
    output: OutputOptions | None = None,
) -> None:
    """Write pictures, a movie and a time series of an expression.

    Parameters
    ----------
    name
        An expression, action unit or muscle, or a mixture such as AU1=0.7,AU4. See `facewrinkle info`.
    intensity
        How strong, 0 to 1.
    frames
        Steps from the relaxed face to the held expression; half as many lead back.
    max_level
        How often triangles may be split; 0 turns refinement off.
    gamma_c
        Threshold of the split criterion (Eq. 19).
    samples
        Vertices that a half cycle of a wrinkle needs.
    depth
        Multiplies the depth of the wrinkles.
    alpha
        Sharpness of the furrows of the muscles that act.
    count
        Number of furrows of the muscles that act.
    compression
        How compression is measured.
    ends
        Wrinkles that fade in at both ends of their region, or the paper's own.
    """
    begin, output = time.perf_counter(), output or OutputOptions()
    report = Report(output.quiet)
    face = (source or FaceOptions()).load(report)
    rates = face.atlas.contractions(mixture(name, face.atlas), intensity)
    take = Take(
        face=_altered(face, rates, _given(alpha=alpha, count=count, ends=ends)),
        rates=rates,
        frames=frames,
        refinement=Refinement(**_given(max_level=max_level, gamma_c=gamma_c, samples=samples)),
        layer=MuscleWrinkles(compression, depth),
        size=output.pixels,
        view=output.view,
        fps=output.fps,
    )
    stem = re.sub(r"[^\w.=-]+", "_", name)[:100]  # the names of files must not become too long
    record(take, output.folder(stem), stem, report, output)
    report.say(f"{time.perf_counter() - begin:.1f} s")


def record(
    take: Take, folder: Path, stem: str, report: Report, output: OutputOptions, *, fields: bool = True
) -> pv.PolyData:
    """Play a take, write what belongs to it into a folder, say what came out, and return the frame at its height."""
    with report.waiting("Preparing the skin"):
        simulation = take.simulation()  # refuses what cannot be played before anything is written
    folder = output_folder(folder, make=False)
    peak, files = take.shoot(simulation, *output.files(folder / stem), report)
    files += output.mesh_of(peak, take.face, folder / stem)
    with report.waiting("Drawing"):
        bare = take.bare(simulation.motion)
        for suffix, view in (("", "front"), ("_closeup", take.close)):
            files.append(save_picture(side_by_side(take.panels(view, peak, bare)), folder / f"{stem}{suffix}.png"))
        if fields:
            files += [save_picture(image, folder / f"{stem}_{name}.png") for name, image in take.fields(peak)]
    height, acting = np.asarray(peak["W"]), np.asarray(peak["W"]) != 0.0
    seconds = sum(simulation.seconds.values()) - simulation.seconds["precompute"]
    report.table(
        stem,
        {
            "triangles": f"{take.face.mesh.n_cells} → {peak.n_cells}",
            "highest bulge": f"{height.max():.2f} mm",
            "deepest furrow": f"{-height.min():.2f} mm",
            "largest compression": f"{np.max(peak['epsilon'], where=acting, initial=0.0):.2f}",
            "simulation": f"{1000.0 * seconds / take.steps:.1f} ms a frame",
            "close-up": take.close,
            f"files in {folder}": "\n".join(sorted(path.name for path in files)),
        },
    )
    return peak


def _given(**options: Any) -> dict[str, Any]:
    """The options that were given."""
    return {name: value for name, value in options.items() if value is not None}


def _altered(face: Face, rates: dict[str, float], changes: dict[str, Any]) -> Face:
    """The face with other wrinkles over the muscles that act."""
    if not changes:
        return face
    return face.with_muscles({name: face.muscles[name].replaced(**changes) for name in rates})
