"""What the benchmarks share: a reference timed in turns with the candidate, and the goals in the summary of the run.

Nothing here fails on a slow machine: what is asserted is that both compute the same. Times are compared within one
run only, in turns, so that whatever else the machine does slows both. The table goes to docs/benchmarks.csv, too, with
the date of each row; those that a run does not make stay. `make bench` makes all of them anew.
"""

from __future__ import annotations

import csv
import datetime
import os
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass

import pytest
import pyvista as pv

import facewrinkle as fw


@dataclass(frozen=True)
class Result:
    """One line of the summary: seconds, what was made of them, what was hoped for."""

    what: str
    ours: float
    reference: float | None
    value: str
    goal: str = ""
    met: bool | None = None


class Results(list[Result]):
    """Lines of the table that ends the run."""

    def record(self, *line):
        self.append(Result(*line))


RESULTS = pytest.StashKey[Results]()
NOTES = pytest.StashKey[dict[str, str]]()


def pytest_configure(config):
    config.stash[RESULTS], config.stash[NOTES] = Results(), {}


@pytest.fixture
def results(request):
    """The table that ends the run; its lines are those of `Result`."""
    return request.config.stash[RESULTS]


@pytest.fixture
def notes(request):
    """Remarks below it, by what they are about."""
    return request.config.stash[NOTES]


def pytest_generate_tests(metafunc):
    """Every test of two functions runs twice, so that each has a row in its group; where nothing is timed, once."""
    if "versus" in metafunc.fixturenames:
        timed = not metafunc.config.getoption("benchmark_disable")
        metafunc.parametrize("versus", ["facewrinkle", "reference"] if timed else ["facewrinkle"], indirect=True)


@pytest.fixture
def versus(request, benchmark, results):
    """Times two functions in turns.

    ``versus(what, ours, reference, goal=4.0)`` asks that `ours` be that many times faster than `reference`. The ratio
    is that of the medians, or of the means where rounds are not alike (``average=statistics.fmean``).
    """

    def versus(what, ours, reference, goal=None, rounds=20, warmup_rounds=1, average=statistics.median):
        first, second = (ours, reference) if request.param == "facewrinkle" else (reference, ours)
        seconds = []

        def before():
            begin = time.perf_counter()
            second()
            seconds.append(time.perf_counter() - begin)

        benchmark.group = what
        benchmark.pedantic(first, setup=before, rounds=rounds, warmup_rounds=warmup_rounds)
        if benchmark.disabled or request.param == "reference":
            return
        mine, other = benchmark.stats.stats.data, seconds[warmup_rounds:]
        ratio, best = average(other) / average(mine), min(other) / min(mine)
        benchmark.extra_info.update(times_faster=ratio, times_faster_at_best=best, goal=goal)
        results.record(
            what,
            average(mine),
            average(other),
            f"{ratio:.2f}x as fast (minima {best:.2f}x)",
            f">= {goal:.3g}x" if goal else "",
            ratio >= goal if goal else None,
        )

    return versus


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """Environment of a new interpreter that finds modules compiled to bytecode, as pip leaves them."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment["PYTHONPYCACHEPREFIX"] = str(tmp_path_factory.mktemp("bytecode"))
    code = "import facewrinkle.commands.express, pyvista; pyvista.Plotter"
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
    return environment


@pytest.hookimpl(trylast=True)
def pytest_terminal_summary(terminalreporter, config):
    lines = config.stash[RESULTS]
    if not lines:
        return
    terminalreporter.section("goals")
    wide = max(len(line.what) for line in lines)
    for line in lines:
        reference = "" if line.reference is None else f"{1e3 * line.reference:10.2f} ms"
        met = {True: "met", False: "NOT MET", None: ""}[line.met]
        seconds = f"{1e3 * line.ours:10.2f} ms {reference:13}"
        terminalreporter.write_line(f"{line.what:{wide}} {seconds}  {line.value:34} {line.goal:9} {met}".rstrip())
    _write(lines, config.rootpath / "docs" / "benchmarks.csv")
    for what, note in config.stash[NOTES].items():
        terminalreporter.write_line(f"{what}: {note}")
    load = ", ".join(f"{x:.2f}" for x in os.getloadavg()) if hasattr(os, "getloadavg") else "unknown"
    terminalreporter.write_line(f"{os.cpu_count()} cores, load over 1, 5 and 15 minutes: {load}")


def _milliseconds(seconds):
    return "" if seconds is None else f"{1e3 * seconds:.{0 if seconds >= 0.1 else 2}f}"


def _write(lines, path):
    """Write the table for the site: rows that were made now in place of those of the same name."""
    rows, today = {}, datetime.date.today().isoformat()
    if path.exists():
        with path.open(newline="", encoding="utf-8") as file:
            rows = {row[0]: row for row in list(csv.reader(file))[1:]}
    for line in lines:
        met = {True: "met", False: "missed", None: ""}[line.met]
        times = map(_milliseconds, (line.ours, line.reference))
        rows[line.what] = (line.what, *times, line.value, line.goal, met, today)
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([("what", "ms", "beside it", "result", "goal", "", "date"), *rows.values()])


@pytest.fixture(scope="module")
def draw():
    """Draws a frame, and returns when it is drawn."""
    plotter = pv.Plotter(off_screen=True, window_size=(800, 800), lighting=None)
    plotter.disable_anti_aliasing()
    plotter.add_light(pv.Light(light_type="headlight"))
    mesh = fw.default_face().mesh.compute_normals(split_vertices=False)
    mapper = plotter.add_mesh(mesh, color="#d8a890", smooth_shading=True).mapper
    plotter.view_xy()
    plotter.camera.zoom(1.3)
    plotter.show(auto_close=False)

    def draw(frame):
        mapper.dataset = frame
        plotter.render()
        plotter.render_window.WaitForCompletion()

    yield draw
    plotter.close()
