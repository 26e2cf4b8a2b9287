"""Models as binary PLY files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .model import Model


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
