"""Lines of wave folds and of the papers' folds against the compression of the skin: ``python -m analysis.folds``.

Both are measured on the frames alone, from the heights: the direction across the lines is that of the gradient of W at
rest, whatever made W. Skin that is compressed along one direction folds across it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

import facewrinkle as fw
from facewrinkle.geometry.interpolation import interpolated
from facewrinkle.geometry.normals import vertex_normals
from facewrinkle.layers.compression import StrainField, principal_compression
from facewrinkle.plotting import Style, picture, side_by_side, stacked
from facewrinkle.simulation.fold_layers import Folds

from . import subjects
from .motion import read_shapes
from .report import Plot, Report, Table, run_report
from .swept import swept_volumes

Array = npt.NDArray[np.float64]

EXPRESSIONS = {
    "surprise": "forehead",
    "happiness": "left_eye",
    "anger": "glabella",
    "disgust": "nose",
    "fear": "forehead",
    "sadness": "forehead",
}
"""Expressions, and the view that shows their folds."""

CAPTURED: dict[str, tuple[str, ...]] = {
    "surprise": ("browInnerUp_L", "browInnerUp_R", "browOuterUp_L", "browOuterUp_R"),
    "smile": ("mouthSmile_L", "mouthSmile_R", "cheekSquint_L", "cheekSquint_R"),
    "frown": ("browDown_L", "browDown_R"),
    "sneer": ("noseSneer_L", "noseSneer_R"),
    "squint": ("eyeSquint_L", "eyeSquint_R", "cheekRaiser_L", "cheekRaiser_R"),
}
"""Mixtures of captured shapes."""

COMPARED: tuple[Folds, ...] = ("wave", "paper")
"""The folds that are measured side by side."""

SHALLOW = 0.05
"""Heights below this, mm, are no folds."""

OFFSETS = (-0.45, -0.3, -0.15, 0.0, 0.15, 0.3, 0.45)
"""Places of upright sections through the forehead, in distances between the pupils from its middle."""


@dataclass(frozen=True)
class Measured:
    """Measurements of the folds in a frame.

    Attributes
    ----------
    angle : float
        Mean angle between the gradient of the heights and the principal compression, weighted by depth, degrees. The
        gradient turns away from the direction across a line where that fades out along it.
    line_angle : float
        The same for the direction across the lines as they are seen: the leading eigenvector of the gradient's products
        (structure tensor), averaged over some base triangles, which are about as large as a fold is wide.
    depth : float
        From the deepest furrow to the highest bulge, mm.
    volume : float
        Net volume over what is displaced.
    triangles : int
    """

    angle: float
    line_angle: float
    depth: float
    volume: float
    triangles: int


def measured(sim: fw.Simulation, frame: object) -> Measured:
    """Measure the folds of a frame of a simulation."""
    face, triangles = sim.face, np.asarray(sim.forest.triangles)
    rest = sim.vertices.points * face.unit
    height = np.asarray(frame["W"])  # type: ignore[index]
    base = np.asarray(_base(sim), np.float64)
    bare = interpolated(base, sim.vertices.corners, sim.vertices.barycentric)
    gradient, area = gradients(rest, triangles, height)
    field = StrainField(face.points_mm, face.triangles)
    normals = vertex_normals(face.points, face.triangles)
    most, direction = principal_compression(field.strain(base), field.metric, normals)
    host = face.triangles[sim.forest.root]
    tensor = (np.maximum(most, 0.0)[host][:, :, None, None] * _outer(direction[host])).mean(axis=1)
    across = np.linalg.eigh(tensor)[1][:, :, 2]
    steep = np.linalg.norm(gradient, axis=1)
    deep = np.abs(height[triangles]).max(axis=1) > SHALLOW
    weight = np.where(deep & (np.trace(tensor, axis1=1, axis2=2) > 0.01), steep**2 * area, 0.0)
    cosine = np.abs((gradient * across).sum(axis=1)) / np.maximum(steep, 1e-12)
    angle = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    smoothed = _spread(_outer(gradient) * area[:, None, None], sim.forest.root, face.triangles)
    seen = np.linalg.eigh(smoothed)[1][:, :, 2][sim.forest.root]
    lines = np.degrees(np.arccos(np.clip(np.abs((seen * across).sum(axis=1)), 0.0, 1.0)))
    smooth = interpolated(vertex_normals(base, face.triangles), sim.vertices.corners, sim.vertices.barycentric)
    smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
    swept = swept_volumes(bare, height[:, None] * smooth, triangles)
    return Measured(
        *(float((weight * found).sum() / max(weight.sum(), 1e-12)) for found in (angle, lines)),
        float(np.ptp(height)),
        float(abs(swept.sum()) / max(np.abs(swept).sum(), 1e-12)),
        len(triangles),
    )


def _spread(values: Array, root: npt.NDArray[np.integer], triangles: npt.NDArray[np.integer]) -> Array:
    """Return sums (m0, 3, 3) of values (m, 3, 3) in each base triangle and those that share a vertex with it."""
    own = np.zeros((len(triangles), 3, 3))
    np.add.at(own, root, values)
    at = np.zeros((int(triangles.max()) + 1, 3, 3))
    for k in range(3):
        np.add.at(at, triangles[:, k], own)
    return np.asarray(at[triangles].sum(axis=1))


def _base(sim: fw.Simulation) -> Array:
    motion = sim.motion
    if isinstance(motion, fw.Skin):
        return np.asarray(motion.points + motion.displacement)
    return np.asarray(motion.step())  # held: a recording stays at its end


def _outer(vectors: Array) -> Array:
    return np.asarray(vectors[..., :, None] * vectors[..., None, :])


def gradients(points: Array, triangles: npt.NDArray[np.integer], values: Array) -> tuple[Array, Array]:
    """Return the gradients (m, 3) of values (n,) that are linear in each triangle, and the areas (m,).

    Examples
    --------
    >>> gradients(np.array([[0.0, 0, 0], [2, 0, 0], [0, 4, 0]]), np.array([[0, 1, 2]]), np.array([0.0, 2, 2]))
    (array([[1. , 0.5, 0. ]]), array([4.]))
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    double = np.linalg.norm(normal, axis=1, keepdims=True)
    unit = normal / np.maximum(double, 1e-12)
    u, v, w = (values[triangles[:, k], None] for k in range(3))
    turned = u * np.cross(unit, c - b) + v * np.cross(unit, a - c) + w * np.cross(unit, b - a)
    return np.asarray(turned / np.maximum(double, 1e-12)), 0.5 * double[:, 0]


