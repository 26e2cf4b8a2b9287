"""How far muscle-driven motion agrees with captured shapes.

Each pair sets one contraction at full strength, waits until the skin rests, and compares the displacements with those
of a captured expression on the same mesh: the cosine similarity of the flattened fields, plain and weighted by area,
the ratio of their sizes, and the mean distance in mm over the vertices that either field moves. A second table tells
how far furrows run across the direction in which the captured skin is compressed most.

    python -m analysis.motion FACE.obj --landmarks LANDMARKS.json --shapes SHAPES.npz --units cm --out output/motion
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyvista as pv

import facewrinkle as fw
from facewrinkle.export import output_folder
from facewrinkle.geometry.normals import vertex_areas, vertex_normals
from facewrinkle.layers.compression import StrainField, principal_compression

Array = npt.NDArray[np.float64]

PAIRS: tuple[tuple[str, str], ...] = (
    ("frontalis_inner_l", "browInnerUp_L"),
    ("frontalis_outer_l", "browOuterUp_L"),
    ("corrugator_l", "browDown_L"),
    ("zygomaticus_major_l", "mouthSmile_L"),
    ("zygomaticus_minor_l", "mouthUpperUp_L"),
    ("nasalis_l", "noseSneer_L"),
    ("depressor_anguli_oris_l", "mouthFrown_L"),
    ("risorius_l", "mouthStretch_L"),
    ("mentalis", "mouthShrugLower"),
    ("orbicularis_oculi_l", "eyeBlink_L"),
    ("orbicularis_oculi_orbital_l", "cheekSquint_L"),
    ("orbicularis_oris", "mouthPucker"),
    ("jaw", "jawOpen"),
)
"""The thirteen pairs; a contraction is a muscle, or a pair of muscles named without side."""

OTHERS: tuple[tuple[str, str], ...] = (
    ("levator_labii_superioris_l", "mouthUpperUp_L"),
    ("depressor_labii_inferioris_l", "mouthLowerDown_L"),
    ("buccinator_l", "mouthDimple_L"),
    ("levator_palpebrae_l", "eyeWide_L"),
    ("orbicularis_oculi_palpebral_l", "eyeSquint_L"),
    ("AU22", "mouthFunnel"),
    ("AU24", "mouthPress_L+mouthPress_R"),
    ("rectus_superior_l", "eyeLookUp_L"),
    ("rectus_inferior_l", "eyeLookDown_L"),
)
"""Muscles that the paper does not have, and action units; shapes joined by + are added."""

FOLDS: tuple[tuple[str, str], ...] = (
    ("frontalis_inner_l", "browInnerUp_L+browInnerUp_R"),
    ("frontalis_major_l", "browInnerUp_L+browOuterUp_L"),
    ("frontalis_outer_l", "browOuterUp_L"),
    ("corrugator_l", "browDown_L+browDown_R"),
    ("nasalis_l", "noseSneer_L+noseSneer_R"),
    ("zygomaticus_major_l", "mouthSmile_L"),
    ("zygomaticus_minor_l", "mouthUpperUp_L"),
    ("levator_labii_superioris_l", "mouthUpperUp_L"),
    ("risorius_l", "mouthStretch_L"),
    ("buccinator_l", "mouthDimple_L"),
    ("depressor_anguli_oris_l", "mouthFrown_L"),
    ("depressor_labii_inferioris_l", "mouthLowerDown_L"),
    ("mentalis_l", "mouthShrugLower"),
    ("orbicularis_oculi_orbital_l", "cheekSquint_L"),
    ("orbicularis_oris", "mouthPucker"),
)
"""Muscles whose furrows are compared with the compression in captured shapes."""


@dataclass(frozen=True)
class Agreement:
    """One contraction against one captured shape.

    Attributes
    ----------
    muscle, shape : str
    cosine, area_cosine : float
        Cosine similarity over all vertices, plain and weighted by their area.
    size : float
        Ours over the captured one (area-weighted root mean square).
    error : float
        Mean distance in mm over the vertices that either field moves by more than 0.2 mm.
    largest, captured : float
        Largest displacement of either, mm.
    """

    muscle: str
    shape: str
    cosine: float
    area_cosine: float
    size: float
    error: float
    largest: float
    captured: float


def compared(ours: Array, captured: Array, area: Array, muscle: str = "", shape: str = "") -> Agreement:
    """Compare two displacement fields (n, 3) in mm; `area` (n,) of the vertices."""
    weight = area[:, None]
    inner, area_inner = (ours * captured).sum(), (weight * ours * captured).sum()
    sizes = [np.sqrt((field**2).sum()) for field in (ours, captured)]
    area_sizes = [np.sqrt((weight * field**2).sum()) for field in (ours, captured)]
    length = np.linalg.norm(ours, axis=1), np.linalg.norm(captured, axis=1)
    moved = np.maximum(*length) > 0.2
    return Agreement(
        muscle,
        shape,
        float(inner / max(sizes[0] * sizes[1], 1e-300)),
        float(area_inner / max(area_sizes[0] * area_sizes[1], 1e-300)),
        float(area_sizes[0] / max(area_sizes[1], 1e-300)),
        float(np.linalg.norm(ours - captured, axis=1)[moved].mean()) if moved.any() else 0.0,
        float(length[0].max()),
        float(length[1].max()),
    )


def settled(skin: fw.Skin, rates: dict[str, float], steps: int = 15) -> Array:
    """Displacement (n, 3) in mm with these contraction rates, once the skin, which should have long steps, rests."""
    skin.reset()
    skin.contract(rates)
    for _ in range(steps):
        skin.step()
    return skin.displacement.copy()


def agreements(
    face: fw.Face, shapes: dict[str, Array], pairs: Iterable[tuple[str, str]] = PAIRS
) -> list[tuple[Agreement, Array]]:
    """Every pair whose muscle and shape exist, with our field."""
    skin = fw.Skin(face, time_step=1.0)
    area = vertex_areas(skin.points, face.triangles)
    out = []
    for muscle, shape in pairs:
        if set(shape.split("+")) <= set(shapes):
            ours = settled(skin, face.atlas.resolve(muscle))
            out.append((compared(ours, joined(shapes, shape), area, muscle, shape), ours))
    return out


def joined(shapes: dict[str, Array], name: str) -> Array:
    """The sum of the shapes whose names are joined by +."""
    return np.asarray(sum(shapes[part] for part in name.split("+")))


@dataclass(frozen=True)
class FoldAngle:
    """Furrows of one muscle in one captured shape.

    Attributes
    ----------
    muscle, shape : str
    epsilon : float
        Largest compression there (mean over the furrows, weighted by their depth, area and that compression).
    folds, fibres : float
        Mean angle in degrees, weighted alike, between the direction of that compression and the one across the furrows,
        and the one along the muscle's fibres, across which the paper lays them. Chance gives 45.
    """

    muscle: str
    shape: str
    epsilon: float
    folds: float
    fibres: float


def fold_angles(face: fw.Face, shapes: dict[str, Array], pairs: Iterable[tuple[str, str]] = FOLDS) -> list[FoldAngle]:
    """How far the furrows of each muscle run across the principal compression of the captured shape."""
    points, triangles = face.points * face.unit, face.triangles
    normals, area = vertex_normals(points, triangles), vertex_areas(points, triangles)
    field = StrainField(points, triangles)
    out = []
    for name, shape in pairs:
        if name not in face.muscles or not set(shape.split("+")) <= set(shapes):
            continue
        strain = field.strain(points + joined(shapes, shape))
        epsilon, principal_direction = principal_compression(strain, field.metric, normals)
        muscle = face.muscles[name]
        weight = muscle.fold_pattern.envelope(face.points) * area * np.maximum(epsilon, 0.0)
        if not weight.any():
            continue
        means = []
        for across in (muscle.fold_pattern.fold_direction(face.points), muscle.fold_direction(face.points)):
            tangent = across - (across * normals).sum(axis=1, keepdims=True) * normals
            length = np.maximum(np.linalg.norm(tangent, axis=1), 1e-12)
            cosine = np.abs((tangent * principal_direction).sum(axis=1)) / length
            means.append(float(np.average(np.degrees(np.arccos(np.minimum(cosine, 1.0))), weights=weight)))
        out.append(FoldAngle(name, shape, float(np.average(epsilon, weights=weight)), *means))
    return out


def read_shapes(path: Path, n_points: int, unit: float) -> dict[str, Array]:
    """Captured shapes in mm from an npz file with `names` (k,) and `deltas` (k, n, 3) in the unit of the mesh."""
    with np.load(path) as content:
        names, deltas = content["names"], np.asarray(content["deltas"], dtype=np.float64) * unit
    if deltas.shape[1:] != (n_points, 3):
        raise fw.FaceWrinkleError(
            f"the shapes in {path.name} have {deltas.shape[1:]} displacements, the mesh has {n_points} points."
        )
    return {str(name): delta for name, delta in zip(names, deltas, strict=True)}


def table(rows: Iterable[Agreement]) -> str:
    """The numbers as text, with their means."""
    rows = list(rows)
    lines = [f"{'muscle':30s}{'captured shape':26s}{'cosine':>7s}{'area':>7s}{'size':>7s}{'error':>7s}{'mm':>12s}"]
    lines += [
        f"{r.muscle:30s}{r.shape:26s}{r.cosine:7.2f}{r.area_cosine:7.2f}{r.size:7.2f}{r.error:7.2f}"
        f"{r.largest:6.1f}/{r.captured:4.1f}"
        for r in rows
    ]
    if rows:
        means = [float(np.mean([getattr(r, name) for r in rows])) for name in ("cosine", "area_cosine")]
        lines.append(f"{'mean':56s}{means[0]:7.2f}{means[1]:7.2f}")
    return "\n".join(lines)


def fold_table(rows: Iterable[FoldAngle]) -> str:
    """The angles as text."""
    lines = [f"{'furrows of':30s}{'captured shape':30s}{'epsilon':>8s}{'angle':>7s}{'of fibres':>11s}"]
    lines += [f"{r.muscle:30s}{r.shape:30s}{r.epsilon:8.2f}{r.folds:7.0f}{r.fibres:11.0f}" for r in rows]
    return "\n".join(lines)


def draw(face: fw.Face, ours: Array, captured: Array, path: Path) -> None:
    """Both fields side by side: the moved faces, coloured by the size of the displacement."""
    plotter = pv.Plotter(off_screen=True, shape=(1, 2), window_size=[1000, 560])
    largest = float(max(np.linalg.norm(field, axis=1).max() for field in (ours, captured)))
    for column, field in enumerate((ours, captured)):
        moved = face.mesh.copy()
        moved.points = face.points + field / face.unit
        moved.point_data.pop("Normals", None)
        moved["mm"] = np.linalg.norm(field, axis=1)
        plotter.subplot(0, column)
        plotter.add_mesh(moved, scalars="mm", clim=(0.0, largest), cmap="viridis", smooth_shading=True)
        plotter.camera.position = face.frame.origin + 7.0 * face.frame.pupil_distance * face.frame.axes[2]
        plotter.camera.focal_point = face.frame.origin - 0.4 * face.frame.pupil_distance * face.frame.axes[1]
        plotter.camera.up = face.frame.axes[1]
    plotter.screenshot(path)
    plotter.close()


def main() -> None:
    """Print the table, and write it with the pictures."""
    parser = argparse.ArgumentParser(description="Compare muscle-driven motion with captured shapes.")
    parser.add_argument("face", type=Path)
    parser.add_argument("--landmarks", type=Path, required=True)
    parser.add_argument("--shapes", type=Path, required=True, help="npz with names (k,) and deltas (k, n, 3)")
    parser.add_argument("--units", default=None, help="unit of the mesh and of the shapes: mm, cm, ...")
    parser.add_argument("--out", type=Path, default=None, help="folder for motion.json and the pictures")
    arguments = parser.parse_args()
    face = fw.fit_face(arguments.face, arguments.landmarks, units=arguments.units)
    shapes = read_shapes(arguments.shapes, face.mesh.n_points, face.unit)
    pairs, others = agreements(face, shapes), agreements(face, shapes, OTHERS)
    print(table(row for row, _ in pairs))
    print("\n" + table(row for row, _ in others))
    angles = fold_angles(face, shapes)
    print("\n" + fold_table(angles))
    if arguments.out is not None:
        folder = output_folder(arguments.out)
        rows = {"pairs": [asdict(row) for row, _ in pairs], "others": [asdict(row) for row, _ in others]}
        rows["folds"] = [asdict(row) for row in angles]
        (folder / "motion.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        for row, ours in pairs:
            draw(face, ours, shapes[row.shape], folder / f"{row.muscle}_{row.shape}.png")


if __name__ == "__main__":
    main()
