"""PLY files as plain arrays, text and binary, with the points numbered as in the file.

VTK's reader crashes the interpreter if a file is cut off or damaged, and splits points at texture seams. Here every
count is checked against the bytes that are there before it is used.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ...errors import MeshError
from ...files import bytes_of
from ..arrays import COLORS
from ..surface import Piece, Surface
from .polygons import image_place, split_polygons, textured

LENGTH = " length"
"""Ending of the columns with the lengths of lists; no name of a property has a blank."""

Property = tuple[str, str, str | None]  # name, type of the numbers, and for a list the type of its length
Element = tuple[str, int, list[Property]]
Columns = dict[str, np.ndarray]
Lists = dict[str, tuple[npt.NDArray[np.int64], np.ndarray]]  # lengths, and the numbers of all lists in a row


def read_ply(path: Path) -> Surface:
    """Read the polygons of a PLY file, with texture coordinates and colors; all else is ignored.

    Raises
    ------
    MeshError
        For a header that makes no sense, fewer data than it announces, or a face whose vertex does not exist.
    """
    elements, order, image, body = _header(path, bytes_of(path))
    try:
        found = _body(elements, order, body)
    except (ValueError, OverflowError):
        announced = ", ".join(f"{count} x {name}" for name, count, _ in elements)
        raise _broken(path, f"it announces {announced}, and the data that follow do not hold them") from None
    vertex, _ = found.get("vertex", ({}, {}))
    _, face = found.get("face", ({}, {}))
    if not vertex.keys() >= set("xyz"):
        raise _broken(path, "its vertices have no x, y and z")
    points = np.stack([vertex[axis] for axis in "xyz"], axis=1).astype(np.float64)
    nothing = np.zeros(0, dtype=np.int64)
    lengths, numbers = face.get("vertex_indices") or face.get("vertex_index") or (nothing, nothing)
    if (lengths < 3).any():
        number = int(np.argmax(lengths < 3))
        raise _broken(path, f"face {number + 1} has {lengths[number]} points, and needs three")
    lengths, numbers = lengths.astype(np.int64), numbers.astype(np.int64)
    triangles, _ = split_polygons(path, points, lengths, numbers)
    texture = _texture(vertex, face, lengths, numbers, len(points))
    channels = [vertex[name] for name in ("red", "green", "blue", "alpha") if name in vertex]
    colors = {COLORS: np.stack(channels, axis=1)} if vertex.keys() >= {"red", "green", "blue"} else {}
    at_corners = None if texture is None else texture[triangles]
    piece = Piece(image=image_place(path.parent, image))
    return Surface(points, numbers[triangles], at_corners, colors, pieces=(piece,))


def _broken(path: Path, reason: str) -> MeshError:
    return MeshError(f"{path.name} cannot be read: {reason}. The file is damaged or cut off: export it again.")


def _header(path: Path, data: bytes) -> tuple[list[Element], str | None, str, bytes]:
    """Elements of the file, its byte order (None for text), the image that it names, and the data after the header."""
    line_end = rb"[ \t]*(?:\r\n|\n|\r)"
    found = re.match(rb"ply" + line_end + rb"(.*?)(?<=[\r\n])end_header" + line_end, data, re.DOTALL)
    if found is None:
        raise _broken(path, "it has no header from 'ply' to 'end_header'")
    kinds = ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")
    names = "char uchar short ushort int uint float double int8 uint8 int16 uint16 int32 uint32 float32 float64"
    kind_of = dict(zip(names.split(), 2 * kinds, strict=True))
    order_of = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
    elements: list[Element] = []
    orders: list[str | None] = []
    images = [""]
    for line in found[1].decode("utf-8", errors="replace").splitlines():
        try:
            match line.split():
                case ["format", name, *_]:
                    orders.append(order_of[name])
                case ["element", name, count]:
                    elements.append((name, int(count), []))
                case ["property", "list", length, kind, name]:
                    elements[-1][2].append((name, kind_of[kind], kind_of[length]))
                case ["property", kind, name]:
                    elements[-1][2].append((name, kind_of[kind], None))
                case ["comment", "TextureFile", _, *_]:
                    images.append(line.split(None, 2)[2].strip())
                case [] | ["comment" | "obj_info", *_]:
                    pass
                case _:
                    raise ValueError
        except (KeyError, IndexError, ValueError):
            raise _broken(path, f"its header says {line.strip()[:60]!r}") from None
    if not orders:
        raise _broken(path, "its header names no format")
    return elements, orders[0], images[:2][-1], data[found.end() :]


def _body(elements: list[Element], order: str | None, body: bytes) -> dict[str, tuple[Columns, Lists]]:
    """Columns of numbers and columns of lists, by element."""
    if order is None:  # text becomes a row of doubles, and is read like binary data
        body = np.array(body.split(), dtype=np.float64).tobytes()
    found = {}
    offset = 0
    for name, count, properties in elements:
        stored = [
            (p, "=f8", length and "=f8") if order is None else (p, order + kind, length and order + length)
            for p, kind, length in properties
        ]
        runs, offset = _runs(stored, count, body, offset)
        columns: Columns = {}
        lists: Lists = {}
        for p, kind, length in properties if runs else ():
            numbers = np.concatenate([run[p].ravel() for run in runs])
            if kind[0] != "f":
                with np.errstate(invalid="ignore"):  # text may hold NaN; as an index, that is refused later
                    numbers = numbers.astype(np.int64 if length else kind)
            if length:
                lists[p] = (np.concatenate([np.full(len(run), run[p].shape[1]) for run in runs]), numbers)
            else:
                columns[p] = numbers
        found[name] = (columns, lists)
    return found


def _runs(properties: list[Property], count: int, body: bytes, offset: int) -> tuple[list[np.ndarray], int]:
    """Rows of an element, in runs of lists with the same lengths, and the offset of the next element.

    Raises
    ------
    ValueError
        If the data hold fewer rows.
    """
    if count < 0:
        raise ValueError
    runs: list[np.ndarray] = []
    done, ahead = 0, 1
    while done < count and properties:
        row = _row(properties, body, offset)
        ahead = min(ahead, count - done, (len(body) - offset) // row.itemsize)
        rows = np.frombuffer(body, row, ahead, offset)
        uniform = np.ones(ahead, dtype=bool)
        for name, _, length in properties:
            if length:
                uniform &= rows[name + LENGTH] == rows[name].shape[1]
        n = ahead if uniform.all() else int(np.argmin(uniform))
        if n == 0:
            raise ValueError
        runs.append(rows[:n])
        done, offset = done + n, offset + n * row.itemsize
        ahead = 2 * ahead if n == ahead else 1
    return runs, offset


def _row(properties: list[Property], body: bytes, offset: int) -> np.dtype:
    """The type of the row at an offset."""
    fields: list[tuple[str, str, tuple[int, ...]]] = []
    for name, kind, length in properties:
        shape: tuple[int, ...] = ()
        if length:
            size = int(np.frombuffer(body, length, 1, offset + np.dtype(fields).itemsize)[0])
            if not 0 <= size <= len(body):
                raise ValueError
            fields.append((name + LENGTH, length, ()))
            shape = (size,)
        fields.append((name, kind, shape))
    return np.dtype(fields)


def _texture(
    vertex: Columns, face: Lists, lengths: np.ndarray, numbers: np.ndarray, n_points: int
) -> np.ndarray | None:
    """Texture coordinates (c, 2) of the corners of all polygons."""
    for u, v in (("u", "v"), ("s", "t"), ("texture_u", "texture_v")):
        if u in vertex and v in vertex:
            return np.stack([vertex[u], vertex[v]], axis=1).astype(np.float64)[numbers]
    sizes, values = face.get("texcoord", (lengths, lengths))
    if "texcoord" not in face or (sizes != 2 * lengths).any():
        return None
    return textured(numbers, np.arange(lengths.sum()), values.reshape(-1, 2).astype(np.float64), n_points)
