"""The atlas: muscles, action units, expressions and tissue as data, their placing on a face, and files of them."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..errors import (
    FaceWrinkleError,
    ParameterError,
    UnknownNameError,
    check_flag,
    check_name,
    check_range,
    unknown_name,
)
from ..files import path_of, toml_of, write_whole
from .landmarks import FaceFrame, of_side
from .muscles import (
    WRINKLES,
    Crease,
    EyeMuscle,
    JawMuscle,
    LidMuscle,
    LinearMuscle,
    Muscle,
    SheetMuscle,
    SphincterMuscle,
    TongueMuscle,
    TriangularMuscle,
    Wrinkles,
    unknown_property,
)

DEFAULT_ATLAS = Path(__file__).parent / "data" / "atlas.toml"

KEYS = {
    "linear": {"attachment", "insertion", "radius", "max_angle", "sliding"},
    "sheet": {"attachment", "insertion", "length", "width", "recoil"},
    "triangular": {"attachment", "insertion", "length", "recoil"},
    "sphincter": {"centre", "semi_major", "semi_minor", "inner", "beta", "dead_zone", "protrusion"},
    "crease": {"path", "crest", "width", "span", "variety"},
    "jaw": {"hinge", "angle"},
    "lid": {"share"},
    "eye": {"turn", "angle"},
    "tongue": set(),
}
"""Keys of a muscle's entry, by its kind, besides those that all muscles have."""

MOST = 1e3
"""The largest number in an atlas."""


