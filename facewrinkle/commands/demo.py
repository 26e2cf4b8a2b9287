"""``facewrinkle demo``: the paper's five expressions and its Table 1."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..anatomy.fitting import default_face
from ..export import output_folder
from ..plotting import Image, picture, save_picture, side_by_side, stacked
from ..plotting.views import Style
from .common import OutputOptions, Report
from .express import record
from .recorder import Take
from .table1 import tabulate
from .timings import PAPER

SIZE, FRAMES, TILE = 400, 24, 204
ITERATIONS, DRAWINGS = 250, 20
SHEET, SIDES = 400, ("front", "left_three_quarter", "left_profile")


def demo(*, out: Path = Path("output"), quiet: bool = False) -> None:
    """The paper's five expressions with pictures and movies, then Table 1.

    Parameters
    ----------
    out
        Folder to write to.
    quiet
        Print nothing but errors.
    """
    begin = time.perf_counter()
    report = Report(quiet)
    folder = output_folder(out, make=False)
    face = default_face()
    output = OutputOptions(series=False)
    columns, rows = [], [_sides(face.mesh, face, "front")]
    for row in PAPER:
        take = Take(face, face.atlas.contractions(row.expression), FRAMES, size=(SIZE, SIZE))
        peak = record(take, folder / row.expression, row.expression, report, output, fields=False)
        styles = (Style(take.size), Style(take.size, take.close), Style(take.size, take.close, wireframe=True))
        with report.waiting("Drawing it for the contact sheets"):
            columns.append(stacked([_small(picture(peak, face, style)) for style in styles]))
            rows.append(_sides(peak, face, take.close))
    contact = save_picture(side_by_side(columns), folder / "contact.png", colours=256)
    sheet = save_picture(stacked(rows), folder / "contact_sheet.png", colours=256)
    report.say(f"\n{sheet}: the neutral face and the five expressions from three sides")
    report.say(f"\n{contact}: the five expressions, their wrinkles, and the triangles under them\n")
    tabulate(face, report, folder, ITERATIONS, DRAWINGS)
    report.say(f"\n{time.perf_counter() - begin:.0f} s")


def _sides(frame: pv.PolyData, face: Face, close: str) -> Image:
    """A frame from the front and from the side on which the close-up is."""
    views = [view.replace("left", "right") if close.startswith("right") else view for view in SIDES]
    return side_by_side([picture(frame, face, Style((SHEET, SHEET), view)) for view in views])


def _small(image: Image) -> Image:
    from PIL import Image as Pillow

    return np.asarray(Pillow.fromarray(image).resize((TILE, TILE), Pillow.Resampling.LANCZOS))
