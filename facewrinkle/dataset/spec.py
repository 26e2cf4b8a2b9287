"""The specification of a data set: what is drawn from what, read from TOML and checked before anything is drawn."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any, Self, cast

import numpy as np

from .. import __version__
from ..anatomy.atlas import load_atlas
from ..anatomy.identity import Identity
from ..errors import FaceWrinkleError, ParameterError, check_range, check_whole, unknown_name
from ..files import LARGEST_SETTINGS, bytes_of
from .distributions import Distribution

DEFAULT = Path(__file__).parent / "data" / "default.toml"

TIME_STEP = 0.02
"""Seconds of a step in clips."""

GAZE = {"yaw": (-40.0, 40.0), "pitch": (-40.0, 40.0)}
FOLDS = {"seed": (0.0, 2.0**31), "depth": (0.0, 3.0), "density": (0.25, 4.0), "irregularity": (0.0, 3.0)}
TEARS = {"time": (0.0, 60.0)}
CAMERA = {
    "yaw": (-180.0, 180.0), "pitch": (-80.0, 80.0), "roll": (-180.0, 180.0), "height": (0.5, 20.0),
    "aside": (-5.0, 5.0), "above": (-5.0, 5.0),
}  # fmt: skip
LIGHTS = {"key": (0.0, 5.0), "fill": (0.0, 5.0), "rim": (0.0, 5.0), "turn": (-180.0, 180.0), "warmth": (-0.5, 0.5)}
BACKGROUND = {"bottom": (0.0, 1.0), "top": (0.0, 1.0), "warmth": (-0.5, 0.5)}
"""Numbers that are drawn, and what is allowed of each."""

NUMBERS = {
    "identity": {field.name: (-1.0, 1.0) for field in fields(Identity)},
    "gaze": GAZE, "folds": FOLDS, "tears": TEARS, "camera": CAMERA, "lights": LIGHTS, "background": BACKGROUND,
}  # fmt: skip

OTHERS = {
    "faces": {"built_in", "scans"},
    "tears": {"share"},
    "clip": {"frames", "interval"},
    "expression": {
        "neutral", "named", "names", "intensity", "count", "units", "contraction", "one_sided", "together", "apart",
    },
}  # fmt: skip
"""Further keys of the tables."""

GENERAL = ("seed", "size", "quick", "mesh", "shard", "per_person")
"""Keys before the first table."""

MESHES = ("npz", "glb")
"""Formats of meshes."""

SCAN_KEYS = ("path", "weight", "licence")


@dataclass(frozen=True)
class Scan:
    """A face that the user brings."""

    path: Path
    weight: float
    licence: str
    digest: str


@dataclass(frozen=True)
class Expressions:
    """Distributions of expressions; the fields are the keys of the table ``[expression]``."""

    neutral: float
    named: float
    names: Distribution
    intensity: Distribution
    count: Distribution
    units: tuple[str, ...]
    contraction: Distribution
    one_sided: float
    together: tuple[tuple[str, str, float], ...]
    apart: frozenset[frozenset[str]]


@dataclass(frozen=True, eq=False)
class Spec:
    """A specification of a data set.

    Attributes
    ----------
    seed : int
    size : tuple of int
        Width and height of the pictures, pixels.
    quick : bool
        Draw with one lamp and without the shader of the skin.
    mesh : {"", "npz", "glb"}
        Keep the mesh of each picture, in this format.
    frames, stride : int
        Number of pictures of a sample, and of steps of :data:`TIME_STEP` between them.
    shard : int
        Number of samples in a file.
    per_person : int
        Number of consecutive samples of one person.
    built_in : float
        Weight of the built-in head among the scans.
    scans : tuple of Scan
    numbers : dict
        Distributions by table and key.
    expressions : Expressions
    crying : float
        Share of faces with tears.
    written : dict
        All values as written, those that were left out from the default.

    Examples
    --------
    >>> spec = Spec.of({"seed": 7, "identity": {"age": 0.5}})
    >>> spec.seed, spec.numbers["identity"]["age"].values, spec.per_person
    (7, (0.5,), 10)
    """

    seed: int
    size: tuple[int, int]
    quick: bool
    mesh: str
    frames: int
    stride: int
    shard: int
    per_person: int
    built_in: float
    scans: tuple[Scan, ...]
    numbers: dict[str, dict[str, Distribution]]
    expressions: Expressions
    crying: float
    written: dict[str, Any]

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a TOML file; paths of scans are relative to its folder.

        Raises
        ------
        ParameterError
            If the file is no TOML, or for values that are not allowed.
        UnknownNameError
            For keys that do not exist; the nearest one is named.
        """
        path = Path(path)
        try:
            written = tomllib.loads(bytes_of(path, LARGEST_SETTINGS).decode())
        except OSError as problem:
            raise ParameterError(f"{str(path)!r} cannot be read: {problem.strerror}. Check the path.") from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as problem:
            raise ParameterError(f"{path.name} is no TOML: {problem}.") from None
        try:
            return cls.of(written, path.parent)
        except FaceWrinkleError as problem:
            raise type(problem)(f"{path.name}: {problem}") from None

    @classmethod
    def of(cls, written: Mapping[str, Any] | None = None, folder: str | Path = ".") -> Self:
        """Return the specification of a dictionary like a TOML file; what it leaves out is as in the default."""
        if written is not None and not isinstance(written, Mapping):
            raise ParameterError(f"a specification is a path or a dictionary, received {written!r}.")
        whole = _completed(written or {})
        faces = whole["faces"]
        scans = _scans(faces["scans"], faces["built_in"], Path(folder))
        found = [{"path": str(scan.path), "weight": scan.weight, "licence": scan.licence} for scan in scans]
        return cls(
            seed=check_whole("seed", whole["seed"], 0, 2**63),
            size=_size(whole["size"]),
            quick=_truth("quick", whole["quick"]),
            mesh=_mesh(whole["mesh"]),
            frames=check_whole("clip.frames", whole["clip"]["frames"], 1, 1e4),
            stride=_stride(whole["clip"]["interval"]),
            shard=check_whole("shard", whole["shard"], 1, 1e6),
            per_person=check_whole("per_person", whole["per_person"], 1, 1e6),
            built_in=check_range("built_in", faces["built_in"], 0.0, 1e9),
            scans=scans,
            numbers={
                table: {
                    key: Distribution.of(whole[table][key], f"{table}.{key}", *limits) for key, limits in keys.items()
                }
                for table, keys in NUMBERS.items()
            },
            expressions=_expressions(whole["expression"]),
            crying=check_range("tears.share", whole["tears"]["share"], 0.0, 1.0),
            written=whole | {"faces": {**faces, "scans": found}},
        )

    @property
    def digest(self) -> str:
        """A hash of all values, of the scans, and of the version of the package: sets that differ in it differ."""
        values = {key: value for key, value in self.written.items() if key != "faces"}
        scans = [(scan.digest, scan.weight) for scan in self.scans]
        text = json.dumps([__version__, values, self.built_in, scans], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def random(self, number: int, what: str, attempt: int = 0) -> np.random.Generator:
        """Return the random numbers of one aspect of a sample or a person: no aspect disturbs another."""
        key = int.from_bytes(hashlib.sha256(what.encode()).digest()[:4])
        return np.random.default_rng([self.seed, number, key, attempt])

    def drawn(self, table: str, random: np.random.Generator) -> dict[str, float]:
        """Return a value of every number of a table."""
        return {key: distribution.draw(random) for key, distribution in self.numbers[table].items()}


@cache
def _default() -> dict[str, Any]:
    return tomllib.loads(DEFAULT.read_text(encoding="utf-8"))


def _completed(written: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is written, and from the default what is not."""
    whole: dict[str, Any] = {}
    for key, value in written.items():
        if key not in _default():
            raise unknown_name("key of a specification", key, _default())
        known = {*NUMBERS.get(key, ()), *OTHERS.get(key, ())}
        if key in GENERAL:
            continue
        if not isinstance(value, Mapping):
            raise ParameterError(f"{key} must be a table, [{key}], received {value!r}.")
        for inner in value:
            if inner not in known:
                raise unknown_name(f"key of [{key}]", inner, known)
    for key, value in _default().items():
        given = written.get(key, value)
        whole[key] = {**value, **given} if isinstance(value, dict) else given
    return whole


def _truth(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise ParameterError(f"{name} must be true or false, received {value!r}.")
    return value


def _mesh(value: Any) -> str:
    if isinstance(value, bool):
        return "npz" if value else ""
    if value not in MESHES:
        raise ParameterError(f"mesh must be true, false, or one of {', '.join(MESHES)}, received {value!r}.")
    return str(value)


def _stride(interval: Any) -> int:
    steps = check_range("clip.interval", interval, TIME_STEP, 10.0, "Seconds.") / TIME_STEP
    if abs(steps - round(steps)) > 1e-6:
        raise ParameterError(f"clip.interval must be a whole number of steps of {TIME_STEP} s, received {interval!r}.")
    return round(steps)


def _size(value: Any) -> tuple[int, int]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ParameterError(f"size must be width and height in pixels, received {value!r}.")
    width, height = (check_whole("each of width and height", pixels, 16, 4096) for pixels in value)
    return width, height


def _scans(written: Any, built_in: float, folder: Path) -> tuple[Scan, ...]:
    if not isinstance(written, list) or any(not isinstance(entry, str | Mapping) for entry in written):
        raise ParameterError(f"scans must be a list of paths or of tables with a path, received {written!r}.")
    scans = []
    for entry in written:
        table = {"path": entry} if isinstance(entry, str) else dict(entry)
        for key in table:
            if key not in SCAN_KEYS:
                raise unknown_name("key of a scan", key, SCAN_KEYS)
        path = (folder / str(table.get("path", ""))).absolute()
        if not path.is_file():
            raise ParameterError(f"the scan {str(path)!r} does not exist. Paths are relative to the specification.")
        weight = check_range("weight", cast(float, table.get("weight", 1.0)), 0.0, 1e9)
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        scans.append(Scan(path, weight, str(table.get("licence", "not stated")), digest))
    if not built_in + sum(scan.weight for scan in scans) > 0.0:
        raise ParameterError("no face is left to draw from: give built_in or a scan a weight above 0.")
    return tuple(scans)


def _expressions(table: Mapping[str, Any]) -> Expressions:
    atlas = load_atlas()
    units = tuple(table["units"]) if isinstance(table["units"], list) else ()
    pairs = [*table["together"], *table["apart"]]
    if any(not isinstance(pair, list) or len(pair) not in (2, 3) for pair in pairs):
        raise ParameterError("together has entries [unit, unit, share], apart [unit, unit].")
    for unit in (*units, *(unit for pair in pairs for unit in pair[:2])):
        if unit not in atlas.action_units:
            raise unknown_name("action unit", unit, atlas.action_units)
    if not units:
        raise ParameterError(f"units must be a list of action units, received {table['units']!r}.")
    neutral, named = (check_range(f"expression.{key}", table[key], 0.0, 1.0) for key in ("neutral", "named"))
    if neutral + named > 1.0:
        raise ParameterError(
            f"neutral and named are shares of all faces: at most 1 together, received {neutral + named:g}."
        )
    return Expressions(
        neutral,
        named,
        Distribution.of_words(table["names"], "expression.names", tuple(atlas.expressions)),
        Distribution.of(table["intensity"], "expression.intensity", 0.0, 1.0),
        Distribution.of(table["count"], "expression.count", 1.0, 20.0),
        units,
        Distribution.of(table["contraction"], "expression.contraction", 0.0, 1.0),
        check_range("expression.one_sided", table["one_sided"], 0.0, 1.0),
        tuple((a, b, check_range(f"share of {a} with {b}", share, 0.0, 1.0)) for a, b, share in table["together"]),
        frozenset(frozenset(pair) for pair in table["apart"]),
    )
