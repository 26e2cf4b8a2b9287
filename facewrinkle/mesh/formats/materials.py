"""Materials of OBJ files, and colours as glTF and USD store them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...array_types import Array
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


def image_place(folder: Path, name: str) -> str:
    """The path of an image by the name that another file gives it, "" with a warning if it may not be read."""
    try:
        return name and str((sibling_file(folder, name) or folder / Path(name).name).absolute())
    except MeshError as problem:
        warn(f"the texture is left out: {problem}")
        return ""


def srgb(light: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Colours in sRGB of linear light (n, 3) or (n, 4), as glTF and USD store it."""
    linear = np.clip(light[:, :3].astype(np.float64), 0.0, 1.0)
    share = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return np.asarray(np.rint(255.0 * share), dtype=np.uint8)


def linear_light(colours: npt.NDArray[np.uint8]) -> Array:
    """Linear light (n, 3), from 0 to 1, of colours in sRGB: the inverse of :func:`srgb`.

    Examples
    --------
    >>> greys = np.arange(256, dtype=np.uint8)[:, None].repeat(3, axis=1)
    >>> bool((srgb(linear_light(greys)) == greys).all())
    True
    """
    share = colours / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


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
