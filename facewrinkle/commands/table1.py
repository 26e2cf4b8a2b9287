"""``facewrinkle table1``: the costs of all parts of the loop, beside those in Table 1 of Zhang, Sim and Tan."""

from __future__ import annotations

import dataclasses
import json
import os
import platform
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pyvista as pv

from ..anatomy.face import Face
from ..errors import check_range
from ..files import output_folder, write_whole
from ..plotting import Scene
from ..plotting.views import Style
from ..simulation import Simulation
from ..simulation.fold_layers import Folds, refinement_for
from .options import FaceOptions, Report, Whole

SIZE = (800, 800)
"""Pixels of a picture whose drawing is timed."""


@dataclass(frozen=True)
class Row:
    """One expression of the table; seconds for all iterations.

    Attributes
    ----------
    expression : str
    before, after : int
        Triangles.
    Tp, Te, Ta, Tw, Tr : float
        Precomputation, skin, refinement, wrinkles, drawing.
    fps : float
        Iterations per second, without the precomputation.

    Examples
    --------
    The paper's mesh becomes finer with the first of its expressions:

    >>> surprise = PAPER[0]
    >>> surprise.expression, round(surprise.after / surprise.before, 2)
    ('surprise', 1.83)
    """

    expression: str
    before: int
    after: int
    Tp: float
    Te: float
    Ta: float
    Tw: float
    Tr: float
    fps: float


PAPER = (
    Row("surprise", 4517, 8245, 1.86, 6.17, 0.53, 0.65, 5.08, 18.5),
    Row("frowning", 4517, 5847, 0.54, 4.34, 0.20, 0.34, 3.94, 29.6),
    Row("closing_eye", 4517, 5395, 0.38, 3.25, 0.14, 0.26, 3.73, 33.5),
    Row("stretching_mouth", 4517, 6328, 0.96, 3.73, 0.28, 0.41, 4.19, 28.2),
    Row("fear", 4517, 7453, 1.37, 5.32, 0.41, 0.52, 4.62, 23.5),
)
"""As printed: a Pentium 4 of 2.8 GHz, about 250 iterations of each expression."""


def table1(
    *,
    source: FaceOptions | None = None,
    folds: Folds = "printed",
    iterations: Whole = 250,
    drawings: Whole = 50,
    out: Path | None = None,
    quiet: bool = False,
) -> None:
    """Measure Table 1 of the paper, and print both side by side.

    Parameters
    ----------
    folds
        printed: the paper's muscles and wrinkles, split by Eq. 19 alone. paper: by its formula, mended where it fails,
        and split where vertices are too few for a wrinkle, too. wave: waves, split there alone.
    iterations
        Time steps of each of the five expressions.
    drawings
        Pictures drawn of each expression; their time is extrapolated to all iterations.
    out
        Folder for table1.txt and table1.json. Default: they are not written.
    quiet
        Print only errors.
    """
    report = Report(quiet)
    face = (source or FaceOptions()).load(report)
    tabulate(face, report, None if out is None else output_folder(out, make=False), iterations, drawings, folds)


def tabulate(
    face: Face, report: Report, folder: Path | None, iterations: int, drawings: int, folds: Folds = "printed"
) -> None:
    """Measure the table, print it, and write it into a folder."""
    rows = list(report.progress(measure(face, iterations, drawings, folds), "Table 1", len(PAPER)))
    machine = f"{_processors()}, Python {platform.python_version()}"
    text = as_text(rows, iterations, machine, folds)
    report.say(text)
    if folder is not None:
        content = {
            "machine": machine,
            "iterations": iterations,
            "folds": folds,
            "criterion": criterion(folds),
            "drawings": drawings,
            "size": SIZE,
            "here": [dataclasses.asdict(row) for row in rows],
            "paper": [dataclasses.asdict(row) for row in PAPER],
        }
        for name, whole in (("table1.txt", text), ("table1.json", json.dumps(content, indent=2))):
            write_whole(folder / name, whole + "\n")


