"""Files of takes as tables: what phones, trackers, spreadsheets and programs write, brought into one form.

A file is read by what it is, not by its name: rows of cells, JSON of any nesting, lines of JSON, recordings of Face Cap
and iFacialMocap, and mouth cues of Rhubarb Lip Sync.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..animation.action_units import plain_name, sided, spellings
from ..array_types import Array
from ..errors import ParameterError
from .shapes import SETS

TIMES = {"time", "times", "t", "s", "sec", "seconds", "timesec", "timecode", "timestamp", "smpte"}
"""Plain names of columns with times whose unit follows from their steps."""

THOUSANDTHS = {"timestampms", "timems", "ms", "milliseconds", "timestampmilliseconds"}
"""Plain names of columns with times in ms."""

FRAMES = {"frame", "frameno", "framenumber", "frameindex", "frameid"}
"""Plain names of columns that count the frames of a video."""

PEOPLE = {"faceid", "personid", "person", "subjectid", "faceindex"}
"""Plain names of columns that tell whose face a row shows."""

HEAD = ("headyaw", "headpitch", "headroll")
"""Plain names of columns with the turn of the head, as Live Link Face writes it: to the left, upwards, to the right."""

CAMERA = ("poserx", "posery", "poserz")
"""Plain names of OpenFace's turn of the head about the axes of the camera (right, down, away)."""

SURE = {"success": 0.5, "confidence": 0.5, "facescore": 0.5, "detectionconfidence": 0.5}
"""Plain names of columns that tell whether the face was seen, and the least value with which it was."""

RATES = ("fps", "exportfps", "framerate", "samplerate", "rate")
"""Plain names under which files keep their frames per second."""

VISEMES: Mapping[str, str] = {
    "aa": "viseme_aa",
    "ih": "viseme_I",
    "ou": "viseme_U",
    "ee": "viseme_E",
    "oh": "viseme_O",  # VRM 1
    "a": "viseme_aa",
    "i": "viseme_I",
    "u": "viseme_U",
    "e": "viseme_E",
    "o": "viseme_O",  # VRM 0
    "vopen": "viseme_aa",
    "vexplosive": "viseme_PP",
    "vdentallip": "viseme_FF",
    "vtighto": "viseme_O",  # iClone
    "vtight": "viseme_U",
    "vwide": "viseme_E",
    "vaffricate": "viseme_CH",
    "vlipopen": "viseme_DD",
}
"""Other names of visemes, by plain name."""

MOODS: Mapping[str, str] = {
    "happy": "happiness",
    "angry": "anger",
    "sad": "sadness",
    "surprised": "emotion_surprise",
}
"""Expressions by the names of VRM's presets; names such as `anger` are probabilities in the tables of trackers."""

CUES: Mapping[str, str] = {
    "A": "viseme_PP", "B": "viseme_SS", "C": "viseme_E", "D": "viseme_aa", "E": "viseme_O", "F": "viseme_U",
    "G": "viseme_FF", "H": "viseme_nn", "X": "",
}  # fmt: skip
"""Visemes by the mouth shapes of Rhubarb Lip Sync."""

BLEND = 0.06
"""Time in which the mouth goes from one cue to the next, s."""

MISSING = {"", "nan", "null", "none", "na", "n/a", "-", "nil"}
"""What stands in cells without a value."""

NAMED, VALUED = ("name", "categoryname", "key", "shape", "blendshape", "id"), ("value", "score", "weight", "val")
"""Plain names of the parts of a pair of name and value in JSON."""

MATRICES = "facialtransformationmatrixes"
"""Plain name under which MediaPipe keeps the turns of heads."""

_SHAPES = {plain_name(name): name for shapes in SETS.values() for name in shapes}
_SIDED = {name for shapes in SETS.values() for name, shape in shapes.items() if shape.side}
_UNIT = re.compile(r"au0*(\d+)(l|r|left|right)?(intensity|intensities|evidence)?")
_PRESENCE = re.compile(r"au0*\d+(c|presence|detection|detections)|au0*\d+\w*occurrence")


