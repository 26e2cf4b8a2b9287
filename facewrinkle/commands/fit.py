"""``facewrinkle fit``: the landmarks and the anatomy of a face, in files and in a picture for checking."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree

from ..anatomy import Face, LinearMuscle, SheetMuscle, SphincterMuscle, write_face
from ..anatomy.face_file import SUFFIX
from ..anatomy.landmarks import NOT_ON_SKIN, write_landmarks
from ..array_types import Image
from ..files import output_folder, output_target
from ..geometry.normals import vertex_normals
from ..mesh import to_polydata
from ..plotting import Scene, Style, save_picture, side_by_side, stacked
from ..plotting.images import reduced
from .options import FaceOptions, Report, face_facts


def fit(
    file: Path,
    /,
    *,
    landmarks: Path | None = None,
    units: float | str | None = None,
    texture: Path | None = None,
    atlas: Path | None = None,
    out: Path | None = None,
    quiet: bool = False,
) -> None:
    """Detect the face on a mesh, and fit skull, eyes and muscles to it.

    Writes NAME.face, which other commands take with --face, NAME.png, a picture for checking the landmarks, and
    NAME.landmarks.json. To correct landmarks, edit their "xyz" there and pass the file with --landmarks: these stay
    fixed, and the rest are detected again.

    Parameters
    ----------
    file
        A mesh of a face: OBJ, OFF, PLY, STL, glTF, USD or a VTK format.
    landmarks
        JSON file with the coordinates of some or all landmarks; the rest are detected.
    units
        Unit of the mesh: um, mm, cm, dm, m, in, or millimeters per unit. Default: from the distance between the eyes.
    texture
        Skin texture. Default: the image that the file references or contains.
    atlas
        TOML file with your own muscles, action units and expressions; see `facewrinkle atlas`.
    out
        Folder to write to. Default: output/NAME.
    quiet
        Print only errors.
    """
    report = Report(quiet)
    stem = file.stem
    folder = output_folder(out or Path("output") / stem, make=False)  # the search takes a while
    options = FaceOptions(landmarks=landmarks, units=units, atlas=atlas, texture=texture)
    face = options.fitted(file, report)
    for ending in (SUFFIX, ".png"):
        output_target(folder / f"{stem}{ending}")  # before anything is written
    write_landmarks(face.landmarks, folder / f"{stem}.landmarks.json", face.estimated, face.confidences)
    write_face(face, folder / f"{stem}{SUFFIX}")
    with report.waiting("Drawing"):
        save_picture(stacked([side_by_side(row) for row in _rows(face)]), folder / f"{stem}.png")
    rows = face_facts(face) | {
        "triangles": str(face.mesh.n_cells),
        f"files in {folder}": "\n".join(f"{stem}{ending}" for ending in (SUFFIX, ".landmarks.json", ".png")),
    }
    if face.report:
        rows["repaired and separated"] = "\n".join(face.report)
    report.table(stem, rows)


def _rows(face: Face) -> Iterator[list[Image]]:
    """Yield pictures from two sides, with the names of the landmarks of one half each; then of skull and muscles."""
    face = dataclasses.replace(face, parts={})  # hair would hide them
    for draw in (_draw_landmarks, _draw_anatomy):
        images = []
        for view in ("front", "left_three_quarter"):
            with Scene(face, Style((760, 860), view)) as scene:
                images.append(draw(scene, face))
        yield images


def _draw_landmarks(scene: Scene, face: Face) -> Image:
    size, forward = face.frame.pupil_distance, face.frame.axes[2]
    scene.show(face.mesh)
    estimated = set(face.estimated)
    for names, color in ((set(face.landmarks) - estimated, "#35d07f"), (estimated, "#ffb347")):
        shown = sorted(names - set(NOT_ON_SKIN))
        if not shown:
            continue
        where = np.array([face.landmarks[name] for name in shown]) + 0.015 * size * forward
        dots = pv.PolyData(where).glyph(geom=pv.Sphere(radius=0.022 * size), scale=False, orient=False)
        scene.plotter.add_mesh(dots, color=color, ambient=0.6, reset_camera=False)
        mine = [i for i, name in enumerate(shown) if "r" not in name.split("_")[1:]]  # the other side's are the same
        labels = ["_".join(part for part in shown[i].split("_") if part != "l") for i in mine]
        scene.plotter.add_point_labels(
            where[mine], labels, font_size=20, text_color="white", shape=None, show_points=False, always_visible=True,
            reset_camera=False,
        )  # fmt: skip
    return _screenshot(scene)


def _draw_anatomy(scene: Scene, face: Face) -> Image:
    size = face.frame.pupil_distance
    scene.plotter.add_mesh(_bone(face), color="#e9e2d0", smooth_shading=True, reset_camera=False)
    scene.plotter.add_mesh(face.mesh, color="#d9a58c", opacity=0.25, smooth_shading=True, reset_camera=False)
    for muscle in face.muscles.values():
        for line in _lines(muscle):
            tube = pv.MultipleLines(line).tube(radius=0.014 * size)
            scene.plotter.add_mesh(tube, color="#b3262e", reset_camera=False)
    return _screenshot(scene)


def _bone(face: Face) -> pv.PolyData:
    """Return the skull without what lies under the skin of mouth and nostrils, which would stand out of the face."""
    skin, bone = face.points, face.tissue.anchors
    outer = ~face.lining.vertices
    nearest = np.flatnonzero(outer)[cKDTree(skin[outer]).query(bone)[1]]
    height = ((bone - skin[nearest]) * vertex_normals(skin, face.triangles)[nearest]).sum(axis=1)
    return to_polydata(bone, face.triangles[(outer & (height < 0.0))[face.triangles].all(axis=1)])


def _lines(muscle: object) -> Iterator[np.ndarray]:
    """Yield polylines (k, 3) along a muscle."""
    if isinstance(muscle, LinearMuscle):
        yield np.array([muscle.attachment, muscle.insertion])
    elif isinstance(muscle, SheetMuscle):
        ends = [np.asarray(end) for end in (muscle.attachment, muscle.insertion)]
        for share in np.linspace(0.0, 1.0, 5):
            yield np.array([(1.0 - share) * end[0] + share * end[1] for end in ends])
    elif isinstance(muscle, SphincterMuscle):
        angle = np.linspace(0.0, 2.0 * np.pi, 60)[:, None]
        for share in (0.6, 0.8, 1.0):
            across = muscle.semi_major * np.cos(angle) * muscle.lateral
            yield muscle.centre + share * (across + muscle.semi_minor * np.sin(angle) * muscle.vertical)


def _screenshot(scene: Scene) -> Image:
    """Return a picture of a scene as it is, at the size of its style."""
    scene.plotter.render()
    image = np.array(scene.plotter.screenshot(None, return_img=True))
    return reduced(image, image.shape[0] // scene.style.size[1])
