"""A page that shows a rig: one HTML file with the model in it, which any browser opens without a server."""

from __future__ import annotations

import base64
import gzip
import html
import json
from importlib.resources import files
from pathlib import Path

from ..files import output_file, written
from .linear_rig import Rig
from .write import rig_bytes

SUFFIXES = (".html",)

VIEWER = "viewer.html"
"""The page without a model: a reader of our own files, and the sliders."""


def write_page(rig: Rig, path: str | Path, title: str = "") -> Path:
    """Write a page with sliders for the shapes of a rig. It needs no server and loads nothing from elsewhere.

    Parameters
    ----------
    rig : Rig
    path : path
        Ends in .html. An existing file is replaced.
    title : str
        Default: the name of the file.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import tempfile
    >>> made = fw.rig(fw.default_face(), shapes="jawOpen", level=0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     text = write_page(made, f"{folder}/head.html").read_text()
    >>> "http" in text.replace("http://www.w3.org", "")
    False
    """
    path = output_file(path, SUFFIXES)
    page = (files(__package__) / "data" / VIEWER).read_text(encoding="utf-8")
    model = base64.b64encode(gzip.compress(rig_bytes(rig, binary=True), mtime=0)).decode()
    page = page.replace("{{title}}", html.escape(title or path.stem)).replace("{{model}}", json.dumps(model))
    with written(path) as whole:
        whole.write_text(page, encoding="utf-8")
    return path