def spacings(sim: fw.Simulation, frame: object) -> list[Array]:
    """Return the distances, mm, between neighboring furrows on upright sections through the forehead."""
    from scipy.interpolate import LinearNDInterpolator

    face, scale = sim.face, sim.face.unit
    local = face.frame.local(sim.vertices.points)
    height = np.asarray(frame["W"])  # type: ignore[index]
    bottom, top = (face.frame.local(face.landmarks[k])[1] for k in ("glabella", "trichion"))
    front = local[:, 2] > face.frame.local(face.landmarks["forehead_mid"])[2] - 1.0
    at = LinearNDInterpolator(local[front][:, :2], height[front])
    found = []
    for offset in OFFSETS:
        up = np.linspace(bottom + 0.05, top, 1500)
        section = np.nan_to_num(at(np.full(len(up), offset), up))
        places = find_peaks(-section, height=SHALLOW, prominence=2.0 * SHALLOW)[0]
        found.append(np.diff(up[places]) * face.frame.pupil_distance * scale)
    return found


def played(face: fw.Face, name: str, folds: Folds) -> tuple[fw.Simulation, object]:
    """Return a simulation that has played an expression and settled, and its last frame."""
    sim = fw.Simulation(face, folds=folds)
    sim.express(name)
    *_, frame = sim.run(50, ramp=0.5)
    return sim, frame


