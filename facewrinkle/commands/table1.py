"""``facewrinkle table1``: the paper's Table 1, measured."""

from __future__ import annotations

import dataclasses
import json
import os
import platform
from pathlib import Path

from ..anatomy.face import Face
from ..errors import check_range
from ..export import output_folder
from ..mesh.files import replaced
from .common import FaceOptions, Report
from .timings import PAPER, SIZE, as_text, measure


def table1(
    *,
    source: FaceOptions | None = None,
    iterations: int = 250,
    drawings: int = 50,
    out: Path | None = None,
    quiet: bool = False,
) -> None:
    """Measure the paper's Table 1 and print it beside the paper's.

    Parameters
    ----------
    iterations
        Of each of the five expressions.
    drawings
        Of each expression; their time is extrapolated to all iterations.
    out
        Folder for table1.txt and table1.json. Default: they are not written.
    quiet
        Print nothing but errors.
    """
    report = Report(quiet)
    check_range("the number of iterations", iterations, 1, 1_000_000)
    check_range("the number of drawings", drawings, 1, 1_000_000)
    face = (source or FaceOptions()).load(report)
    tabulate(face, report, None if out is None else output_folder(out, make=False), iterations, drawings)


def tabulate(face: Face, report: Report, folder: Path | None, iterations: int, drawings: int) -> None:
    """Measure, print, and write into a folder."""
    rows = list(report.progress(measure(face, iterations, drawings), "Table 1", len(PAPER)))
    machine = f"{_processor()}, Python {platform.python_version()}"
    text = as_text(rows, iterations, machine)
    report.say(text)
    if folder is not None:
        content = {
            "machine": machine,
            "iterations": iterations,
            "drawings": drawings,
            "size": SIZE,
            "here": [dataclasses.asdict(row) for row in rows],
            "paper": [dataclasses.asdict(row) for row in PAPER],
        }
        for name, whole in (("table1.txt", text), ("table1.json", json.dumps(content, indent=2))):
            with replaced(folder / name) as file:
                file.write_text(whole + "\n", encoding="utf-8")


def _processor() -> str:
    """Number and kind of the processors."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        kind = next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        kind = platform.processor() or platform.machine()
    return f"{os.cpu_count()} x {kind}"
