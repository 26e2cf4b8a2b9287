"""Which image lies on what: materials of OBJ files, and images by the names that other files give them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

_OPTION = re.compile(
    r"-(?:(?:o|s|t)(?:\s+[-+.\deE]+){1,3}|mm(?:\s+\S+){2}|(?:blendu|blendv|cc|clamp|texres|imfchan|boost|bm)\s+\S+)\s+"
)


def beside(folder: Path, name: str) -> Path | None:
    """A file by the name that another one gives it: with the folders of another machine, or in another case."""
    name = name.replace("\\", "/")
    for candidate in (folder / name, folder / Path(name).name):
        try:
            if candidate.is_file():
                return candidate
        except (OSError, ValueError):  # a name that no file can have
            continue
    wanted = Path(name).name.casefold()
    return next((file for file in sorted(folder.iterdir()) if file.name.casefold() == wanted), None)


def images_of_materials(folder: Path, libraries: Iterable[str]) -> dict[str, str]:
    """The names of the images (`map_Kd`) of the materials in MTL files of a folder; missing files have none."""
    images: dict[str, str] = {}
    for library in libraries:
        found = beside(folder, library)
        current = ""
        for line in () if found is None else found.read_text(encoding="utf-8", errors="replace").splitlines():
            word, _, rest = line.strip().partition(" ")
            if word == "newmtl":
                current = rest.strip()
            elif word == "map_Kd" and (name := _OPTION.sub("", rest.strip() + " ").strip()):
                images[current] = name
    return images