def recorded(
    face: fw.Face, shapes: dict[str, Array], names: tuple[str, ...], folds: Folds
) -> tuple[fw.Simulation, object]:
    """Return a simulation of captured shapes (n, 3), mm, in which those of some names have come to full weight."""
    weights = np.array([[0.0] * len(shapes), [float(name in names) for name in shapes]])
    deltas = np.stack([delta / face.unit for delta in shapes.values()])
    clip = fw.Recorded.of_shapes(deltas, weights, times=[0.0, 0.4], names=list(shapes))
    sim = fw.Simulation(face, motion=clip, folds=folds)
    *_, frame = sim.run(26)
    return sim, frame


def report(quick: bool = False) -> Report:
    """Measure the folds of expressions on several faces, and on captured shapes."""
    faces = [name for name in ("head-0", "ict-0", "makehuman") if name in subjects.names()][: 1 if quick else 3]
    names = list(EXPRESSIONS)[: 2 if quick else None]
    rows, plots, numbers = [], [], {}
    for subject in faces:
        face, shots = subjects.subject(subject), {folds: [] for folds in COMPARED}
        for name in names:
            found = {}
            for folds in COMPARED:
                sim, frame = played(face, name, folds)
                found[folds] = measured(sim, frame)
                shots[folds].append(picture(frame, face, Style((360, 330), EXPRESSIONS[name])))  # type: ignore[arg-type]
                if name == "surprise" and folds == "wave":
                    gaps = np.concatenate(spacings(sim, frame))
                    numbers[f"{subject} spacing"] = [float(gaps.mean()), float(gaps.std() / gaps.mean()), len(gaps)]
            numbers[f"{subject} {name}"] = {folds: vars(m) for folds, m in found.items()}
            rows.append([subject, name, *_row(found)])
        caption = f"{subject}: {', '.join(names)}; waves above, the papers' folds below."
        plots.append(Plot(subject, stacked([side_by_side(shots[folds]) for folds in COMPARED]), caption))
    captured = [] if quick else _captured(numbers)
    columns = ["face", "expression", *(f"{what}, {folds}" for what in UNITS for folds in COMPARED)]
    angles, lines = (
        {folds: np.mean([row[at + k] for row in [*rows, *captured]]) for k, folds in enumerate(COMPARED)}
        for at in (2, 4)
    )
    return Report(
        "folds",
        "Directions, depths and volumes of folds",
        "Angle between the gradient of the heights, and the direction across the lines, and the principal compression "
        "of the skin, weighted by depth; depth from furrow to bulge; net volume over what is displaced.",
        f"On average waves lie {lines['wave']:.1f} degrees off the compression, the papers' folds "
        f"{lines['paper']:.1f}; by their gradients, {angles['wave']:.1f} and {angles['paper']:.1f}.",
        [Table("Folds of expressions, and of captured shapes", columns, [*rows, *captured])],
        plots,
        numbers,
    )


UNITS = ("angle (degrees)", "angle of lines (degrees)", "depth (mm)", "net volume (%)", "triangles")


def _row(found: dict[Folds, Measured]) -> list[float]:
    """Cells of a table: each measurement of the waves beside that of the papers' folds."""
    pairs = zip(*((m.angle, m.line_angle, m.depth, 100.0 * m.volume, m.triangles) for m in found.values()), strict=True)
    return [round(value, 2) for pair in pairs for value in pair]


def _captured(numbers: dict[str, object]) -> list[list[object]]:
    """Rows of the captured face, moved by its captured shapes; none where it is not at hand."""
    path = subjects.FACES / "ict_face_expressions.npz"
    if not path.exists():
        return []
    face = subjects.subject("ict-0")
    known = read_shapes(path, face.mesh.n_points, face.unit)
    rows = []
    for name, shapes in CAPTURED.items():
        found = {folds: measured(*recorded(face, known, shapes, folds)) for folds in COMPARED}
        numbers[f"captured {name}"] = {folds: vars(m) for folds, m in found.items()}
        rows.append(["captured", name, *_row(found)])
    return rows


if __name__ == "__main__":
    run_report(report)