@cache
def shapes_of_column(column: str) -> tuple[str, ...]:
    """Return the shapes that a column names: ARKit's, visemes, action units with or without a side, expressions.

    Examples
    --------
    >>> shapes_of_column("EyeBlink_L"), shapes_of_column("mouthFrown"), shapes_of_column("hair")
    (('eyeBlinkLeft',), ('mouthFrownLeft', 'mouthFrownRight'), ())
    >>> shapes_of_column("AU06_r"), shapes_of_column("AU12_L"), shapes_of_column("Brow_Raise_Inner_L")
    (('AU6',), ('AU12L',), ('browInnerUpLeft',))
    """
    plain = plain_name(column)
    if unit := _unit(column):
        return (f"AU{unit[1]}{(unit[2] or '')[:1].upper()}",)
    for other in spellings(column):
        if other in _SHAPES:
            return (_SHAPES[other],)
    if plain in VISEMES or plain in MOODS:
        return (VISEMES.get(plain) or MOODS[plain],)
    stem, side = sided(column)
    if side is None and stem in _SHAPES.values():
        return (stem,)
    words = {"l": ["Left"], "r": ["Right"], None: ["Left", "Right"]}[side]
    found = tuple(f"{stem}{word}" for word in words if f"{stem}{word}" in _SIDED)
    return found or ((stem,) if stem in _SHAPES.values() else ())  # a half of a shape without sides


def _unit(column: str) -> re.Match[str] | None:
    """Match the name of an action unit. The r of OpenFace's AU12_r is no side, but that of AU12R and AU12_R is."""
    plain = plain_name(column)
    found = _UNIT.fullmatch(plain)
    return _UNIT.fullmatch(plain[:-1] + "intensity") if found and column.endswith("_r") else found


def is_intensity(column: str) -> bool:
    """Tell whether a column is the intensity of an action unit from 0 to 5, as OpenFace writes it.

    Examples
    --------
    >>> is_intensity("AU12_r"), is_intensity("AU12")
    (True, False)
    """
    found = _unit(column)
    return bool(found and found[3] and found[3] != "evidence")


def is_evidence(column: str) -> bool:
    """Tell whether a column has the evidence for an action unit, as FACET writes it: the decimal logarithm of odds.

    Examples
    --------
    >>> is_evidence("AU12 Evidence"), is_evidence("AU12")
    (True, False)
    """
    found = _unit(column)
    return bool(found and found[3] == "evidence")


def is_presence(column: str) -> bool:
    """Tell whether a column only says that an action unit is there, beside one with its intensity.

    Examples
    --------
    >>> is_presence("AU12_c"), is_presence("AU12_r")
    (True, False)
    """
    return bool(_PRESENCE.fullmatch(plain_name(column)))


class Table(NamedTuple):
    """The content of a file.

    Attributes
    ----------
    names : list of str
        Of columns.
    values : ndarray, shape (f, c)
        NaN where there is none.
    times : sequence of str, optional
        As they are written.
    clock : str
        Name of the column with the times.
    fps : float, optional
        Frames per second that the file tells.
    """

    names: list[str]
    values: Array
    times: Sequence[str] | None = None
    clock: str = ""
    fps: float | None = None


def table_of(file: str, text: str) -> Table:
    """Return the table of the text of a file.

    Raises
    ------
    ParameterError
        If it is empty or broken, or has no frames.

    Examples
    --------
    >>> table_of("a.csv", "time;jawOpen\\n0;0,5\\n").values
    array([[nan, 0.5]])
    """
    if text.lstrip()[:1] in ("{", "["):
        return _of_json(file, text)
    lines = [line for line in text.splitlines() if line.strip()]
    if not lines:
        raise ParameterError(f"{file} is empty. A table needs a row with the names of its columns.")
    if re.match(r"\w+[-&]-?[\d.]+\|", lines[0]):
        return _of_pairs(lines)
    if any(line.startswith("bs,") for line in lines[:10]):
        return _of_face_cap(lines)
    if all(re.fullmatch(r"[\d.]+\s+[A-HX]", line.strip()) for line in lines):
        starts, cues = zip(*(line.split() for line in lines), strict=True)
        return _of_cues([float(start) for start in starts], cues)
    return _of_rows(file, lines)