@dataclass(frozen=True, eq=False)
class Atlas:
    """Anatomy that all faces share: muscles, action units, expressions and tissue.

    Attributes
    ----------
    muscles : dict of str to dict
        Entries as written, by full name ("corrugator_l").
    action_units : dict of str to dict
        Contraction rates by full muscle name; "AU12" and, where both sides take part, "AU12L" and "AU12R".
    action_unit_names : dict of str to str
    expressions : dict of str to dict
        Contraction rates by full muscle name.
    tissue : list of dict
        Samples of soft tissue: `at` (weights of landmarks, offset), `depth` (mm), `stiffness`, and where they are not
        1.0 and 0.45, `across` and `bulge`; see :class:`facewrinkle.anatomy.skull.Tissue`.
    mixtures : dict of str to dict
        Expressions as written: weights of action units, muscles, and expressions before them.

    Examples
    --------
    >>> atlas = load_atlas()
    >>> atlas.action_unit_names["AU12"], atlas.action_units["AU12L"]
    ('Lip corner puller', {'zygomaticus_major_l': 1.0})
    >>> atlas.contractions({"AU12L": 0.5, "frowning": 0.2})
    {'zygomaticus_major_l': 0.5, 'corrugator_l': 0.2, 'corrugator_r': 0.2}
    """

    muscles: dict[str, dict[str, Any]]
    action_units: dict[str, dict[str, float]]
    action_unit_names: dict[str, str]
    expressions: dict[str, dict[str, float]]
    tissue: list[dict[str, Any]]
    mixtures: dict[str, dict[str, float]] = field(default_factory=dict)

    def contractions(self, what: Mixture, intensity: float = 1.0) -> dict[str, float]:
        """Contraction rates by muscle of an expression, an action unit, or a mixture of them with weights.

        A mixture is a text such as "AU1=0.7+AU4", a list of names, or a dictionary of names and weights. Where several
        of them use the same muscle, the largest rate counts. Upper and lower case are the same.

        Raises
        ------
        UnknownNameError
            For a name that is no expression, action unit or muscle; the nearest names are suggested.
        ParameterError
            For a weight or intensity outside [0, 1], or a text that is no mixture.

        Examples
        --------
        >>> load_atlas().contractions("AU46", 0.5)
        {'orbicularis_oculi_l': 0.5}
        >>> load_atlas().contractions("AU12L=0.5+AU46") == load_atlas().contractions({"AU12L": 0.5, "AU46": 1.0})
        True
        """
        check_range("intensity", intensity, 0.0, 1.0, "An expression at 1 is at its strongest.")
        total: dict[str, float] = {}
        for name, weight in self._weights_of(what).items():
            check_range(f"the weight of {name}", weight, 0.0, 1.0)
            for muscle, rate in self.resolve(name, "expression, action unit or muscle").items():
                total[muscle] = max(total.get(muscle, 0.0), intensity * weight * rate)
        return total

    def with_expressions(self, added: Mapping[str, Mixture]) -> Self:
        """Return the atlas with further expressions, each a mixture of units, muscles and expressions.

        Raises
        ------
        ParameterError
            For a name that a unit or a muscle has: it would mean two things.

        Examples
        --------
        >>> atlas = load_atlas().with_expressions({"smirk": "AU2L+AU14R=0.5", "sulk": {"smirk": 1.0, "AU17": 0.5}})
        >>> list(atlas.expressions["smirk"])
        ['frontalis_outer_l', 'frontalis_major_l', 'buccinator_r']
        """
        atlas = replace(self, expressions=dict(self.expressions), mixtures=dict(self.mixtures))
        for name, mixture in added.items():
            if name in self.unit_and_muscle_names:
                raise ParameterError(f"{name!r} is an action unit or a muscle. Give the expression another name.")
            weights = atlas._weights_of(mixture)
            atlas.expressions[name], atlas.mixtures[name] = atlas.contractions(weights), weights
        return atlas

    @property
    def unit_and_muscle_names(self) -> set[str]:
        """Names that mean an action unit, a muscle or a pair of muscles, and can mean nothing else.

        Examples
        --------
        >>> {"AU12L", "corrugator", "corrugator_l"} <= load_atlas().unit_and_muscle_names
        True
        """
        pairs = {name.removesuffix("_l").removesuffix("_r") for name in self.muscles}
        return {*self.action_units, *self.muscles, *pairs}

    def _weights_of(self, what: Mixture) -> dict[str, float]:
        """The weights by name of a mixture in any of its forms."""
        if isinstance(what, str):
            return {what: 1.0} if what in self.expressions else parse_weights(what)
        if isinstance(what, list | tuple) and all(isinstance(name, str) for name in what):
            return dict.fromkeys(what, 1.0)
        if not isinstance(what, Mapping):
            raise ParameterError(
                "an expression is a name, a text such as 'AU1=0.7+AU4', a list of names, or a dictionary of names and "
                f"weights, received {what!r}."
            )
        return dict(what)

    def units_of(self, what: Mapping[str, float]) -> dict[str, float]:
        """Weights of the action units in a mixture of expressions and action units, as the Facial Action Coding System
        writes a face down.

        An expression has the units, and those of the expressions, that it is written in. If it is written in muscles
        alone, it has the units of which all muscles take part, as far as they do.

        Examples
        --------
        >>> load_atlas().units_of({"contempt": 0.5, "AU1": 0.25})
        {'AU12R': 0.25, 'AU14R': 0.5, 'AU1': 0.25}
        >>> load_atlas().units_of({"paper_surprise": 1.0})
        {'AU1': 1.0, 'AU2': 0.7}
        """
        total: dict[str, float] = {}
        for name, weight in what.items():
            if weight > 0.0:
                for unit, share in self._units_of(name).items():
                    total[unit] = max(total.get(unit, 0.0), weight * share)
        return total

    def _units_of(self, name: str) -> dict[str, float]:
        """Weights of the action units in a unit or in an expression; none of a muscle."""
        if name in self.action_units:
            return {name: 1.0}
        if name not in self.expressions:
            return {}
        rates, written = self.expressions[name], self.written(name)
        units = self.units_of(written) if written != rates else {}
        if not units:  # those of which all muscles contract, as far as they do
            for unit in self.action_unit_names:
                needed = {muscle: rate for muscle, rate in self.action_units[unit].items() if rate > 0.0}
                share = min((rates.get(muscle, 0.0) / rate for muscle, rate in needed.items()), default=0.0)
                if share > 0.0:
                    units[unit] = min(share, 1.0)
        return units

    def written(self, name: str) -> dict[str, float]:
        """Weights of units, muscles, and other expressions in which an expression is written.

        Its muscles alone, if it is not what was written any more: an atlas may have got other expressions since.

        Examples
        --------
        >>> load_atlas().written("sneer"), load_atlas().written("frowning")
        ({'AU9L': 1.0, 'AU10L': 0.8}, {'corrugator': 1.0})
        """
        mixture, rates = self.mixtures.get(name, {}), self.expressions[name]
        with suppress(FaceWrinkleError):  # of what is no longer there
            if name not in mixture and self.contractions(mixture) == rates:
                return dict(mixture)
        return dict(rates)

    def resolve(self, name: str, kind: str = "muscle") -> dict[str, float]:
        """Contraction rates of one muscle, muscle pair, action unit or expression at full strength.

        An error calls an unknown name an "unknown `kind`". A name in another case is found, too.

        Examples
        --------
        >>> load_atlas().resolve("Frowning"), load_atlas().resolve("au12l")
        ({'corrugator_l': 1.0, 'corrugator_r': 1.0}, {'zygomaticus_major_l': 1.0})
        """
        for table in (self.action_units, self.expressions):
            if name in table:
                return dict(table[name])
        muscles = [n for n in (name, f"{name}_l", f"{name}_r") if n in self.muscles]
        if muscles:
            return dict.fromkeys(muscles, 1.0)
        every = [*self.expressions, *self.action_units, *self.muscles]
        alike = [each for each in every if each != name and each.casefold() == str(name).casefold()]
        if len(alike) != 1:
            raise unknown_name(kind, name, every)
        return self.resolve(alike[0])

    def place(self, landmarks: Mapping[str, Array], frame: FaceFrame) -> dict[str, Muscle]:
        """Return all muscles placed on a face, in the unit of its landmarks."""
        placed = {}
        for name, entry in self.muscles.items():
            try:
                placed[name] = _placed(entry, landmarks, frame)
            except (KeyError, TypeError, ValueError) as error:
                raise FaceWrinkleError(f"in the atlas: muscle {name!r}: {_reason(error)}") from None
        return placed

    def tissue_samples(self, landmarks: Mapping[str, Array], frame: FaceFrame) -> tuple[Array, Array]:
        """Positions (k, 3) of the tissue samples on both sides, and what holds there (k, 4): depth, mm, stiffness along
        and across the skin, relative to the forehead's, and bulge.
        """
        usually = {"depth": 0.0, "stiffness": 0.0, "across": 1.0, "bulge": 0.45}  # 0 where it must be given
        try:
            rows = [
                (
                    _point(t["at"], s, landmarks, frame),
                    [
                        check_range(f"{name} of tissue", t.get(name, usual) if usual else t[name], 0.0, MOST)
                        for name, usual in usually.items()
                    ],
                )
                for t in self.tissue
                for s in "lr"
            ]
        except (KeyError, TypeError, AttributeError) as error:
            raise FaceWrinkleError(f"in the atlas: tissue: {_reason(error)}") from None
        if not rows:
            raise FaceWrinkleError("in the atlas: there are no samples of tissue; one [[tissue]] at least is needed.")
        return tuple(np.array(column) for column in zip(*rows, strict=True))  # type: ignore[return-value]


