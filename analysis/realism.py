"""How real the lines are: depths and spacings by region and age, at rest and in expressions, beside published ones.

A face is cut across the lines of a region by planes, and W, the height over the bare skin, is read along each cut. A
furrow is as deep as it lies below the lower of the crests on either side; lines are as far apart as the bottoms of
neighboring furrows. Of all cuts through a region the deepest furrows count, as in profilometry.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.signal import find_peaks

import facewrinkle as fw
from facewrinkle.simulation.fold_layers import fold_layers

from . import subjects
from .report import Report, Table, run_report

Array = npt.NDArray[np.float64]

AGES = (0.0, 0.5, 1.0)
CUTS = 9
"""Planes that cut a region, on each side of the face if it lies on both."""

MIDDLE = ("glabella", "forehead")
"""Regions over the middle of the face."""

SHALLOW = 0.03
"""Depth below which a furrow is not counted, mm."""


@dataclass(frozen=True)
class Region:
    """A region of lines.

    Attributes
    ----------
    axis : int
        The cuts have constant x (0) or constant y (1) in the axes of the head.
    units : str
        The action units that fold it, joined by +.
    at_rest, contracted, spacing : str
        What is published: depths, mm, at rest on old faces and in expressions, and the distance between lines, mm.
    """

    axis: int
    units: str
    at_rest: str
    contracted: str = ""
    spacing: str = ""


REGIONS = {
    "corners of the eyes": Region(0, "AU6+AU12", ".1 to .3, up to .5"),
    "corners of the mouth": Region(1, "AU15", ""),
    "glabella": Region(1, "AU4", "seen from 40 years on"),
    "beside the nose": Region(1, "AU6+AU12", "below .2 to above .8"),
    "forehead": Region(0, "AU1+AU2", ".1 to .4", ".5 to 1.5", "rest 6 to 14, contracted 5.8 to 7.9"),
}
"""Regions, in the order in which they age on people (Takema and others 1997). Sources are on the page "How real?"."""


def in_region(face: fw.Face, points: npt.ArrayLike, name: str) -> npt.NDArray[np.bool_]:
    """Return which points (n, 3) of a face lie in a region, on both sides, by distances in those between the pupils.

    Examples
    --------
    >>> face = fw.default_face()
    >>> [in_region(face, [face.landmarks["forehead_mid"]], name).item() for name in ("forehead", "glabella")]
    [True, False]
    """
    marks = {mark: face.frame.local(point) for mark, point in face.landmarks.items()}
    x, y, z = face.frame.local(np.asarray(points)).T
    front = z > min(marks["zygion_l"][2], marks["zygion_r"][2])
    low = max(marks["brow_l_mid"][1], marks["brow_r_mid"][1]) + 0.1
    if name == "forehead":
        high = marks["trichion"][1] if "trichion" in marks else np.inf
        return np.asarray(front & (y > low) & (y < high) & (np.abs(x) < marks["brow_l_outer"][0]))
    if name == "glabella":
        near = np.hypot(x - marks["glabella"][0], y - marks["glabella"][1]) < 0.25
        return np.asarray(front & near & (y <= low))
    inside = np.zeros(len(x), bool)
    for side, out in (("l", 1.0), ("r", -1.0)):
        eye, mouth, wing = marks[f"eye_{side}_outer"], marks[f"mouth_{side}"], marks[f"ala_{side}"]
        if name == "corners of the eyes":
            below = y < marks[f"brow_{side}_outer"][1]
            inside |= below & (out * (x - eye[0]) > 0.05) & (np.hypot(x - eye[0], y - eye[1]) < 0.4)
        elif name == "corners of the mouth":
            inside |= (y < mouth[1]) & (np.hypot(x - mouth[0], y - mouth[1]) < 0.35)
        else:
            aside = out * (x - wing[0])
            inside |= (y < wing[1] + 0.15) & (y > mouth[1]) & (aside > -0.05) & (aside < 0.5)
    return np.asarray(front & inside)


def cuts(face: fw.Face, frame: pv.PolyData, name: str) -> Iterator[tuple[Array, Array]]:
    """Yield distance along the skin at rest, mm, and W, mm, of each cut through a region, side by side: first left,
    then right if it lies on both sides of the middle.
    """
    axis = REGIONS[name].axis
    normal = face.frame.axes[axis]
    still = frame.copy()
    if "rest" in frame.point_data:
        still.points = np.asarray(frame["rest"])
    left = face.frame.local(still.points)[:, 0] > 0.0
    inside = in_region(face, still.points, name)
    for part in (inside,) if name in MIDDLE else (inside & left, inside & ~left):
        low, high = np.quantile(still.points[part] @ normal, (0.02, 0.98))
        skin = still.extract_points(part, include_cells=True)
        for level in np.linspace(low, high, CUTS):
            line = skin.slice(normal=normal, origin=level * normal)
            points, height = np.asarray(line.points), np.asarray(line["W"])
            along = points @ face.frame.axes[1 - axis]
            some = np.flatnonzero(in_region(face, points, name))
            some = some[np.argsort(along[some])]
            if len(some) > 4:
                step = np.linalg.norm(np.diff(points[some], axis=0), axis=1)
                yield face.unit * np.concatenate([[0.0], np.cumsum(step)]), height[some]


def furrows(distance: Array, height: Array) -> tuple[Array, Array]:
    """Return where furrows are along a cut, and how deep each is below the lower of its crests.

    Examples
    --------
    >>> distance = np.linspace(0.0, 30.0, 301)
    >>> where, deep = furrows(distance, 0.2 * np.cos(2.0 * np.pi * distance / 10.0))
    >>> where.tolist(), deep.round(2).tolist()
    ([5.0, 15.0, 25.0], [0.4, 0.4, 0.4])
    """
    found, about = find_peaks(-height, prominence=SHALLOW)
    return distance[found], np.asarray(about["prominences"])


def held(face: fw.Face, age: float, seed: int, units: str = "") -> pv.PolyData:
    """Return the frame in which a face of an age, with one drawing of its lines, holds action units joined by +."""
    sim = fw.Simulation(face, layers=fold_layers(face, "wave", age=age, seed=seed))
    if units:
        sim.express(dict.fromkeys(units.split("+"), 1.0))
    return sim.settle()


def measured(face: fw.Face, frame: pv.PolyData, name: str) -> tuple[float, float]:
    """Return depth and spacing of the lines in a region, mm: the ninth decile of the furrows, and the median distance.

    Where there is no furrow the depth is 0; where there are no two, the spacing is not a number.
    """
    found = [furrows(*cut) for cut in cuts(face, frame, name)]
    deep = np.concatenate([each[1] for each in found])
    gaps = np.concatenate([np.diff(each[0]) for each in found])
    return float(np.quantile(deep, 0.9)) if len(deep) else 0.0, float(np.median(gaps)) if len(gaps) else np.nan


def report(quick: bool = False) -> Report:
    """Report depths and spacings on the built-in head and a captured face, means over several drawings of the lines."""
    faces, seeds = [name for name in ("head-0", "ict-0") if name in subjects.names()], range(2)
    if quick:
        faces, seeds = faces[:1], range(1)
    rows: list[tuple[str | float, ...]] = []
    numbers: dict[str, dict[str, list[list[float]]]] = {}
    for subject in faces:
        face = subjects.subject(subject)
        frame = cache(partial(held, face))  # regions share faces at rest, and smiles
        for name, region in REGIONS.items():
            waves = name in ("forehead", "corners of the eyes")
            found = [
                np.mean([measured(face, frame(age, seed, units), name) for seed in seeds], axis=0)
                for units in ("", region.units)
                for age in AGES
            ]
            numbers.setdefault(subject, {})[name] = np.array(found).tolist()
            deep = [f"{depth:.2f}" for depth, _ in found]
            apart = [f"{found[k][1]:.1f}" if waves else "" for k in (2, 4)]
            rows.append(
                (subject, name, *deep[1:3], region.at_rest, *deep[3:], region.contracted, *apart, region.spacing)
            )
    eyes, forehead = (numbers[faces[0]][name] for name in ("corners of the eyes", "forehead"))
    return Report(
        "realism",
        "Lines by region and age",
        "Depth (ninth decile of the furrows, below the lower of their crests) and distance of lines, mm, on cuts across"
        f" each region, means of {len(seeds)} people. Contracted: AU6+12, AU15, "
        'AU4, AU6+12 and AU1+2. Published values are in columns of that name; sources are on the page "How real?".',
        f"At age .5 the corners of the eyes have {eyes[1][0] / eyes[2][0]:.0%} of their depth at rest, the forehead "
        f"{forehead[1][0] / forehead[2][0]:.0%}.",
        [
            Table(
                "Depths and spacings, mm",
                (
                    "face",
                    "region",
                    "rest, age .5",
                    "age 1",
                    "published",
                    "contracted, age 0",
                    ".5",
                    "1",
                    "published",
                    "apart at rest",
                    "contracted",
                    "published",
                ),
                rows,
            )
        ],
        numbers=numbers,
    )


if __name__ == "__main__":
    run_report(report)
