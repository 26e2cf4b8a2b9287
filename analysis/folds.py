"""Soundness of the skin in expressions: no triangle turned over, no lip in the other, no lid in the eye.

Every expression and action unit is held at full intensity, alone and in pairs (contractions added, up to 1).

    python -m analysis.folds [FACE.obj --landmarks LANDMARKS.json --units cm] [--every 7]
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

import facewrinkle as fw
from facewrinkle.geometry.rigid_alignment import closest_rotations
from facewrinkle.geometry.topology import vertex_rings

from .report import COLOURS, OUTPUT, Plot, Report, Table, plot, publish, run

Array = npt.NDArray[np.float64]


class Orientation:
    """Orientation of triangles relative to the rotation of the skin around each: negative for those turned over.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        At rest.
    triangles : ndarray of int, shape (m, 3)
    """

    def __init__(self, points: Array, triangles: npt.NDArray[np.int32]) -> None:
        n = len(points)
        start, ring = vertex_rings(triangles, n)
        first = csr_array((np.ones(len(ring)), ring, start), shape=(n, n))
        two = (first @ first + first).tocoo()
        self._from, self._to = two.coords
        self._triangles = triangles
        self._rest = points[self._to] - points[self._from]
        self._weight = 1.0 / np.maximum((self._rest**2).sum(axis=1), 1e-12)
        self._normals = self._crossed(points)

    def _crossed(self, points: Array) -> Array:
        a, b, c = (points[self._triangles[:, k]] for k in range(3))
        return np.asarray(np.cross(b - a, c - a))

    def shares(self, points: Array) -> Array:
        """Return the signed area (m,) of the triangles, relative to rest, along their rotated rest normals.

        The rotation of a normal is the one that fits two rings around its triangle best (Kabsch).
        """
        now, n = points[self._to] - points[self._from], len(points)
        spread = np.empty((n, 3, 3))
        for i in range(3):
            for j in range(3):
                spread[:, i, j] = np.bincount(self._from, self._weight * now[:, i] * self._rest[:, j], n)
        turn = closest_rotations(spread[self._triangles].sum(axis=1))
        rotated = np.einsum("tij,tj->ti", turn, self._normals)
        return np.asarray((self._crossed(points) * rotated).sum(axis=1) / (self._normals**2).sum(axis=1))


@dataclass(frozen=True)
class Soundness:
    """One mixture: triangles turned over, depth of skin in the eyes, and of lips in each other and the teeth, mm."""

    names: tuple[str, ...]
    turned_over: int
    in_eyes: float
    in_lips: float


def mixtures(face: fw.Face, every: int = 1) -> Iterator[tuple[tuple[str, ...], dict[str, float]]]:
    """Yield all different expressions and action units alone, and each `every`-th of their pairs."""
    library: dict[str, dict[str, float]] = {}
    for name, rates in {**face.atlas.expressions, **face.atlas.action_units}.items():
        if rates not in library.values() and all(muscle in face.muscles for muscle in rates):
            library[name] = rates
    k = 0
    for first, second in combinations_with_replacement(library, 2):
        if first == second:
            yield (first,), library[first]
            continue
        k += 1
        if k % every == 0:
            a, b = library[first], library[second]
            yield (first, second), {m: min(a.get(m, 0.0) + b.get(m, 0.0), 1.0) for m in {**a, **b}}


def soundness(face: fw.Face, every: int = 1, steps: int = 10) -> Iterator[Soundness]:
    """Yield the soundness of all mixtures on a face, each after a number of long steps from rest.

    A long step has as many iterations as the short ones in its place would have: with fewer, lips that meet do not
    settle.
    """
    skin = fw.Skin(face, time_step=0.1, iterations=15)
    orientation = Orientation(skin.points, face.triangles)
    rest = [np.linalg.norm(skin.points - eye.centre * face.unit, axis=1) for eye in face.eyes]
    for names, rates in mixtures(face, every):
        skin.reset()
        skin.contract(rates)
        for _ in range(steps):
            x = skin.step()
        eyes = [
            np.minimum(d, eye.radius * face.unit) - np.linalg.norm(x - eye.centre * face.unit, axis=1)
            for d, eye in zip(rest, face.eyes, strict=True)
        ]
        p = skin.contacts.lips
        on_mesh = x[skin.mesh.vertices]
        apart = ((on_mesh[p.vertices] - np.einsum("kc,kcj->kj", p.shares, on_mesh[p.corners])) * p.away).sum(axis=1)
        yield Soundness(
            names,
            int((orientation.shares(x) <= 0.0).sum()),
            float(max(e.max() for e in eyes)),
            float(np.maximum(-apart, 0.0).max(initial=0.0)),
        )


def report(rows: list[Soundness]) -> Report:
    """Return the report on some mixtures."""
    bad = [row for row in rows if row.turned_over or row.in_eyes > 0.1 or row.in_lips > 0.1]
    turned = sum(row.turned_over > 0 for row in rows)
    eyes, lips = (max(getattr(row, where) for row in rows) for where in ("in_eyes", "in_lips"))
    figure, axes = plot(1, 2, (9.0, 3.2))
    for ax, where in zip(axes, ("in_eyes", "in_lips"), strict=True):
        depths = [getattr(row, where) for row in rows]
        ax.hist(depths, bins=np.linspace(min(*depths, -0.1), max(*depths, 0.15), 41).tolist(), color=COLOURS[0])
        ax.axvline(0.1, color=COLOURS[1], linestyle="--", linewidth=1, label="not sound beyond")
        ax.set(xlabel=f"skin {where.replace('_', ' ')}, deepest (mm; below 0: free)", ylabel="mixtures")
    axes[0].legend(fontsize=7, frameon=False)
    return Report(
        "folds",
        "Soundness of the skin",
        "Triangles that turn over, and depths of skin in the eyes, the other lip or the teeth, in expressions, "
        "action units and pairs of them.",
        f"Of {len(rows)} mixtures {turned} turn triangles over; the deepest skin is "
        f"{eyes:.3f} mm in the eyes and {lips:.3f} mm in the lips.",
        [
            Table(
                "Mixtures that are not sound", ("mixture", "turned over", "in the eyes (mm)", "in the lips (mm)"),
                [(" + ".join(row.names), row.turned_over, row.in_eyes, row.in_lips) for row in bad],
            )
        ],
        [Plot("depths", figure, "Depth of skin in the eyes, and in lips and teeth, over all mixtures.")],
        {"mixtures": len(rows), "turned over": turned, "in eyes": eyes, "in lips": lips},
    )  # fmt: skip


def main(
    face: Path | None = None,
    *,
    landmarks: Path | None = None,
    units: str | None = None,
    every: int = 1,
    out: Path = OUTPUT,
) -> None:
    """Check that expressions keep the skin sound.

    Parameters
    ----------
    face
        A mesh. Default: the built-in head.
    landmarks
        JSON file with its landmarks. Default: found by its shape.
    units
        Unit of the mesh: mm, cm, ...
    every
        Check every n-th pair.
    out
        Folder for folds.json, the plot and the index page.
    """
    on = fw.default_face() if face is None else fw.fit_face(face, landmarks, units=units)
    publish(report(list(soundness(on, every))), out)


if __name__ == "__main__":
    run(main)