@lru_cache(maxsize=1)
def printed_atlas() -> Atlas:
    """The 23 muscles of Zhang, Sim and Tan with the wrinkles that their paper prints, and its five expressions.

    The tissue is that of :func:`load_atlas`.

    Examples
    --------
    >>> atlas = printed_atlas()
    >>> len(atlas.muscles), list(atlas.expressions)[:5]
    (23, ['surprise', 'frowning', 'closing_eye', 'stretching_mouth', 'fear'])
    """
    return replace(read_atlas(DEFAULT_ATLAS.with_name("printed.toml")), tissue=load_atlas().tissue)


@lru_cache(maxsize=1)
def load_atlas() -> Atlas:
    """The atlas that comes with the package.

    Examples
    --------
    >>> load_atlas().action_unit_names["AU4"]
    'Brow lowerer'
    """
    return read_atlas(DEFAULT_ATLAS)


def read_atlas(path: str | Path) -> Atlas:
    """Read an atlas from a TOML file in the form of the package's own, which ``facewrinkle atlas`` prints.

    A file that begins with ``base = "facewrinkle"`` holds changes of the package's own atlas: other keys of its
    muscles, and other or further muscles, action units and expressions.

    Raises
    ------
    FaceWrinkleError
        If the file cannot be read or is not TOML.
    UnknownNameError
        If an action unit or expression names a muscle that the file does not have.

    Examples
    --------
    >>> read_atlas(DEFAULT_ATLAS).expressions["frowning"]
    {'corrugator_l': 1.0, 'corrugator_r': 1.0}
    """
    path = path_of(path)
    try:
        content = toml_of(path)
    except OSError as error:
        raise FaceWrinkleError(f"cannot read the atlas {str(path)!r}: {error.strerror or error}.") from None
    except ValueError as error:  # not UTF-8, or not TOML
        raise FaceWrinkleError(f"the atlas {str(path)!r} is not valid TOML: {error}.") from None
    try:
        _check_values({table: content[table] for table in ("muscles", "folds", "tissue") if table in content})
        return _expanded_atlas(_completed(content) if "base" in content else content)
    except UnknownNameError as error:
        raise UnknownNameError(f"in the atlas: {error}") from None
    except (KeyError, TypeError, AttributeError, RecursionError, IndexError) as error:
        what = f"the atlas {str(path)!r} does not have the form of an atlas"
        raise FaceWrinkleError(f"{what}: {_reason(error)}") from None


