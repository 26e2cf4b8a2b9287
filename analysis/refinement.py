"""Effects of adaptive refinement: ``python -m analysis.refinement``.

The triangles that five expressions need; the distance of the surface from a very fine one, compared with meshes that
are refined everywhere; the angles of the triangles; and the edges that each criterion finds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyvista as pv

import facewrinkle as fw
from facewrinkle.anatomy.muscles import Wrinkles
from facewrinkle.geometry.interpolation import barycentric
from facewrinkle.geometry.normals import vertex_areas
from facewrinkle.mesh import to_polydata

from .performance import PAPER
from .report import COLORS, Plot, Report, Table, log_scales, plot, run_report
from .surfaces import (
    EXPRESSIONS,
    IntArray,
    WrinkledSurface,
    rates_of,
    settled,
    squeezed,
    uniform,
    wrinkled_surface,
    wrinkling,
)

Array = npt.NDArray[np.float64]

STAGES = ("skin", "refinement", "wrinkles", "frame")


# --- triangles over time ------------------------------------------------------------------------


def counts(face: fw.Face, expression: str, frames: int) -> tuple[Array, dict[str, float]]:
    """Return the triangles per level (frames, levels) while an expression comes and goes as printed, and ms per frame
    by stage.
    """
    sim = fw.Simulation(face, folds="printed")
    levels = int(sim.refinement.max_level or 0) + 1
    sim.express(expression)
    for _ in sim.run(4):
        pass
    sim.reset()
    before, out = dict(sim.seconds), []
    for relaxing in (False, True):
        sim.relax() if relaxing else sim.express(expression)
        for _ in sim.run(frames):
            out.append(np.bincount(sim.forest.level, minlength=levels))
        if not relaxing:
            cost = {stage: 1000.0 * (sim.seconds[stage] - before[stage]) / frames for stage in STAGES}
    return np.array(out), cost


# --- distance from a very fine mesh -------------------------------------------------------------


@dataclass(frozen=True)
class Gap:
    """Distance of a mesh from a very fine one where that is wrinkled.

    Attributes
    ----------
    triangles : int
    distance, largest : float
        Root mean square and 99.9 % quantile, mm.
    angle : float
        Angle between the normals, root mean square, degrees.
    """

    triangles: int
    distance: float
    largest: float
    angle: float


def gap(surface: WrinkledSurface, fine: WrinkledSurface, most: int = 20_000) -> Gap:
    """Compare a wrinkled surface with a very fine one at some of the vertices of the latter."""
    where = np.flatnonzero(np.abs(fine.height) > 0.01)
    where = where[:: max(len(where) // most, 1)]
    area = vertex_areas(fine.wrinkled, fine.triangles)[where]
    mesh = to_polydata(surface.wrinkled, surface.triangles)
    cells, points = mesh.find_closest_cell(fine.wrinkled[where], return_closest_point=True)
    corners = surface.triangles[cells]
    shares = barycentric(np.asarray(points), surface.wrinkled[corners])
    normals = np.einsum("kc,kcj->kj", shares, surface.shading[corners])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    away = np.linalg.norm(fine.wrinkled[where] - points, axis=1)
    angle = np.degrees(np.arccos(np.clip((normals * fine.shading[where]).sum(axis=1), -1.0, 1.0)))
    mean = [float(np.sqrt(np.average(x**2, weights=area))) for x in (away, angle)]
    return Gap(len(surface.triangles), mean[0], float(np.quantile(away, 0.999)), mean[1])


def against_uniform(face: fw.Face, expression: str, levels: int, finest: int, frames: int) -> dict[str, list[Gap]]:
    """Return the gaps of one frame on meshes that are refined adaptively, and everywhere."""
    sim = settled(face, expression, frames)
    fine = wrinkled_surface(sim, wrinkling(face, rates_of(sim), finest))
    adaptive = []
    for level in range(levels + 1):
        own = settled(face, expression, frames, refinement=fw.Refinement(max_level=level))
        adaptive.append(gap(wrinkled_surface(sim, own.forest), fine))
    return {
        "adaptive": adaptive,
        "uniform": [gap(wrinkled_surface(sim, uniform(face, k)), fine) for k in range(levels + 1)],
    }


def at_equal_count(gaps: dict[str, list[Gap]], adaptive: Gap) -> tuple[float, float]:
    """Return the distance of a uniform mesh of as many triangles, and the triangles of a uniform mesh of that distance,
    both from straight lines between the logarithms.
    """
    count, distance = (np.log([getattr(g, name) for g in gaps["uniform"]]) for name in ("triangles", "distance"))
    same = np.interp(np.log(adaptive.triangles), count, distance)
    needed = np.interp(-np.log(adaptive.distance), -distance, count)
    return float(np.exp(same)), float(np.exp(needed))


# --- angles -------------------------------------------------------------------------------------


def smallest_angles(points: Array, triangles: IntArray) -> Array:
    """Return the smallest angle (m,) of each triangle, degrees."""
    corners = points[triangles]
    angles = []
    for k in range(3):
        a, b = (corners[:, (k + j) % 3] - corners[:, k] for j in (1, 2))
        angles.append(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1)))
    return np.degrees(np.min(angles, axis=0))


# --- criteria -----------------------------------------------------------------------------------


def bends(surface: WrinkledSurface, edges: IntArray) -> Array:
    """Return Eq. 19 of edges."""
    (i, j), now, then = edges.T, surface.folded, surface.rest_normals
    rest = (then[i] * then[j]).sum(axis=1)
    return np.asarray((rest - (now[i] * now[j]).sum(axis=1)) / np.maximum(np.abs(rest), 0.1))


def lengths(surface: WrinkledSurface, edges: IntArray, unit: float, samples: float) -> Array:
    """Return the lengths of edges across the folds, relative to those that `samples` vertices per half cycle allow."""
    out, (i, j) = np.zeros(len(edges)), edges.T
    along = (surface.rest[j] - surface.rest[i]) / unit
    for displacement in surface.displacements:
        for v in (i, j):
            span = np.abs((along * displacement.across[v]).sum(axis=1))
            out = np.maximum(out, samples * span / displacement.spacing[v])
    return out


def caught(sim: fw.Simulation, level: int, tolerance: float = 0.1) -> dict[str, float]:
    """Return the share of the edges that need splitting, in %, that each criterion finds on a mesh of one level.

    An edge needs splitting if at its midpoint the wrinkles are more than `tolerance` mm off the straight line.
    """
    face, r = sim.face, sim.refinement
    coarse, forest = wrinkled_surface(sim, uniform(face, level)), uniform(face, level + 1)
    fine = wrinkled_surface(sim, forest)
    n = len(coarse.rest)
    edges = forest.parents[n:]
    need = np.abs(fine.height[n:] - coarse.height[edges].mean(axis=1)) > tolerance
    bent = bends(coarse, edges) > r.gamma_c
    long = lengths(coarse, edges, face.unit, r.samples) > 1.0
    total = max(int(need.sum()), 1)
    return {
        "edges": len(edges), "needed": int(need.sum()),
        "Eq. 19": 100.0 * float((need & bent).sum()) / total,
        "wavelength": 100.0 * float((need & long).sum()) / total,
        "either": 100.0 * float((need & (bent | long)).sum()) / total,
        "Eq. 19 in vain": 100.0 * float((bent & ~need).sum()) / max(int(bent.sum()), 1),
        "wavelength in vain": 100.0 * float((long & ~need).sum()) / max(int(long.sum()), 1),
    }  # fmt: skip


def blind_spots(ratios: Array, phases: int) -> Array:
    """Return the largest Eq. 19 (ratios, phases) in the middle of a plate, by the distance of its rows of vertices in
    half cycles u.
    """
    out = np.zeros((len(ratios), phases))
    for i, ratio in enumerate(ratios):
        for j in range(phases):
            face = rows(ratio, (j + 0.5) / phases if phases > 1 else 0.0)
            layers, as_it_is = [fw.MuscleWrinkles(inextensible=False)], fw.Refinement(max_level=0)
            sim = squeezed(face, 0.2, layers=layers, refinement=as_it_is)
            frame = sim.step()
            x, y = np.abs(frame["rest"][:, :2].T)
            spacing = ratio * 5.0
            inner = (x < 2.5 * spacing) & (y < y.max() - 4.5 * spacing)
            out[i, j] = float(frame["split_gamma"][inner].max())
    return out


def rows(ratio: float, phase: float, u: float = 5.0) -> fw.Face:
    """Return a plate with rows of vertices along the folds, `ratio` half cycles u apart and shifted by `phase` rows.

    At least ten rows are folded; the folds start at the bottom of a furrow, and at phase 0 a row lies there.
    """
    spacing, folds = ratio * u, 2 * int(np.ceil(6.0 * max(ratio, 0.5)))
    length = 2.0 * u * folds
    count = int(np.ceil(0.5 * length / spacing)) + 2
    y, x = (np.arange(-count, count + 1) + phase) * spacing, np.arange(-4, 5) * spacing
    grid = pv.StructuredGrid(*np.meshgrid(x, y, [0.0], indexing="ij"))
    width = 4.0 * np.ptp(x)
    attachment, insertion = ([(sx * 0.5 * width, sy * 0.5 * length, 0.0) for sx in (-1, 1)] for sy in (1, -1))
    style = Wrinkles(count=folds, start=0.0, depth=1.0, core=1.0, ends="paper")
    sheet = fw.SheetMuscle(attachment, insertion, thickness=length, wrinkles=style)
    return fw.surface(grid.extract_surface(algorithm="dataset_surface").triangulate()).with_muscles({"muscle": sheet})


# --- report -------------------------------------------------------------------------------------


def report(quick: bool = False) -> Report:
    """Return the report on everything, or on fewer levels and frames."""
    face = fw.default_face()
    names = EXPRESSIONS
    paper = dict(zip(names, PAPER, strict=True))
    played = {name: counts(face, name, 25 if quick else 70) for name in names}
    levels, finest, frames = (2, 4, 30) if quick else (3, 5, 50)
    sims = {name: settled(face, name, frames) for name in names}
    gaps = {name: against_uniform(face, name, levels, finest, frames) for name in names[: 1 if quick else None]}
    cap = int(sims[names[0]].refinement.max_level or 0)
    base_angle = float(smallest_angles(face.points, face.triangles).min())
    angles = {}
    for name in names:
        forests = [settled(face, name, 20, refinement=fw.Refinement(max_level=k)).forest for k in range(1, levels + 1)]
        angles[name] = [
            float(smallest_angles(wrinkled_surface(sims[name], f).rest, f.triangles).min()) for f in forests
        ]
    found = {(name, k): caught(sims[name], k) for name in names for k in range(cap)}
    ratios = np.array([0.25, 0.5, 1.0, 1.5, 2.0]) if quick else np.arange(0.1, 2.51, 0.1)
    blind = blind_spots(ratios, 1), blind_spots(ratios, 2 if quick else 7)
    triangles, equal = [], []
    for name, (by_level, cost) in played.items():
        top = by_level[len(by_level) // 2 - 1]
        row = paper[name]
        others = (len(sims[name].forest.triangles), len(settled(face, name, frames, folds="wave").forest.triangles))
        printed = fw.Simulation(face, folds="printed")
        printed.express(name)
        triangles.append((name, row.before, row.after, printed.settle().n_cells, *map(int, top),
                          int(by_level[-1].sum()), *others, *cost.values(), sum(cost.values())))  # fmt: skip
    for name, pair in gaps.items():
        own = pair["adaptive"][cap]
        same, needed = at_equal_count(pair, own)
        equal.append((name, own.triangles, own.distance, same, own.angle, same / own.distance, needed))
    printed_levels = next(iter(played.values()))[0].shape[1]
    either = min(row["either"] for row in found.values() if row["needed"])
    tables = [
        Table(
            "Triangles at full strength, and ms per frame: the paper's, ours as printed (Eq. 19), and with mended and "
            "wave folds, whose rule is vertices per cycle",
            ("expression", "before", "after, paper", "after, printed",
             *(f"level {k} in motion" for k in range(printed_levels)),
             "released", "after, mended", "after, waves", *STAGES, "all"),
            triangles,
        ),
        Table(
            "Distance from a very fine mesh where it is wrinkled (rms, mm), and that of a uniform mesh of equal count",
            ("expression", "triangles", "distance", "uniform", "normals (degrees)", "ratio", "uniform would need"),
            equal,
        ),
        Table(
            "Distances by mesh", ("expression", "mesh", "triangles", "rms (mm)", "99.9 % (mm)", "normals (degrees)"),
            [(name, kind, g.triangles, g.distance, g.largest, g.angle)
             for name, pair in gaps.items() for kind, some in pair.items() for g in some],
        ),
        Table(
            "Smallest angle of the mesh at rest by max_level (degrees)",
            ("expression", "0", *map(str, range(1, levels + 1))), [(n, base_angle, *a) for n, a in angles.items()],
        ),
        Table(
            "Edges 0.1 mm off at their midpoint, and the share each criterion finds, in %; in vain: of those found",
            ("expression", "level", *next(iter(found.values()))),
            [(*key, *row.values()) for key, row in found.items()],
        ),
    ]  # fmt: skip
    worst = min(min(a) for a in angles.values())
    return Report(
        "refinement",
        "Adaptive refinement",
        "Triangles over time as printed, by Eq. 19, beside the paper's; of mended folds, distance from a fine mesh "
        "beside uniformly refined ones, smallest angles, and which edges each criterion finds.",
        f"As printed, expressions need {min(t[3] for t in triangles):,} to {max(t[3] for t in triangles):,} triangles "
        f"and give them back; a uniform mesh of as many is {min(e[5] for e in equal):.1f} to "
        f"{max(e[5] for e in equal):.1f} times as far off. The smallest angle is {worst:.1f} degrees, from "
        f"{base_angle:.1f} before. Eq. 19 is blind "
        f"where rows of vertices lie u or 2 u apart and sees little from 0.8 u on; together with the wavelength "
        f"criterion it finds {either:.0f} % or more of the edges that need splitting.",
        tables,
        [_counts_plot(played, paper), _gaps_plot(gaps, cap), _blind_plot(ratios, blind), _caught_plot(found)],
        {
            "triangles": {t[0]: t[3] for t in triangles},
            "released": {name: int(by_level[-1].sum()) for name, (by_level, _) in played.items()},
            "gaps": {n: {k: [vars(g) for g in some] for k, some in pair.items()} for n, pair in gaps.items()},
            "angles": {"base": base_angle, **angles}, "caught": {f"{n}, {k}": v for (n, k), v in found.items()},
            "blind": {"ratios": ratios, "aligned": blind[0][:, 0], "others": blind[1]},
        },
    )  # fmt: skip


def _counts_plot(played: dict[str, tuple[Array, dict[str, float]]], paper: dict) -> Plot:  # type: ignore[type-arg]
    figure, (left, right) = plot(1, 2)
    for (name, (by_level, _)), color in zip(played.items(), COLORS, strict=False):
        total = by_level.sum(axis=1)
        left.plot(np.arange(1, len(total) + 1), total, color=color, label=name)
        left.plot([len(total) // 2], [paper[name].after], "o", color=color, markersize=5)
    left.set(xlabel="frame (released at half time)", ylabel="triangles", ylim=(0, None))
    title = "lines: as printed, here; dots: the paper's"
    left.legend(loc="lower center", fontsize=7, frameon=False, title=title, title_fontsize=7)
    name, (by_level, _) = next(iter(played.items()))
    right.stackplot(
        np.arange(1, len(by_level) + 1), by_level.T, labels=[f"level {k}" for k in range(by_level.shape[1])],
        colors=["#c9d6df", "#7fa6c4", "#1f5a85", "#0d2f4a"],
    )  # fmt: skip
    right.set(xlabel="frame", ylabel=f"triangles in {name}")
    right.legend(fontsize=7, frameon=False, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return Plot(
        "counts", figure,
        "Triangles while an expression comes, is held and goes, beside the final counts of the paper, and by level.",
    )  # fmt: skip


def _gaps_plot(gaps: dict[str, dict[str, list[Gap]]], cap: int) -> Plot:
    figure, axes = plot(1, 2)
    shown = {"distance": "distance, rms (mm)", "angle": "normals, rms (degrees)"}
    for ax, (what, label) in zip(axes, shown.items(), strict=True):
        for (name, pair), color in zip(gaps.items(), COLORS, strict=False):
            for kind, style in (("adaptive", "-"), ("uniform", "--")):
                x, y = [g.triangles for g in pair[kind]], [getattr(g, what) for g in pair[kind]]
                ax.plot(
                    x,
                    y,
                    style,
                    marker="o",
                    markersize=3,
                    color=color,
                    linewidth=1,
                    label=name if style == "-" else None,
                )
            own = pair["adaptive"][cap]
            ax.plot([own.triangles], [getattr(own, what)], "o", color=color, markersize=8, fillstyle="none")
        log_scales(ax)
        ax.set(xlabel="triangles of the whole head", ylabel=label)
    axes[0].legend(fontsize=7, frameon=False)
    return Plot(
        "gaps", figure,
        "Distance from a very fine mesh where it is wrinkled, by number of triangles: refined adaptively (solid, one "
        "point per level cap, circle: the default) and everywhere (dashed).",
    )  # fmt: skip


def _blind_plot(ratios: Array, blind: tuple[Array, Array]) -> Plot:
    figure, (ax,) = plot(1, 1, (7.0, 3.6))
    ax.fill_between(
        ratios,
        blind[1].min(axis=1),
        blind[1].max(axis=1),
        color=COLORS[0],
        alpha=0.25,
        linewidth=0,
        label="rows anywhere",
    )
    ax.plot(ratios, blind[0][:, 0], "o-", color=COLORS[0], markersize=4, label="a row at the bottom of a furrow")
    ax.axhline(0.03, color=COLORS[1], linestyle="--", linewidth=1, label="gamma_c = 0.03")
    ax.axvspan(0.25, ratios[-1], color=COLORS[2], alpha=0.08, label="too long for the wavelength")
    ax.set(xlabel="distance of the rows of vertices / half cycle u", ylabel="largest Eq. 19 on the plate")
    ax.legend(fontsize=7, frameon=False)
    return Plot(
        "blind", figure,
        "Eq. 19 in the middle of a plate with folds 1.2 mm deep: where rows lie u and 2 u apart all normals are "
        "parallel, and it sees nothing at all; the wavelength criterion splits from u / 4 on.",
    )  # fmt: skip


def _caught_plot(found: dict[tuple[str, int], dict[str, float]]) -> Plot:
    figure, (ax,) = plot(1, 1, (10.0, 3.6))
    for k, (kind, color) in enumerate(zip(("Eq. 19", "wavelength", "either"), COLORS, strict=False)):
        ax.bar(
            np.arange(len(found)) + (k - 1) * 0.27,
            [row[kind] for row in found.values()],
            0.25,
            color=color,
            label=kind,
        )
    ax.set_xticks(
        np.arange(len(found)), [f"{name.replace('_', chr(10))}\nlevel {level}" for name, level in found], fontsize=7
    )
    ax.set(ylabel="% of the edges that need it", ylim=(0, 105))
    ax.legend(fontsize=8, frameon=False, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return Plot(
        "caught", figure,
        "Edges that are more than 0.1 mm off at their midpoint, on the head at level 0 and 1, and the share of them "
        "that each criterion finds.",
    )  # fmt: skip


if __name__ == "__main__":
    run_report(report)
