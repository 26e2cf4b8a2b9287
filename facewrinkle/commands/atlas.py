"""``facewrinkle atlas``: the muscles, action units and expressions of the package, as a file to edit."""

from __future__ import annotations

import sys
from pathlib import Path

from ..anatomy.atlas import DEFAULT_ATLAS
from ..files import output_file, written
from . import loading


def atlas(*, out: Path | None = None) -> None:
    """Print the atlas: muscles, action units and expressions, to be changed and given back with --atlas.

    A file with only the entries that you change or add is enough, if its first line is: base = "facewrinkle"

    Parameters
    ----------
    out
        TOML file to write to. Default: print it.
    """
    text = DEFAULT_ATLAS.read_text(encoding="utf-8")
    if out is None:
        loading.end()
        sys.stdout.write(text)
        return
    with written(output_file(out, (".toml",))) as whole:
        whole.write_text(text, encoding="utf-8")