def _completed(changes: Mapping[str, Any]) -> dict[str, Any]:
    """The content of the package's own atlas with changes: entries of muscles key by key, all others as a whole, and
    all samples of tissue at once.
    """
    content = tomllib.loads(DEFAULT_ATLAS.read_text(encoding="utf-8"))
    check_name("base of an atlas", changes["base"], ["facewrinkle"])
    for table, entries in {name: entries for name, entries in changes.items() if name != "base"}.items():
        check_name("table", table, content)
        if type(entries) is not type(content[table]):
            form = "[[{}]], once for each sample" if table == "tissue" else "[{}], with entries by name"
            raise FaceWrinkleError(f"in the atlas: {table} must be written as {form.format(table)}.")
        if table == "tissue":
            content[table] = entries
            continue
        for name, entry in entries.items():
            old = content[table].get(name)
            content[table][name] = {**old, **entry} if table == "muscles" and isinstance(old, dict) else entry
    return content


def _check_values(value: Any, where: str = "atlas", key: str = "") -> None:
    """Raise an error for words where numbers are needed, for numbers that no face has, and the like."""
    if isinstance(value, Mapping | list):
        named = value.items() if isinstance(value, Mapping) else ((key, each) for each in value)
        for name, each in named:
            _check_values(each, f"{where}.{name}" if isinstance(value, Mapping) else where, name)
    elif key in ("paired", "waves"):
        check_flag(where, value)
    elif key in ("kind", "turn", "ends", "falloff", "fronts", "folds"):
        if not isinstance(value, str):
            raise ParameterError(f"{where} must be a word, received {value!r}.")
    else:
        check_range(where, value, -MOST, MOST)


def _reason(error: Exception) -> str:
    return f"{error} is missing." if isinstance(error, KeyError) else str(error)


