"""Does the skin bulge and hollow as captured faces do?

The eye sees shading, that is curvature, not displacement. Each pair compares the change of mean curvature from rest to
full contraction, smoothed over 2.5 mm, with that of a captured expression on the same mesh: their correlation and the
ratio of their sizes, by area over the skin that is seen, and over all vertices alike, the lining of the mouth included,
which is a third of them. Only skin that the captured expression moves by more than 1 mm counts, 6 mm or more from a
rim. The skin is bare: no layer folds it.

    python -m analysis.relief FACE.obj --landmarks LANDMARKS.json --shapes SHAPES.npz --units cm
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

import facewrinkle as fw
from facewrinkle.geometry.laplacian import cotangent_laplacian
from facewrinkle.geometry.normals import vertex_areas, vertex_normals

from .motion import compared, run_on_captured, settled, summed
from .report import Plot, Report, Table

Array = npt.NDArray[np.float64]

PAIRS: dict[str, tuple[str, str]] = {
    "smile": ("AU12", "mouthSmile_L+mouthSmile_R"),
    "smile and cheeks": ("AU12+AU6", "mouthSmile_L+mouthSmile_R+cheekSquint_L+cheekSquint_R"),
    "sneer": ("AU9", "noseSneer_L+noseSneer_R"),
    "upper lip": ("AU10", "mouthUpperUp_L+mouthUpperUp_R"),
    "dimple": ("AU14", "mouthDimple_L+mouthDimple_R"),
    "mouth frown": ("AU15", "mouthFrown_L+mouthFrown_R"),
    "pucker": ("AU18", "mouthPucker"),
    "press": ("AU24", "mouthPress_L+mouthPress_R"),
    "brows down": ("AU4", "browDown_L+browDown_R"),
    "brows up": ("AU1+AU2", "browInnerUp_L+browInnerUp_R+browOuterUp_L+browOuterUp_R"),
}
"""Action units at full intensity, and the captured shapes that they make; those joined by + are added."""

SMOOTHED, MOVED, OFF_RIM, SEEN = 2.5, 1.0, 6.0, 1.0
"""Standard deviation of the Gaussian that smooths the curvature, least captured displacement, least distance from rims
of the mesh, and depth behind the lips and nostrils down to which skin is seen, mm.
"""


@dataclass(frozen=True)
class Relief:
    """Change of curvature of one expression against that of a captured one.

    Attributes
    ----------
    expression, units : str
    r, size : float
        Correlation of the changes of curvature, and standard deviation of ours over that of the captured one, by area
        over the skin that is seen.
    vertex_r, vertex_size : float
        The same over all vertices alike.
    cosine : float
        Cosine similarity of the displacements of these.
    """

    expression: str
    units: str
    r: float
    size: float
    vertex_r: float
    vertex_size: float
    cosine: float


def correlation(ours: Array, captured: Array, weight: Array) -> tuple[float, float]:
    """Return the weighted correlation of values (n,) with captured ones, and the ratio of their deviations."""
    share = weight / weight.sum()
    a, b = ours - share @ ours, captured - share @ captured
    sizes = np.sqrt(share @ a**2), np.sqrt(share @ b**2)
    return float(share @ (a * b) / max(sizes[0] * sizes[1], 1e-300)), float(sizes[0] / max(sizes[1], 1e-300))


def mean_curvature(points: Array, triangles: npt.NDArray[np.int32]) -> Array:
    """Return the mean curvature (n,) of a mesh, by its cotangent Laplacian: 1 / R on a sphere of radius R."""
    off = cotangent_laplacian(points, triangles) @ points
    out = (off * vertex_normals(points, triangles)).sum(axis=1)
    return np.asarray(out / (2.0 * np.maximum(vertex_areas(points, triangles), 1e-12)))


def smoother(points: Array, width: float = SMOOTHED) -> csr_array:
    """Return the matrix (n, n) that smooths values at points (n, 3) by a Gaussian of a width, cut off at 2.5 of it."""
    tree = cKDTree(points)
    near = tree.sparse_distance_matrix(tree, 2.5 * width, output_type="coo_matrix").tocsr()
    near.data = np.exp(-0.5 * (near.data / width) ** 2)
    return csr_array(near.multiply(1.0 / near.sum(axis=1)))


def change_of_curvature(points: Array, triangles: npt.NDArray[np.int32]) -> Callable[[Array], Array]:
    """Return the function from displacements (n, 3), mm, to the smoothed change of mean curvature (n,), 1/mm."""
    smooth = smoother(points)
    rest = mean_curvature(points, triangles)
    return lambda moved: np.asarray(smooth @ (mean_curvature(points + moved, triangles) - rest))


def off_rims(face: fw.Face) -> npt.NDArray[np.bool_]:
    """Return where (n,) the skin of a face is far enough from rims of its mesh."""
    if not face.boundary_loops:
        return np.ones(len(face.points), bool)
    rim = face.points[np.concatenate(face.boundary_loops)]
    return np.asarray(cKDTree(rim).query(face.points)[0] * face.unit > OFF_RIM)


def reliefs(face: fw.Face, shapes: dict[str, Array]) -> list[tuple[Relief, Array, Array]]:
    """Return the relief of every pair whose shapes exist, with the change of curvature (n,), ours and captured."""
    skin, far = fw.Skin(face, time_step=1.0), off_rims(face)
    area = vertex_areas(skin.points, face.triangles)
    seen = area * (face.cavities.depth(face.points) < SEEN * face.frame.scale)
    change, out = change_of_curvature(skin.points, face.triangles), []
    for name, (units, shape) in PAIRS.items():
        if not set(shape.split("+")) <= set(shapes):
            continue
        field = summed(shapes, shape)
        ours = settled(skin, face.atlas.contractions(dict.fromkeys(units.split("+"), 1.0)))
        where = far & (np.linalg.norm(field, axis=1) > MOVED)
        a, b = change(ours), change(field)
        by_area, by_vertex = (correlation(a, b, where * weight) for weight in (seen, 1.0))
        cosine = compared(ours[where], field[where], area[where]).cosine
        out.append((Relief(name, units, *by_area, *by_vertex, cosine), a, b))
    return out


def maps(face: fw.Face, ours: Array, captured: Array) -> npt.NDArray[np.uint8]:
    """Draw the change of curvature, ours on the left and the captured one on the right: red bulges, blue hollows."""
    plotter = pv.Plotter(off_screen=True, shape=(1, 2), window_size=[1000, 560])
    limit = float(np.quantile(np.abs(captured), 0.99))
    bar = {"title": "1/mm", "vertical": True, "position_x": 0.85, "position_y": 0.25, "height": 0.5, "width": 0.08}
    for column, values in enumerate((ours, captured)):
        plotter.subplot(0, column)
        plotter.add_mesh(
            face.mesh.copy(), scalars=values, clim=(-limit, limit), cmap="RdBu_r", smooth_shading=True,
            scalar_bar_args=bar,
        )  # fmt: skip
        plotter.camera.position = face.frame.origin + 7.0 * face.frame.pupil_distance * face.frame.axes[2]
        plotter.camera.focal_point = face.frame.origin - 0.4 * face.frame.pupil_distance * face.frame.axes[1]
        plotter.camera.up = face.frame.axes[1]
    image = np.array(plotter.screenshot(None, return_img=True))
    plotter.close()
    return image


def report(face: fw.Face, shapes: dict[str, Array]) -> Report:
    """Report all pairs on a captured face, with maps of each."""
    found = reliefs(face, shapes)
    rows = [row for row, *_ in found]
    r, sizes = [row.r for row in rows], [row.size for row in rows]
    return Report(
        "relief",
        "Change of curvature",
        "Change of the mean curvature of bare skin, smoothed over 2.5 mm, against that of captured expressions on the "
        "same mesh, by area over the skin that is seen, and over all vertices alike.",
        f"Correlation {np.mean(r):.2f} on average (the least {min(r):.2f}), sizes {min(sizes):.2f} to {max(sizes):.2f} "
        f"of the captured ones; over all vertices {np.mean([row.vertex_r for row in rows]):.2f}; mean cosine of the "
        f"displacements {np.mean([row.cosine for row in rows]):.2f}.",
        [
            Table(
                "Bare skin against captured skin",
                ("expression", "units", "correlation", "size", "of all vertices", "size", "cosine of displacements"),
                [tuple(asdict(row).values()) for row in rows],
            )
        ],
        [
            Plot(row.expression.replace(" ", "_"), maps(face, ours, captured),
                 f"{row.expression}, ours (left) and captured: correlation {row.r:.2f}, size {row.size:.2f}.")
            for row, ours, captured in found
        ],
        {"pairs": [asdict(row) for row in rows]},
    )  # fmt: skip


if __name__ == "__main__":
    run_on_captured(report)
