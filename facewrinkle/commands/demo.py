"""``facewrinkle demo``: the paper's five expressions and its Table 1."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from ..anatomy.fitting import default_face
from ..export import output_folder
from ..plotting import Image, Style, picture, save_picture, side_by_side, stacked
from ..table1 import PAPER
from .common import Report
from .express import record
from .table1 import tabulate
from .take import Take

SIZE, FRAMES, TILE = 400, 24, 204
ITERATIONS, DRAWINGS = 250, 20


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
    folder = output_folder(out)
    face = default_face()
    columns = []
    for row in PAPER:
        take = Take(face, face.atlas.contractions(row.expression), FRAMES, size=(SIZE, SIZE))
        peak = record(take, folder / row.expression, row.expression, report, series=False, fields=False)
        styles = (Style(take.size), Style(take.size, take.close), Style(take.size, take.close, wireframe=True))
        columns.append(stacked([_small(picture(peak, face, style)) for style in styles]))
    contact = save_picture(side_by_side(columns), folder / "contact.png", colours=256)
    report.say(f"\n{contact}: the five expressions, their wrinkles, and the triangles under them\n")
    tabulate(face, report, folder, ITERATIONS, DRAWINGS)
    report.say(f"\n{time.perf_counter() - begin:.0f} s")


def _small(image: Image) -> Image:
    from PIL import Image as Pillow

    return np.asarray(Pillow.fromarray(image).resize((TILE, TILE), Pillow.Resampling.LANCZOS))
