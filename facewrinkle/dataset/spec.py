"""The specification of a data set: what is drawn from what, read from TOML and checked before anything is drawn."""

from __future__ import annotations

import ast
import hashlib
import json
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from glob import escape, iglob
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np

from ..anatomy.atlas import load_atlas
from ..anatomy.identity import EVEN, Identity
from ..errors import FaceWrinkleError, ParameterError, check_name
from ..files import bytes_of, toml_of
from ..schemas import Limits, Share, conforming, plain

DEFAULT = Path(__file__).parent / "data" / "default.toml"

TIME_STEP = 0.02
"""Seconds of a step in clips."""

NUMBERS: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "identity": {each.name: (-1.0, 1.0) for each in fields(Identity)},
    "gaze": {"yaw": (-40.0, 40.0), "pitch": (-40.0, 40.0)},
    "folds": {"seed": (0.0, 2.0**31), "depth": (0.0, 3.0), "density": (0.25, 4.0), "irregularity": (0.0, 3.0)},
    "tears": {"time": (0.0, 60.0)},
    "camera": {
        "yaw": (-180.0, 180.0), "pitch": (-80.0, 80.0), "roll": (-180.0, 180.0), "height": (0.5, 20.0),
        "aside": (-5.0, 5.0), "above": (-5.0, 5.0),
    },
    "lights": {
        "key": (0.0, 5.0), "fill": (0.0, 5.0), "rim": (0.0, 5.0), "turn": (-180.0, 180.0), "warmth": (-0.5, 0.5),
    },
    "background": {"bottom": (0.0, 1.0), "top": (0.0, 1.0), "warmth": (-0.5, 0.5)},
}  # fmt: skip
"""Numbers that are drawn, by table, and what is allowed of each."""

Finite = Annotated[float, Limits(-1e12, 1e12)]
Weight = Annotated[float, Limits(0.0, 1e9)]
Count = Annotated[int, Limits(1, 10**6)]
Pixels = Annotated[int, Limits(16, 4096)]


@dataclass
class Drawn:
    """A distribution as it is written."""

    uniform: tuple[Finite, Finite] | None = None
    normal: tuple[Finite, Finite] | None = None
    within: tuple[Finite, Finite] | None = None
    choice: Annotated[list[Any], Limits(1)] | None = None
    weights: list[Weight] | None = None


@dataclass(frozen=True)
class Distribution:
    """Something to draw values from: a choice, a range, or a normal distribution within limits.

    Attributes
    ----------
    values : tuple
        What is chosen from; for ranges, the least and the greatest.
    kind : {"choice", "uniform", "normal"}
    weights : tuple of float
        Probabilities of a choice; mean and standard deviation of a normal distribution.
    """

    values: tuple[Any, ...]
    kind: str
    weights: tuple[float, ...] = ()

    @classmethod
    def of(cls, written: Any, name: str, low: float = -1e12, high: float = 1e12) -> Distribution:
        """Return a distribution of numbers from what is written in a specification.

        Parameters
        ----------
        written : number, list or dict
            A number is fixed; from a list, each is as likely; ``{uniform = [low, high]}``;
            ``{normal = [mean, deviation], within = [low, high]}``; ``{choice = [...], weights = [...]}``.
        name : str
            For errors.
        low, high : float
            What is allowed.

        Raises
        ------
        UnknownNameError
            For an unknown distribution or key.
        ParameterError
            For a range that is upside down or not allowed, or a distribution that hardly ever meets its range.

        Examples
        --------
        >>> ages = Distribution.of({"uniform": [-1, 1]}, "age", -1, 1)
        >>> -1.0 <= ages.draw(np.random.default_rng(0)) <= 1.0
        True
        >>> Distribution.of([0.25, 0.75], "age").draw(np.random.default_rng(0))
        0.75
        """
        return _distribution(written, name, Annotated[float, Limits(low, high)], (low, high))

    @classmethod
    def of_words(cls, written: Any, name: str, allowed: Iterable[str]) -> Distribution:
        """Return a distribution of allowed words.

        Examples
        --------
        >>> Distribution.of_words("l", "side", ("l", "r")).draw(np.random.default_rng(0))
        'l'
        """
        found = _distribution(written, name, str, None)
        for word in found.values:
            check_name(name, word, allowed)
        return found

    def draw(self, random: np.random.Generator) -> Any:
        """Return a value."""
        if self.kind == "uniform":
            return float(random.uniform(*self.values))
        if self.kind == "normal":
            low, high = self.values
            mean, deviation = self.weights
            while not low <= (value := float(random.normal(mean, deviation))) <= high:
                pass
            return value
        return self.values[int(random.choice(len(self.values), p=self.weights))]


