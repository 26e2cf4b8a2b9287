"""``facewrinkle demo``: the paper's five expressions and its Table 1."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyvista as pv

from ..anatomy.fitting import default_face
from ..array_types import Image
from ..export import output_folder
from ..plotting import save_picture, side_by_side, stacked
from ..plotting.views import Style
from .express import Performance, record
from .options import OutputOptions
from .recorder import Scenes
from .report import Report
from .table1 import PAPER, tabulate

SIZE, FRAMES = 400, 24
"""Pixels of the pictures, and frames until an expression is held."""
TILE = 204
"""Pixels of a picture on the sheet of wrinkles and triangles."""
SHEET, SIDES = 400, ("front", "left_three_quarter", "left_profile")
"""Pixels and views of the pictures on the sheet of all sides."""
ITERATIONS, DRAWINGS = 250, 20
"""For Table 1."""


def demo(*, out: Path = Path("output"), quiet: bool = False) -> None:
    """Write pictures and movies of the paper's five expressions, and Table 1.

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
    output = OutputOptions()
    columns, rows = [], []
    with Scenes(face) as scenes:
        rows.append(_sides(face.mesh, scenes, "front"))
        for row in PAPER:
            performance = Performance(face, face.atlas.contractions(row.expression), FRAMES, size=(SIZE, SIZE))
            stem = row.expression
            peak = record(performance, folder / stem, stem, report, output, fields=False, scenes=scenes)
            with report.waiting("Drawing it for the contact sheets"):
                columns.append(stacked([_small(image) for image in (peak.front[2], *peak.closeup[2:])]))
                rows.append(_sides(peak.frame, scenes, peak.close))
    contact = save_picture(side_by_side(columns), folder / "contact.png", colours=256)
    sheet = save_picture(stacked(rows), folder / "contact_sheet.png", colours=256)
    report.say(f"\n{sheet}: the neutral face and the five expressions from three sides")
    report.say(f"\n{contact}: the five expressions, their wrinkles, and the triangles under them\n")
    tabulate(face, report, folder, ITERATIONS, DRAWINGS)
    report.say_time()


def _sides(frame: pv.PolyData, scenes: Scenes, close: str) -> Image:
    """Return a frame from the front and from the side on which the close-up is."""
    views = [view.replace("left", "right") if close.startswith("right") else view for view in SIDES]
    return side_by_side([scenes.picture(frame, Style((SHEET, SHEET), view)) for view in views])


def _small(image: Image) -> Image:
    from PIL import Image as Pillow

    return np.asarray(Pillow.fromarray(image).resize((TILE, TILE), Pillow.Resampling.LANCZOS))
