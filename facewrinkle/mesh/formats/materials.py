"""Materials of OBJ files."""

from __future__ import annotations

import re
from collections.abc import Iterable
from io import StringIO
from pathlib import Path

from ...errors import MeshError, warn
from ...files import sibling_file, text_of

LIBRARIES = 64
"""The most material libraries of one line that are looked for."""

_COMMENT = re.compile(r"(?:^|(?<=\s))#.*", re.DOTALL)
_OPTION = re.compile(
    r"-(?:(?:o|s|t)(?:\s+[-+.\deE]+){1,3}|mm(?:\s+\S+){2}|(?:blendu|blendv|cc|clamp|texres|imfchan|boost|bm)\s+\S+)\s+"
)


def uncommented(line: str) -> str:
    """Return a line without its comment; a number sign within a word is part of a name.

    Examples
    --------
    >>> uncommented("usemtl skin#2 # of the face")
    'usemtl skin#2 '
    """
    return _COMMENT.sub("", line) if "#" in line else line


def _library_files(folder: Path, library: str) -> list[Path | None]:
    """Files of a line `mtllib`: a name with blanks, or several names; None for those that cannot be had."""
    try:
        whole = sibling_file(folder, library)
        return [whole] if whole else [sibling_file(folder, name) for name in dict.fromkeys(library.split()[:LIBRARIES])]
    except MeshError as problem:
        warn(f"materials are left out: {problem}")
        return []


def images_of_materials(folder: Path, libraries: Iterable[str]) -> dict[str, str]:
    """Names of the images (`map_Kd`) of the materials in MTL files of a folder; missing files are ignored."""
    images: dict[str, str] = {}
    for library in dict.fromkeys(libraries):
        for file in dict.fromkeys(_library_files(folder, library)):
            current = ""
            for line in () if file is None else StringIO(text_of(file), newline=None):
                word, *rest = line.strip().split(None, 1) or [""]
                if word == "newmtl":
                    current = " ".join(uncommented(*rest).split()) if rest else ""
                elif word.lower() == "map_kd" and rest and (name := _OPTION.sub("", rest[0] + " ").strip(' "')):
                    images[current] = name
    return images
