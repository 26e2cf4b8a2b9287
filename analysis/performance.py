"""Cost of a frame: Table 1 compared with the paper's; the cost of a frame, and of the forest, by the size of the mesh.

``python -m analysis.performance``. Times by size are minima of a few repetitions (for the skin, CPU times), so that
other work on the machine matters less.
"""

from __future__ import annotations

import dataclasses
import os
import time
import tracemalloc
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.geometry.interpolation import interpolated
from facewrinkle.geometry.refinement import RedGreenForest
from facewrinkle.mesh import to_polydata
from facewrinkle.plotting import Scene, Style

from .report import COLORS, Plot, Report, Table, log_scales, order, plot, run_report
from .surfaces import Given, rates_of, settled, uniform


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


def measure(face: fw.Face, iterations: int = 250, drawings: int = 50) -> Iterator[Row]:
    """Play the paper's five expressions on a face with its wrinkles as printed, and time all parts of the loop.

    A short run comes first, so that no compilation is timed. Assembling frames counts as time for wrinkles (Tw).
    Drawing is timed off screen at 800 x 800 pixels, without anti-aliasing and with one light, on every
    (iterations / drawings)-th frame, and extrapolated to all.
    """
    _measured(face, PAPER[0].expression, min(iterations, 12), 1)
    for paper in PAPER:
        yield _measured(face, paper.expression, iterations, min(drawings, iterations))


def _measured(face: fw.Face, expression: str, iterations: int, drawings: int) -> Row:
    simulation = fw.Simulation(face, folds="printed")
    simulation.express(expression)
    every, drawn, drawing = iterations // drawings, 0, 0.0
    frame: pv.PolyData
    with Scene(face, Style(quick=True)) as scene:
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


STAGES = ("skin", "whole_skin", "refinement", "wrinkles", "frame", "drawing")


@dataclass(frozen=True)
class Cost:
    """Cost of a frame of surprise on a mesh of some size, ms; NaN where it was not measured.

    Attributes
    ----------
    triangles : int
    skin, refinement, wrinkles, frame, drawing : float
        Drawing is of the skin alone, off screen at 800 x 800 pixels, with one light.
    whole_skin : float
        Of the skin if every vertex is simulated.
    """

    triangles: int
    skin: float
    whole_skin: float
    refinement: float
    wrinkles: float
    frame: float
    drawing: float

    @property
    def loop(self) -> float:
        """Sum of all but the skin and drawing."""
        return self.refinement + self.wrinkles + self.frame


def costs(face: fw.Face, levels: range, skin_up_to: int, repeats: int = 5) -> Iterator[Cost]:
    """Yield the costs of the head in surprise, all its triangles split beforehand to each level; the finer, the less is
    left to refine.

    The skin is also simulated whole on meshes up to one level. For all other stages, meshes move as the head's own.
    """
    sim = settled(face, "paper_surprise")
    for level in levels:
        forest = uniform(face, level)
        fine = to_polydata(interpolated(face.points, forest.corners, forest.barycentric), forest.triangles)
        moved = interpolated(sim.motion.displacement, forest.corners, forest.barycentric)  # type: ignore[attr-defined]
        muscles = {name: face.muscles[name] for name in rates_of(sim)}
        same = dataclasses.replace(face, mesh=fine, muscles=muscles)
        refinement = fw.Refinement(max_level=max(2 - level, 0))
        driven = fw.Simulation(same, refinement, motion=Given(same, moved), folds="paper")
        spent, frame = _stages(driven, rates_of(sim), repeats)
        fitted, whole = fw.fit_face(fine, face.landmarks, units=face.unit), np.nan
        skin = _skin(fw.Skin(fitted), rates_of(sim))
        if level <= skin_up_to:
            whole = _skin(fw.Skin(fitted, vertices=None), rates_of(sim))
        with Scene(same, Style(quick=True, eyes=False, brows=False)) as scene:
            scene.picture(frame)  # opens the window: until then, nothing is rendered
            drawing = 1000.0 * min(_seconds(scene.draw, driven.step()) for _ in range(2))
        yield Cost(
            len(fine.regular_faces), skin, whole, spent["refinement"], spent["wrinkles"], spent["frame"], drawing
        )


@dataclass(frozen=True)
class ForestCost:
    """Memory of the refinement forest of a mesh of some size, and CPU time of a change of a tenth of it.

    Attributes
    ----------
    triangles : int
    held, peak : float
        Bytes per triangle that the allocator has handed out: for the forest with all its arrays and spare rows, and at
        most while it was made.
    split, coarsen : float
        ms for splitting a contiguous tenth of the triangles in four, and for taking that back.
    """

    triangles: int
    held: float
    peak: float
    split: float
    coarsen: float


