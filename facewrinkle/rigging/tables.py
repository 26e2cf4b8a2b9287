"""Files of takes as tables: what phones, trackers, spreadsheets and programs write, brought into one form.

A file is read by what it is, not by its name: rows of cells, JSON of any nesting, lines of JSON, recordings of Face Cap
and iFacialMocap, and mouth cues of Rhubarb Lip Sync.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import chain
from typing import Any, Literal, NamedTuple

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
    "happy": "happiness",
    "angry": "anger",
    "sad": "sadness",
    "surprised": "surprise",  # VRM's presets; names such as `anger` are probabilities in the tables of trackers
}
"""Other names of visemes and expressions, by plain name."""

MATRICES = "facialtransformationmatrixes"
"""Plain name under which MediaPipe keeps the turns of heads."""

Kind = Literal["shape", "unit", "intensity", "evidence", "presence", ""]
"""What a column of a take tells."""

_SHAPES = {plain_name(name): name for shapes in SETS.values() for name in shapes}
_SIDED = {name for shapes in SETS.values() for name, shape in shapes.items() if shape.side}


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
    if plain in VISEMES:
        return (VISEMES[plain],)
    stem, side = sided(column)
    if side is None and stem in _SHAPES.values():
        return (stem,)
    words = {"l": ["Left"], "r": ["Right"], None: ["Left", "Right"]}[side]
    found = tuple(f"{stem}{word}" for word in words if f"{stem}{word}" in _SIDED)
    return found or ((stem,) if stem in _SHAPES.values() else ())  # a half of a shape without sides


def _unit(column: str) -> re.Match[str] | None:
    """Match the name of an action unit. The r of OpenFace's AU12_r is no side, but that of AU12R and AU12_R is."""
    unit, plain = r"au0*(\d+)(l|r|left|right)?(intensity|intensities|evidence)?", plain_name(column)
    found = re.fullmatch(unit, plain)
    return re.fullmatch(unit, plain[:-1] + "intensity") if found and column.endswith("_r") else found


@cache
def kind_of_column(column: str) -> Kind:
    """Return what a column tells: the weight of a shape or of a unit; the intensity of a unit, from 0 to 5, as OpenFace
    writes it; the evidence for one, as FACET does: the decimal logarithm of odds; its presence, beside one of these.

    Examples
    --------
    >>> [kind_of_column(name) for name in ("jawOpen", "AU12", "AU12_r", "AU12 Evidence", "AU12_c", "hair")]
    ['shape', 'unit', 'intensity', 'evidence', 'presence', '']
    """
    if unit := _unit(column):
        return "unit" if not unit[3] else "evidence" if unit[3] == "evidence" else "intensity"
    if re.fullmatch(r"au0*\d+(c|presence|detection|detections|\w*occurrence)", plain_name(column)):
        return "presence"
    return "shape" if shapes_of_column(column) else ""


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
        return _of_pairs(file, lines)
    if any(line.startswith("bs,") for line in lines[:10]):
        return _of_face_cap(file, lines)
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
    kept = [i for i, name in enumerate(names) if name]
    columns = [[row[i] if i < len(row) else "" for row in rows] for i in kept]
    rate = re.search(r"(?i)\bfps\W{1,3}(\d+(?:\.\d+)?)", "\n".join(lines[:head]))
    return _tabled(file, [names[i] for i in kept], columns, float(rate[1]) if rate else None)


def _tabled(file: str, names: list[str], columns: Sequence[Sequence[Any]], fps: float | None = None) -> Table:
    """Return the table of columns of cells, None where there is none; the times are in one that has all."""
    timed = (i for i, name in enumerate(names) if plain_name(name) in TIMES | THOUSANDTHS and None not in columns[i])
    clock = next(timed, None)
    values = [
        np.full(len(cells), np.nan) if i == clock else _numbers(cells, file, names[i])
        for i, cells in enumerate(columns)
    ]
    times = None if clock is None else [str(cell) for cell in columns[clock]]
    return Table(names, np.stack(values, axis=1), times, "" if clock is None else names[clock], fps)


