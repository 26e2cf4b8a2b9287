"""Cross-sections of simulated wrinkles against the closed form: ``python -m analysis.profiles``.

On an evenly compressed plate everything is known: :mod:`facewrinkle.geometry.equations` gives the heights in closed
form, and all differences come from the mesh. On the head the compression is that of the simulated skin.
"""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

import facewrinkle as fw
from facewrinkle import plotting
from facewrinkle.anatomy.atlas import printed_atlas
from facewrinkle.anatomy.muscles import Muscle, Wrinkles
from facewrinkle.geometry import equations

from .report import COLORS, Plot, Report, Table, log_scales, order, plot, run_report
from .sections import Section, cut, expected, measure
from .surfaces import (
    EXPRESSIONS,
    KINDS,
    WrinkledSurface,
    plate,
    rates_of,
    settled,
    squeezed,
    uniform,
    wrinkled_surface,
    wrinkling,
)

Array = npt.NDArray[np.float64]

SHAPE = ("amplitude", "wavelength", "narrow")
EPSILON = 0.2
"""Compression of the plate."""

CUTS = (-0.4, -0.2, 0.0, 0.2, 0.4)
"""Places of the cuts through the plate, within the core of the muscle, where there is no attenuation."""


def sheet(**wrinkles: Any) -> fw.SheetMuscle:
    """Return a muscle for the plate: 44 mm long, 40 mm wide, with four wrinkles of 9.9 mm."""
    style = Wrinkles(**{"count": 4, "start": 0.1, "depth": 0.5, "alpha": 2.0, **wrinkles})
    return fw.SheetMuscle([(-20, 22, 0), (20, 22, 0)], [(-20, -22, 0), (20, -22, 0)], wrinkles=style)


def folded(muscle: fw.SheetMuscle, level: int) -> WrinkledSurface:
    """Return the compressed plate with the unbounded wrinkles of a muscle, all of it split `level` times."""
    sim = squeezed(plate(muscle), EPSILON, layers=[fw.MuscleWrinkles(inextensible=False)])
    return wrinkled_surface(sim, uniform(sim.face, level))


def closed_form(muscle: fw.SheetMuscle, along: Array) -> Array:
    """Return the height on the central fiber of the compressed plate (Eqs. 3-7 and 10)."""
    style, u = muscle.wrinkles, muscle.half_wavelength
    w = equations.phase(along, style.start * muscle.length, u, style.alpha, style.ends)
    k0 = style.depth * float(equations.anisotropy(EPSILON))
    return equations.shape(w, u, k0, style.alpha)


def closed_narrow(alpha: float) -> float:
    """Return the share of a wavelength deeper than the mean of crest and furrow.

    It is ``1 - s`` with ``s (1 + s^2)^alpha = 2^(alpha-1)``.

    Examples
    --------
    >>> closed_narrow(0.0)
    0.5
    """
    return 1.0 - float(brentq(lambda s: s * (1.0 + s * s) ** alpha - 2.0 ** (alpha - 1.0), 0.0, 1.0, xtol=1e-15))


def convergence(levels: range) -> dict[str, list[float]]:
    """Return the errors of the plate's height by level, over all cuts, mm: mean, root mean square and largest."""
    muscle = sheet()
    out: dict[str, list[float]] = {k: [] for k in ("edge", "mean", "rms", "largest", "amplitude", "wave", "narrow")}
    for level in levels:
        surface = folded(muscle, level)
        sections = [cut(surface, muscle, across=across) for across in CUTS]
        low, high = muscle.wrinkles.start * muscle.length, muscle.length
        x = np.linspace(low, high, 8001)[1:-1]
        error = np.abs([section.at(x) - closed_form(muscle, x) for section in sections])
        shapes = [measure(section.distance, section.height) for section in sections]
        a, b, _ = surface.rest[surface.triangles].transpose(1, 0, 2)
        out["edge"].append(float(np.linalg.norm(a - b, axis=1).mean()))
        out["mean"].append(float(error.mean()))
        out["rms"].append(float(np.sqrt((error**2).mean())))
        out["largest"].append(float(error.max()))
        out["amplitude"].append(float(np.mean([s.amplitude for s in shapes])))
        out["wave"].append(float(np.nanmean([s.wavelength for s in shapes])) if level else np.nan)
        out["narrow"].append(float(np.nanmean([s.narrow for s in shapes])) if level else np.nan)
    return out