def _of_rows(file: str, lines: list[str]) -> Table:
    """Return the table of rows of cells, below whatever stands before the names of the columns."""
    head, separator = _header(lines)
    first, *rows = csv.reader(lines[head:], delimiter=separator, skipinitialspace=True)
    names = [name.strip() for name in first]
    if not rows:
        raise ParameterError(f"{file} has no frames: there is nothing below the names of its columns.")
    for number, row in enumerate(rows, start=head + 2):
        if any(cell.strip() for cell in row[len(names) :]):  # a separator at the end of a row does no harm
            raise ParameterError(
                f"{file}: row {number} has more columns than the row of their names. Export it again, with another "
                "separator if its numbers have decimal commas."
            )
    columns = list(zip(*([*row[: len(names)], *[""] * (len(names) - len(row))] for row in rows), strict=True))
    clock = _clock(names)
    values = [np.full(len(rows), np.nan) if name == clock else _numbers(columns[i], file, name)
              for i, name in enumerate(names)]  # fmt: skip
    kept = [i for i, name in enumerate(names) if name]
    rate = re.search(r"(?i)\bfps\W{1,3}(\d+(?:\.\d+)?)", "\n".join(lines[:head]))
    times = columns[names.index(clock)] if clock else None
    table = np.stack([values[i] for i in kept], axis=1)
    return Table([names[i] for i in kept], table, times, clock, float(rate[1]) if rate else None)


def _header(lines: list[str]) -> tuple[int, str]:
    """Return the number of the line that names the columns, the first that names a shape, and what separates them."""
    for number, line in enumerate(lines[:100]):
        separator = max(",;\t|", key=line.count)
        if any(shapes_of_column(cell.strip()) for cell in next(csv.reader([line], delimiter=separator), ())):
            return number, separator
    return 0, max(",;\t|", key=lines[0].count)


def _clock(names: Sequence[str]) -> str:
    """Return the name of the column with the times; the empty string if there is none."""
    return next((name for name in names if plain_name(name) in TIMES | THOUSANDTHS), "")


def _numbers(cells: Sequence[str], file: str, column: str) -> Array:
    """Return the numbers in cells; NaN for empty ones, and for words in columns that are not needed."""
    try:
        return np.array(cells, float)
    except ValueError:
        return np.array([_number(cell.strip(), file, column) for cell in cells])


def _number(cell: str, file: str, column: str) -> float:
    if cell.lower() in MISSING:
        return np.nan
    try:
        return float(cell.rstrip("%").replace(",", "."))
    except ValueError:
        if shapes_of_column(column) or plain_name(column) in (*HEAD, *CAMERA):
            raise ParameterError(f"{file}: the column {column} must hold numbers, received {cell[:40]!r}.") from None
        return np.nan


def _of_pairs(lines: list[str]) -> Table:
    """Return the table of lines of iFacialMocap: ``jawOpen-12|...|=head#...``, 60 a second, weights from 0 to 100."""
    rows = [dict(re.findall(r"(\w+)[-&](-?[\d.]+)\|", line)) for line in lines]
    names = list(dict.fromkeys(name for row in rows for name in row))
    values = np.array([[float(row.get(name, "nan")) for name in names] for row in rows])
    return Table(names, values / 100.0, fps=60.0)


def _of_face_cap(lines: list[str]) -> Table:
    """Return the table of a recording of Face Cap: rows of `bs` with names and `k` with ms, ten angles and weights."""
    names = next(line for line in lines if line.startswith("bs,")).split(",")[1:]
    rows = [line.split(",")[1:] for line in lines if line.startswith("k,")]
    values = np.array([[float(cell) for cell in row[-len(names) :]] for row in rows]).reshape(len(rows), len(names))
    return Table(names, values, [row[0] for row in rows], "timestampMs")


def _of_cues(starts: Sequence[float], cues: Sequence[str]) -> Table:
    """Return the table of mouth cues, each of which lasts until the next."""
    names = sorted(set(filter(None, (CUES.get(cue, "") for cue in cues)))) or ["viseme_sil"]
    held = np.array([[float(CUES.get(cue, "") == name) for name in names] for cue in cues])
    times: list[float] = []
    rows = []
    for number, start in enumerate(starts):
        end = starts[number + 1] - BLEND if number + 1 < len(starts) else start
        for time in (start, max(end, start + 1e-3)) if number + 1 < len(starts) else (start,):
            times.append(time)
            rows.append(held[number])
    return Table(["time", *names], np.column_stack([times, rows]), [str(time) for time in times], "time")


