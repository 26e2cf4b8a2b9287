"""``facewrinkle blender``: the extension for Blender, as a file to install."""

from __future__ import annotations

from pathlib import Path

from ..rigging.write import write_extension
from .options import Report


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
    Report(quiet).say(str(write_extension(path)))
