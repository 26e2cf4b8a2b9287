"""Are creases steps of flesh, or cuts?

A face is cut across each crease of its atlas at full contraction. Where captured skin creases, the flesh on one side
comes forward over the line, and beyond the line the skin goes on as it was: its slope does not turn back. A furrow has
a far wall, which does. The line is at the origin of a cut, the crest of the fold at positive places; slopes are taken
over 1 mm.

    python -m analysis.creases FACE.obj --landmarks LANDMARKS.json --shapes SHAPES.npz --units cm
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt
import pyvista as pv

import facewrinkle as fw
from facewrinkle.anatomy.muscles import Crease
from facewrinkle.geometry.interpolation import closest, interpolated

from .motion import run_on_captured, summed
from .report import COLORS, Plot, Report, Table, plot

Array = npt.NDArray[np.float64]

CREASES: dict[str, tuple[str, str, str]] = {
    "beside the nose": ("AU12", "zygomaticus_major_l", "mouthSmile_L+mouthSmile_R"),
    "beside the nose, upper lip": ("AU10", "levator_labii_superioris_l", "mouthUpperUp_L+mouthUpperUp_R"),
    "corner of the mouth": ("AU20", "risorius_l", "mouthStretch_L+mouthStretch_R"),
    "dimple": ("AU14", "buccinator_l", "mouthDimple_L+mouthDimple_R"),
    "below the corner": ("AU15", "depressor_anguli_oris_l", "mouthFrown_L+mouthFrown_R"),
    "between the brows": ("AU4", "corrugator_l", "browDown_L+browDown_R"),
    "lower lid": ("AU7", "orbicularis_oculi_palpebral_l", "eyeSquint_L+eyeSquint_R"),
}
"""The action unit that folds each crease, the muscle that it is of, and the captured shapes of that unit."""

PLACES = (0.3, 0.5, 0.7)
"""Places along a crease, from its start to its end, at which it is cut."""

STEP = 1.0
"""Slopes are those between places this far apart along the skin, mm."""


@dataclass(frozen=True, eq=False)
class Cut:
    """A cut across a crease.

    Attributes
    ----------
    place : ndarray, shape (k,)
        Distance along the bare, moved skin from the line, mm; positive on the side of the crest.
    height : ndarray, shape (k,)
        W: how far the crease lifts the skin, mm.
    skin : ndarray, shape (k, 2)
        The skin that is seen: across the crease, and forwards from the face, mm.
    """

    place: Array
    height: Array
    skin: Array

    @property
    def turn(self) -> float:
        """Steepest slope, degrees, with which the skin rises again beyond the line, against the bare skin."""
        away = np.arange(0.0, -self.place[0], STEP)
        return float(np.degrees(np.arctan(np.diff(np.interp(-away, self.place, self.height)).max(initial=0.0) / STEP)))

    @property
    def bend(self) -> float:
        """Sharpest bend, degrees/mm, of the skin against the bare skin."""
        return bend(self.place, self.height)

    @property
    def slopes(self) -> tuple[float, float]:
        """Least and largest slope, degrees, against the plane of the face, within 8 mm of the line."""
        near = np.abs(self.place) <= 8.0
        across, forward = self.skin[near].T
        slope = np.degrees(_slopes(across, forward))
        return float(slope.min()), float(slope.max())

    @property
    def sharpest(self) -> float:
        """Sharpest bend, degrees/mm, of the skin itself within 8 mm of the line."""
        near = np.abs(self.place) <= 8.0
        return bend(*self.skin[near].T)


def _slopes(along: Array, height: Array) -> Array:
    at = np.arange(along.min(), along.max(), STEP)
    order = np.argsort(along)
    return np.arctan(np.diff(np.interp(at, along[order], height[order])) / STEP)


def bend(along: Array, height: Array) -> float:
    """Return the sharpest bend of a profile, degrees/mm: the change from one slope to the next.

    Examples
    --------
    A roof with slopes of 45 degrees, and a circle of 60 mm:

    >>> x = np.linspace(-8.0, 8.0, 1601)
    >>> round(bend(x, -np.abs(x)))
    90
    >>> round(bend(x, np.sqrt(60.0**2 - x**2)), 2), round(np.degrees(1.0 / 60.0), 2)
    (0.97, 0.95)
    """
    return float(np.abs(np.degrees(np.diff(_slopes(along, height)))).max(initial=0.0) / STEP)


def cuts(face: fw.Face, frame: pv.PolyData, crease: Crease) -> Iterator[Cut]:
    """Yield the cuts across a crease of a face, from its start to its end, of a frame."""
    unit, triangles = face.unit, np.asarray(frame.regular_faces, np.int32)
    rest, points = np.asarray(frame["rest"], np.float64), np.asarray(frame.points, np.float64)
    height = np.asarray(frame["W"]) if "W" in frame.point_data else np.zeros(len(points))
    bare = points - height[:, None] * np.asarray(frame["Normals"]) / unit
    first, last = crease.span
    across = np.linspace(-0.38, 0.8, 119)
    for place in PLACES:
        along = np.full(len(across), first + place * (last - first))
        found = [closest(rest, triangles, at) for at in crease.points_at(along, across)]
        own, share = triangles[[t for t, *_ in found]], np.array([weights for _, weights, _ in found])
        seen, below, lifted = (interpolated(v, own, share) for v in (points * unit, bare * unit, height[:, None]))
        steps = np.linalg.norm(np.diff(below, axis=0), axis=1)
        some = np.append(True, steps > 1e-6)
        way = np.append(0.0, np.cumsum(steps))
        forward = face.frame.axes[2]
        side = crease.fold_direction(crease.points_at(along[:1], [0.0]))[0]
        side -= (side @ forward) * forward
        skin = np.stack([seen @ side / np.linalg.norm(side), seen @ forward], axis=1)
        yield Cut((way - np.interp(0.0, across, way))[some], lifted[some, 0], skin[some])


@dataclass(frozen=True)
class Row:
    """One crease of a face, the worst of its cuts: see :class:`Cut`."""

    crease: str
    units: str
    turn: float
    bend: float
    slopes: tuple[float, float]
    sharpest: float


def folded(face: fw.Face, units: str, age: float = 0.0) -> pv.PolyData:
    """Return the frame of a face of an age in which an action unit has folded its creases, and nothing else."""
    sim = fw.Simulation(face, layers=[fw.Creases(age=age)])
    sim.express(units)
    return sim.settle()


def moved(face: fw.Face, field: Array) -> pv.PolyData:
    """Return the bare skin of a face moved by a captured displacement (n, 3), mm."""
    frame = fw.Simulation(face, layers=[]).step().copy()
    frame.points = face.points + field / face.unit
    frame["W"] = np.zeros(len(face.points))
    return frame


def row(crease: str, units: str, found: list[Cut]) -> Row:
    """Return the worst of the cuts across a crease."""
    least, largest = np.transpose([cut.slopes for cut in found])
    worst = max(cut.turn for cut in found), max(cut.bend for cut in found)
    slopes = float(least.min()), float(largest.max())
    return Row(crease, units, *worst, slopes, max(cut.sharpest for cut in found))


def creases(face: fw.Face, age: float = 0.0) -> list[tuple[Row, list[Cut]]]:
    """Return every crease of a face of an age, with the cuts across it."""
    found = []
    for name, (units, muscle, _) in CREASES.items():
        pattern = face.muscles[muscle].fold_pattern
        assert isinstance(pattern, Crease)
        own = list(cuts(face, folded(face, units, age), pattern))
        found.append((row(name, units, own), own))
    return found


def captured_creases(face: fw.Face, shapes: dict[str, Array]) -> list[tuple[Row, list[Cut]]]:
    """Return the same places of captured skin."""
    found = []
    for name, (_, muscle, shape) in CREASES.items():
        pattern = face.muscles[muscle].fold_pattern
        assert isinstance(pattern, Crease)
        own = list(cuts(face, moved(face, summed(shapes, shape)), pattern))
        found.append((row(name, shape, own), own))
    return found


def report(face: fw.Face, shapes: dict[str, Array]) -> Report:
    """Report the creases of a captured face at ages 0 and 1, beside its captured skin."""
    young, old, truth = creases(face), creases(face, 1.0), captured_creases(face, shapes)
    rows = [
        (a.crease, a.units, a.turn, a.bend, b.turn, b.bend, *map(_spread, (a.slopes, c.slopes)), a.sharpest, c.sharpest)
        for (a, _), (b, _), (c, _) in zip(young, old, truth, strict=True)
    ]
    heads = "crease", "units", "turns back", "bends", "at age 1", "", "slopes", "captured", "bends", "captured"
    kinds = {"captured": truth, "age 0": young, "age 1": old}
    return Report(
        "creases",
        "Creases: steps of flesh, or cuts",
        "Cuts across each crease at full contraction, the worst of three: the slope, degrees, with which the skin "
        "rises again beyond the line, and the sharpest bend, degrees/mm, against the bare skin; then slopes against "
        "the plane of the face, and the sharpest bend, of the skin itself, beside those of captured skin.",
        f"At age 0 the skin turns back by at most {max(a.turn for a, _ in young):.0f} degrees and bends by at most "
        f"{max(a.bend for a, _ in young):.0f} degrees/mm; at age 1 by {max(a.turn for a, _ in old):.0f} and "
        f"{max(a.bend for a, _ in old):.0f}.",
        [Table("Creases", heads, rows)],
        [_cuts_plot(kinds)],
        {name: [asdict(a) for a, _ in found] for name, found in kinds.items()},
    )


def _spread(slopes: tuple[float, float]) -> str:
    return "{:.0f} to {:.0f}".format(*slopes)


def _cuts_plot(kinds: dict[str, list[tuple[Row, list[Cut]]]]) -> Plot:
    figure, axes = plot(2, 4, (12.0, 5.5))
    for ax in axes[len(CREASES) :]:
        ax.set_axis_off()
    for k, (name, ax) in enumerate(zip(CREASES, axes, strict=False)):
        for (label, found), color in zip(kinds.items(), ("black", *COLORS), strict=False):
            cut = found[k][1][1]
            across, forward = (cut.skin - cut.skin[np.argmin(np.abs(cut.place))]).T
            ax.plot(across, forward, color=color, linewidth=1.2, label=label)
        ax.set_title(f"{name} ({CREASES[name][0]})", fontsize=8)
        ax.set_aspect("equal")
    axes[0].legend(fontsize=7, frameon=False)
    return Plot("cuts", figure, "The skin halfway along each crease, mm; the line is at 0, forwards is up.")


if __name__ == "__main__":
    run_on_captured(report)