def _of_json(file: str, text: str) -> Table:
    """Return the table of JSON, or of lines of it."""
    try:
        content = json.loads(text)
    except ValueError as problem:
        try:
            content = [json.loads(line) for line in text.splitlines() if line.strip()]
        except ValueError:
            raise ParameterError(f"{file} is not valid JSON: {problem}.") from None
    if isinstance(content, Mapping) and isinstance(content.get("mouthCues"), list):
        cues = content["mouthCues"]
        ends = [cues[-1]["end"]] if cues else []
        return _of_cues([*(float(cue["start"]) for cue in cues), *ends], [*(str(cue["value"]) for cue in cues), "X"])
    rows = [row for frame in _frames(content) for row in _faces(frame)]
    if not any(shapes_of_column(name) for row in rows for name in row):
        raise ParameterError(
            f"{file} has no frames with weights of shapes. Needed are frames with weights by name, such as jawOpen, in "
            f"a list, by number or by shape; received {_keys(content)}."
        )
    names = list(dict.fromkeys(name for row in rows for name in row))
    clock = _clock([name for name in names if all(name in row for row in rows)])
    shapes = {name for name in names if shapes_of_column(name)}
    values = np.array([[_value(row, name, name == clock) for name in names] for row in rows])
    seen = ~np.isnan(values).all(axis=1)
    named = np.array([name in shapes for name in names])
    seen &= ~np.isnan(values[:, named]).all(axis=1)
    values[np.ix_(seen, named)] = np.nan_to_num(values[np.ix_(seen, named)])  # who names some has none of the others
    return Table(names, values, [str(row[clock]) for row in rows] if clock else None, clock, _rate(content))


def _value(row: Mapping[str, Any], name: str, is_time: bool) -> float:
    """Return a weight; NaN where there is none."""
    value = row.get(name)
    if is_time or value is None or (isinstance(value, str) and not shapes_of_column(name)):
        return np.nan
    return float(value)


def _rate(content: Any) -> float | None:
    """Return the frames per second that an object tells at its top, or one level below."""
    if not isinstance(content, Mapping):
        return None
    for level in (content, *(value for value in content.values() if isinstance(value, Mapping))):
        for key, value in level.items():
            if plain_name(str(key)) in RATES and isinstance(value, int | float) and value > 0:
                return float(value)
    return None


def _keys(content: Any) -> str:
    """Return what stands at the top of JSON."""
    if isinstance(content, Mapping):
        return "an object with " + ", ".join(list(map(str, content))[:8])
    return (
        f"a list of {len(content)} {type(content[0]).__name__}" if isinstance(content, list) and content else "nothing"
    )


def _frames(content: Any, names: Sequence[str] = ()) -> list[Any]:
    """Return the frames in JSON: the first list of them, or an object of them by number, or lists by shape."""
    if isinstance(content, list):
        return [_labeled(frame, names) for frame in content if isinstance(frame, Mapping | list)]
    if not isinstance(content, Mapping):
        return []
    for value in content.values():
        if isinstance(value, list) and value and all(isinstance(each, str) for each in value):
            names = value if any(map(shapes_of_column, value)) else names
    lists = {key: value for key, value in content.items() if isinstance(value, list) and value}
    if any(shapes_of_column(key) and isinstance(lists[key][0], int | float) for key in lists):
        lengths = {len(value) for key, value in lists.items() if shapes_of_column(key)}
        same = {key: value for key, value in lists.items() if len(value) in lengths}
        return [dict(zip(same, row, strict=True)) for row in zip(*same.values(), strict=True)]
    if content and all(re.fullmatch(r"\d+(\.\d+)?", str(key)) for key in content):
        clock = "time" if any("." in key for key in content) else "frame"
        return [
            {clock: float(key), "": value} for key, value in sorted(content.items(), key=lambda item: float(item[0]))
        ]
    if any(shapes_of_column(key) for key, value in content.items() if isinstance(value, int | float)):
        return [content]
    for value in content.values():
        found = _frames(value, names)
        if any(shapes_of_column(name) for frame in found[:100] for row in _faces(frame) for name in row):
            clocks = {key: each for key, each in lists.items()
                      if plain_name(key) in TIMES | THOUSANDTHS | FRAMES and len(each) == len(found)}  # fmt: skip
            return [{"": frame, **{key: each[i] for key, each in clocks.items()}} for i, frame in enumerate(found)]
    return [content] if any(map(shapes_of_column, _flat(content))) else []


