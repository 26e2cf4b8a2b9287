"""``facewrinkle demo``: the paper's five expressions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyvista as pv

from ..anatomy.fitting import default_face
from ..array_types import Image
from ..export import output_folder
from ..plotting import save_picture, side_by_side, stacked
from ..plotting.views import Style
from ..simulation.fold_layers import Folds, refinement_for
from .express import Peak, Performance, record
from .options import FoldOptions, OutputOptions, Report
from .recorder import Scenes

EXPRESSIONS = ("surprise", "frowning", "closing_eye", "stretching_mouth", "fear")

SIZE, FRAMES = 400, 24
"""Pixels of the pictures, and frames until an expression is held."""
TILE = 204
"""Pixels of a picture on the sheet of wrinkles and triangles."""
SHEET, SIDES = 400, ("front", "left_three_quarter", "left_profile")
"""Pixels and views of the pictures on the sheet of all sides."""
SHOWN: dict[Folds, str] = {"printed": "the paper's, as printed", "wave": "waves, which are beyond the paper"}
"""The folds that are drawn."""


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
    for folds, meaning in SHOWN.items():
        report.say(f"\nFolds {folds!r}: {meaning}\n")
        options = FoldOptions(folds)
        with Scenes(options.face(face)) as scenes:
            peaks = [perform(name, options, scenes, folder / folds, report) for name in EXPRESSIONS]
            sheet = save_picture(side_by_side([column(peak) for peak in peaks]), folder / f"{folds}.png", colors=256)
            report.say(f"\n{sheet}: the five expressions, their wrinkles, and the triangles under them")
            if folds == "wave":
                rows = [_sides(face.mesh, scenes, "front"), *(_sides(peak.frame, scenes, peak.close) for peak in peaks)]
                sheet = save_picture(stacked(rows), folder / "contact_sheet.png", colors=256)
                report.say(f"\n{sheet}: the neutral face and the five expressions from three sides")
    report.say_time()


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
        options.layers(face, FRAMES),
        options,
        (SIZE, SIZE),
    )
    output = OutputOptions(movie=movie)
    return record(performance, folder / expression, expression, report, output, fields=False, scenes=scenes)


def column(peak: Peak) -> Image:
    """Return an expression on the sheet: from the front, its wrinkles, and the triangles under them."""
    return stacked([_small(image) for image in (peak.front[2], *peak.closeup[2:])])


def _sides(frame: pv.PolyData, scenes: Scenes, close: str) -> Image:
    """Return a frame from the front and from the side on which the close-up is."""
    views = [view.replace("left", "right") if close.startswith("right") else view for view in SIDES]
    return side_by_side([scenes.picture(frame, Style((SHEET, SHEET), view)) for view in views])


def _small(image: Image) -> Image:
    from PIL import Image as Pillow

    return np.asarray(Pillow.fromarray(image).resize((TILE, TILE), Pillow.Resampling.LANCZOS))
