"""Files of takes as tables of numbers: columns of text files, and the frames of JSON."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..array_types import Array
from ..errors import ParameterError
from ..motion.action_units import sided
from .shapes import ARKIT, SETS

OPENFACE_MOST = 5.0
"""Intensity of an action unit of OpenFace (columns such as AU12_r) that is a weight of 1."""

SECONDS = {"time", "times", "t", "s", "sec", "seconds", "timestamp", "timestampms", "timems", "ms", "timesec"}
"""Plain names of columns with times; the unit follows from the steps, which last less than a second."""

HEAD = ("headyaw", "headpitch", "headroll")
"""Plain names of columns with the turn of the head, in radians."""

SILENT = {"blendshapecount", "neutral", "frame", "faceid", "confidence", "success"} | {
    f"{side}eye{turn}" for side in ("left", "right") for turn in ("yaw", "pitch", "roll")
}
"""Plain names of columns that are not needed: eyes turn by eyeLookInLeft and so on."""

_ACTION_UNIT = re.compile(r"au0*(\d+)(r?)")


class Table(NamedTuple):
    """The content of a file: values (f, c) of columns, NaN where there is none, and time codes or times of the rows."""

    names: list[str]
    values: Array
    times: Sequence[str] | None
    head: Array | None


def of_table(path: Path, text: str) -> Table:
    """Return the table of a text file, whose first row names the columns."""
    lines = [line for line in text.splitlines() if line.strip()]
    if not lines:
        raise ParameterError(f"{path.name} is empty. A table needs a row with the names of its columns.")
    separator = max(",;\t", key=lines[0].count)
    header, *rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=separator)]
    while header and not header[-1]:  # a separator at the end of the row
        header.pop()
    if not rows:
        raise ParameterError(f"{path.name} has no frames: there is nothing below the names of its columns.")
    rows = [_row(row, len(header), f"{path.name}: row {number}") for number, row in enumerate(rows, start=2)]
    plain = [plain_name(name) for name in header]
    when = next((k for k, name in enumerate(plain) if name == "timecode" or name in SECONDS), None)
    values = np.array(
        [[np.nan if k == when else _number(row[k], path.name, header[k]) for k in range(len(header))] for row in rows]
    )
    return Table(header, values, None if when is None else [row[when] for row in rows], None)


def _row(row: list[str], count: int, where: str) -> list[str]:
    """Return the cells of a row, as many as there are columns; a frame without a face may end after its time."""
    found = row[:count] if not any(row[count:]) else row
    if len(found) <= 2:
        found = found + [""] * (count - len(found))
    if len(found) != count:
        raise ParameterError(f"{where} has {len(found)} columns, the first row has {count}. Export the file again.")
    return found


def _number(cell: str, file: str, column: str) -> float:
    try:
        return float(cell.replace(",", ".")) if cell else np.nan
    except ValueError:
        if _is_needed(column):
            raise ParameterError(f"{file}: the column {column} must hold numbers, received {cell[:40]!r}.") from None
        return np.nan


def _is_needed(column: str) -> bool:
    return bool(shapes_of_column(column)[0]) or plain_name(column) in HEAD


def of_json(path: Path, text: str) -> Table:
    """Return the frames of a JSON file as a table."""
    try:
        content = json.loads(text)
    except ValueError as problem:
        raise ParameterError(f"{path.name} is no JSON: {problem}.") from None
    frames = _frames(content)
    if not frames:
        raise ParameterError(
            f"{path.name} has no frames. Needed is a list of them, each with weights by name or with the categories of "
            "MediaPipe's blend shapes."
        )
    found = [_weights(frame) for frame in frames]
    names = list(dict.fromkeys(name for weights in found for name in weights))
    values = np.array([[weights.get(name, np.nan) for name in names] for weights in found]).reshape(len(found), -1)
    seen = ~np.isnan(values).all(axis=1) if len(names) else np.zeros(len(found), bool)
    values[seen] = np.nan_to_num(values[seen])  # a frame that names some shapes has none of the others
    keys = {key for key in frames[0] if plain_name(key) in SECONDS}
    times = [str(frame[min(keys)]) for frame in frames] if keys and all(min(keys) in f for f in frames) else None
    turns = [_turn(frame) for frame in frames]
    head = None if all(turn is None for turn in turns) else np.array([[np.nan] * 3 if t is None else t for t in turns])
    return Table(names, values, times, head)


def _frames(content: Any) -> list[Mapping[str, Any]]:
    """Return the frames of the content of a JSON file."""
    if isinstance(content, Mapping):
        columns = {key: value for key, value in content.items() if isinstance(value, list)}
        if columns and all(isinstance(x, int | float) for values in columns.values() for x in values):
            if len({len(values) for values in columns.values()}) > 1:
                raise ParameterError("all shapes of a JSON file need the same number of weights.")
            return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        frames = [v for k, v in columns.items() if v and isinstance(v[0], Mapping | list) and not _is_one(str(k))]
        content = frames[0] if frames else [content]
    if isinstance(content, list) and content and isinstance(content[0], list):  # lists of categories
        content = [{"categories": frame} for frame in content]
    if isinstance(content, list) and content and _is_category(content[0]):
        content = [{"categories": content}]
    return [frame for frame in content if isinstance(frame, Mapping)] if isinstance(content, list) else []


def _is_one(key: str) -> bool:
    """Return True for keys of a single frame of MediaPipe, whose lists hold faces or categories."""
    return plain_name(key).startswith(("faceblendshapes", "blendshapes", "categories", "facial", "facelandmarks"))


def _is_category(item: Any) -> bool:
    return isinstance(item, Mapping) and bool({"categoryName", "category_name"} & item.keys())


def _categories(item: Any) -> list[Mapping[str, Any]] | None:
    """Return the first list of categories within a frame."""
    if isinstance(item, list) and item and _is_category(item[0]):
        return item
    for inner in item.values() if isinstance(item, Mapping) else item if isinstance(item, list) else ():
        if isinstance(inner, Mapping | list) and (found := _categories(inner)) is not None:
            return found
    return None


def _weights(frame: Mapping[str, Any]) -> dict[str, float]:
    categories = _categories(frame)
    if categories is not None:
        return {str(c.get("categoryName", c.get("category_name"))): float(c["score"]) for c in categories}
    inner = next((v for k, v in frame.items() if isinstance(v, Mapping) and plain_name(k) != "head"), frame)
    return {
        str(name): float(value)
        for name, value in inner.items()
        if isinstance(value, int | float) and plain_name(str(name)) not in SECONDS
    }


def _turn(frame: Mapping[str, Any]) -> Array | None:
    """Return yaw, pitch and roll of the first matrix of a frame: 16 numbers by columns, or rows of 4."""
    key = next((k for k in frame if plain_name(str(k)).startswith("facialtransformationmatri")), None)
    found = frame[key] if key is not None else None
    while isinstance(found, Mapping | list) and found:
        if isinstance(found, Mapping):
            found = found.get("data", found.get("packedData"))
            continue
        if len(found) == 16 and isinstance(found[0], int | float):
            return _angles(np.array(found, float).reshape(4, 4).T)
        if len(found) == 4 and isinstance(found[0], list) and len(found[0]) == 4:
            return _angles(np.array(found, float))
        found = found[0]
    return None


def _angles(matrix: Array) -> Array | None:
    if not np.isfinite(matrix).all() or np.linalg.det(matrix[:3, :3]) < 1e-9:
        return None
    yaw, down, roll = Rotation.from_matrix(matrix[:3, :3]).as_euler("YXZ")
    return np.array([yaw, -down, roll])


def is_number(text: str) -> bool:
    """Return True for a number, also one with a decimal comma.

    Examples
    --------
    >>> is_number("0,5"), is_number("half")
    (True, False)
    """
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def plain_name(name: str) -> str:
    """Return a name without case and punctuation.

    Examples
    --------
    >>> plain_name("Eye_Blink Left")
    'eyeblinkleft'
    """
    return re.sub(r"[\W_]", "", name).lower()


_SHAPES = {plain_name(name): name for shapes in SETS.values() for name in shapes}


def shapes_of_column(column: str) -> tuple[list[str], float]:
    """Return the shapes that a column names, and the value that is a weight of 1.

    Examples
    --------
    >>> shapes_of_column("EyeBlink_L"), shapes_of_column("mouthFrown")
    ((['eyeBlinkLeft'], 1.0), (['mouthFrownLeft', 'mouthFrownRight'], 1.0))
    >>> shapes_of_column("AU06_r"), shapes_of_column("hair")
    ((['AU6'], 5.0), ([], 1.0))
    """
    plain = plain_name(column)
    if plain in _SHAPES:
        return [_SHAPES[plain]], 1.0
    if unit := _ACTION_UNIT.fullmatch(plain):
        return [f"AU{unit[1]}"], OPENFACE_MOST if unit[2] else 1.0
    stem, side = sided(column)
    words = {"l": ["Left"], "r": ["Right"], None: ["", "Left", "Right"]}[side]
    return [f"{stem}{word}" for word in words if f"{stem}{word}" in ARKIT], 1.0