def shapes(level: int) -> list[dict[str, float]]:
    """Return amplitude, wavelength and sharpness of the plate with other alpha and k0, measured and in closed form."""
    out = []
    for alpha, depth in [(a, 0.5) for a in (0.5, 1.0, 2.0, 4.0)] + [(2.0, k) for k in (0.1, 0.25, 1.0)]:
        muscle = sheet(alpha=alpha, depth=depth)
        section = cut(folded(muscle, level), muscle)
        found, share = measure(section.distance, section.height), float(equations.anisotropy(EPSILON))
        out.append(
            {
                "alpha": alpha, "k0": depth,
                "amplitude": found.amplitude, "closed amplitude": depth * share * 2.0**alpha,
                "wavelength": found.wavelength, "closed wavelength": 2.0 * muscle.half_wavelength * (1.0 - EPSILON),
                "narrow": found.narrow, "closed narrow": closed_narrow(alpha),
            }
        )  # fmt: skip
    return out


def measured_size(section: Section) -> float:
    """Return the root mean square of the height, which unlike the extremes does not depend on the vertices' places."""
    return float(np.sqrt((section.resampled().height ** 2).mean()))


def attenuated(level: int, falloff: equations.Falloff = "paper") -> list[tuple[float, float, float]]:
    """Return places across the fibers, the measured share of the central amplitude there, and At (Eq. 13)."""
    muscle = sheet(falloff=falloff)
    surface, out = folded(muscle, level), []
    full = measured_size(cut(surface, muscle, across=0.1))
    for across in (0.1, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95):
        share = measured_size(cut(surface, muscle, across=across)) / full
        at = equations.attenuation(equations.band(across, muscle.wrinkles.core, 1.0), falloff)
        out.append((across, share, float(at)))
    return out


def deepest_muscle(sim: fw.Simulation) -> str:
    """Return the contracted muscle with the deepest wrinkles."""
    depth = {n: rate * sim.face.muscles[n].fold_pattern.wrinkles.depth for n, rate in rates_of(sim).items()}
    return max(depth, key=lambda name: depth[name])


def on_head(sim: fw.Simulation, muscle: Muscle, levels: range) -> list[tuple[float, Section, Section, Array]]:
    """Return, by level of refinement: mean error over the cut, the section, a fine one, and the closed form on that."""
    unit, out = sim.face.unit, []
    surface = wrinkled_surface(sim, wrinkling(sim.face, rates_of(sim), max(levels[-1], 4)))
    finest = cut(surface, muscle, unit).resampled()
    truth = expected(finest, sim, surface)
    for level in levels:
        section = cut(wrinkled_surface(sim, wrinkling(sim.face, rates_of(sim), level)), muscle, unit)
        out.append((float(np.abs(section.at(finest.along) - truth).mean()), section, finest, truth))
    return out


def in_kind(expression: str, folds: str, muscle: Muscle) -> tuple[int, float, float, float]:
    """Return how many furrows a kind of folds draws on a cut across the region of a muscle, and their measures."""
    sim = settled(fw.default_face(), expression, folds=folds)
    section = cut(wrinkled_surface(sim), muscle, sim.face.unit)
    found = measure(section.distance, section.height)
    return found.count, found.amplitude, found.wavelength, found.narrow


