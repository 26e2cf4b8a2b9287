"""The content of a session: its parts, checked when it is made, and its files."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import InitVar, dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

from ..anatomy import NAMES, Identity
from ..anatomy.atlas import Atlas, load_atlas, read_atlas
from ..errors import ParameterError, check_name
from ..files import LARGEST_SETTINGS, bytes_of, write_whole
from ..layers.patterns_on_skin.kinds import KINDS
from ..layers.wave_folds.layer import REGIONS
from ..plotting.views import VIEWS
from ..schemas import Limits, Share, conforming, kinds_of, plain, table_of
from .parts import (
    Angle,
    Anywhere,
    Factor,
    Folds,
    Look,
    Mixture,
    Name,
    OwnName,
    Pattern,
    Place,
    Point,
    Tear,
    Time,
    Timeline,
)

MARK, VERSION = "facewrinkle session", 2
"""The name under which files say that they are sessions, and the newest form of these. The first had no places on
triangles, nor takes, time and look.
"""

T = TypeVar("T", bound="Content")


@dataclass(frozen=True)
class Content:
    """The content of a :class:`Session`, which tells what each part is."""

    face: str = ""
    landmarks: dict[Name, Anywhere] = field(default_factory=dict)
    mixture: Mixture = field(default_factory=dict)
    mixtures: Annotated[dict[OwnName, Annotated[Mixture, Limits(1)]], Limits(most=64)] = field(default_factory=dict)
    intensity: Share = 1.0
    gaze: tuple[Angle, Angle] = (0.0, 0.0)
    folds: Folds = field(default_factory=Folds)
    regions: dict[Name, Factor] = field(default_factory=dict)
    identity: dict[Name, Annotated[float, Limits(-1.0, 1.0)]] = field(default_factory=dict)
    patterns: Annotated[dict[Name, Pattern], Limits(most=32)] = field(default_factory=dict)
    tears: Annotated[dict[Name, Tear], Limits(most=32)] = field(default_factory=dict)
    probes: Annotated[dict[Name, Anywhere], Limits(most=32)] = field(default_factory=dict)
    timeline: Timeline = field(default_factory=Timeline)
    atlas: str = ""
    take: str = ""
    time: Time = 0.0
    look: Look = field(default_factory=Look)
    known: InitVar[Atlas | None] = None

    def __post_init__(self, known: Atlas | None) -> None:
        for name, kind in kinds_of(Content).items():
            object.__setattr__(self, name, conforming(getattr(self, name), kind, name))
        _check_names("landmark", self.landmarks, NAMES)
        _check_names("region of folds", self.regions, REGIONS)
        _check_names("parameter of an identity", self.identity, [each.name for each in fields(Identity)])
        _check_names("pattern", (pattern.kind for pattern in self.patterns.values()), KINDS)
        _check_names("view", [self.look.view] if isinstance(self.look.view, str) else [], VIEWS)
        atlas = known or (read_atlas(self.atlas) if self.atlas else load_atlas())
        keys = (key.unit for key in self.timeline.keys.values())
        own = (name for mixture in self.mixtures.values() for name in mixture)
        for name in (*self.mixture, *own, *keys):
            atlas.resolve(name, "expression, action unit or muscle")

    @classmethod
    def of(cls, table: Mapping[str, Any], known: Atlas | None = None) -> Self:
        """Return the session of a table, as of JSON; what it leaves out is as usual."""
        names = kinds_of(Content)
        for name in table:
            check_name("part of the session", name, names)
        return cls(**table, known=known)

    def changed(self, known: Atlas | None = None, **parts: Any) -> Self:
        """Return the session with other parts; if one is not allowed, there is an error and no session.

        Examples
        --------
        >>> Content(intensity=0.5).changed(gaze=[10, 0]).gaze
        (10.0, 0.0)
        """
        return self.of({**vars(self), **parts}, known)

    # --- files ---------------------------------------------------------------------------------

    def table(self) -> dict[str, Any]:
        """Return all parts as plain data."""
        found: dict[str, Any] = plain(self)
        return found

    def to_json(self) -> str:
        """Return the session as JSON."""
        return json.dumps({MARK: VERSION, **self.table()}, indent=1)

    @classmethod
    def from_json(cls, text: str | bytes, known: Atlas | None = None, folder: str | Path = "") -> Self:
        """Return the session of a JSON text; files that it names are relative to a folder.

        Raises
        ------
        ParameterError, UnknownNameError
            If it is not a session, or one of a newer version.
        """
        content = _marked(text)
        if content is None:
            raise ParameterError(f"this is not a session of the studio: it must be JSON with a {MARK!r}.")
        number = content.pop(MARK)
        if number not in (1, VERSION):
            raise ParameterError(
                f"the session has the version {number!r}, and this program reads {VERSION}: update it."
            )
        files = {part: content.get(part) for part in ("face", "atlas", "take")}
        named = {part: str(Path(folder, file)) for part, file in files.items() if isinstance(file, str) and file}
        return cls.of(content | named, known)

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a session from a file; files that it names are looked for beside it."""
        try:
            return cls.from_json(bytes_of(path, LARGEST_SETTINGS), folder=Path(path).parent)
        except OSError as problem:
            raise ParameterError(f"{str(path)!r} cannot be read: {problem.strerror}. Check the path.") from None

    def write(self, path: str | Path) -> Path:
        """Write the session to a .json file."""
        return write_whole(path, self.to_json())


def is_session(text: str | bytes) -> bool:
    """Return True if a text is a session, of any version.

    Examples
    --------
    >>> is_session('{"facewrinkle session": 1}'), is_session('[{"jawOpen": 0.5}]')
    (True, False)
    """
    return _marked(text) is not None


def _marked(text: str | bytes) -> dict[str, Any] | None:
    """Return the table of a JSON text that is marked as a session; None for any other text."""
    try:
        table = table_of(text)
    except ValueError:
        return None
    return table if MARK in table else None


def placed(session: T, attach: Callable[[Point], Place], known: Atlas | None = None) -> T:
    """Return the session with its coordinates as places on the skin."""

    def of(place: Anywhere) -> Place:
        return place if isinstance(place, Place) else attach(place)

    parts: dict[str, Any] = {
        "landmarks": {name: of(place) for name, place in session.landmarks.items()},
        "probes": {name: of(place) for name, place in session.probes.items()},
        "patterns": {name: replace(each, center=of(each.center)) for name, each in session.patterns.items()},
        "tears": {name: replace(each, start=of(each.start)) for name, each in session.tears.items()},
    }
    same = all(getattr(session, part) == value for part, value in parts.items())
    return session if same else session.changed(known, **parts)


def _check_names(what: str, names: Iterable[str], known: Collection[str]) -> None:
    for name in names:
        check_name(what, name, known)