def _distribution(written: Any, name: str, kind: Any, limits: tuple[float, float] | None) -> Distribution:
    """Return a distribution of values of a kind; of words if there are no limits."""
    if not isinstance(written, Mapping | list):
        return Distribution((conforming(written, kind, name),), "choice", (1.0,))
    written = {"choice": written} if isinstance(written, list) else written
    table = conforming(written, Drawn, name)
    together = [{"uniform"}, {"normal"}, {"normal", "within"}] if limits else []
    together += [{"choice"}, {"choice", "weights"}]
    if set(written) not in together:
        allowed = ", ".join(" with ".join(sorted(keys)) for keys in together)
        raise ParameterError(f"{name} must have {allowed}, received {', '.join(written) or 'none of them'}.")
    if table.choice:
        values = conforming(table.choice, list[kind], name)
        weights = table.weights or [1.0] * len(values)
        total = sum(weights)
        if len(weights) != len(values) or not total > 0.0:
            raise ParameterError(
                f"weights of {name} must be one for each of {len(values)} values, and one above 0, received {weights}."
            )
        return Distribution(tuple(values), "choice", tuple(weight / total for weight in weights))
    assert limits is not None
    low, high = conforming(table.uniform or table.within or limits, tuple[kind, kind], name)
    if low > high:
        raise ParameterError(f"{name} must be two numbers in rising order, received [{low:g}, {high:g}].")
    if table.normal is None:
        return Distribution((low, high), "uniform")
    mean, deviation = table.normal
    if deviation <= 0.0 or not low <= mean <= high or high - low < 0.05 * deviation:
        raise ParameterError(
            f"the normal distribution of {name} needs a positive deviation, and its mean within a range that is not "
            f"much narrower than that, received {dict(written)!r}."
        )
    return Distribution((low, high), "normal", (mean, deviation))


@dataclass(frozen=True)
class Scan:
    """A face that the user brings."""

    path: str
    weight: Weight = 1.0
    licence: str = "not stated"


@dataclass(frozen=True)
class InputFile:
    """A file that the user brings, and the SHA-256 of its content."""

    path: str
    digest: str


@dataclass(frozen=True)
class Faces:
    """The table ``[faces]``: the weight of the built-in head among the scans."""

    built_in: Weight
    scans: list[Scan]


@dataclass(frozen=True)
class Clip:
    """The table ``[clip]``: pictures of a sample, and the seconds between them."""

    frames: Annotated[int, Limits(1, 10**4)]
    interval: Annotated[float, Limits(TIME_STEP, 10.0)]

    @property
    def stride(self) -> int:
        """Number of steps of :data:`TIME_STEP` between pictures."""
        return round(self.interval / TIME_STEP)


