"""Faces found in many poses: ``python -m analysis.finding [POSES]`` prints a table.

The built-in head and the real faces beside the repository, turned, scaled (1e-3 to 1e3) and shifted at random, are
searched as they are and spoiled in turn. Errors are in % of the distance between the pupils.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pyvista as pv
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import frame_of, read_landmarks
from facewrinkle.mesh import to_polydata

FACES = Path(__file__).parents[2] / "shared" / "faces"
PAIRS = tuple(name.format(side) for name in ("eye_{}_inner", "mouth_{}") for side in "lr")
CENTRAL = ("nose_tip", "subnasale", "nasion", "upper_lip_mid", "lower_lip_mid", *PAIRS)
MORE = (*CENTRAL, "eye_l_outer", "eye_r_outer", "ala_l", "ala_r", "pogonion", "menton")

Marks = dict[str, np.ndarray]


def faces() -> Iterator[tuple[str, pv.PolyData, Marks]]:
    """Name, mesh and documented landmarks."""
    head = fw.default_face()
    yield "built-in", head.mesh, head.landmarks
    for path in sorted(FACES.glob("*.landmarks.json")):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fw.FaceWrinkleWarning)
            stem = path.name.removesuffix(".landmarks.json")
            yield stem, fw.read_surface(FACES / f"{stem}.obj"), read_landmarks(path)


def _noisy(mesh: pv.PolyData, size: float) -> pv.PolyData:
    rng, other = np.random.default_rng(0), mesh.copy()
    other.points += 0.01 * size * rng.normal(size=mesh.points.shape)
    return other


def _coarse(mesh: pv.PolyData, size: float) -> pv.PolyData:
    return mesh.decimate(1.0 - 1500 / mesh.n_cells) if mesh.n_cells > 1500 else mesh


def _fine(mesh: pv.PolyData, size: float) -> pv.PolyData:
    times = int(np.ceil(np.log(200_000 / mesh.n_cells) / np.log(4.0)))
    return to_polydata(mesh.points, mesh.regular_faces).subdivide(times)


def _inside_out(mesh: pv.PolyData, size: float) -> pv.PolyData:
    return to_polydata(mesh.points, mesh.regular_faces[:, ::-1])


SPOILED: dict[str, Callable[[pv.PolyData, float], pv.PolyData]] = {
    "as it is": lambda mesh, size: mesh,
    "noise of 1 %": _noisy,
    "1,500 triangles": _coarse,
    "inside out": _inside_out,
    "200,000 triangles": _fine,
}


def main(count: int = 75) -> None:
    """Search every face in so many poses and print what came out."""
    print(
        f"{'face':32s} {'how':18s} {'poses':>5s} {'found':>5s} {'central':>8s} {'worst':>6s} {'more':>6s} {'conf.':>6s}"
    )
    for name, mesh, marks in faces():
        size = frame_of(marks).pupil_distance
        for number, (how, spoiled) in enumerate(SPOILED.items()):
            other = spoiled(mesh, size)
            rows = [_searched(other, marks, seed) for seed in range(number, count, len(SPOILED))]
            if not rows:
                continue
            good, central, worst, more, confidence = np.array(rows).T
            print(
                f"{name:32s} {how:18s} {len(rows):5d} {int(good.sum()):5d} {central.mean():8.1f} {worst.max():6.1f} "
                f"{more.mean():6.1f} {confidence.min():6.2f}",
                flush=True,
            )


def _searched(mesh: pv.PolyData, marks: Marks, seed: int) -> tuple[float, ...]:
    """Whether the pose was found, three errors, and the confidence."""
    rng = np.random.default_rng(seed)
    turn, scale = Rotation.random(rng=rng).as_matrix(), 10.0 ** rng.uniform(-3.0, 3.0)
    shift = scale * np.ptp(np.asarray(mesh.points)) * rng.normal(size=3)
    moved = to_polydata(scale * np.asarray(mesh.points) @ turn.T + shift, mesh.regular_faces)
    truth = {name: scale * turn @ point + shift for name, point in marks.items()}
    frame = frame_of(truth)
    found = fw.find_landmarks(moved)
    off = {n: 100.0 * float(np.linalg.norm(found.landmarks[n] - truth[n])) / frame.pupil_distance for n in MORE}
    good = np.trace(found.pose.axes @ frame.axes.T) > 1.0 + 2.0 * np.cos(np.radians(10.0))
    central = [off[name] for name in CENTRAL]
    return float(good), np.mean(central), max(central), np.mean(list(off.values())), found.confidence


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