def _expanded_atlas(content: Mapping[str, Any]) -> Atlas:
    """The atlas of a file's content, which states paired entries once, with both sides of them."""
    patterns = content.get("folds", {})
    muscles = {
        f"{name}_{side}" if entry.get("paired", True) else name: {
            **entry,
            **_folds_of(entry, patterns),
            "side": side,
        }
        for name, entry in content.get("muscles", {}).items()
        for side in ("lr" if entry.get("paired", True) else "l")
    }
    atlas = Atlas(muscles, {}, {}, {}, content.get("tissue", []))
    for name, unit in content.get("action_units", {}).items():
        rates = atlas.contractions(unit["muscles"])
        atlas.action_units[name] = rates
        atlas.action_unit_names[name] = unit["name"]
        if {m[-2:] for m in rates} == {"_l", "_r"}:
            for side in "lr":
                atlas.action_units[name + side.upper()] = {m: r for m, r in rates.items() if m.endswith("_" + side)}
    for name, mixture in content.get("expressions", {}).items():
        atlas.expressions[name], atlas.mixtures[name] = atlas.contractions(mixture), dict(mixture)
    return atlas


def _folds_of(entry: Mapping[str, Any], patterns: Mapping[str, Any]) -> dict[str, Any]:
    """The pattern of folds that a muscle has or names, with the muscle's own wrinkles; empty if there is none."""
    pattern = entry.get("folds")
    if pattern is None:
        return {}
    if isinstance(pattern, str):
        check_name("pattern of folds", pattern, patterns)
        pattern = patterns[pattern]
    return {"folds": {**pattern, "wrinkles": {**pattern.get("wrinkles", {}), **entry.get("wrinkles", {})}}}


def _point(entry: Mapping[str, Any], side: str, landmarks: Mapping[str, Array], frame: FaceFrame) -> Array:
    """A point of the atlas on a face: a weighted mean of landmarks, plus an offset along the face's axes."""
    weights = {stem: weight for stem, weight in entry.items() if stem != "offset"}
    total = sum(weights.values())
    if abs(total - 1.0) > 1e-9:
        raise FaceWrinkleError(f"the weights of {dict(entry)} add up to {total:g}, they must add up to 1.")
    point = sum(weight * landmarks[of_side(stem, side)] for stem, weight in weights.items())
    return np.asarray(point) + _direction(entry.get("offset", (0.0, 0.0, 0.0)), side, frame) * frame.pupil_distance


def _direction(local: npt.ArrayLike, side: str, frame: FaceFrame) -> Array:
    """A direction [outwards, up, forward] on one side, in the coordinates of the mesh."""
    outwards, up, forward = np.asarray(local, dtype=np.float64)
    return np.array([outwards if side == "l" else -outwards, up, forward]) @ frame.axes