@dataclass(frozen=True)
class Expressions:
    """The table ``[expression]``; what is drawn becomes distributions."""

    neutral: Share
    named: Share
    names: Any
    intensity: Any
    count: Any
    units: Annotated[list[str], Limits(1)]
    contraction: Any
    one_sided: Share
    together: list[tuple[str, str, Share]]
    apart: list[tuple[str, str]]


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
    shard : int
        Number of samples in a file.
    per_person : int
        Number of samples of one person, who takes turns with the others of a shard.
    faces : Faces
    clip : Clip
    expression : Expressions
    crying : float
        Share of faces with tears.
    backgrounds, environments : tuple of InputFile
        Pictures, one of which is behind each face, and environment maps, one of which lights it; empty for none.
    numbers : dict
        Distributions by table and key.
    written : dict
        All values as written, those that were left out from the default.
    digest : str
        A hash of all values, of the scans and pictures, and of the code of the package: sets that differ in it differ.

    Examples
    --------
    >>> spec = Spec.of({"seed": 7, "identity": {"age": 0.5}})
    >>> spec.seed, spec.numbers["identity"]["age"].values, spec.per_person
    (7, (0.5,), 10)
    """

    seed: Annotated[int, Limits(0, 2**63 - 1)]
    size: tuple[Pixels, Pixels]
    quick: bool
    mesh: Literal["", "npz", "glb"]
    shard: Count
    per_person: Count
    faces: Faces
    clip: Clip
    expression: Expressions
    crying: Share
    backgrounds: tuple[InputFile, ...] = ()
    environments: tuple[InputFile, ...] = ()
    numbers: dict[str, dict[str, Distribution]] = field(default_factory=dict)
    written: dict[str, Any] = field(default_factory=dict)
    digest: str = ""

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a TOML file; paths of scans and pictures are relative to its folder.

        Raises
        ------
        ParameterError
            If the file is no TOML, or for values that are not allowed.
        UnknownNameError
            For keys that do not exist; the nearest one is named.
        """
        path = Path(path)
        try:
            written = toml_of(path)
        except OSError as problem:
            raise ParameterError(f"{str(path)!r} cannot be read: {problem.strerror}. Check the path.") from None
        except ValueError as problem:
            raise ParameterError(f"{path.name} is not valid TOML: {problem}.") from None
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
        given = {each.name: whole[each.name] for each in fields(cls) if each.name in whole}
        crying = conforming(whole["tears"]["share"], Share, "tears.share")
        spec = conforming(given | {"crying": crying}, cls, "")
        if abs(spec.clip.interval / TIME_STEP - spec.clip.stride) > 1e-6:
            raise ParameterError(
                f"clip.interval must be a whole number of steps of {TIME_STEP} s, received {spec.clip.interval}."
            )
        faces = replace(spec.faces, scans=_scans(spec.faces, Path(folder)))
        whole["faces"] = plain(faces)
        backgrounds = _files(whole["background"], "pictures", Path(folder))
        environments = _files(whole["lights"], "environment", Path(folder))
        contents = {
            "faces": [faces.built_in, [(input_content(scan.path)[0].digest, scan.weight) for scan in faces.scans]],
            "background": whole["background"] | {"pictures": [(Path(f.path).name, f.digest) for f in backgrounds]},
            "lights": whole["lights"] | {"environment": [(Path(f.path).name, f.digest) for f in environments]},
        }
        text = json.dumps([code_digest(), whole | contents], sort_keys=True)
        numbers = {
            table: {key: Distribution.of(whole[table][key], f"{table}.{key}", *limits) for key, limits in keys.items()}
            for table, keys in NUMBERS.items()
        }
        return replace(
            spec, faces=faces, expression=_expressions(spec.expression), numbers=numbers, backgrounds=backgrounds,
            environments=environments, written=whole, digest=hashlib.sha256(text.encode()).hexdigest()[:16],
        )  # fmt: skip

    def random(self, number: int, what: str, attempt: int = 0) -> np.random.Generator:
        """Return the random numbers of one aspect of a sample or a person: no aspect disturbs another."""
        key = int.from_bytes(hashlib.sha256(what.encode()).digest()[:4])
        return np.random.default_rng([self.seed, number, key, attempt])

    def drawn(self, table: str, random: np.random.Generator) -> dict[str, float]:
        """Return a value of every number of a table."""
        return {key: distribution.draw(random) for key, distribution in self.numbers[table].items()}


@cache
def code_digest() -> str:
    """Return a hash of the code and the data of the package that make the samples: no comments, no docstrings."""
    return digest_of(Path(__file__).parents[1])


def digest_of(package: Path) -> str:
    """Return that hash of the package in a folder."""
    found = hashlib.sha256()
    for path in sorted(package.rglob("*.*")):
        inner = path.relative_to(package)
        needless = inner.parts[0] in ("rigging", "session", "live", "commands")
        if path.suffix in (".py", ".toml", ".json", ".npz") and len(inner.parts) > 1 and not needless:
            content = meaning_of(path.read_bytes()) if path.suffix == ".py" else path.read_bytes()
            found.update(inner.as_posix().encode() + content)
    return found.hexdigest()[:16]


