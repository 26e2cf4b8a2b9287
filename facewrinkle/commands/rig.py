"""``facewrinkle rig``: a face with blend shapes that wrinkle, for other programs; ``blender``: an extension."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ..anatomy.face_file import SUFFIX
from ..errors import ParameterError
from ..files import output_folder, output_target, remove_stale, write_whole
from ..rigging import bake_layers, on_source, write_layers
from ..rigging import rig as make_rig
from ..rigging.linear_rig import facts_text, label
from ..rigging.wrinkle_layers import check_layer_size
from ..rigging.write import write_extension, write_page, write_rig_files
from .options import FaceOptions, Report, Whole, removed_rows


def rig(
    face: Path | None = None,
    /,
    *,
    source: FaceOptions = FaceOptions(),
    shapes: str = "arkit",
    wrinkles: Literal["baked", "separate", "maps", "none"] = "baked",
    level: Whole | None = None,
    correctives: Whole = 0,
    same_mesh: bool = False,
    map_size: Whole | None = None,
    format: Literal["glb", "gltf", "usd", "usdc", "usda"] = "glb",
    dense: bool = False,
    page: bool = False,
    errors: bool = False,
    out: Path | None = None,
    quiet: bool = False,
) -> None:
    """Write a rig with blend shapes that wrinkle, for other programs.

    Parameters
    ----------
    face
        A mesh of a face, or a .face file of `facewrinkle fit`. Default: the built-in head.
    shapes
        Sets joined by +: arkit (Apple's 52), visemes (15), extras (mouthOpen, eyesClosed, ...), aus (action units),
        expressions, age (lines of old skin at rest); or names of single shapes.
    wrinkles
        baked into the shapes; separate, as targets NAME_wrinkle to drive by the square of the weight; maps, as up to
        four layers of normal and height maps with a mask for each shape, beside a smooth rig on the unrefined mesh,
        with a module that plays them in three.js; or none.
    level
        How many times a triangle may be split where any shape folds the skin; 0 keeps the mesh, as maps do. Default: 2.
    correctives
        Maximum number of pairs of shapes that get a corrective, a target to drive by the product of their weights:
        those whose sum is farthest from the simulation. NAME.rig.json lists them.
    same_mesh
        Write the shapes as vertex displacements of the mesh file itself, in its order, unit and axes, for programs that
        have it open: NAME.npz with the arrays names, points, deltas, reached, unit, and chart if the file has no
        texture coordinates for maps.
    map_size
        Width of the maps in texels: a power of two from 64 to 2048. Default: 1024.
    format
        glb; gltf with all data embedded; usd (UsdSkel, with pictures in files beside).
    dense
        Write every vertex of every shape, for importers without sparse accessors.
    page
        Also write a page with sliders, one file, that shows the rig in any browser.
    errors
        Measure how far the shapes are from the simulation, half and full, print the worst, and write all to
        NAME.rig.json.
    out
        Folder to write to. Default: output/rig, or output/FACE/rig.
    quiet
        Print only errors.
    """
    report, source = Report(quiet), source.of(face)
    if wrinkles != "maps" and map_size is not None:
        raise ParameterError("--map-size belongs to wrinkles in maps: add --wrinkles maps, or leave it out.")
    if wrinkles == "maps" and level:
        raise ParameterError("--level splits triangles, and maps are for the mesh as it is: leave out --level.")
    if same_mesh and (source.face is None or source.face.suffix == SUFFIX):
        raise ParameterError("--same-mesh is about the vertices of a mesh file: name that, and give --landmarks.")
    if same_mesh and level:
        raise ParameterError("--level splits triangles, and --same-mesh splits none: leave out one of them.")
    size_of_maps = check_layer_size(1024 if map_size is None else map_size)
    folder = output_folder(out or Path("output") / source.label / "rig", make=False)
    loaded, stem = source.load(report), source.label or "head"
    path = folder / f"{stem}.{'npz' if same_mesh else format}"
    output_target(path)  # an error before the shapes are made, which takes a while
    made = make_rig(
        loaded,
        shapes,
        wrinkles=wrinkles,
        level=0 if same_mesh else level,
        correctives=correctives,
        progress=report.progress,
    )
    if same_mesh and source.face is not None:
        files = [on_source(made, source.face).save(path)]
    else:
        files = write_rig_files(made, path, dense=dense)
    layers = None
    if wrinkles == "maps":
        layers = bake_layers(made, size_of_maps, progress=report.progress)
        files += write_layers(layers, path)
    if page:
        files.append(write_page(made, folder / f"{stem}.html", layers))
    size = files[0].stat().st_size / 1e6
    rows = {
        "shapes": f"{len(made.names)}, of {len(made.parts)} meshes: {', '.join(made.parts)}",
        "vertices of the skin": f"{loaded.mesh.n_points} to {len(made.parts['face'].points)}",
    }
    if made.drivers:
        rows["driven by products of weights"] = f"{len(made.drivers)} of them, listed in {stem}.rig.json"
    if made.left_out:
        rows["left out"] = "\n".join(f"{name}: {why}" for name, why in made.left_out.items())
    if errors:
        with report.waiting("Comparing with the simulation"):
            found = sorted(made.report, key=lambda item: -item[1].mean)[:6]
        rows["farthest from the simulation"] = "\n".join(
            f"{label(mixed)}: {error.mean:.2f} mm on average, {error.largest:.2f} at most, of {error.motion:.1f}"
            for mixed, error in found
        )
    if errors or made.drivers or same_mesh:
        files.append(write_whole(folder / f"{stem}.rig.json", facts_text(made, errors)))
    names = [f"{files[0].name} ({size:.1f} MB)", *(path.name for path in files[1:])]
    rows[f"files in {folder}"] = "\n".join(names)
    report.table(stem, rows | removed_rows(remove_stale(folder / f".{stem}.rig.files", files)))


def blender(path: Path = Path("facewrinkle-blender.zip"), /, *, quiet: bool = False) -> None:
    """Write the extension for Blender 4.2 or newer: shape keys and wrinkles on your own head.

    Drag the file into Blender's window; in its preferences, name the Python that has facewrinkle.

    Parameters
    ----------
    path
        The file to write, .zip.
    quiet
        Print only errors.
    """
    Report(quiet).say(str(write_extension(path)))