def _placed(entry: Mapping[str, Any], landmarks: Mapping[str, Array], frame: FaceFrame) -> Muscle:
    side, size = entry["side"], frame.pupil_distance
    check_name("kind", entry["kind"], KEYS)
    shared = {each.name for each in fields(Muscle)}
    known = sorted({"kind", "side", "paired"} | shared | KEYS[entry["kind"]])
    for key in entry:
        check_name("key", key, known)
    common = {key: value for key, value in entry.items() if key in shared - {"wrinkles", "folds"}}
    if "folds" in entry:
        common["folds"] = _placed({**entry["folds"], "side": side}, landmarks, frame)
    else:
        for key in set(entry.get("wrinkles", {})) - set(WRINKLES):
            raise unknown_property("key of wrinkles", key, WRINKLES)
        common["wrinkles"] = Wrinkles(**entry.get("wrinkles", {}))

    def point(part: Mapping[str, Any]) -> Array:
        return _point(part, side, landmarks, frame)

    if entry["kind"] == "linear":
        a, i = point(entry["attachment"]), point(entry["insertion"])
        radius = max(entry["radius"] * size, float(np.linalg.norm(i - a)))
        return LinearMuscle(a, i, np.deg2rad(entry["max_angle"]), radius, entry.get("sliding", 0.0), **common)
    if entry["kind"] in ("sheet", "triangular"):
        a, i = (np.array([point(end) for end in entry[part]]) for part in ("attachment", "insertion"))
        length, recoil = entry["length"] * size, entry.get("recoil", 0.0)
        if entry["kind"] == "triangular":
            return TriangularMuscle(a, i, length, recoil=recoil, **common)
        return SheetMuscle(a, i, length, entry["width"] * size, recoil=recoil, **common)
    if entry["kind"] == "crease":
        crest, path = _direction(entry["crest"], side, frame), np.array([point(part) for part in entry["path"]])
        width, span, variety = entry["width"] * size, entry.get("span", (0.0, 1.0)), entry.get("variety", 0.0)
        return Crease(path, crest, width, span, variety=variety, **common)
    if entry["kind"] == "jaw":
        return JawMuscle(point(entry["hinge"]), frame.axes[0], np.deg2rad(entry["angle"]), **common)
    if entry["kind"] == "lid":
        return LidMuscle(side, entry["share"], **common)
    if entry["kind"] == "eye":
        return EyeMuscle(side, entry["turn"], np.deg2rad(entry["angle"]), **common)
    if entry["kind"] == "tongue":
        return TongueMuscle(**common)
    beta1, beta2 = np.deg2rad(entry["beta"])
    return SphincterMuscle(
        point(entry["centre"]),
        entry["semi_major"] * size,
        entry["semi_minor"] * size,
        normal=_direction((0, 0, 1), side, frame),
        lateral=_direction((1, 0, 0), side, frame),
        vertical=_direction((0, 1, 0), side, frame),
        inner=entry["inner"],
        beta1=float(beta1),
        beta2=float(beta2),
        dead_zone=entry["dead_zone"],
        protrusion=entry.get("protrusion", 0.0),
        **common,
    )


# --- mixtures as text: names with numbers, such as AU1=0.7+AU4 -----------------------------------------------------


Mixture = str | Sequence[str] | Mapping[str, float]
"""What makes an expression: a text, a list of names, or weights by name."""


def split_names(text: str) -> list[str]:
    """Return what is joined by + or by commas; a sign before a number joins nothing.

    Examples
    --------
    >>> split_names("AU1=+.7 + AU4, AU12")
    ['AU1=+.7', 'AU4', 'AU12']
    """
    return [part.strip() for part in re.split(r",|\+(?=\s*[^\W\d])", text)]


def parse_weights(text: str, usual: float | None = 1.0) -> dict[str, float]:
    """Return numbers by name, from "mouthSmile=0.8+jawOpen" or "mouthSmile=0.8,jawOpen"; `usual` where none is given.

    Raises
    ------
    ParameterError
        For what is no number, for none where there is no usual one, and for a name that comes twice.

    Examples
    --------
    >>> parse_weights("mouthSmile=0.8 + jawOpen"), parse_weights("jaw=0.5, age=1", usual=None)
    ({'mouthSmile': 0.8, 'jawOpen': 1.0}, {'jaw': 0.5, 'age': 1.0})
    """
    found: dict[str, float] = {}
    for part in split_names(text):
        name, equals, number = (piece.strip() for piece in part.partition("="))
        if name in found:
            raise ParameterError(f"{name} is named twice in {text!r}. Give one number for each name.")
        try:
            found[name] = float(number) if equals or usual is None else usual
        except ValueError:
            example = "jaw=0.5,age=1" if usual is None else "AU1=0.7+AU4"
            raise ParameterError(f"names with numbers are needed, such as {example}; received {part!r}.") from None
    return found


# --- writing an atlas as TOML, in the form that read_atlas reads ---------------------------------------------------


