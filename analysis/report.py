"""Reports of analyses: sentences, tables, numbers and plots; printed, written into a folder, and shown on one page."""

from __future__ import annotations

import html
import json
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from cyclopts import App
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from rich.console import Console
from rich.table import Table as Printed

from facewrinkle.export import output_folder
from facewrinkle.plotting import save_picture

OUTPUT = Path("output/analysis")
COLORS = ("#1f5a85", "#c8553d", "#3a7d44", "#8a5aa8", "#c99700", "#5f6b76")
"""Colors of lines in plots, in their order."""

Cell = str | int | float


@dataclass
class Table:
    """Rows under named columns; the names hold the units."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]


@dataclass
class Plot:
    """A figure or a picture (h, w, 3), with one sentence on it."""

    name: str
    image: Figure | npt.NDArray[np.uint8]
    caption: str


@dataclass
class Report:
    """Measurements and findings of one analysis.

    Attributes
    ----------
    name, title : str
        Name of the files, and title of the section on the page.
    measured, found : str
        One sentence each.
    tables : list of Table
    plots : list of Plot
    numbers : dict
        Further numbers for the JSON file; tests and the gallery read these.
    """

    name: str
    title: str
    measured: str
    found: str
    tables: list[Table] = field(default_factory=list)
    plots: list[Plot] = field(default_factory=list)
    numbers: dict[str, Any] = field(default_factory=dict)


def publish(report: Report, out: Path = OUTPUT) -> None:
    """Print a report, write NAME.json and its plots into a folder, and rewrite the page of all reports there."""
    console = Console(highlight=False, soft_wrap=True)
    if not console.is_terminal:
        console.width = 200
    console.print(f"\n[bold]{report.title}[/bold]\n{report.measured}", markup=True)
    for table in report.tables:
        printed = Printed(title=table.title, title_justify="left", box=None, pad_edge=False)
        numeric = [all(not isinstance(row[k], str) for row in table.rows) for k in range(len(table.columns))]
        for name, right in zip(table.columns, numeric, strict=True):
            printed.add_column(name, justify="right" if right else "left", no_wrap=True)
        for row in table.rows:
            printed.add_row(*map(shown, row))
        console.print(printed)
    console.print(report.found)
    folder = output_folder(out)
    content = asdict(Report(**{**vars(report), "plots": []}))
    content["plots"] = [{"file": f"{report.name}_{p.name}.png", "caption": p.caption} for p in report.plots]
    text = json.dumps(content, indent=1, default=_plain)
    (folder / f"{report.name}.json").write_text(text + "\n", encoding="utf-8")
    for plot in report.plots:
        path = folder / f"{report.name}_{plot.name}.png"
        if isinstance(plot.image, Figure):
            plot.image.savefig(path, dpi=130)
        else:
            save_picture(plot.image, path)
    write_index(folder)


def write_index(folder: Path) -> Path:
    """Write the page of all reports in a folder: index.html."""
    reports = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))]
    parts = [_section(content) for content in reports if "measured" in content]
    links = " · ".join(f'<a href="#{c["name"]}">{html.escape(c["title"])}</a>' for c in reports if "measured" in c)
    page = PAGE.format(links=links, sections="\n".join(parts))
    path = folder / "index.html"
    path.write_text(page, encoding="utf-8")
    return path


def run(command: Callable[..., None]) -> None:
    """Run the command line of a module; ``--help`` prints the docstring of the command."""
    if sys.platform.startswith("linux"):  # otherwise VTK looks for a display first
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    app = App(help=command.__doc__)
    app.default(command)
    app()


def run_report(report: Callable[[bool], Report]) -> None:
    """Run the command line of an analysis that needs nothing but the package."""

    def command(*, out: Path = OUTPUT, quick: bool = False) -> None:
        """Print the tables of this analysis, and write them and its plots.

        Parameters
        ----------
        out
            Folder for the tables as JSON, the plots and the index page.
        quick
            Coarser meshes and fewer repetitions.
        """
        publish(report(quick), out)

    run(command)


def shown(value: Cell) -> str:
    """Return a value as it stands in a table.

    Examples
    --------
    >>> shown(0.123456), shown(12345), shown("x"), shown(float("nan"))
    ('0.123', '12,345', 'x', '')
    """
    if isinstance(value, str):
        return value
    if isinstance(value, int | np.integer):
        return f"{value:,}"
    if np.isnan(value):
        return ""
    return f"{value:.0f}" if 1000.0 <= abs(value) < 1e6 else f"{value:.3g}"


def plot(rows: int = 1, columns: int = 1, size: tuple[float, float] = (10.0, 3.6)) -> tuple[Figure, list[Any]]:
    """Return a figure with its axes in reading order; size in inches."""
    figure = Figure(figsize=size, layout="constrained")
    axes = list(np.ravel(figure.subplots(rows, columns)))
    for ax in axes:
        ax.grid(True, color="#dddddd", linewidth=0.6)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8)
    return figure, axes


def log_scales(ax: Any) -> None:
    """Make both axes logarithmic, a short one with plain numbers at 1, 2 and 5 times the powers of ten."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis, (low, high) in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        short = high < 60.0 * low
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if short else (1.0,)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}" if value >= 1.0 else f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())