def forest_costs(face: fw.Face, sizes: Iterable[int], repeats: int = 3) -> Iterator[ForestCost]:
    """Yield the costs of the forest of a head that is split until it has at least so many triangles."""
    for size in sizes:
        tracemalloc.start()
        forest = _grown(face, size)
        held, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        m, split, coarsen = len(forest.triangles), [], []
        for _ in range(repeats):
            twin = forest.copy()
            begin = time.process_time()
            twin.split(np.arange(m // 10))
            middle = time.process_time()
            twin.coarsen(twin.level > forest.level.max())
            split.append(middle - begin)
            coarsen.append(time.process_time() - middle)
        yield ForestCost(m, held / m, peak / m, 1000.0 * min(split), 1000.0 * min(coarsen))


def _grown(face: fw.Face, size: int) -> RedGreenForest:
    """Return the head split as a whole while it stays below a size, and then in part."""
    forest = RedGreenForest(face.triangles, n_points=len(face.points))
    while (m := len(forest.triangles)) < size:
        forest.split(np.arange(min(m, -(-(size - m) // 3))))
    return forest


def _stages(sim: fw.Simulation, rates: dict[str, float], repeats: int) -> tuple[dict[str, float], pv.PolyData]:
    """Smallest time in ms of each stage of a face that moves a little, nothing left to refine, and its last frame."""
    sim.contract(rates)
    for _ in range(4):
        frame = sim.step()
    least = dict.fromkeys(sim.seconds, np.inf)
    for k in range(repeats):
        sim.contract({name: rate * (1.0 - 1e-3 * (k % 2 == 0)) for name, rate in rates.items()})
        before = dict(sim.seconds)
        frame = sim.step()
        least = {name: min(least[name], 1000.0 * (sim.seconds[name] - before[name])) for name in least}
    return least, frame


def _skin(skin: fw.Skin, rates: dict[str, float], steps: int = 8) -> float:
    """CPU time of a step in ms: the median over some, while the contraction grows."""
    spent = []
    for k in range(steps):
        skin.contract({name: rate * (k + 1) / steps for name, rate in rates.items()})
        begin = time.process_time()
        skin.step()
        spent.append(time.process_time() - begin)
    return 1000.0 * float(np.median(spent))


def _seconds(function: Callable[..., Any], *arguments: Any) -> float:
    begin = time.perf_counter()
    function(*arguments)
    return time.perf_counter() - begin


def exponents(rows: list[Cost] | list[ForestCost], names: tuple[str, ...] = (*STAGES, "loop")) -> dict[str, float]:
    """Return the exponent of the number of triangles by stage, over the sizes at which it was measured."""
    out = {}
    for name in names:
        known = [(r.triangles, getattr(r, name)) for r in rows if np.isfinite(getattr(r, name))]
        out[name] = order(*zip(*known, strict=True)) if len(known) > 1 else np.nan
    return out


def report(quick: bool = False) -> Report:
    """Return the report on everything, or on few iterations and small meshes."""
    face, iterations = fw.default_face(), 10 if quick else 250
    here = list(measure(face, iterations, 1 if quick else 25))
    rows = list(costs(face, range(2 if quick else 5), 1 if quick else 2, 2 if quick else 5))
    powers = exponents(rows)
    sizes = (4517, 18_068) if quick else (4517, 18_068, 72_272, 289_088)
    forests = list(forest_costs(face, sizes, 1 if quick else 3))
    totals = [dataclasses.replace(r, held=r.held * r.triangles, peak=r.peak * r.triangles) for r in forests]
    forest_powers = exponents(totals, ("held", "peak", "split", "coarsen"))
    names = ("Tp", "Te", "Ta", "Tw", "Tr", "fps")
    table = []
    for then, now in zip(PAPER, here, strict=True):
        scale = 250.0 / iterations
        for who, row, k in (("paper", then, 1.0), ("here", now, scale)):
            seconds = [getattr(row, n) * (k if n in ("Te", "Ta", "Tw", "Tr") else 1.0) for n in names]
            table.append((row.expression, who, row.before, row.after, *seconds))
    loop = [(r.Te + r.Ta + r.Tw) / k for rows_of, k in ((PAPER, 250), (here, iterations)) for r in rows_of]
    faster = [then / now for then, now in zip(loop[: len(PAPER)], loop[len(PAPER) :], strict=True)]
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else np.nan
    fps = [now.fps / then.fps for then, now in zip(PAPER, here, strict=True)]
    last = rows[-1]
    return Report(
        "performance",
        "Performance",
        "Seconds of 250 iterations of the paper's five expressions, beside the paper's (a Pentium 4 of 2.8 GHz with "
        "its graphics card), ms per frame of surprise on the head with 4 thousand to 1 million triangles, and memory "
        "and time of the refinement forest with 4 to 289 thousand.",
        f"Skin, refinement and wrinkles take {min(faster):.1f} to {max(faster):.1f} times less than in the paper, and "
        f"frames come {min(fps):.1f} to {max(fps):.1f} times as fast, drawn in software (load {load:.1f} on "
        f"{os.cpu_count()} cores). With the number of triangles, refinement, wrinkles and the frame together "
        f"grow by exponent {powers['loop']:.2f}, to {last.loop:.0f} ms at {last.triangles:,}; the skin with "
        f"{powers['skin']:.2f} ({powers['whole_skin']:.2f} if every vertex is simulated); drawing with "
        f"{powers['drawing']:.2f}. The forest holds at most {max(row.held for row in forests):.0f} bytes a triangle.",
        [
            Table(f"Table 1 (seconds for 250 iterations; here from {iterations})",
                  ("expression", "", "before", "after", *names), table),
            Table("A frame of surprise (ms)",
                  ("triangles", *(name.replace("_", " ") for name in STAGES), "without skin and drawing"),
                  [(*asdict(row).values(), row.loop) for row in rows]
                  + [("exponent", *(powers[s] for s in STAGES), powers["loop"])]),
            Table("The refinement forest (bytes a triangle; ms for a tenth of the triangles; exponents of the whole)",
                  ("triangles", "held", "at most while it is made", "split", "coarsen"),
                  [tuple(asdict(row).values()) for row in forests]
                  + [("exponent", *forest_powers.values())]),
        ],
        [_table_plot(here, iterations), _size_plot(rows, powers)],
        {"exponents": powers, "costs": [asdict(row) for row in rows], "table1": [asdict(row) for row in here],
         "forest": [asdict(row) for row in forests], "forest exponents": forest_powers,
         "iterations": iterations, "load": load},
    )  # fmt: skip


def _table_plot(here: list[Row], iterations: int) -> Plot:
    figure, axes = plot(1, 2, (10.0, 3.8))
    parts = {"Te": "skin", "Ta": "refinement", "Tw": "wrinkles", "Tr": "drawing"}
    for k, (source, scale) in enumerate(((PAPER, 1.0), (here, 250.0 / iterations))):
        place, bottom = np.arange(len(PAPER)) + 0.4 * (k - 0.5), np.zeros(len(PAPER))
        for (name, label), color in zip(parts.items(), COLORS, strict=False):
            values = np.array([getattr(row, name) * scale for row in source])
            axes[0].bar(
                place, values, 0.36, bottom=bottom, color=color, alpha=1.0 - 0.45 * (1 - k), label=label if k else None
            )
            bottom += values
        axes[1].bar(
            place,
            [row.fps for row in source],
            0.36,
            color=COLORS[0],
            alpha=1.0 - 0.45 * (1 - k),
            label=("paper", "here")[k],
        )
    for ax, label in zip(axes, ("seconds for 250 iterations", "frames per second"), strict=True):
        ax.set_xticks(np.arange(len(PAPER)), [row.expression.replace("_", "\n") for row in PAPER], fontsize=7)
        ax.set(ylabel=label)
        ax.legend(fontsize=7, frameon=False, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return Plot("table1", figure, "Table 1: the paper's on the left of each pair (pale), measured here on the right.")


def _size_plot(rows: list[Cost], powers: dict[str, float]) -> Plot:
    figure, (ax,) = plot(1, 1, (7.0, 4.0))
    for name, color in zip(STAGES, COLORS, strict=False):
        known = [(row.triangles, getattr(row, name)) for row in rows if np.isfinite(getattr(row, name))]
        ax.plot(
            *zip(*known, strict=True),
            "o-",
            color=color,
            markersize=4,
            label=f"{name.replace('_', ' ')}: exponent {powers[name]:.2f}",
        )
    log_scales(ax)
    ax.set(xlabel="triangles of the base mesh", ylabel="ms per frame")
    ax.legend(fontsize=8, frameon=False)
    return Plot(
        "size", figure,
        "A frame of surprise by the size of the base mesh: coarse ones are refined once or twice, so that wrinkles "
        "cost more there than their number of triangles suggests.",
    )  # fmt: skip


if __name__ == "__main__":
    run_report(report)