SIDES = ("_l", "_r")
"""Endings of the names of muscles that come in pairs."""


def write_atlas(atlas: Atlas, path: str | Path) -> Path:
    """Write an atlas to a TOML file; :func:`facewrinkle.read_atlas` returns the same one from it.

    Parameters
    ----------
    atlas : Atlas
    path : path
        An existing file is replaced.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    ParameterError
        If the two muscles of a pair differ: such an atlas has no file.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import dataclasses, tempfile
    >>> mine = fw.default_face().atlas
    >>> mine = dataclasses.replace(mine, expressions={**mine.expressions, "smirk": {"zygomaticus_major_l": 0.6}})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     again = fw.read_atlas(write_atlas(mine, f"{folder}/mine.toml"))
    >>> again.expressions["smirk"], again.muscles == mine.muscles
    ({'zygomaticus_major_l': 0.6}, True)
    """
    return write_whole(path_of(path), atlas_text(atlas))


def atlas_text(atlas: Atlas) -> str:
    """Return an atlas as TOML."""
    lines = []
    for name, entry in _unpaired(atlas.muscles):
        lines += [f"[muscles.{_key(name)}]", *(f"{_key(key)} = {_value(value)}" for key, value in entry.items()), ""]
    for name, title in atlas.action_unit_names.items():
        units = _value(_joined(atlas.action_units[name], atlas.muscles))
        lines += [f"[action_units.{_key(name)}]", f"name = {_value(title)}", f"muscles = {units}", ""]
    written = {name: _joined(atlas.written(name), atlas.muscles) for name in atlas.expressions}
    lines += ["[expressions]", *(f"{_key(name)} = {_value(mixture)}" for name, mixture in written.items())]
    for sample in atlas.tissue:
        lines += ["", "[[tissue]]", *(f"{_key(key)} = {_value(value)}" for key, value in sample.items())]
    return "\n".join(lines) + "\n"


def _unpaired(muscles: Mapping[str, Mapping[str, Any]]) -> Iterable[tuple[str, dict[str, Any]]]:
    """Yield the entries as a file states them: once for both sides."""
    for name, entry in muscles.items():
        bare = {key: value for key, value in entry.items() if key not in ("side", "paired")}
        if not entry.get("paired", True):
            yield name, {**bare, "paired": False}
            continue
        stem = name[: -len(SIDES[0])]
        if name.endswith(SIDES[1]):
            if stem + SIDES[0] not in muscles:
                raise ParameterError(f"the atlas has {name} without its other side, which a file cannot say.")
            continue
        other = muscles.get(stem + SIDES[1])
        if other is None or {**other, "side": entry["side"]} != entry:
            raise ParameterError(f"the two sides of the muscle {stem} differ, which the file of an atlas cannot say.")
        yield stem, bare


def _joined(rates: Mapping[str, float], muscles: Mapping[str, Any]) -> dict[str, float]:
    """Return rates with both muscles of a pair under one name, where they are the same."""
    out: dict[str, float] = {}
    for name, rate in rates.items():
        stem, left = name[:-2], name.endswith(SIDES[0])
        pair = name.endswith(SIDES) and stem not in muscles and {stem + side for side in SIDES} <= muscles.keys()
        if pair and rates.get(stem + SIDES[left]) == rate:
            out[stem] = rate
        else:
            out[name] = rate
    return out


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _value(name)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(str(key))} = {_value(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(each) for each in value) + "]"
    if isinstance(value, bool | int | float | str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", r"\u007f")  # all else is the same in JSON and TOML
    raise ParameterError(f"the file of an atlas cannot hold {value!r}.")


MUSCLES = load_atlas().muscles
"""The muscles of the atlas that comes with the package, as :class:`Atlas` holds them."""

ACTION_UNITS = load_atlas().action_units
"""Its action units: contractions by muscle."""

EXPRESSIONS = load_atlas().expressions
"""Its expressions: contractions by muscle or action unit."""