def order(sizes: npt.ArrayLike, errors: npt.ArrayLike) -> float:
    """Return the exponent p of ``error = c size^p`` that fits best (least squares of the logarithms).

    Examples
    --------
    >>> round(order([1.0, 2.0, 4.0], [3.0, 12.0, 48.0]), 9)
    2.0
    """
    return float(np.polyfit(np.log(np.asarray(sizes)), np.log(np.asarray(errors)), 1)[0])


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays in a form that JSON can hold."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else str(value)


def _section(content: dict[str, Any]) -> str:
    def cells(tag: str, values: Sequence[Cell]) -> str:
        return "".join(
            f"<{tag}{'' if isinstance(v, str) else ' class=n'}>{html.escape(shown(v))}</{tag}>" for v in values
        )

    tables = "".join(
        f"<table><caption>{html.escape(t['title'])}</caption><tr>{cells('th', t['columns'])}</tr>"
        + "".join(f"<tr>{cells('td', row)}</tr>" for row in t["rows"])
        + "</table>"
        for t in content["tables"]
    )
    plots = "".join(
        f'<figure><img src="{p["file"]}" alt="{html.escape(p["caption"])}">'
        f"<figcaption>{html.escape(p['caption'])}</figcaption></figure>"
        for p in content["plots"]
    )
    text = "".join(f"<p><b>{k}:</b> {html.escape(content[k.lower()])}</p>" for k in ("Measured", "Found"))
    return (
        f'<section id="{content["name"]}"><h2>{html.escape(content["title"])}</h2>{text}{plots}{tables}'
        f'<p><a href="{content["name"]}.json">{content["name"]}.json</a></p></section>'
    )


PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>facewrinkle: analysis</title><style>
body {{ font: 15px/1.5 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; color: #222 }}
h2 {{ border-bottom: 1px solid #ccc; margin-top: 2.5em }} img {{ max-width: 100% }} figure {{ margin: 1.5em 0 }}
figcaption, caption {{ color: #555; text-align: left }} caption {{ padding: .5em 0; font-weight: 600 }}
table {{ border-collapse: collapse; margin: 1em 0; font-size: 13px; display: block; overflow-x: auto }}
th, td {{ padding: .15em .8em .15em 0; border-bottom: 1px solid #eee; text-align: left; white-space: nowrap }}
td.n {{ text-align: right; font-variant-numeric: tabular-nums }}
</style></head><body><h1>facewrinkle: analysis</h1>
<p>Made by <code>make analysis</code>, or one by one by <code>python -m analysis.NAME</code>.</p><p>{links}</p>
{sections}
</body></html>
"""
