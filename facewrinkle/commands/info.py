"""``facewrinkle info`` and ``atlas``: muscles, action units and expressions; and the content of a file."""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
from rich.table import Table

from ..anatomy.atlas import DEFAULT_ATLAS, Atlas, load_atlas
from ..anatomy.face_file import SUFFIX, read_face
from ..anatomy.landmarks import NOT_ON_SKIN, REFUSED
from ..animation.gltf import shapes_of_gltf
from ..array_types import Array, IntArray
from ..errors import FaceWrinkleWarning, LandmarkError, unknown_name
from ..files import output_file, reading, write_whole
from ..geometry.topology import boundary_loops
from ..mesh import Surface, merged_texture, outside_images, prepare, surface_in
from ..mesh.formats.reading import GLTF
from ..session.player import joined
from .options import Report, face_facts


def info(topic: str | None = None, /) -> None:
    """List muscles, action units and expressions, or describe a mesh or a .face file.

    Parameters
    ----------
    topic
        muscles, action-units or expressions (default: all three); or the name of a file.
    """
    report = Report(quiet=False)
    tables = {"muscles": _muscles, "action-units": _action_units, "expressions": _expressions}
    if topic is not None and topic not in tables:
        path = Path(topic)
        if not path.suffix and not path.exists():
            raise unknown_name("topic or file", topic, tables)
        report.table(path.name, _of_face(path) if path.suffix == SUFFIX else _of_mesh(path))
        return
    for name, table in tables.items():
        if topic in (None, name):
            report.say(table(load_atlas()))


def atlas(*, out: Path | None = None) -> None:
    """Print the atlas of muscles, action units and expressions, to edit and pass with --atlas.

    A file with only the entries that you change or add is enough if its first line is: base = "facewrinkle"

    Parameters
    ----------
    out
        TOML file to write. Default: print to the terminal.
    """
    text = DEFAULT_ATLAS.read_text(encoding="utf-8")
    if out is None:
        sys.stdout.write(text)
        return
    write_whole(output_file(out, (".toml",)), text)


def _of_face(path: Path) -> dict[str, str]:
    """Return the rows of a table about a fitted face."""
    face = read_face(path)
    rows = face_facts(face) | {"muscles": str(len(face.muscles))}
    if face.parts:
        rows["parts"] = ", ".join(face.parts)
    return rows | _surface(face.points, face.triangles, face.texture is not None, face.report)


def _of_mesh(path: Path) -> dict[str, str]:
    """Return the rows of a table about a mesh and its faults."""
    source = surface_in(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FaceWrinkleWarning)  # it is in the table
        clean = _head_of(source)
    rows = {"in the file": f"{len(source.points)} points, {len(source.triangles)} triangles"}
    meshes = Counter(source.pieces[number].name.split("/")[0] for number in source.piece.tolist())
    if len(meshes) > 1:
        rows[f"meshes ({len(meshes)})"] = ", ".join(f"{name or '(unnamed)'} ({n})" for name, n in meshes.items())
    _, texture = merged_texture(clean)
    rows["texture coordinates"] = "no" if source.texture is None else "yes"
    if path.suffix.lower() in GLTF:
        with reading(path):
            shapes, animations = shapes_of_gltf(path)
        for label, names in shapes.items():
            first = next(other for other, same in shapes.items() if same == names)  # eyes and teeth repeat the head's
            rows[f"shapes of {label} ({len(names)})"] = ", ".join(names) if first == label else f"those of {first}"
        rows["animations"] = ", ".join(animations) or "none"
    report = outside_images(source, path) + clean.report
    return rows | _surface(clean.points, clean.triangles, texture is not None, report)


def _head_of(source: Surface) -> Surface:
    """Return the part of a mesh that is a face, as ``facewrinkle fit`` takes it; without one, the largest."""
    clean = prepare(source)
    if clean.others is None:
        return clean
    from ..anatomy.finding import find_landmarks  # slow to load

    try:
        found = find_landmarks(source)
    except LandmarkError:
        return clean
    near = np.array([place for name, place in found.landmarks.items() if name not in NOT_ON_SKIN])
    return prepare(source, near=near, forward=found.pose.axes[2]) if found.confidence >= REFUSED else clean


def _surface(points: Array, triangles: IntArray, textured: bool, report: tuple[str, ...]) -> dict[str, str]:
    holes = boundary_loops(triangles)
    width, height, depth = np.ptp(points, axis=0)
    return {
        "triangles": str(len(triangles)),
        "size": f"{width:.4g} x {height:.4g} x {depth:.4g}",
        "texture": "yes" if textured else "no",
        "borders": "none" if not holes else f"{len(holes)}, of {', '.join(str(len(hole)) for hole in holes[:8])} edges",
        "repaired and separated": "\n".join(report) or "nothing",
    }


def _muscles(atlas: Atlas) -> Table:
    table = _table("Muscles", "name", "kind", "sides", "furrows", "depth (mm)")
    for full, entry in atlas.muscles.items():
        paired = entry.get("paired", True)
        if not paired or full.endswith("_l"):
            wrinkles = entry.get("folds", entry).get("wrinkles", {})
            name = full.removesuffix("_l") if paired else full
            sides = "_l, _r" if paired else "one"
            table.add_row(name, entry["kind"], sides, str(wrinkles.get("count", "")), str(wrinkles.get("depth", "")))
    return table


def _action_units(atlas: Atlas) -> Table:
    table = _table("Action units", "unit", "what", "muscles")
    for unit, what in atlas.action_unit_names.items():
        table.add_row(unit, what, _listed(atlas.action_units[unit]))
    return table


def _expressions(atlas: Atlas) -> Table:
    table = _table("Expressions", "name", "muscles")
    for name, rates in atlas.expressions.items():
        table.add_row(name, _listed(rates))
    return table


def _table(title: str, *columns: str) -> Table:
    return Table(*columns, title=f"\n{title}", title_justify="left", title_style="bold", box=None, header_style="dim")


def _listed(rates: dict[str, float]) -> str:
    """Return muscles with their rates; a pair with equal rates under one name."""
    return ", ".join(name if rate == 1.0 else f"{name} {rate:g}" for name, rate in joined(rates).items())