def _processors() -> str:
    """Return number and kind of the processors."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        kind = next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        kind = platform.processor() or platform.machine()
    return f"{os.cpu_count()} x {kind}"


def measure(face: Face, iterations: int = 250, drawings: int = 50, folds: Folds = "printed") -> Iterator[Row]:
    """Play the paper's five expressions on a face, and time all parts of the loop.

    A short run comes first, so that no compilation is timed. Assembling frames counts as time for wrinkles (Tw).
    Drawing is timed off screen at `SIZE`, without anti-aliasing and with one light, on every
    (iterations / drawings)-th frame, and extrapolated to all.

    Parameters
    ----------
    face : Face
    iterations : int
    drawings : int
    folds : {"printed", "paper", "wave"}

    Yields
    ------
    Row

    Examples
    --------
    >>> import facewrinkle as fw
    >>> row = next(measure(fw.default_face(), iterations=4, drawings=2))
    >>> row.expression, row.before
    ('surprise', 4517)
    """
    check_range("iterations", iterations, 1, 1_000_000)
    check_range("drawings", drawings, 1, 1_000_000)
    _measured(face, PAPER[0].expression, min(iterations, 12), 1, folds)
    for paper in PAPER:
        yield _measured(face, paper.expression, iterations, min(drawings, iterations), folds)


def _measured(face: Face, expression: str, iterations: int, drawings: int, folds: Folds) -> Row:
    simulation = Simulation(face, folds=folds)
    simulation.express(expression)
    every, drawn, drawing = iterations // drawings, 0, 0.0
    frame: pv.PolyData
    with Scene(face, Style(SIZE, quick=True)) as scene:
        scene.picture(face.mesh)  # opens the window; until then, nothing is rendered
        for number, frame in enumerate(simulation.run(iterations)):
            if number % every == 0:
                begin = time.perf_counter()
                scene.draw(frame)
                drawing += time.perf_counter() - begin
                drawn += 1
    spent = simulation.seconds
    skin, refinement, wrinkles = spent["skin"], spent["refinement"], spent["wrinkles"] + spent["frame"]
    drawing *= iterations / drawn
    total = skin + refinement + wrinkles + drawing
    return Row(
        expression, face.mesh.n_cells, frame.n_cells, spent["precompute"], skin, refinement, wrinkles, drawing,
        iterations / total,
    )  # fmt: skip


def criterion(folds: Folds) -> str:
    """Say by which criterion triangles are split.

    Examples
    --------
    >>> criterion("printed")
    'Eq. 19 alone, gamma_c = 0.01'
    >>> criterion("wave")
    'fewer than 4 vertices per half wavelength'
    """
    settings = refinement_for(folds)
    samples = f"fewer than {settings.samples:g} vertices per half wavelength"
    if settings.gamma_c is None:
        return samples
    return f"Eq. 19 {f'or {samples}' if settings.samples else 'alone'}, gamma_c = {settings.gamma_c:g}"


def as_text(rows: list[Row], iterations: int, machine: str, folds: Folds = "printed") -> str:
    """Return the paper's table with the measured one beside it, and a note on how it was measured.

    Examples
    --------
    >>> as_text(list(PAPER), 250, "a Pentium 4").splitlines()[2].split()[:7]
    ['surprise', '4517', '->', '8245', '4517', '->', '8245']
    """
    paper = {row.expression: row for row in PAPER}
    lines = [
        f"{'':16}  {'triangles':>31}  {'Tp':>10}  {'Te':>10} {'Ta':>10} {'Tw':>10} {'Tr':>10}  {'fps':>11}",
        f"{'':16}  {'paper':>14}  {'here':>14} {'  paper here' * 2}{' paper here' * 3}  {'paper':>5} {'here':>5}",
    ]
    for row in rows:
        then = paper[row.expression]
        pairs = [(getattr(then, name), getattr(row, name)) for name in ("Tp", "Te", "Ta", "Tw", "Tr")]
        triangles = "  ".join(f"{r.before:5} -> {r.after:5}" for r in (then, row))
        seconds = "".join(f"{'  ' if k < 2 else ' '}{a:5.2f} {b:4.2f}" for k, (a, b) in enumerate(pairs))
        lines.append(f"{row.expression:16}  {triangles} {seconds}  {then.fps:5.1f} {row.fps:5.1f}")
    lines += [
        "",
        f"Triangles here: folds {folds!r}, split by {criterion(folds)}.",
        f"Seconds for {iterations} iterations; here on {machine}; in the paper for about 250 on a P4 of 2.8 GHz.",
        "Tp precomputation, Te skin, Ta refinement, Tw wrinkles and frames, Tr drawing; fps leaves out Tp.",
        f"Tr here: off screen at {SIZE[0]} x {SIZE[1]} pixels; some frames, extrapolated.",
    ]
    return "\n".join(lines)
