"""``facewrinkle blender``: the extension for Blender, as a file to install."""

from __future__ import annotations

import zipfile
from pathlib import Path

from ..files import output_file, written
from .options import Report

EXTENSION = Path(__file__).parents[1] / "rigging" / "data" / "blender"


def blender(path: Path = Path("facewrinkle-blender.zip"), /, *, quiet: bool = False) -> None:
    """Write the extension for Blender 4.2 or newer: shape keys and wrinkles on your own head.

    Drag the file into Blender's window; in its preferences, name the Python that has facewrinkle.

    Parameters
    ----------
    path
        The file to write, .zip.
    quiet
        Print only errors.
    """
    with (
        written(output_file(path, [".zip"])) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as whole,
    ):
        for file in [*sorted(EXTENSION.glob("*.*")), EXTENSION / "LICENSE"]:
            whole.write(file, file.name)
    Report(quiet).say(str(path))
