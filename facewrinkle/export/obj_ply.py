"""Models as Wavefront OBJ files and as binary PLY files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .model import WATER_INDEX, WATER_OPACITY, Model


def obj_files(skin: Model, path: Path, texture: Path, tears: Model | None = None) -> dict[Path, bytes]:
    """Return the content of an OBJ file and of the files that belong to it.

    The corners of its triangles name position, texture and normal one by one: nothing is split at seams.
    """
    material = path.with_suffix(".mtl")
    plain = skin.png is None and tears is None
    lines = _skin_lines(skin, [] if plain else [f"mtllib {material.name}", "g face", "usemtl skin"])
    if tears is not None:
        lines += _tears_lines(tears, skin.origin.max() + 1)
    files = {path: _text(lines)}
    if plain:
        return files
    lines = ["newmtl skin", "Kd 1 1 1", "Ks 0 0 0"]
    if skin.png is not None:
        lines += [f"map_Kd {texture.name}"]
        files[texture] = skin.png
    if tears is not None:
        lines += ["newmtl tears", "Kd 1 1 1", "Ks 1 1 1", "Ns 900", f"Ni {WATER_INDEX}", f"d {WATER_OPACITY}"]
        lines += ["illum 7"]
    return files | {material: _text(lines)}


def _skin_lines(skin: Model, material: list[str]) -> list[str]:
    n = int(skin.origin.max()) + 1
    lines = [f"# {n} vertices, {len(skin.triangles)} triangles", *material]
    if skin.colours is None:
        lines += _rows("v %.9g %.9g %.9g", skin.points[:n])
    else:
        lines += _rows("v %.9g %.9g %.9g %.4g %.4g %.4g", np.hstack([skin.points[:n], skin.colours[:n] / 255.0]))
    lines += _rows("vn %.6g %.6g %.6g", skin.normals[:n])
    corners = skin.origin[skin.triangles] + 1
    if skin.uv is None:
        return lines + _rows("f %d//%d %d//%d %d//%d", np.repeat(corners, 2, axis=1))
    lines += _rows("vt %.9g %.9g", skin.uv)
    numbers = np.stack([corners, skin.triangles + 1, corners], axis=2)
    return lines + _rows("f %d/%d/%d %d/%d/%d %d/%d/%d", numbers.reshape(-1, 9))


def _tears_lines(tears: Model, n: int) -> list[str]:
    """Return a group of tears behind a skin of n vertices."""
    corners = np.repeat(tears.triangles + 1, 2, axis=1) + n
    lines = ["g tears", "usemtl tears", *_rows("v %.9g %.9g %.9g", tears.points)]
    return lines + _rows("vn %.6g %.6g %.6g", tears.normals) + _rows("f %d//%d %d//%d %d//%d", corners)


def _rows(form: str, values: np.ndarray) -> list[str]:
    return [form % tuple(row) for row in values.tolist()]


def _text(lines: list[str]) -> bytes:
    return ("\n".join(lines) + "\n").encode()


def ply_files(model: Model, path: Path, texture: Path) -> dict[Path, bytes]:
    """Return the content of a PLY file, and of the texture beside it."""
    columns: list[tuple[str, str, np.ndarray]] = [
        ("x y z", "f4", model.points),
        ("nx ny nz", "f4", model.normals),
    ]
    if model.uv is not None:
        columns.append(("s t", "f4", model.uv))
    if model.colours is not None:
        columns.append(("red green blue", "u1", model.colours))
    names = [(name, kind) for group, kind, _ in columns for name in group.split()]
    vertices = np.empty(len(model.points), [(name, "<" + kind) for name, kind in names])
    for group, _, values in columns:
        for name, column in zip(group.split(), values.T, strict=True):
            vertices[name] = column
    faces = np.empty(len(model.triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, model.triangles
    header = ["ply", "format binary_little_endian 1.0"]
    header += [f"comment TextureFile {texture.name}"] if model.png is not None else []
    header += [f"element vertex {len(vertices)}"]
    header += [f"property {'float' if kind == 'f4' else 'uchar'} {name}" for name, kind in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header\n"]
    files = {path: "\n".join(header).encode() + vertices.tobytes() + faces.tobytes()}
    return files if model.png is None else files | {texture: model.png}
