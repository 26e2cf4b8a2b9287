"""Messages between a page and the studio.

A page sends JSON objects with the name of a command and its arguments, checked before they are used. What it is sent of
each frame has the length of its header, the header as JSON, and the arrays one after the other, each aligned to four
bytes. Positions are whole numbers from 0 to 65535 in a box around the face, normals bytes from -127 to 127. Arrays that
a page has already, the very same objects, are named and not sent.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..errors import FaceWrinkleError, ParameterError, check_name
from ..schemas import Limits, Share, conforming, table_of
from ..session.parts import LONGEST, Camera, Name

# --- what a page sends ---------------------------------------------------------------------------

LARGEST_MESSAGE = 64 * 1024
"""Bytes of a message."""

Whole = Annotated[int, Limits(0, 2**53 - 1)]
Text = Annotated[str, Limits(most=256)]


Kind = Literal["picture", "cutout", "movie", "glb", "animation", "rig", "maps", "face", "atlas", "session"]
"""What can be saved."""


FIBERS = "fibers"
"""The part with the fibers of muscles."""


@dataclass(kw_only=True)
class Message:
    """A message; the answer has its number, and there is none for 0."""

    id: Whole = 0


@dataclass(kw_only=True)
class Hello(Message):
    """The first message of a page, with the key that it was given, or of a widget."""

    key: Annotated[str, Limits(most=128)] = ""


@dataclass(kw_only=True)
class Shown(Message):
    """The page has drawn a frame."""


@dataclass(kw_only=True)
class Change(Message):
    """Change the document; patches of one gesture are one step of undo."""

    patches: Annotated[list[tuple[Annotated[list[Name], Limits(most=4)], Any]], Limits(most=512)]
    gesture: Text


@dataclass(kw_only=True)
class Undo(Message):
    """Take the last step back."""


@dataclass(kw_only=True)
class Redo(Message):
    """Do the last step that was taken back again."""


@dataclass(kw_only=True)
class Reset(Message):
    """Set everything back."""


@dataclass(kw_only=True)
class Field(Message):
    """Show a field in color, or none, and the fibers of muscles, or not."""

    name: Text | None
    muscles: bool = False

    @property
    def parts(self) -> set[str]:
        """Names of what a frame must hold for that."""
        return {name for name in (self.name, FIBERS if self.muscles else None) if name}


FACE_ALONE = Field(name=None)
"""What a page shows at first."""


@dataclass(kw_only=True)
class Probe(Message):
    """Tell what is known at a place in a triangle of some version of the skin."""

    corners: tuple[Whole, Whole, Whole]
    shares: tuple[Share, Share, Share]
    version: Whole


@dataclass(kw_only=True)
class Show(Message):
    """Show another face that is open."""

    name: Text


@dataclass(kw_only=True)
class Pose(Message):
    """Show a time of the timeline, s."""

    time: Annotated[float, Limits(0.0, LONGEST)]


@dataclass(kw_only=True)
class Play(Message):
    """Let the timeline run, or stop it."""

    on: bool


@dataclass(kw_only=True)
class Copy(Message):
    """Tell a program that makes what is shown, and its picture by an upright camera: position and focal point."""

    camera: Camera


@dataclass(kw_only=True)
class Save(Message):
    """Save a file; see `Copy` for the camera of pictures."""

    what: Kind
    camera: Camera


@dataclass(kw_only=True)
class Stop(Message):
    """End the making of a file that takes long."""


@dataclass(kw_only=True)
class Continue(Message):
    """Go on with the session that was found, or leave it."""

    on: bool


COMMANDS = {kind.__name__.lower(): kind for kind in Message.__subclasses__()}
"""The kinds of messages by the names of their commands."""


def parse(text: str) -> Message:
    """Return the message that a text is.

    Raises
    ------
    ParameterError, UnknownNameError
        If it is none, and for arguments that are not allowed.

    Examples
    --------
    >>> parse('{"do": "field", "name": "W", "id": 3}')
    Field(id=3, name='W', muscles=False)
    """
    try:
        content = table_of(text)
    except ValueError as problem:
        raise ParameterError(f"a message must be a JSON object: {problem}.") from None
    command = str(content.pop("do", ""))[:64]
    check_name("command", command, COMMANDS)
    found: Message = conforming(content, COMMANDS[command], command)
    return found


def key_of(text: str) -> str | None:
    """Return the key of the first message of a page or a widget; None if it is something else.

    Examples
    --------
    >>> key_of('{"do": "hello", "key": "secret"}'), key_of('{"do": "undo"}')
    ('secret', None)
    """
    try:
        message = parse(text)
    except FaceWrinkleError:
        return None
    return message.key if isinstance(message, Hello) else None


# --- what a page is sent -------------------------------------------------------------------------

Known = Mapping[tuple[str, str], np.ndarray]
"""Arrays that a page has, by the names of their part and of themselves."""

LARGEST = 65535
"""Largest whole number that a coordinate becomes."""


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
    >>> box.quantized(np.array([[0.0, 5.0, 10.0]])).tolist()
    [[0, 32768, 65535]]
    """

    low: Array
    size: float

    @classmethod
    def around(cls, *points: Array) -> Box:
        """Return a box around points (n, 3), with room for them to move."""
        low = np.min([p.min(axis=0) for p in points], axis=0)
        high = np.max([p.max(axis=0) for p in points], axis=0)
        extent = float((high - low).max())
        return cls(low - 0.2 * extent, 1.4 * extent)

    def holds(self, points: Array) -> bool:
        """Return True if all points (n, 3) lie in the box."""
        return bool((points.min(axis=0) >= self.low).all() and (points.max(axis=0) <= self.low + self.size).all())

    def quantized(self, points: Array) -> npt.NDArray[np.uint16]:
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
    >>> dot = Part("dot", "mesh", {"color": np.zeros(3, np.uint8), "place": np.zeros((1, 3), np.uint16)})
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
