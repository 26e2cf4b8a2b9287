"""Writing an atlas as TOML, in the form that :func:`facewrinkle.read_atlas` reads."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..errors import ParameterError
from ..files import path_of, written
from .atlas import Atlas

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
    target = path_of(path)
    content = atlas_text(atlas)
    with written(target) as whole:
        whole.write_text(content, encoding="utf-8")
    return target


def atlas_text(atlas: Atlas) -> str:
    """Return an atlas as TOML."""
    lines = []
    for name, entry in _unpaired(atlas.muscles):
        lines += [f"[muscles.{_key(name)}]", *(f"{_key(key)} = {_value(value)}" for key, value in entry.items()), ""]
    for name, title in atlas.action_unit_names.items():
        units = _value(_joined(atlas.action_units[name], atlas.muscles))
        lines += [f"[action_units.{_key(name)}]", f"name = {_value(title)}", f"muscles = {units}", ""]
    lines.append("[expressions]")
    for name in atlas.expressions:
        lines.append(f"{_key(name)} = {_value(_joined(atlas.written(name), atlas.muscles))}")
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