def _labeled(frame: Any, names: Sequence[str]) -> Any:
    """Return a frame whose rows of numbers have the names that stand elsewhere."""
    if isinstance(frame, list) and names and len(frame) == len(names):
        return dict(zip(names, frame, strict=True))
    if isinstance(frame, Mapping) and names:
        return {key: _labeled(value, names) if isinstance(value, list) else value for key, value in frame.items()}
    return frame


def _pair(item: Any) -> tuple[str, Any] | None:
    """Return the name and the value of an object that holds just such a pair."""
    if not isinstance(item, Mapping):
        return None
    name = value = None
    for key, content in item.items():
        plain = plain_name(key)
        if plain in NAMED and isinstance(content, str) and content:
            name = content
        elif plain in VALUED:
            value = content
    return None if name is None or value is None else (name, value)


def _flat(item: Any) -> dict[str, Any]:
    """Return the numbers and times of an object by name, from whatever depth, but not those of several faces."""
    found: dict[str, Any] = {}
    if isinstance(item, Mapping):
        for key, value in item.items():
            if isinstance(value, int | float) or plain_name(str(key)) in TIMES:
                found[str(key)] = value
            elif plain_name(str(key)) != MATRICES:
                found |= _flat(value)
    elif isinstance(item, list):
        for each in item:
            if pair := _pair(each):
                found[pair[0]] = pair[1]
    return found


def _groups(item: Any) -> Iterator[list[dict[str, Any]]]:
    """Yield the weights of the faces of a frame, where it lists them: as lists, or as objects that hold pairs."""
    if isinstance(item, Mapping):
        for key, value in item.items():
            if plain_name(str(key)) != MATRICES:
                yield from _groups(value)
    elif isinstance(item, list):
        faces = [_flat(each) for each in item if isinstance(each, list | Mapping) and _pair(each) is None]
        if any(shapes_of_column(name) for face in faces for name in face):
            yield faces


def _faces(frame: Any) -> list[dict[str, Any]]:
    """Return the weights in a frame, a row for each face that it shows."""
    shared, turns = _flat(frame), _turns(frame)
    rows = [shared | face for face in next(_groups(frame), [{}])]
    for number, row in enumerate(rows):
        if len(rows) > 1:
            row["face_id"] = number
        if number < len(turns) and not np.isnan(turns[number]).any():
            row |= dict(zip(HEAD, turns[number].tolist(), strict=True))
    return rows


def _turns(frame: Any) -> list[Array]:
    """Return yaw, pitch and roll of the matrices of a frame of MediaPipe; NaN for what is no rotation."""
    if not isinstance(frame, Mapping):
        return []
    key = next((key for key in frame if plain_name(str(key)) == MATRICES), None)
    return [_turn(matrix) for matrix in frame[key] or ()] if key is not None else []


def _turn(matrix: Any) -> Array:
    """Return yaw, pitch and roll of a matrix: 16 numbers by columns in a browser, four rows of four in Python."""
    by_columns = isinstance(matrix, Mapping)
    numbers = np.array(matrix["data"] if by_columns else matrix, float).reshape(4, 4)
    return yaw_pitch_roll(numbers.T[:3, :3] if by_columns else numbers[:3, :3])


def yaw_pitch_roll(matrix: Array) -> Array:
    """Return the turn of a head to its left, upwards and to its right shoulder, radians, of a matrix (3, 3) in axes
    [left, up, forward]; NaN if it is no rotation.

    Examples
    --------
    >>> yaw_pitch_roll(np.eye(3)).tolist()
    [0.0, -0.0, 0.0]
    """
    if not np.isfinite(matrix).all() or np.linalg.det(matrix) < 1e-9:
        return np.full(3, np.nan)
    yaw, down, roll = Rotation.from_matrix(matrix).as_euler("YXZ")
    return np.array([yaw, -down, roll])