def report(quick: bool = False) -> Report:
    """Return the report on everything, or on fewer levels."""
    levels = range(5) if quick else range(6)
    errors = convergence(levels)
    orders = {kind: order(errors["edge"][1:], errors[kind][1:]) for kind in ("mean", "rms", "largest")}
    by_shape, faded = shapes(4 if quick else 5), attenuated(4)
    closed = by_shape[2]
    face = fw.default_face().with_atlas(printed_atlas())  # whose muscles all fold the skin over them, as in the paper
    sims = {name: settled(face, name) for name in EXPRESSIONS}
    rows, heads, numbers = [], {}, {}
    for name, sim in sims.items():
        which = deepest_muscle(sim)
        muscle = face.muscles[which].fold_pattern
        runs = on_head(sim, muscle, range(4 if quick else 5))
        own = cut(wrinkled_surface(sim), muscle, face.unit)
        fine, truth = runs[-1][2:]
        found, exact = measure(own.distance, own.height), measure(fine.distance, truth)
        gap = float(np.abs(own.at(fine.along) - truth).mean())
        heads[name] = (which, own, fine, truth)
        numbers[name] = {"order": order(0.5 ** np.arange(len(runs))[1:], [r[0] for r in runs][1:]), "mean": gap}
        numbers[name]["share"] = gap / exact.amplitude
        rows.append(
            (name, which, found.amplitude, exact.amplitude, found.wavelength, exact.wavelength, found.narrow,
             exact.narrow, gap, 100.0 * gap / exact.amplitude, numbers[name]["order"])
        )  # fmt: skip
    tables = [
        Table(
            "The plate by level (mm); the closed form is the last row",
            ("level", "edge", "mean error", "rms error", "largest error", "amplitude", "wavelength", "narrow"),
            [
                *((level, *(errors[k][i] for k in errors)) for i, level in enumerate(levels)),
                ("closed form", 0.0, 0.0, 0.0, 0.0, *(closed[f"closed {k}"] for k in SHAPE)),
                ("order", np.nan, *orders.values(), np.nan, np.nan, np.nan),
            ],
        ),
        Table("Other alpha and k0 (mm)", tuple(closed), [tuple(row.values()) for row in by_shape]),
        Table("Attenuation: share of the amplitude at a place across the fibers", ("across", "measured", "At"), faded),
        Table(
            "Five expressions of the paper's muscles, with mended folds at the default resolution, cut across those "
            "of one muscle (mm)",
            ("expression", "muscle", "amplitude", "closed", "wavelength", "closed", "narrow", "closed", "mean error",
             "% of amplitude", "order by level"),
            rows,
        ),
        Table(
            "The same cuts in each kind of folds, measured (mm)",
            ("expression", "folds", "furrows", "amplitude", "wavelength", "narrow"),
            [
                (name, folds, *in_kind(name, folds, face.muscles[heads[name][0]].fold_pattern))
                for name in EXPRESSIONS
                for folds in KINDS
            ],
        ),
    ]  # fmt: skip
    worst = max(abs(row["amplitude"] / row["closed amplitude"] - 1.0) for row in by_shape)
    images = [
        _levels_plot(levels, errors, orders),
        _shapes_plot(4),
        _heads_plot(heads),
        *_papers_plots(face, (300, 260) if quick else (620, 520)),
    ]
    return Report(
        "profiles",
        "Profiles of wrinkles",
        "Heights of the wrinkled over the bare surface along cuts across the folds, against H A At in closed form, "
        "with amplitude, wavelength and its share in the furrow (narrow: deeper than half the amplitude).",
        f"The mean error falls as the edge length to the power {orders['mean']:.2f}, the largest one, at the creases "
        f"of H, to the power {orders['largest']:.2f}; at the finest level amplitudes are within {100 * worst:.1f} % of "
        f"the closed form. At the default resolution heights on the head are within {max(row[9] for row in rows):.1f} "
        f"% of the amplitude on average, but furrows are cut off where no vertex lies on their crease: amplitudes are "
        f"up to {max(100.0 * (1.0 - row[2] / row[3]) for row in rows):.0f} % too small.",
        tables,
        images,
        {"plate": errors, "orders": orders, "shapes": by_shape, "attenuation": faded, "head": numbers},
    )


def _levels_plot(levels: range, errors: dict[str, list[float]], orders: dict[str, float]) -> Plot:
    figure, (left, right) = plot(1, 2)
    muscle = sheet()
    x = np.linspace(4.4, 44.0, 2001)
    left.plot(x, closed_form(muscle, x), color="black", linewidth=2.5, alpha=0.25, label="closed form")
    for level, color in zip((1, 2, 3), COLORS, strict=False):
        section = cut(folded(muscle, level), muscle)
        left.plot(section.along, section.height, ".-", color=color, linewidth=1, markersize=3, label=f"level {level}")
    left.set(xlim=(3, 25), xlabel="place along the fiber at rest, l (mm)", ylabel="height (mm)")
    left.legend(fontsize=7, ncols=4, loc="upper center", bbox_to_anchor=(0.5, 1.13), frameon=False)
    for kind, color in zip(("largest", "rms", "mean"), COLORS, strict=False):
        edge, error = np.array(errors["edge"]), np.array(errors[kind])
        right.plot(edge, error, "o-", color=color, label=f"{kind}: order {orders[kind]:.2f}")
    right.plot(edge, 0.012 * edge**2, "--", color="gray", linewidth=1, label="edge squared")
    log_scales(right)
    right.set(xlabel="mean edge (mm)", ylabel="error of the height (mm)")
    right.legend(fontsize=7, frameon=False)
    return Plot(
        "levels", figure,
        "A plate compressed by 20 %: half of a section by level of refinement, and the error of five sections against "
        "the length of the edges (level 0 is left out of the fits: it has less than two edges per wrinkle).",
    )  # fmt: skip


