"""The document of a session: all that was set by hand, as plain data, with undo and redo.

A patch is a path and a value: ``[["mixture", "AU12L"], 0.7]``. Patches of one gesture, such as the drag of a slider,
are one step of undo. Values are checked before anything changes.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from ..anatomy.atlas import Atlas
from ..anatomy.identity import Identity
from ..anatomy.landmarks import NAMES
from ..checks import vector
from ..errors import ParameterError, check_range, check_whole, unknown_name
from ..layers.patterns_on_skin.kinds import KINDS

VERSION = 1
"""Of the form of session files."""

MOST_STEPS = 1000
"""Steps that can be undone."""

MOST_ITEMS = 32
"""Patterns, and tears, of one document."""

MOST_KEYS = 256
"""Keys of the timeline."""

Patch = tuple[tuple[str, ...], Any]
"""A path and its new value; None takes an entry of a table away."""

LONGEST = 600.0
"""Seconds of a timeline at most."""

START: Mapping[str, Any] = {
    "face": "",
    "landmarks": {},
    "mixture": {},
    "mixtures": {},
    "intensity": 1.0,
    "gaze": [0.0, 0.0],
    "folds": {
        "depth": 1.0,
        "left": 1.0,
        "right": 1.0,
        "density": 1.0,
        "length": 1.0,
        "irregularity": 1.0,
        "seed": 0,
        "age": 0.0,
        "pinch": 0.0,
    },
    "regions": {},
    "identity": {},
    "patterns": {},
    "tears": {},
    "timeline": {"length": 4.0, "loop": True, "keys": {}},
}
"""A document in which nothing is set."""

FOLDS: Mapping[str, tuple[float, float]] = {
    "depth": (0.0, 4.0),
    "left": (0.0, 4.0),
    "right": (0.0, 4.0),
    "density": (0.25, 4.0),
    "length": (0.5, 2.0),
    "irregularity": (0.0, 3.0),
    "age": (0.0, 1.0),
    "pinch": (0.0, 1.0),
}
"""Ranges of the numbers of folds; the seed is a whole number."""

REGIONS: Mapping[str, tuple[str, ...]] = {
    "forehead": ("forehead_mid", "brow_l_mid", "brow_r_mid"),
    "between the brows": ("glabella",),
    "crow's feet": ("eye_l_outer", "eye_r_outer"),
    "nose": ("nasion", "sellion", "ala_l", "ala_r"),
    "cheeks": ("malar_l", "malar_r"),
    "mouth": ("mouth_l", "mouth_r", "upper_lip_mid", "lower_lip_mid"),
    "chin": ("pogonion", "menton"),
}
"""Regions whose folds have a factor of their own, by the landmarks that they lie around."""

MOST_MIXTURES = 64
"""Mixtures that are kept under a name."""

PATTERN: Mapping[str, tuple[float, float]] = {"size": (2.0, 120.0), "depth": (-6.0, 6.0), "strength": (0.0, 1.0)}
"""Ranges of the numbers of a pattern; sizes and depths are in mm."""

TEAR: Mapping[str, tuple[float, float]] = {"width": (0.6, 6.0), "length": (5.0, 120.0), "begin": (0.0, 60.0)}
"""Ranges of the numbers of a tear: mm, and the second at which it begins."""

KEY: Mapping[str, tuple[float, float]] = {
    "onset": (0.0, LONGEST),
    "apex": (0.0, LONGEST),
    "offset": (0.0, LONGEST),
    "end": (0.0, LONGEST),
    "weight": (0.0, 1.0),
}
"""Ranges of the numbers of an event of the timeline, s: it grows from onset to apex, and fades from offset to end."""


@dataclass(frozen=True)
class _Step:
    """One step of undo: patches, and those that take them back."""

    gesture: str
    done: list[Patch]
    back: list[Patch]


class Document:
    """All that was set by hand, with its history.

    Parameters
    ----------
    atlas : Atlas
        Of the face, for the names that a mixture may have.
    faces : callable, optional
        Returns the names of the faces that are open; "" is the one of the start.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> document = Document(fw.default_face().atlas)
    >>> document.change([(("mixture", "AU12"), 0.5)], gesture="drag 1")
    >>> document.change([(("mixture", "AU12"), 0.8)], gesture="drag 1")
    >>> document.data["mixture"], document.undo(), document.data["mixture"]
    ({'AU12': 0.8}, True, {})
    """

    def __init__(self, atlas: Atlas, faces: Callable[[], Collection[str]] = lambda: ("",)) -> None:
        self._atlas, self._faces = atlas, faces
        self.data: dict[str, Any] = deepcopy(dict(START))
        self.version = 0
        self._done: list[_Step] = []
        self._undone: list[_Step] = []

    @property
    def history(self) -> tuple[int, int]:
        """Numbers of steps that can be undone, and done again."""
        return len(self._done), len(self._undone)

    def change(self, patches: Iterable[Patch], gesture: str = "") -> None:
        """Apply patches, all or none; those with the gesture of the last step belong to that step.

        Raises
        ------
        ParameterError, UnknownNameError
            For paths and values that the document does not have or allow.
        """
        checked = [(path, self._checked(path, value)) for path, value in patches]
        if not checked:
            return
        data = deepcopy(self.data)  # other threads may be reading the present one
        back = [(path, _set(data, path, value)) for path, value in checked]
        self.data, self.version = data, self.version + 1
        self._undone.clear()
        if gesture and self._done and self._done[-1].gesture == gesture:
            last, many = self._done[-1], len(checked)
            if [path for path, _ in last.done[-many:]] == [path for path, _ in checked]:
                last.done[-many:] = checked  # of a long drag, the last values and the first are enough
            else:
                last.done.extend(checked)
                last.back.extend(back)
        else:
            self._done.append(_Step(gesture, checked, back))
            del self._done[:-MOST_STEPS]

    def undo(self) -> bool:
        """Take the last step back; return False if there is none."""
        return self._move(self._done, self._undone, lambda step: list(reversed(step.back)))

    def redo(self) -> bool:
        """Do the last step that was undone again; return False if there is none."""
        return self._move(self._undone, self._done, lambda step: step.done)

    def _move(self, source: list[_Step], target: list[_Step], patches: Callable[[_Step], list[Patch]]) -> bool:
        if not source:
            return False
        step = source.pop()
        target.append(_Step("", step.done, step.back))  # a later drag is a step of its own
        data = deepcopy(self.data)
        for path, value in patches(step):
            _set(data, path, value)
        self.data, self.version = data, self.version + 1
        return True

    def reset(self, gesture: str = "") -> None:
        """Set everything back but the expressions that are kept, as a step that can be undone."""
        start = {**START, "mixtures": self.data["mixtures"]}
        self.change([((name,), deepcopy(value)) for name, value in start.items() if self.data[name] != value], gesture)

    # --- files ---------------------------------------------------------------------------------

    def text(self) -> str:
        """Return the session as JSON."""
        return json.dumps({"facewrinkle session": VERSION, **self.data}, indent=1)

    def load(self, text: str) -> None:
        """Take over the session of a file, as a step that can be undone.

        Raises
        ------
        ParameterError
            If it is not a session, or one of a newer version.
        """
        try:
            content = json.loads(text)
        except (ValueError, RecursionError):
            content = None
        if not isinstance(content, dict) or "facewrinkle session" not in content:
            raise ParameterError("this is not a session of the studio: it must be JSON with a 'facewrinkle session'.")
        number = content.pop("facewrinkle session")
        if number != VERSION:
            raise ParameterError(
                f"the session has the version {number!r}, and this program reads {VERSION}: update it."
            )
        given = {**deepcopy(dict(START)), **content}
        self.change([((name,), value) for name, value in given.items() if self.data.get(name) != value])

    # --- checks --------------------------------------------------------------------------------

    def _checked(self, path: Sequence[str], value: Any) -> Any:
        if not path or not all(isinstance(name, str) and len(name) <= 64 for name in path) or path[0] not in START:
            raise unknown_name("part of the session", path[0] if path else "", START)
        head, rest = path[0], path[1:]
        check: Callable[[Sequence[str], Any], Any] = getattr(self, f"_checked_{head}")
        if value is None and (not rest or head in ("folds", "intensity", "gaze", "face")):
            raise ParameterError(f"{'.'.join(path)} cannot be taken away; set it to a value.")
        return check(rest, value)

    def _table(self, what: str, rest: Sequence[str], value: Any, check: Callable[[str, Any], Any], most: int) -> Any:
        """A table of entries, given whole, or one entry."""
        if len(rest) == 1:
            return None if value is None else check(rest[0], value)
        if rest or not isinstance(value, dict) or len(value) > most:
            raise ParameterError(f"{what} must be a table of at most {most} entries, received {type(value).__name__}.")
        return {str(name): check(str(name), each) for name, each in value.items()}

    def _checked_face(self, rest: Sequence[str], value: Any) -> str:
        if rest or not isinstance(value, str) or value not in self._faces():
            raise ParameterError(f"the face {str(value)[:64]!r} is not open. Open its file first.")
        return value

    def _checked_landmarks(self, rest: Sequence[str], value: Any) -> Any:
        def check(name: str, place: Any) -> list[float]:
            if name not in NAMES:
                raise unknown_name("landmark", name, NAMES)
            return vector("a place", place).tolist()

        return self._table("landmarks", rest, value, check, len(NAMES))

    def _checked_mixture(self, rest: Sequence[str], value: Any) -> Any:
        def check(name: str, weight: Any) -> float:
            self._atlas.resolve(name, "expression, action unit or muscle")
            return check_range(f"the weight of {name}", weight, 0.0, 1.0)

        return self._table("a mixture", rest, value, check, 512)

    def _checked_mixtures(self, rest: Sequence[str], value: Any) -> Any:
        def check(name: str, weights: Any) -> dict[str, float]:
            if not re.fullmatch(r"\w[\w' -]{0,39}", name):
                raise ParameterError(
                    f"a mixture is named by at most 40 letters, digits, spaces and '-_, received {name!r}."
                )
            if weights == {}:
                raise ParameterError("there is nothing to keep: set a slider first.")
            checked: dict[str, float] = self._checked_mixture((), weights)
            return checked

        return self._items("mixtures", rest, value, check, MOST_MIXTURES)

    def _checked_regions(self, rest: Sequence[str], value: Any) -> Any:
        def check(name: str, factor: Any) -> float:
            if name not in REGIONS:
                raise unknown_name("region of folds", name, REGIONS)
            return check_range(f"the folds of {name}", factor, 0.0, 4.0)

        return self._table("regions", rest, value, check, len(REGIONS))

    def _checked_intensity(self, rest: Sequence[str], value: Any) -> float:
        return check_range("intensity", value, 0.0, 1.0)

    def _checked_gaze(self, rest: Sequence[str], value: Any) -> list[float]:
        if rest or not isinstance(value, list) or len(value) != 2:
            raise ParameterError(f"gaze must be two angles, received {value!r}.")
        return [check_range("an angle of the gaze", angle, -40.0, 40.0) for angle in value]

    def _checked_folds(self, rest: Sequence[str], value: Any) -> Any:
        def check(name: str, number: Any) -> float:
            if name == "seed":
                return check_whole("seed", number, 0, 2**31)
            if name not in FOLDS:
                raise unknown_name("number of folds", name, [*FOLDS, "seed"])
            return check_range(name, number, *FOLDS[name])

        return {**START["folds"], **self._table("folds", rest, value, check, 16)} if not rest else check(rest[0], value)

    def _checked_identity(self, rest: Sequence[str], value: Any) -> Any:
        def check(name: str, number: Any) -> float:
            known = list(Identity.__dataclass_fields__)
            if name not in known:
                raise unknown_name("parameter of an identity", name, known)
            return check_range(name, number, -1.0, 1.0, "0 is the mean head.")

        return self._table("an identity", rest, value, check, 64)

    def _checked_patterns(self, rest: Sequence[str], value: Any) -> Any:
        def check(name: str, entry: Any) -> dict[str, Any]:
            found = _entry("a pattern", entry, PATTERN, ("kind", "centre"), {"strength": 1.0})
            if found["kind"] not in KINDS:
                raise unknown_name("pattern", found["kind"], KINDS)
            return {**found, "centre": vector("a place", found["centre"]).tolist()}

        return self._items("patterns", rest, value, check, MOST_ITEMS)

    def _checked_tears(self, rest: Sequence[str], value: Any) -> Any:
        def check(name: str, entry: Any) -> dict[str, Any]:
            found = _entry("a tear", entry, TEAR, ("start",), {"width": 2.6, "length": 60.0, "begin": 0.0})
            return {**found, "start": vector("a place", found["start"]).tolist()}

        return self._items("tears", rest, value, check, MOST_ITEMS)

    def _checked_timeline(self, rest: Sequence[str], value: Any) -> Any:
        def check(name: str, entry: Any) -> dict[str, Any]:
            found = _entry("a key", entry, KEY, ("unit",), {})
            self._atlas.resolve(str(found["unit"]), "expression, action unit or muscle")
            if not found["onset"] <= found["apex"] <= found["offset"] <= found["end"]:
                raise ParameterError("the times of a key must follow each other: onset, apex, offset, end.")
            return found

        if not rest:
            if not isinstance(value, dict) or set(value) != set(START["timeline"]):
                raise ParameterError("a timeline must have length, loop and keys.")
            return {name: self._checked_timeline((name,), each) for name, each in value.items()}
        if rest[0] == "length":
            return check_range("length", value, 0.2, LONGEST)
        if rest[0] == "loop":
            return bool(value)
        if rest[0] != "keys":
            raise unknown_name("part of the timeline", rest[0], START["timeline"])
        return self._items("keys", rest[1:], value, check, MOST_KEYS)

    def _items(self, what: str, rest: Sequence[str], value: Any, check: Callable[[str, Any], Any], most: int) -> Any:
        held = self.data["timeline"]["keys"] if what == "keys" else self.data[what]
        if len(rest) == 1 and value is not None and rest[0] not in held and len(held) >= most:
            raise ParameterError(f"there are {most} {what} already; take one away first.")
        return self._table(what, rest, value, check, most)


def _set(data: dict[str, Any], path: Sequence[str], value: Any) -> Any:
    """Set an entry of a document, or take it away, and return what it was."""
    table = data
    for name in path[:-1]:
        if name not in table:
            raise unknown_name("entry", name, table)
        table = table[name]
    before = table.get(path[-1])
    if value is None:
        table.pop(path[-1], None)
    else:
        table[path[-1]] = deepcopy(value)
    return before


def _entry(
    what: str, entry: Any, numbers: Mapping[str, tuple[float, float]], words: Sequence[str], usual: Mapping[str, Any]
) -> dict[str, Any]:
    """Check an entry that has words and numbers in ranges."""
    if not isinstance(entry, dict):
        raise ParameterError(f"{what} must be a table, received {type(entry).__name__}.")
    for name in entry:
        if name not in numbers and name not in words:
            raise unknown_name(f"entry of {what}", name, [*words, *numbers])
    full = {**usual, **entry}
    for name in (*words, *numbers):
        if name not in full:
            raise ParameterError(f"{what} needs {name!r}; it has {', '.join(full) or 'nothing'}.")
    return {
        name: check_range(name, value, *numbers[name]) if name in numbers else value for name, value in full.items()
    }
