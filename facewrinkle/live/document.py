"""The document of a session: all that was set by hand, as plain data, with undo and redo.

A patch is a path and a value: ``[["mixture", "AU12L"], 0.7]``. Patches of one gesture, such as the drag of a slider,
are one step of undo. Values are checked before anything changes. Places are those on the person of the document: when
it becomes another person, they go along.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import fields
from typing import Annotated, Any, get_args

import msgspec
from msgspec import Meta, Struct
from msgspec.structs import fields as fields_of

from ..anatomy.atlas import Atlas
from ..anatomy.identity import Identity
from ..anatomy.landmarks import NAMES
from ..errors import ParameterError, unknown_name
from ..layers.patterns_on_skin.kinds import KINDS
from ..layers.wave_folds.amounts import REGIONS
from ..schemas import Share, conforming

VERSION, MARK = 1, "facewrinkle session"
"""The form of session files, and the name under which they say it."""

LONGEST = 600.0
"""Seconds of a timeline at most."""

Name = Annotated[str, Meta(max_length=64)]
Factor = Annotated[float, Meta(ge=0.0, le=4.0)]
Angle = Annotated[float, Meta(ge=-40.0, le=40.0)]
Time = Annotated[float, Meta(ge=0.0, le=LONGEST)]
Coordinate = Annotated[float, Meta(ge=-1e9, le=1e9)]
Place = tuple[Coordinate, Coordinate, Coordinate]
Mixture = Annotated[dict[Name, Share], Meta(max_length=512)]
Data = Mapping[str, Any]
OwnName = Annotated[str, Meta(min_length=1, max_length=40)]


class Folds(Struct, frozen=True):
    """Numbers of folds: factors of their depth, by side, and what waves are made of. Those that are not known, as in
    sessions of earlier versions, are left out.
    """

    depth: Factor = 1.0
    left: Factor = 1.0
    right: Factor = 1.0
    density: Annotated[float, Meta(ge=0.25, le=4.0)] = 1.0
    length: Annotated[float, Meta(ge=0.5, le=2.0)] = 1.0
    irregularity: Annotated[float, Meta(ge=0.0, le=3.0)] = 1.0
    seed: Annotated[int, Meta(ge=0, le=2**31)] = 0
    age: Share = 0.0


class Pattern(Struct, frozen=True, forbid_unknown_fields=True):
    """A pattern; sizes and depths are in mm."""

    kind: Name
    center: Place
    size: Annotated[float, Meta(ge=2.0, le=120.0)]
    depth: Annotated[float, Meta(ge=-6.0, le=6.0)]
    strength: Share = 1.0


class Tear(Struct, frozen=True, forbid_unknown_fields=True):
    """A tear: mm, and the second at which it begins."""

    start: Place
    width: Annotated[float, Meta(ge=0.6, le=6.0)] = 2.6
    length: Annotated[float, Meta(ge=5.0, le=120.0)] = 60.0
    begin: Annotated[float, Meta(ge=0.0, le=60.0)] = 0.0


class Key(Struct, frozen=True, forbid_unknown_fields=True):
    """An event of the timeline, s: it grows from onset to apex, and fades from offset to end."""

    unit: Name
    weight: Share
    onset: Time
    apex: Time
    offset: Time
    end: Time


class Timeline(Struct, frozen=True, forbid_unknown_fields=True):
    """Events in time, s."""

    length: Annotated[float, Meta(ge=0.2, le=LONGEST)] = 4.0
    loop: bool = True
    keys: Annotated[dict[Name, Key], Meta(max_length=256)] = {}


class Session(Struct, frozen=True, forbid_unknown_fields=True):
    """All that is set by hand."""

    face: str = ""
    landmarks: dict[Name, Place] = {}
    mixture: Mixture = {}
    mixtures: Annotated[dict[OwnName, Annotated[Mixture, Meta(min_length=1)]], Meta(max_length=64)] = {}
    intensity: Share = 1.0
    gaze: tuple[Angle, Angle] = (0.0, 0.0)
    folds: Folds = Folds()
    regions: dict[Name, Factor] = {}
    identity: dict[Name, Annotated[float, Meta(ge=-1.0, le=1.0)]] = {}
    patterns: Annotated[dict[Name, Pattern], Meta(max_length=32)] = {}
    tears: Annotated[dict[Name, Tear], Meta(max_length=32)] = {}
    probes: Annotated[dict[Name, Place], Meta(max_length=32)] = {}
    timeline: Timeline = Timeline()


START: Mapping[str, Any] = msgspec.json.decode(msgspec.json.encode(Session()))
"""A document in which nothing is set."""

PARTS = {field.name: field.type for field in fields_of(Session)}
"""The types of the parts of a document."""

KNOWN: Mapping[str, tuple[str, Collection[str]]] = {
    "landmarks": ("landmark", NAMES),
    "regions": ("region of folds", REGIONS),
    "identity": ("parameter of an identity", [field.name for field in fields(Identity)]),
}
"""What the entries of some parts are, and their names."""


def ranges(kind: type[Struct]) -> dict[str, tuple[float, float]]:
    """Return the ranges of the numbers of a pattern, a tear or of folds.

    Examples
    --------
    >>> ranges(Tear)["width"]
    (0.6, 6.0)
    """
    numbers = [(field.name, get_args(field.type)) for field in fields_of(kind)]
    return {name: (limits[0].ge, limits[0].le) for name, (number, *limits) in numbers if number is float and limits}


def is_session(text: str | bytes) -> bool:
    """Return True if a text is a session, of any version.

    Examples
    --------
    >>> is_session('{"facewrinkle session": 1}'), is_session('[{"jawOpen": 0.5}]')
    (True, False)
    """
    try:
        return MARK in msgspec.json.decode(text, type=dict[str, Any])
    except (ValueError, RecursionError):
        return False


class Document:
    """All that was set by hand, with its history.

    Parameters
    ----------
    atlas : Atlas
        Of the face, for the names that a mixture may have.
    faces : callable, optional
        Returns the names of the faces that are open; "" is the one of the start.
    carry : callable, optional
        Called with the data before and after a change, and the names of the parts that it did not touch; returns those
        of them whose places are others on the person after the change.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> document = Document(fw.default_face().atlas)
    >>> document.change([(("mixture", "AU12"), 0.5)], gesture="drag 1")
    >>> document.change([(("mixture", "AU12"), 0.8)], gesture="drag 1")
    >>> document.data["mixture"], document.undo(), document.data["mixture"]
    ({'AU12': 0.8}, True, {})
    """

    def __init__(
        self,
        atlas: Atlas,
        faces: Callable[[], Collection[str]] = lambda: ("",),
        carry: Callable[[Data, Data, Collection[str]], Data] = lambda before, after, parts: {},
    ) -> None:
        self._atlas, self._faces, self._carry = atlas, faces, carry
        self.version = 0
        self._states: list[dict[str, Any]] = [dict(START)]
        self._at, self._gesture = 0, ""

    @property
    def data(self) -> dict[str, Any]:
        """All that is set, as plain data; it is never changed, as other threads may be reading it."""
        return self._states[self._at]

    @property
    def history(self) -> tuple[int, int]:
        """Numbers of steps that can be undone, and done again."""
        return self._at, len(self._states) - 1 - self._at

    def change(self, patches: Iterable[tuple[Sequence[str], Any]], gesture: str = "") -> None:
        """Apply patches, all or none; those with the gesture of the last step belong to that step.

        A patch is a path and its new value; None takes an entry of a table away.

        Raises
        ------
        ParameterError, UnknownNameError
            For paths and values that the document does not have or allow.
        """
        data, heads = dict(self.data), []
        for path, value in patches:
            _set(data, path, value)
            heads.append(path[0])
        for head in dict.fromkeys(heads):
            data[head] = self._checked(head, data.get(head, START[head]))
        if not heads:
            return
        data |= self._carry(self.data, data, START.keys() - set(heads))
        if gesture and gesture == self._gesture:
            self._states[self._at :] = [data]
        else:
            self._states[self._at + 1 :] = [data]
            self._at = len(self._states) - 1
        self._gesture, self.version = gesture, self.version + 1

    def undo(self) -> bool:
        """Take the last step back; return False if there is none."""
        return self._move(-1)

    def redo(self) -> bool:
        """Do the last step that was undone again; return False if there is none."""
        return self._move(1)

    def _move(self, by: int) -> bool:
        if not 0 <= self._at + by < len(self._states):
            return False
        self._at, self._gesture, self.version = self._at + by, "", self.version + 1
        return True

    def reset(self) -> None:
        """Set everything back but the expressions that are kept, as a step that can be undone."""
        start = {**START, "mixtures": self.data["mixtures"]}
        self.change([((name,), value) for name, value in start.items() if self.data[name] != value])

    # --- files ---------------------------------------------------------------------------------

    def text(self) -> str:
        """Return the session as JSON."""
        return json.dumps({MARK: VERSION, **self.data}, indent=1)

    def load(self, text: str | bytes) -> None:
        """Take over the session of a file, as a step that can be undone.

        Raises
        ------
        ParameterError
            If it is not a session, or one of a newer version.
        """
        if not is_session(text):
            raise ParameterError(f"this is not a session of the studio: it must be JSON with a {MARK!r}.")
        content = msgspec.json.decode(text, type=dict[str, Any])
        number = content.pop(MARK)
        if number != VERSION:
            raise ParameterError(
                f"the session has the version {number!r}, and this program reads {VERSION}: update it."
            )
        given = {**START, **content}
        if given != self.data:
            self.change([((name,), value) for name, value in given.items()])

    # --- checks --------------------------------------------------------------------------------

    def _checked(self, head: str, value: Any) -> Any:
        """Return a part as plain data, complete; raise an error for what is not allowed."""
        part = msgspec.json.decode(msgspec.json.encode(conforming(value, PARTS[head], head)))
        match head:
            case "face":
                if part not in self._faces():
                    raise ParameterError(f"the face {part[:64]!r} is not open. Open its file first.")
            case "mixture":
                self._check_units(part)
            case "mixtures":
                for mixture in part.values():
                    self._check_units(mixture)
            case "patterns":
                _check_names("pattern", (pattern["kind"] for pattern in part.values()), KINDS)
            case "timeline":
                self._check_units(key["unit"] for key in part["keys"].values())
                for key in part["keys"].values():
                    if not key["onset"] <= key["apex"] <= key["offset"] <= key["end"]:
                        raise ParameterError("the times of a key must follow each other: onset, apex, offset, end.")
            case "landmarks" | "regions" | "identity":
                _check_names(KNOWN[head][0], part, KNOWN[head][1])
        return part

    def _check_units(self, names: Iterable[str]) -> None:
        for name in names:
            self._atlas.resolve(name, "expression, action unit or muscle")


def _check_names(what: str, names: Iterable[str], known: Collection[str]) -> None:
    for name in names:
        if name not in known:
            raise unknown_name(what, name, known)


def _set(data: dict[str, Any], path: Sequence[str], value: Any) -> None:
    """Set an entry of a document, or take it away."""
    if not path or path[0] not in START:
        raise unknown_name("part of the session", path[0] if path else "", START)
    if len(path) > 1:
        data[path[0]] = deepcopy(data[path[0]])
    table = data
    for name in path[:-1]:
        if not isinstance(table.get(name), dict):
            raise unknown_name("table of the session", name, [key for key in table if isinstance(table[key], dict)])
        table = table[name]
    if value is None:
        table.pop(path[-1], None)
    else:
        table[path[-1]] = value