def meaning_of(code: bytes) -> bytes:
    """Return what a module does, without its comments, layout and docstrings.

    Examples
    --------
    >>> meaning_of(b'x = 1  # one') == meaning_of(b'"Return it."; x = 1')
    True
    """
    tree = ast.parse(code)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            kept = [line for line in body if not (isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant))]
            node.body = kept  # type: ignore[attr-defined]
    return ast.dump(tree).encode()


def _completed(written: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is written, and from the default what is not; it has all keys but those of usual people."""
    whole = tomllib.loads(DEFAULT.read_text(encoding="utf-8"))
    # What the default does not write of people is as in Identity.random: of all values alike, or mostly near the mean.
    even, usual = {"uniform": [-0.9, 0.9]}, {"normal": [0.0, 0.45], "within": [-0.9, 0.9]}
    whole["identity"] = {name: even if name in EVEN else usual for name in NUMBERS["identity"]} | whole["identity"]
    for key, value in written.items():
        check_name("key of a specification", key, whole)
        if not isinstance(whole[key], dict):
            whole[key] = value
            continue
        if not isinstance(value, Mapping):
            raise ParameterError(f"{key} must be a table, [{key}], received {value!r}.")
        for inner in value:
            check_name(f"key of [{key}]", inner, whole[key])
        whole[key] = {**whole[key], **value}
    return whole


def _scans(faces: Faces, folder: Path) -> list[Scan]:
    """Return the scans, of which each must be there."""
    scans: list[Scan] = []
    for scan in faces.scans:
        path = (folder / scan.path).absolute()
        if not path.is_file():
            raise ParameterError(f"the scan {str(path)!r} does not exist. Paths are relative to the specification.")
        scans.append(replace(scan, path=str(path)))
    if not faces.built_in + sum(scan.weight for scan in scans) > 0.0:
        raise ParameterError("no face is left to draw from: give built_in or a scan a weight above 0.")
    return scans


def _files(table: dict[str, Any], key: str, folder: Path) -> tuple[InputFile, ...]:
    """Return the files that a pattern in a table names, of which one must be there; the pattern becomes absolute."""
    pattern = conforming(table[key], str, key)
    if not pattern:
        return ()
    table[key] = str(Path(escape(str(folder.absolute()))) / Path(pattern).expanduser())
    if pattern.count("**") > 1:
        raise ParameterError(f"{key}: ** may stand once in a pattern, received {pattern[:80]!r}.")
    most = 100_000
    seen = list(islice(iglob(table[key], recursive=True), most + 1))
    if len(seen) > most:
        raise ParameterError(f"{key}: more than {most:,} files and folders are like {pattern!r}. Name fewer.")
    found = sorted(path for path in map(Path, seen) if path.is_file())
    if not found:
        raise ParameterError(
            f"{key}: no file is like {table[key]!r}. A pattern such as 'folder/*.jpg' is relative to the specification."
        )
    return tuple(input_content(str(path))[0] for path in found)


def input_content(path: str) -> tuple[InputFile, bytes]:
    """Return a file as it is now, and its content."""
    try:
        content = bytes_of(path)
    except OSError as problem:
        raise ParameterError(f"{path!r} cannot be read: {problem.strerror}.") from None
    return InputFile(path, hashlib.sha256(content).hexdigest()), content


def _expressions(table: Expressions) -> Expressions:
    atlas = load_atlas()
    for unit in (*table.units, *(unit for pair in (*table.together, *table.apart) for unit in pair[:2])):
        check_name("action unit", str(unit), atlas.action_units)
    if table.neutral + table.named > 1.0:
        raise ParameterError(
            f"neutral and named are shares of all faces: at most 1 together, received {table.neutral + table.named:g}."
        )
    return replace(
        table,
        names=Distribution.of_words(table.names, "expression.names", atlas.expressions),
        intensity=Distribution.of(table.intensity, "expression.intensity", 0.0, 1.0),
        count=Distribution.of(table.count, "expression.count", 1.0, 20.0),
        contraction=Distribution.of(table.contraction, "expression.contraction", 0.0, 1.0),
    )
