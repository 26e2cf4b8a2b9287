"""Parts of a picture as bytes: what a page is sent of each frame.

A message has the length of its header, the header as JSON, and the arrays one after the other, each aligned to four
bytes. Positions are whole numbers from 0 to 65535 in a box around the face, normals bytes from -127 to 127. Arrays
that a page has already, the very same objects, are named and not sent.
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

Known = Mapping[tuple[str, str], np.ndarray]
"""Arrays that a page has, by the names of their part and of themselves."""

LARGEST = 65535
"""Largest whole number that a coordinate becomes."""

ROOM = 0.2
"""Room around the face in its box, as a share of its largest extent."""


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
    >>> box.quantised(np.array([[0.0, 5.0, 10.0]])).tolist()
    [[0, 32768, 65535]]
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
        return bool((points.min(axis=0) >= self.low).all() and (points.max(axis=0) <= self.low + self.size).all())

    def quantised(self, points: Array) -> npt.NDArray[np.uint16]:
        """Return points (n, 3) as whole numbers; those outside are moved to the border."""
        numbers = np.rint((points - self.low) * (LARGEST / self.size))
        return np.clip(numbers, 0, LARGEST, out=numbers).astype(np.uint16)


def small_normals(normals: Array, fourth: Array | float = 0.0) -> npt.NDArray[np.int8]:
    """Return normals (n, 3) and a number in [0, 1] as bytes (n, 4)."""
    out = np.empty((len(normals), 4), np.int8)
    out[:, :3] = np.rint(127.0 * np.asarray(normals))
    out[:, 3] = np.rint(127.0 * np.asarray(fourth))
    return out


@dataclass(frozen=True, eq=False)
class Part:
    """A thing in the picture.

    Attributes
    ----------
    name : str
    kind : str
        How the page draws it.
    arrays : dict of str to ndarray
        An array that is the very object of the frame before is not sent again.
    info : dict
        What goes into the header.
    """

    name: str
    kind: str
    arrays: Mapping[str, np.ndarray]
    info: Mapping[str, Any] = field(default_factory=dict)


def message(head: Mapping[str, Any], parts: Iterable[Part], known: Known) -> tuple[bytes, Known]:
    """Return a message with what a page does not have yet, and what it has after it.

    Examples
    --------
    >>> dot = Part("dot", "mesh", {"colour": np.zeros(3, np.uint8), "place": np.zeros((1, 3), np.uint16)})
    >>> first, has = message({}, [dot], {})
    >>> moved = Part("dot", "mesh", {**dot.arrays, "place": np.ones((1, 3), np.uint16)})
    >>> second, _ = message({}, [moved], has)
    >>> len(first) > len(second)
    True
    """
    entries, chunks, offset, has = [], [], 0, {}
    for part in parts:
        arrays: dict[str, list[Any] | None] = {}
        for name, values in part.arrays.items():
            has[part.name, name] = values
            arrays[name] = None
            if known.get((part.name, name)) is not values:
                width = values.shape[1] if values.ndim > 1 else 1
                arrays[name] = [values.dtype.name, offset, int(values.size), int(width)]
                data = values.tobytes()
                chunks += [data, b"\0" * (-len(data) % 4)]
                offset += len(data) + -len(data) % 4
        entries.append({"name": part.name, "kind": part.kind, "info": dict(part.info), "arrays": arrays})
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