def _columns(rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> list[tuple[Any, ...]]:
    """Return what rows hold under some names, None for nothing, by name."""
    return list(zip(*[tuple(map(row.get, names)) for row in rows], strict=True))


def _header(lines: list[str]) -> tuple[int, str]:
    """Return the number of the line that names the columns, the first that names a shape, and what separates them."""
    for number, line in enumerate(lines[:100]):
        separator = max(",;\t|", key=line.count)
        if any(shapes_of_column(cell.strip()) for cell in next(csv.reader([line], delimiter=separator), ())):
            return number, separator
    return 0, max(",;\t|", key=lines[0].count)


def _numbers(cells: Sequence[Any], file: str, column: str) -> Array:
    """Return the numbers in cells; NaN for empty ones, and for words in columns that are not needed."""
    try:
        return np.array(cells, float)
    except (ValueError, TypeError):
        return np.array([_number(str(cell).strip(), file, column) for cell in cells])


def _number(cell: str, file: str, column: str) -> float:
    if cell.lower() in {"", "nan", "null", "none", "na", "n/a", "-", "nil"}:
        return np.nan
    try:
        return float(cell.rstrip("%").replace(",", "."))
    except ValueError:
        if shapes_of_column(column) or plain_name(column) in (*HEAD, *CAMERA):
            raise ParameterError(f"{file}: the column {column} must hold numbers, received {cell[:40]!r}.") from None
        return np.nan


def _of_pairs(file: str, lines: list[str]) -> Table:
    """Return the table of lines of iFacialMocap: ``jawOpen-12|...|=head#...``, 60 a second, weights from 0 to 100."""
    rows = [dict(re.findall(r"(\w+)[-&](-?[\d.]+)\|", line)) for line in lines]
    names = list(dict.fromkeys(chain.from_iterable(rows)))
    table = _tabled(file, names, _columns(rows, names), 60.0)
    return table._replace(values=table.values / 100.0)


def _of_face_cap(file: str, lines: list[str]) -> Table:
    """Return the table of a recording of Face Cap: rows of `bs` with names and `k` with ms, ten angles and weights."""
    names = next(line for line in lines if line.startswith("bs,")).split(",")[1:]
    rows = [line.split(",")[1:] for line in lines if line.startswith("k,")]
    columns = zip(*([row[0], *row[-len(names) :]] for row in rows), strict=True)
    return _tabled(file, ["timestampMs", *names], list(columns))


def _of_cues(starts: Sequence[float], cues: Sequence[str]) -> Table:
    """Return the table of mouth cues, each of which lasts until 0.06 s before the next."""
    of_cue = {  # the mouth shapes of Rhubarb Lip Sync; X is none
        "A": "viseme_PP", "B": "viseme_SS", "C": "viseme_E", "D": "viseme_aa", "E": "viseme_O", "F": "viseme_U",
        "G": "viseme_FF", "H": "viseme_nn",
    }  # fmt: skip
    visemes = [of_cue.get(cue, "") for cue in cues]
    names = sorted({*visemes} - {""}) or ["viseme_sil"]
    held = np.array([[float(viseme == name) for name in names] for viseme in visemes])
    start = np.array(starts)
    end = np.append(np.maximum(start[1:] - 0.06, start[:-1] + 1e-3), np.nan)
    times = np.stack([start, end], axis=1).ravel()[:-1]
    return Table(
        ["time", *names], np.column_stack([times, np.repeat(held, 2, axis=0)[:-1]]), times.astype(str).tolist(), "time"
    )


# --- JSON -------------------------------------------------------------------------------------------------------------


def _of_json(file: str, text: str) -> Table:
    """Return the table of JSON, or of lines of it."""
    try:
        content = json.loads(text)
    except ValueError as problem:
        try:
            content = [json.loads(line) for line in text.splitlines() if line.strip()]
        except ValueError:
            raise ParameterError(f"{file} is not valid JSON: {problem}.") from None
    if isinstance(content, dict) and isinstance(content.get("mouthCues"), list):
        cues = content["mouthCues"]
        ends = [cues[-1]["end"]] if cues else []
        return _of_cues([*(float(cue["start"]) for cue in cues), *ends], [*(str(cue["value"]) for cue in cues), "X"])
    labels = _labels(content)
    rows = [row for frame in _frames(content, labels) for row in _faces(frame, labels)]
    matrices = [row.pop(MATRICES, None) for row in rows]
    names = list(dict.fromkeys(chain.from_iterable(rows)))
    shapes = np.array([bool(shapes_of_column(name)) for name in names], bool)
    if not shapes.any():
        raise ParameterError(
            f"{file} has no frames with weights of shapes. Needed are frames with weights by name, such as jawOpen, in "
            f"a list, by number or by shape; received {_keys(content)}."
        )
    table = _tabled(file, names, _columns(rows, names), _rate(content))
    seen = ~np.isnan(table.values[:, shapes]).all(axis=1)
    table.values[np.ix_(seen, shapes)] = np.nan_to_num(table.values[np.ix_(seen, shapes)])  # the others are 0
    if not any(matrix is not None for matrix in matrices):
        return table
    turns = yaw_pitch_roll(np.array([np.full((3, 3), np.nan) if each is None else each for each in matrices]))
    return table._replace(names=[*HEAD, *names], values=np.hstack([turns, table.values]))


def _rate(content: Any) -> float | None:
    """Return the frames per second that an object tells at its top, or one level below."""
    levels = [content, *content.values()] if isinstance(content, dict) else []
    names = ("fps", "exportfps", "framerate", "samplerate", "rate")
    rates = (value for level in levels if isinstance(level, dict) for key, value in level.items()
             if plain_name(key) in names and isinstance(value, int | float) and value > 0)  # fmt: skip
    return next(map(float, rates), None)


def _keys(content: Any) -> str:
    """Return what stands at the top of JSON."""
    if isinstance(content, dict):
        return "an object with " + ", ".join(list(content)[:8])
    return f"a list of {len(content)} {type(content[0]).__name__}" if content else "nothing"


def _labels(content: Any) -> list[str]:
    """Return the list of names, wherever it stands, that rows of numbers go by; an empty one if there is none."""
    if isinstance(content, dict):
        return next(filter(None, map(_labels, content.values())), [])
    is_names = isinstance(content, list) and all(isinstance(name, str) for name in content)
    return content if is_names and any(map(shapes_of_column, content)) else []


def _frames(content: Any, labels: list[str]) -> list[Any]:
    """Return the frames in JSON: the first list of them, or an object of them by number, or lists by shape."""
    if not isinstance(content, dict):
        return content if isinstance(content, list) else []
    lists = {key: value for key, value in content.items() if isinstance(value, list) and value}
    if lengths := {
        len(each) for key, each in lists.items() if isinstance(each[0], int | float) and shapes_of_column(key)
    }:
        same = {key: each for key, each in lists.items() if len(each) in lengths}
        return [dict(zip(same, row, strict=True)) for row in zip(*same.values(), strict=True)]
    if content and all(re.fullmatch(r"\d+(\.\d+)?", key) for key in content):
        clock = "time" if any("." in key for key in content) else "frame"
        return [{clock: key, "": content[key]} for key in sorted(content, key=float)]
    for value in content.values():
        found = _frames(value, labels)
        if any(shapes_of_column(name) for frame in found[:100] for row in _faces(frame, labels) for name in row):
            clocks = {key: each for key, each in lists.items()
                      if plain_name(key) in TIMES | THOUSANDTHS | FRAMES and len(each) == len(found)}  # fmt: skip
            return [{"": frame, **{key: each[i] for key, each in clocks.items()}} for i, frame in enumerate(found)]
    return [content]


def _faces(item: Any, labels: list[str]) -> list[dict[str, Any]]:
    """Return the weights, times and matrices in an item of JSON, from whatever depth, by name: a row for each face."""
    if isinstance(item, list):
        keys = next((keys for each in item if isinstance(each, dict) and (keys := _pair(tuple(each)))), None)
        if keys:
            name, value = keys
            return [
                {each[name]: each[value] for each in item if isinstance(each, dict) and name in each and value in each}
            ]
        if labels and len(item) == len(labels) and isinstance(item[0], int | float):
            return [dict(zip(labels, item, strict=True))]
        rows = [row for each in item if isinstance(each, list | dict) for row in _faces(each, labels)]
        return [row for row in rows if any(map(shapes_of_column, row))]
    shared, faces, matrices = dict[str, Any](), list[dict[str, Any]](), list[Any]()
    for key, value in item.items() if isinstance(item, dict) else ():
        if isinstance(value, int | float) or plain_name(key) in TIMES | FRAMES:
            shared[key] = value
        elif plain_name(key) == MATRICES:
            matrices = [_matrix(each) for each in value or ()]
        elif len(found := _faces(value, labels)) == 1:
            shared |= found[0]
        else:
            faces = faces or found
    rows = [shared | {"face_id": number} | face for number, face in enumerate(faces)] or [shared]
    return [row | {MATRICES: matrix} for row, matrix in zip(rows, matrices, strict=False)] + rows[len(matrices) :]


@cache
def _pair(keys: tuple[str, ...]) -> tuple[str, str] | None:
    """Return which keys of an object are those of a name and of its value."""
    of_names = ("name", "categoryname", "key", "shape", "blendshape", "id")
    of_values = ("value", "score", "weight", "val")
    names, values = ([key for key in keys if plain_name(key) in known] for known in (of_names, of_values))
    return (names[-1], values[0]) if names and values else None


def _matrix(matrix: Any) -> Any:
    """Return the turn (3, 3) of a matrix: 16 numbers by columns in a browser, four rows of four in Python."""
    by_columns = isinstance(matrix, dict)
    numbers = np.array(matrix["data"] if by_columns else matrix, float).reshape(4, 4)
    return (numbers.T if by_columns else numbers)[:3, :3]


def yaw_pitch_roll(matrices: Array) -> Array:
    """Return the turns (f, 3) of a head to its left, upwards and to its right shoulder, radians, of matrices (f, 3, 3)
    in axes [left, up, forward]; NaN for what is no rotation.

    Examples
    --------
    >>> yaw_pitch_roll(np.eye(3)[None]).tolist()
    [[0.0, -0.0, 0.0]]
    """
    turns = np.full((len(matrices), 3), np.nan)
    real = np.isfinite(matrices).all(axis=(1, 2)) & (np.linalg.det(np.nan_to_num(matrices)) > 1e-9)
    if real.any():
        turns[real] = Rotation.from_matrix(matrices[real]).as_euler("YXZ") * [1.0, -1.0, 1.0]
    return turns
