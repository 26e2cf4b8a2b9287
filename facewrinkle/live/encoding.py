"""Parts of a picture as bytes: what a page is sent of each frame.

A message has the length of its header, the header as JSON, and the arrays one after the other, each aligned to four
bytes. Positions are whole numbers from 0 to 65535 in a box around the face, normals bytes from -127 to 127. Arrays
that a page has already are left out.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from . import _byte_kernels as kernels

Known = dict[str, tuple[int, int, dict[str, np.ndarray]]]
"""Things that a page has: the version, the last change and the arrays of each part, by name."""

FEW = 256
"""Arrays of fewer rows are always sent whole."""

LARGEST = 65535
"""Largest whole number that a coordinate becomes."""

ROOM = 0.2
"""Room around the face in its box, as a share of its largest extent."""

CODES = {"uint8": "u8", "int8": "i8", "uint16": "u16", "uint32": "u32", "float32": "f32"}
"""Types of arrays, and what the page calls them."""


@dataclass(frozen=True, eq=False)
class Box:
    """A box that holds all positions.

    Attributes
    ----------
    low : ndarray, shape (3,)
    size : float
        Length of its edges, in the unit of the mesh.

    Examples
    --------
    >>> box = Box(np.zeros(3), 10.0)
    >>> numbers = box.quantised(np.array([[0.0, 5.0, 10.0]]))
    >>> numbers.tolist(), box.restored(numbers).round(3).tolist()
    ([[0, 32768, 65535]], [[0.0, 5.0, 10.0]])
    """

    low: Array
    size: float

    @classmethod
    def around(cls, *points: Array) -> Box:
        """Return a box around points (n, 3), with room for them to move."""
        low = np.min([p.min(axis=0) for p in points], axis=0)
        high = np.max([p.max(axis=0) for p in points], axis=0)
        room = ROOM * float((high - low).max())
        return cls(low - room, float((high - low).max()) + 2.0 * room)

    def holds(self, points: Array) -> bool:
        """Return True if all points (n, 3) lie in the box."""
        return bool(kernels.inside(np.asarray(points, np.float64), self.low, self.low + self.size))

    def quantised(self, points: Array) -> npt.NDArray[np.uint16]:
        """Return points (n, 3) as whole numbers; those outside are moved to the border."""
        numbers = np.empty(points.shape, np.uint16)
        kernels.quantise(np.asarray(points, np.float64), self.low, LARGEST / self.size, float(LARGEST), numbers)
        return numbers

    def restored(self, numbers: npt.NDArray[np.uint16]) -> Array:
        """Return the points that whole numbers stand for."""
        return np.asarray(self.low + numbers * (self.size / LARGEST))

    @property
    def step(self) -> float:
        """Distance of neighbouring numbers, in the unit of the mesh."""
        return self.size / LARGEST


def small_normals(normals: Array, fourth: Array | float = 0.0) -> npt.NDArray[np.int8]:
    """Return normals (n, 3) and a number in [0, 1] as bytes (n, 4)."""
    out = np.empty((len(normals), 4), np.int8)
    out[:, :3] = np.rint(127.0 * np.asarray(normals))
    out[:, 3] = np.rint(127.0 * np.asarray(fourth))
    return out


@dataclass(eq=False)
class Part:
    """A thing in the picture.

    Attributes
    ----------
    name : str
    kind : str
        How the page draws it.
    version : int
        Grows with each change of what is fixed.
    changed : int
        Grows with each change of what moves.
    fixed, moving : dict of str to ndarray
        Arrays that stay the same for many frames, and those that change.
    fixed_info, info : dict
        What goes into the header with them.
    """

    name: str
    kind: str
    version: int
    changed: int
    fixed: Mapping[str, np.ndarray] = field(default_factory=dict)
    moving: Mapping[str, np.ndarray] = field(default_factory=dict)
    fixed_info: Mapping[str, Any] = field(default_factory=dict)
    info: Mapping[str, Any] = field(default_factory=dict)


def message(head: Mapping[str, Any], parts: Iterable[Part], known: Known) -> tuple[bytes, Known]:
    """Return a message with what a page does not have yet, and what it has after it.

    Examples
    --------
    >>> dot = Part("dot", "mesh", 1, 1, {"colour": np.zeros(3, np.uint8)}, {"place": np.zeros((1, 3), np.uint16)})
    >>> first, has = message({}, [dot], {})
    >>> second, _ = message({}, [dot], has)
    >>> sorted(decoded(first)[1]["dot"]), sorted(decoded(second)[1]["dot"])
    (['colour', 'place'], [])
    """
    entries, chunks, offset, has = [], [], 0, {}
    for part in parts:
        version, changed, had = known.get(part.name, (-1, -1, {}))
        entry: dict[str, Any] = {"name": part.name, "kind": part.kind, "info": dict(part.info), "arrays": {}}
        arrays: dict[str, np.ndarray] = {}
        if version != part.version:
            entry["fixed"] = dict(part.fixed_info)
            arrays |= part.fixed
        if changed != part.changed or version != part.version:
            arrays |= part.moving
        for name, values in arrays.items():
            width = values.shape[1] if values.ndim > 1 else 1
            mask = changed_rows(had.get(name), values)
            sent = [values] if mask is None else [values[mask], np.packbits(mask, bitorder="little")]
            entry["arrays"][name] = [CODES[values.dtype.name], offset, int(values.size), int(width)]
            for each in sent:
                if each is not sent[0]:
                    entry["arrays"][name].append(offset)
                data = np.ascontiguousarray(each).tobytes()
                chunks += [data, b"\0" * (-len(data) % 4)]
                offset += len(data) + -len(data) % 4
        kept = {name: values for name, values in had.items() if name in part.fixed or name in part.moving}
        has[part.name] = part.version, part.changed, kept | arrays
        entries.append(entry)
    text = json.dumps({**head, "parts": entries}, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([struct.pack("<I", len(text)), text, *chunks]), has


def photo_message(name: str, photo: bytes) -> bytes:
    """Return a message with the photo of a part.

    Examples
    --------
    >>> photo_message("skin", b"...")[:12]
    b'PHOT\\x04\\x00\\x00\\x00skin'
    """
    text = name.encode()
    return b"PHOT" + struct.pack("<I", len(text)) + text + photo


def changed_rows(before: np.ndarray | None, now: np.ndarray) -> npt.NDArray[np.bool_] | None:
    """Return True (n,) for rows that a page does not have; None if all are better sent.

    Examples
    --------
    >>> before = np.zeros((300, 2), np.int8)
    >>> now = before.copy()
    >>> now[5] = 1
    >>> np.flatnonzero(changed_rows(before, now)).tolist(), changed_rows(before[:5], now)
    ([5], None)
    """
    if before is None or len(now) < FEW or before.dtype != now.dtype or before.shape[1:] != now.shape[1:]:
        return None
    mask = np.empty(len(now), bool)
    count = kernels.differing(_rows_of_bytes(before), _rows_of_bytes(now), mask)
    return mask if count < 0.9 * len(now) else None


def _rows_of_bytes(values: np.ndarray) -> npt.NDArray[np.uint8]:
    rows = np.ascontiguousarray(values).view(np.uint8)
    return rows.reshape(len(values), rows.size // max(len(values), 1))


def decoded(
    data: bytes, had: Mapping[str, Mapping[str, np.ndarray]] | None = None
) -> tuple[dict[str, Any], dict[str, dict[str, np.ndarray]]]:
    """Return the header of a message and its arrays, by the names of the parts; `had` are those of earlier messages."""
    types = {code: np.dtype(name) for name, code in CODES.items()}
    length = struct.unpack_from("<I", data)[0]
    head = json.loads(data[4 : 4 + length])
    begin = 4 + length

    def array(part: str, name: str, code: str, offset: int, count: int, width: int, mask_at: int = -1) -> np.ndarray:
        if mask_at < 0:
            return np.frombuffer(data, types[code], count, begin + offset).reshape(-1, width)
        n = count // width
        bits = np.frombuffer(data, np.uint8, -(-n // 8), begin + mask_at)
        mask = np.unpackbits(bits, count=n, bitorder="little").astype(bool)
        values, before = np.zeros((n, width), types[code]), (had or {})[part][name]
        values[: len(before)] = before[:n]
        few = np.count_nonzero(mask)
        values[mask] = np.frombuffer(data, types[code], few * width, begin + offset).reshape(-1, width)
        return values

    arrays = {
        part["name"]: {name: array(part["name"], name, *entry) for name, entry in part["arrays"].items()}
        for part in head["parts"]
    }
    return head, arrays
