"""The messages of a page: JSON objects with the name of a command and its arguments, checked before they are used."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

from ..errors import FaceWrinkleError, ParameterError, unknown_name
from ..schemas import Share, conforming
from .document import LONGEST, Coordinate, Name

LARGEST_MESSAGE = 64 * 1024
"""Bytes of a message."""

Whole = Annotated[int, Meta(ge=0, lt=2**53)]
Text = Annotated[str, Meta(max_length=256)]
Camera = Annotated[list[Coordinate], Meta(min_length=6, max_length=6)]


class Message(Struct, forbid_unknown_fields=True, kw_only=True):
    """A message; the answer has its number, and there is none for 0."""

    id: Whole = 0


class Hello(Message):
    """The first message of a page, with the key that it was given, or of a widget."""

    key: Annotated[str, Meta(max_length=128)] = ""


class Shown(Message):
    """The page has drawn a frame."""


class Change(Message):
    """Change the document; patches of one gesture are one step of undo."""

    patches: Annotated[list[tuple[Annotated[list[Name], Meta(max_length=4)], Any]], Meta(max_length=512)]
    gesture: Text


class Undo(Message):
    """Take the last step back."""


class Redo(Message):
    """Do the last step that was taken back again."""


class Reset(Message):
    """Set everything back."""


class Field(Message):
    """Show a field in colour, or none."""

    name: Text | None


class Probe(Message):
    """Tell what is known at a place in a triangle of some version of the skin."""

    corners: tuple[Whole, Whole, Whole]
    shares: tuple[Share, Share, Share]
    version: Whole


class Show(Message):
    """Show another face that is open."""

    name: Text


class Pose(Message):
    """Show a time of the timeline, s."""

    time: Annotated[float, Meta(ge=0.0, le=LONGEST)]


class Play(Message):
    """Let the timeline run, or stop it."""

    on: bool


class Live(Message):
    """Show a mixture on top of the document until the next one."""

    weights: Annotated[dict[Text, Share], Meta(max_length=256)]


class Copy(Message):
    """Tell a program that makes what is shown, and its picture by an upright camera: position and focal point."""

    camera: Camera


class Save(Message):
    """Save a file; see `Copy` for the camera of pictures."""

    what: Text
    camera: Camera


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
    Field(name='W', id=3)
    """
    try:
        content = msgspec.json.decode(text, type=dict[str, Any])
    except (ValueError, RecursionError) as problem:
        raise ParameterError(f"a message must be a JSON object: {problem}.") from None
    command = str(content.pop("do", ""))
    if command not in COMMANDS:
        raise unknown_name("command", command[:64], COMMANDS)
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
