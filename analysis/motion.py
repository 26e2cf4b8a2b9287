"""Agreement of muscle-driven motion with captured shapes.

Each pair sets one contraction at full strength, waits until the skin rests, and compares the displacements with those
of a captured expression on the same mesh: the cosine similarity of the flattened fields, plain and weighted by area,
the ratio of their sizes, and the mean distance in mm over the vertices that either field moves. A second table
compares the direction of furrows with the direction in which the captured skin is compressed most.

    python -m analysis.motion FACE.obj --landmarks LANDMARKS.json --shapes SHAPES.npz --units cm
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyvista as pv

import facewrinkle as fw
from facewrinkle.geometry.normals import vertex_areas, vertex_normals
from facewrinkle.layers.compression import StrainField, principal_compression

from .report import COLORS, OUTPUT, Plot, Report, Table, plot, publish, run
from .subjects import FACES

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
"""The thirteen pairs; a contraction is that of a muscle, or of both muscles of a pair, named without side."""

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
        Size of our field over that of the captured one (root mean square, weighted by area).
    error : float
        Mean distance in mm over the vertices that either field moves by more than 0.2 mm.
    largest, captured : float
        Largest displacements, ours and the captured one, mm.
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
    """Compare two displacement fields (n, 3) in mm; `area` (n,) is that of the vertices."""
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


AT_REST = 1e-3
"""Skin has come to rest if no point moves farther in a step, mm."""


def settled(skin: fw.Skin, rates: dict[str, float], steps: int = 15) -> Array:
    """Return the displacement (n, 3) in mm at which the skin rests with these rates; long time steps are quickest."""
    skin.reset()
    skin.contract(rates)
    before = skin.displacement
    for _ in range(steps):
        skin.step()
        if np.abs(skin.displacement - before).max() < AT_REST:
            break
        before = skin.displacement
    return skin.displacement.copy()


def agreements(
    face: fw.Face, shapes: dict[str, Array], pairs: Iterable[tuple[str, str]] = PAIRS
) -> list[tuple[Agreement, Array]]:
    """Return the agreement of every pair whose muscle and shape exist, with our displacement field."""
    skin = fw.Skin(face, time_step=1.0)
    area = vertex_areas(skin.points, face.triangles)
    out = []
    for muscle, shape in pairs:
        if set(shape.split("+")) <= set(shapes):
            ours = settled(skin, face.atlas.resolve(muscle))
            out.append((compared(ours, summed(shapes, shape), area, muscle, shape), ours))
    return out


def summed(shapes: dict[str, Array], name: str) -> Array:
    """Return the sum of the shapes whose names are joined by +."""
    return np.asarray(sum(shapes[part] for part in name.split("+")))


@dataclass(frozen=True)
class FoldAngle:
    """Furrows of one muscle in one captured shape.

    Attributes
    ----------
    muscle, shape : str
    epsilon : float
        Largest compression there (mean over the furrows, weighted by their depth, area and that compression).
    folds, fibers : float
        Mean angle in degrees, weighted alike, between the direction of that compression and the one across the furrows,
        and the one along the muscle's fibers, across which the paper lays them. Chance gives 45.
    """

    muscle: str
    shape: str
    epsilon: float
    folds: float
    fibers: float


def fold_angles(face: fw.Face, shapes: dict[str, Array], pairs: Iterable[tuple[str, str]] = FOLDS) -> list[FoldAngle]:
    """Return the angles of the furrows of each muscle to the principal compression of the captured shape."""
    points, triangles = face.points_mm, face.triangles
    normals, area = vertex_normals(points, triangles), vertex_areas(points, triangles)
    field = StrainField(points, triangles)
    out = []
    for name, shape in pairs:
        if name not in face.muscles or not set(shape.split("+")) <= set(shapes):
            continue
        strain = field.strain(points + summed(shapes, shape))
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
    """Read captured shapes (mm) from an npz file with `names` (k,) and `deltas` (k, n, 3) in the unit of the mesh."""
    with np.load(path) as content:
        names, deltas = content["names"], np.asarray(content["deltas"], dtype=np.float64) * unit
    if deltas.shape[1:] != (n_points, 3):
        raise fw.FaceWrinkleError(
            f"the shapes in {path.name} have {deltas.shape[1:]} displacements, the mesh has {n_points} points."
        )
    return {str(name): delta for name, delta in zip(names, deltas, strict=True)}


BAR = {"title": "mm", "vertical": True, "position_x": 0.85, "position_y": 0.25, "height": 0.5, "width": 0.08}


def picture(face: fw.Face, ours: Array, captured: Array) -> npt.NDArray[np.uint8]:
    """Draw both fields side by side: the moved faces, colored by the size of the displacement."""
    plotter = pv.Plotter(off_screen=True, shape=(1, 2), window_size=[1000, 560])
    largest = float(max(np.linalg.norm(field, axis=1).max() for field in (ours, captured)))
    for column, field in enumerate((ours, captured)):
        moved = face.mesh.copy()
        moved.points = face.points + field / face.unit
        moved.point_data.pop("Normals", None)
        moved["mm"] = np.linalg.norm(field, axis=1)
        plotter.subplot(0, column)
        plotter.add_mesh(
            moved, scalars="mm", clim=(0.0, largest), cmap="viridis", smooth_shading=True, scalar_bar_args=BAR
        )
        plotter.camera.position = face.frame.origin + 7.0 * face.frame.pupil_distance * face.frame.axes[2]
        plotter.camera.focal_point = face.frame.origin - 0.4 * face.frame.pupil_distance * face.frame.axes[1]
        plotter.camera.up = face.frame.axes[1]
    image = np.array(plotter.screenshot(None, return_img=True))
    plotter.close()
    return image


def report(face: fw.Face, shapes: dict[str, Array], pictures: bool = True) -> Report:
    """Report all pairs on a captured face, with a picture of each."""
    pairs, others = agreements(face, shapes), agreements(face, shapes, OTHERS)
    rows, angles = [row for row, _ in pairs], fold_angles(face, shapes)
    figure, axes = plot(1, 2, (11.0, 4.0))
    for k, (name, label) in enumerate({"cosine": "cosine", "area_cosine": "weighted by area", "size": "size"}.items()):
        place = np.arange(len(rows)) + 0.27 * (k - 1)
        axes[0].barh(place, [getattr(row, name) for row in rows], 0.25, color=COLORS[k], label=label)
    axes[0].set_yticks(np.arange(len(rows)), [row.muscle for row in rows], fontsize=7)
    for k, (name, label) in enumerate({"folds": "furrows", "fibers": "across the fibers, as in the paper"}.items()):
        place = np.arange(len(angles)) + 0.4 * (k - 0.5)
        axes[1].barh(place, [getattr(row, name) for row in angles], 0.36, color=COLORS[k], label=label)
    axes[1].set_yticks(np.arange(len(angles)), [row.muscle for row in angles], fontsize=7)
    axes[0].set(xlabel="cosine, or size over the captured one")
    axes[1].set(xlabel="angle to the largest compression (degrees)")
    for ax in axes:
        ax.invert_yaxis()
        ax.legend(fontsize=7, frameon=False, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    plots = [Plot("agreement", figure, "Agreement of the muscles with captured shapes, and how furrows run.")]
    if pictures:
        plots += [
            Plot(f"{row.muscle}_{row.shape}", picture(face, ours, summed(shapes, row.shape)),
                 f"{row.muscle} (left) and the captured {row.shape}: cosine {row.cosine:.2f}.")
            for row, ours in pairs
        ]  # fmt: skip
    names = ("muscle", "shape", "cosine", "by area", "size", "error (mm)", "largest (mm)", "captured (mm)")
    return Report(
        "motion",
        "Motion of muscles",
        "Displacements of muscles at full contraction against those of captured expressions on the same mesh, and the "
        "angle of furrows to the direction in which the captured skin is compressed most.",
        f"Mean cosine {np.mean([r.cosine for r in rows]):.2f} (the least {min(r.cosine for r in rows):.2f}), weighted "
        f"by area {np.mean([r.area_cosine for r in rows]):.2f}; on average furrows run "
        f"{np.mean([a.folds for a in angles]):.0f} degrees off, and across the fibers they would run "
        f"{np.mean([a.fibers for a in angles]):.0f} degrees off.",
        [
            Table("The thirteen pairs", names, [tuple(asdict(row).values()) for row in rows]),
            Table("Others", names, [tuple(asdict(row).values()) for row, _ in others]),
            Table("Furrows", ("muscle", "shape", "epsilon", "furrows (degrees)", "fibers (degrees)"),
                  [tuple(asdict(row).values()) for row in angles]),
        ],
        plots,
        {"pairs": [asdict(row) for row in rows], "others": [asdict(row) for row, _ in others],
         "folds": [asdict(row) for row in angles]},
    )  # fmt: skip


def captured(
    face: Path = FACES / "ict_face_narrow.obj",
    landmarks: Path | None = FACES / "ict_face_narrow.landmarks.json",
    shapes: Path = FACES / "ict_face_expressions.npz",
    units: str | None = "cm",
) -> tuple[fw.Face, dict[str, Array]] | None:
    """Return a face and the shapes that were captured on it; None, and a word, where there are no such files."""
    if missing := [str(path) for path in (face, shapes) if not path.exists()]:
        print(f"Left out: there is no {' and no '.join(missing)}.")
        return None
    fitted = fw.fit_face(face, landmarks, units=units)
    return fitted, read_shapes(shapes, fitted.mesh.n_points, fitted.unit)


def run_on_captured(report: Callable[[fw.Face, dict[str, Array]], Report]) -> None:
    """Run the command line of an analysis that needs captured shapes."""

    def command(
        face: Path = FACES / "ict_face_narrow.obj",
        *,
        landmarks: Path | None = FACES / "ict_face_narrow.landmarks.json",
        shapes: Path = FACES / "ict_face_expressions.npz",
        units: str | None = "cm",
        out: Path = OUTPUT,
    ) -> None:
        """Compare with captured shapes.

        Parameters
        ----------
        face
            The mesh that the shapes were captured on.
        landmarks
            JSON file with its landmarks.
        shapes
            npz file with names (k,) and deltas (k, n, 3).
        units
            Unit of the mesh and of the shapes: mm, cm, ...
        out
            Folder for the numbers, the plots and the index page.
        """
        if (found := captured(face, landmarks, shapes, units)) is not None:
            publish(report(*found), out)

    run(command)


if __name__ == "__main__":
    run_on_captured(report)