def _shapes_plot(level: int) -> Plot:
    figure, axes = plot(1, 3, (11.0, 3.4))
    varied = {"alpha": (0.5, 1.0, 2.0, 4.0), "depth": (0.1, 0.25, 0.5, 1.0)}
    for (name, values), ax in zip(varied.items(), axes, strict=False):
        for value, color in zip(values, COLORS, strict=False):
            muscle = sheet(**{name: value})
            section = cut(folded(muscle, level), muscle)
            label = f"α = {value:g}" if name == "alpha" else f"k₀ = {value:g} mm"
            x = np.linspace(4.4, 44.0, 4001)
            ax.plot(x, closed_form(muscle, x), color=color, linewidth=1, label=label)
            ax.plot(section.along[::3], section.height[::3], ".", color=color, markersize=3)
        ax.set(xlim=(10, 25), xlabel="l (mm)", ylabel="height (mm)")
        ax.legend(fontsize=7, frameon=False, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    across = np.linspace(-1.05, 1.05, 801)
    for falloff, color in zip(get_args(equations.Falloff), COLORS, strict=False):
        at = equations.attenuation(equations.band(np.abs(across), 0.5, 1.0), falloff)
        axes[2].plot(across, at, color=color, linewidth=1, label=f"At, {falloff}")
        rows = np.array(attenuated(level, falloff))
        axes[2].plot(rows[:, 0], rows[:, 1], "o", color=color, markersize=4)
    axes[2].set(xlabel="place across the fibers (1: border)", ylabel="share of the central amplitude")
    axes[2].legend(fontsize=7, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return Plot(
        "shapes", figure,
        f"Measured on the plate at level {level} (dots) and in closed form (lines): other alpha, other k0, and the "
        "amplitude across the fibers, where it is attenuated.",
    )  # fmt: skip


def _heads_plot(heads: dict[str, tuple[str, Section, Section, Array]]) -> Plot:
    figure, axes = plot((len(heads) + 2) // 3, min(len(heads), 3), (10.0, 3.0 * ((len(heads) + 2) // 3)))
    for ax in axes[len(heads) :]:
        ax.set_axis_off()
    for ax, (name, (which, own, fine, truth)) in zip(axes, heads.items(), strict=False):
        ax.plot(fine.distance, truth, color="black", linewidth=2.5, alpha=0.25, label="closed form")
        place = np.interp(own.along, fine.along, fine.distance)
        ax.plot(place, own.height, ".-", color=COLORS[0], markersize=4, linewidth=1, label="frame")
        ax.set_title(f"{name}\n{which}", fontsize=8)
        ax.set(xlabel="along the bare skin (mm)", ylabel="height (mm)")
    axes[0].legend(fontsize=7, frameon=False)
    return Plot(
        "head", figure,
        "The five expressions at full strength and default resolution: sections across the folds of the muscle that "
        "folds deepest.",
    )  # fmt: skip


def _papers_plots(face: fw.Face, size: tuple[int, int]) -> list[Plot]:
    """Plots of muscle-driven wrinkles and a pattern, on one forehead that the same muscles raise."""
    pattern = fw.PatternLayer.preset("forehead", face, strength="skin")
    sims = {
        "Zhang, Sim, Tan: muscles fold the skin": settled(face, "paper_surprise"),
        "Lin, Cheng: the forehead pattern": settled(face, "paper_surprise", layers=[pattern]),
    }
    style = plotting.Style(size, "forehead")
    frames = [sim.step() for sim in sims.values()]
    picture = plotting.side_by_side([plotting.picture(frame, face, style) for frame in frames])
    top, brow = face.landmarks["forehead_mid"], face.landmarks["glabella"]
    to_left = 0.22 * face.frame.pupil_distance * face.frame.axes[0]
    lines = [[p - to_left, p + to_left] for p in (1.6 * top - 0.6 * brow + to_left, brow + to_left)]
    ruler = fw.SheetMuscle(*lines, wrinkles=Wrinkles(start=0.0))
    figure, axes = plot(1, 1, (8.0, 3.2))
    for (label, sim), color in zip(sims.items(), COLORS, strict=False):
        section = cut(wrinkled_surface(sim), ruler, face.unit)
        up = face.unit * ruler.length - section.along
        axes[0].plot(up, section.height, ".-", color=color, linewidth=1.2, markersize=3, label=label)
    axes[0].set(xlabel="up from the glabella, at rest (mm)", ylabel="height (mm)")
    axes[0].legend(fontsize=8, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return [
        Plot(
            "papers",
            figure,
            "Both papers' wrinkles on one forehead in surprise: sections upwards, 14 mm to the left of the middle.",
        ),
        Plot(
            "papers_picture",
            picture,
            "The same two foreheads: wrinkles of the frontalis (left), the forehead pattern (right).",
        ),
    ]


if __name__ == "__main__":
    run_report(report)
