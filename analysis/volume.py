"""Volume of wrinkles: ``python -m analysis.volume``.

Eq. 7 makes the integral of the shape H over a cycle vanish. The volume of a fold is that integral weighted by all that
varies within the fold: the width of the region, its attenuation, the compression of the skin. Nothing in the paper
makes these integrals vanish.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

import facewrinkle as fw
from facewrinkle.anatomy.muscles import Muscle, Wrinkles
from facewrinkle.geometry import equations
from facewrinkle.geometry.normals import vertex_areas
from facewrinkle.layers.muscle_wrinkles import MuscleWrinkles
from facewrinkle.simulation.fold_layers import with_printed_muscles

from .profiles import EPSILON, sheet
from .report import COLORS, Plot, Report, Table, log_scales, order, plot, run_report
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
from .swept import swept_volumes

Array = npt.NDArray[np.float64]

STEPS = ("H", "H At", "H At A", "bounded", "default mesh")
"""Factors that are added to a wrinkle one after the other."""


def quadrature(alphas: npt.ArrayLike, u: float = 5.0, k0: float = 0.7) -> list[tuple[float, float, float]]:
    """Return alpha, the integral of H over a cycle (mm^2, by Gauss's rule, piece by piece), and that of |H|."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    out = []
    for alpha in np.atleast_1d(np.asarray(alphas, dtype=np.float64)):
        zero = u * (1.0 - equations.zero_crossing(float(alpha)))
        ends = np.array([0.0, zero, u, 2.0 * u - zero, 2.0 * u])
        pieces = []
        for a, b in pairwise(ends):
            w = 0.5 * (a + b) + 0.5 * (b - a) * nodes
            pieces.append(0.5 * (b - a) * float(weights @ equations.shape(w, u, k0, float(alpha))))
        out.append((float(alpha), float(np.sum(pieces)), float(np.abs(pieces).sum())))
    return out


def in_the_plane(muscle: Muscle, count: int = 4000) -> tuple[float, float]:
    """Return the net share of the volume, in %, of H and of H At over a muscle's region in its plane, by the midpoint
    rule in the coordinates of the muscle, with `count` points across the folds.
    """
    middle = [(np.arange(n) + 0.5) / n for n in (count, 200)]
    along, across = (x.ravel() for x in np.meshgrid(*middle, indexing="ij"))
    if isinstance(muscle, fw.SphincterMuscle):
        psi, r = (muscle.beta1 + muscle.beta2) * along - muscle.beta1, muscle.inner + (1.0 - muscle.inner) * across
        border = 1.0 / np.hypot(np.cos(psi) / muscle.semi_major, np.sin(psi) / muscle.semi_minor)
        points, area = np.stack([r * border * np.cos(psi), r * border * np.sin(psi)]), r * border**2
    else:
        begin, side = muscle.wrinkles.start, 2.0 * across - 1.0
        along = begin + (1.0 - begin) * along
        if isinstance(muscle, fw.SheetMuscle):
            points, area = np.stack([0.5 * muscle.width * side, 25.0 - muscle.length * along]), np.ones(len(side))
        else:
            assert isinstance(muscle, fw.LinearMuscle)
            angle, l = muscle.max_angle * side, muscle.radius * along
            straight = muscle.wrinkles.fronts == "straight"
            r = l / np.cos(angle) if straight else l
            points = np.stack([r * np.sin(angle), r * np.cos(angle) - 25.0])
            area = l / np.cos(angle) ** 2 if straight else l
    x = np.column_stack([*points, np.zeros(len(area))])
    plain = muscle.height(x) * area
    return share(plain), share(plain * muscle.envelope(x))


def share(parts: Array) -> float:
    """Return the sum of volumes, in % of the sum of their absolute values."""
    return 100.0 * float(parts.sum() / np.abs(parts).sum())


def volumes(surface: WrinkledSurface) -> Array:
    """Return the signed volume (m,) under each triangle of a wrinkled surface, mm^3."""
    return swept_volumes(surface.bare, surface.wrinkled - surface.bare, surface.triangles)


def by_fold(surface: WrinkledSurface, muscle: fw.SheetMuscle, unit: float = 1.0) -> Array:
    """Return the net and displaced volume (count, 2) of each fold of a sheet, bulge and furrow together, mm^3."""
    centroids = surface.rest[surface.triangles].mean(axis=1) / unit
    place = (muscle.coordinates(centroids)[0] - muscle.wrinkles.start) * muscle.length / (2.0 * muscle.half_wavelength)
    fold, parts = np.floor(place).astype(int), volumes(surface)
    fold = np.clip(fold, 0, muscle.wrinkles.count - 1)  # triangles that lie half in the region belong to its ends
    return np.stack([np.bincount(fold, parts), np.bincount(fold, np.abs(parts))], axis=1)


def on_plate(levels: range, seeds: int = 3) -> dict[str, list[float]]:
    """Return, by level: edge length, net share of the volume in %, and error of the displaced volume in % (root mean
    squares over some meshes).
    """
    muscle, out = sheet(), dict[str, list[float]](edge=[], net=[], displaced=[])
    exact = displaced_exactly(muscle)
    for level in levels:
        edges, nets, off = [], [], []
        for seed in range(seeds):
            sim = squeezed(plate(muscle, seed=seed), EPSILON, layers=[_unbounded()])
            surface = wrinkled_surface(sim, uniform(sim.face, level))
            parts = volumes(surface)
            a, b, _ = surface.rest[surface.triangles].transpose(1, 0, 2)
            edges.append(np.linalg.norm(a - b, axis=1).mean())
            nets.append(share(parts))
            off.append(100.0 * (np.abs(parts).sum() / exact - 1.0))
        for name, values in (("edge", edges), ("net", nets), ("displaced", off)):
            out[name].append(float(np.sqrt(np.mean(np.square(values)))))
    return out


def displaced_exactly(muscle: fw.SheetMuscle) -> float:
    """Return the integral of |H At A| over the compressed plate, mm^3."""
    style = muscle.wrinkles
    _, _, size = quadrature(style.alpha, muscle.half_wavelength, style.depth)[0]
    nodes, weights = np.polynomial.legendre.leggauss(40)
    across = style.core + (1.0 - style.core) * (0.5 + 0.5 * nodes)
    fade = equations.attenuation(equations.band(across, style.core, 1.0), style.falloff)
    width = muscle.width * (style.core + (1.0 - style.core) * 0.5 * float(weights @ fade))
    return float(style.count * size * width * equations.anisotropy(EPSILON) * (1.0 - EPSILON))


def ladder(sim: fw.Simulation, level: int) -> dict[str, float]:
    """Return the net share of the volume in % as each of STEPS is added to H, on a fine mesh but for the last."""
    face, rates = sim.face, rates_of(sim)
    fine = wrinkling(face, rates, level)
    surface = wrinkled_surface(sim, fine, [_unbounded()])
    rest, area = surface.rest / face.unit, vertex_areas(surface.rest, surface.triangles)
    plain, faded = np.zeros(len(rest)), np.zeros(len(rest))
    for name, rate in rates.items():
        muscle = face.muscles[name].fold_pattern
        where = np.flatnonzero(muscle.wrinkling_region(rest))
        k0 = muscle.wrinkles.depth * rate
        plain[where] += k0 * muscle.height(rest[where])
        faded[where] += k0 * muscle.unit_amplitude(rest[where])
    return {
        "H": share(plain * area),
        "H At": share(faded * area),
        "H At A": share(volumes(surface)),
        "bounded": share(volumes(wrinkled_surface(sim, fine, [MuscleWrinkles()]))),
        "default mesh": share(volumes(wrinkled_surface(sim))),
    }


def of_frame(expression: str, folds: str) -> float:
    """Return the net share in % of the displaced volume of a whole face, in a kind of folds."""
    return share(volumes(wrinkled_surface(settled(fw.default_face(), expression, folds=folds))))


def report(quick: bool = False) -> Report:
    """Return the report on everything, or on coarser meshes."""
    cycle = quadrature(np.linspace(0.0, 4.0, 17))
    worst = max(abs(net / size) for _, net, size in cycle)
    mesh = on_plate(range(5 if quick else 6), 2 if quick else 4)
    orders = {name: order(mesh["edge"][1:], mesh[name][1:]) for name in ("net", "displaced")}
    default = squeezed(plate(sheet()), EPSILON, layers=[_unbounded()])
    for _ in default.run(6):
        pass
    folds = by_fold(wrinkled_surface(default), sheet())
    flat = [(name, *in_the_plane(muscle, 1000 if quick else 4000)) for name, muscle in regions().items()]
    face = with_printed_muscles(fw.default_face())
    rungs = {}
    for name in EXPRESSIONS:
        rungs[name] = ladder(settled(face, name, layers=[MuscleWrinkles()]), 3 if quick else 5)
    sizes = [abs(rung["default mesh"]) for rung in rungs.values()]
    whole = [(name, *(of_frame(name, folds) for folds in KINDS)) for name in EXPRESSIONS]
    largest = max(abs(share) for _, *shares in whole for share in shares)
    tables = [
        Table(
            "The plate: net volume, and error of the displaced volume, in % of the displaced volume",
            ("level", "edge (mm)", "net", "displaced"),
            [*((k, *(mesh[c][k] for c in mesh)) for k in range(len(mesh["net"]))), ("order", np.nan, *orders.values())],
        ),
        Table(
            "The plate at the default resolution, fold by fold (mm³)", ("fold", "net", "displaced"),
            [*((k + 1, *folds[k]) for k in range(len(folds))), ("all", *folds.sum(axis=0))],
        ),
        Table("Regions in the plane: net in % of the displaced volume", ("region", "H", "H At"), flat),
        Table(
            "The head, mended folds of the paper's muscles: net in % of the displaced volume", ("expression", *STEPS),
            [(name, *rung.values()) for name, rung in rungs.items()],
        ),
        Table(
            "The frames of whole faces, by the kind of folds: net in % of the displaced volume", ("expression", *KINDS),
            whole,
        ),
    ]  # fmt: skip
    return Report(
        "volume",
        "Volume of wrinkles",
        "The integral of H over a cycle, and the signed volume between the wrinkled and the bare surface as "
        "attenuation, compression and the mesh come in.",
        f"The integral of H vanishes to {worst:.0e} of that of |H|, the net volume on an evenly compressed plate as "
        f"the edge length to the power {orders['net']:.1f}: {abs(share_of(folds)):.2f} % are left at the default "
        "resolution. On the head, uneven compression, tapering, and cycles that start where H is 0 in a region that "
        f"widens leave {min(sizes):.1f} to {max(sizes):.1f} % of the paper's muscles with mended folds, whatever the "
        f"mesh. Of whole faces, in each kind of folds, at most {largest:.1f} % are left.",
        tables,
        [_mesh_plot(mesh, orders), _ladder_plot(rungs)],
        {"cycle": worst, "plate": mesh, "orders": orders, "default net": share_of(folds), "head": rungs,
         "plane": {name: values for name, *values in flat}, "whole": {name: values for name, *values in whole}},
    )  # fmt: skip


def share_of(folds: Array) -> float:
    """Return the net share in % of folds (k, 2) together."""
    return 100.0 * float(folds[:, 0].sum() / folds[:, 1].sum())


def regions() -> dict[str, Muscle]:
    """Return one flat region of each kind, to see the effect of its shape."""
    style = Wrinkles(count=4, start=0.2, depth=1.0)
    tapered = Wrinkles(count=4, start=0.2, depth=1.0, taper=0.6)
    cone = fw.LinearMuscle((0, -25, 0), (0, 20, 0), 0.5, 50.0, wrinkles=style)
    ring = fw.SphincterMuscle((0, 0, 0), 40.0, 40.0, (0, 0, 1), (1, 0, 0), wrinkles=Wrinkles(count=4, depth=1.0))
    flat = fw.SheetMuscle([(-20, 25, 0), (20, 25, 0)], [(-20, -25, 0), (20, -25, 0)], wrinkles=style)
    return {
        "sheet": flat,
        "sheet, tapered": flat.replaced(taper=tapered.taper),
        "cone, straight folds": cone,
        "cone, straight folds from the bottom of a furrow, as printed": cone.replaced(ends="paper"),
        "cone, round folds": cone.replaced(fronts="round"),
        "ring, a circle": ring,
        "ring, an ellipse": ring.replaced(semi_minor=26.0),
    }


def _unbounded() -> MuscleWrinkles:
    return MuscleWrinkles(inextensible=False)


def _mesh_plot(mesh: dict[str, list[float]], orders: dict[str, float]) -> Plot:
    figure, (ax,) = plot(1, 1, (6.0, 3.8))
    labels = {"net": "net volume", "displaced": "error of the displaced volume"}
    for (name, label), color in zip(labels.items(), COLORS, strict=False):
        ax.plot(mesh["edge"], mesh[name], "o-", color=color, label=f"{label}: order {orders[name]:.2f}")
    ax.axhline(0.5, color="gray", linestyle="--", linewidth=1)
    log_scales(ax)
    ax.set(xlabel="mean edge (mm)", ylabel="% of the displaced volume")
    ax.legend(fontsize=8, frameon=False)
    return Plot(
        "mesh", figure,
        "An evenly compressed plate: net volume and error of the displaced volume against the length of the edges "
        "(level 0 is left out of the fits); dashed: 0.5 %.",
    )  # fmt: skip


def _ladder_plot(rungs: dict[str, dict[str, float]]) -> Plot:
    figure, (ax,) = plot(1, 1, (10.0, 3.8))
    width = 0.13
    for k, (step, color) in enumerate(zip(STEPS, COLORS, strict=False)):
        place = np.arange(len(rungs)) + (k - 2.0) * width
        ax.bar(place, [rung[step] for rung in rungs.values()], width * 0.92, color=color, label=step)
    ax.axhline(0.0, color="black", linewidth=0.8)
    ax.set_xticks(np.arange(len(rungs)), list(rungs))
    ax.set(ylabel="net, % of the displaced volume")
    ax.legend(fontsize=8, frameon=False, ncols=len(STEPS), loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return Plot(
        "ladder", figure,
        "Where the volume of wrinkles on the head comes from: H over its region, with attenuation and tapering (At), "
        "with the compression of the skin (A), within what skin of fixed length folds, and on the mesh of the frame.",
    )  # fmt: skip


if __name__ == "__main__":
    run_report(report)
