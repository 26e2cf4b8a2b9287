"""The session in the folder of a studio: saved by itself, and offered again at the next start."""

from __future__ import annotations

import contextlib
import os
import time

from ..errors import OutputError
from .document import Document
from .saving import Folder

NAME = "session.json"

LARGEST = 2**22
"""Bytes of a session that is read."""


class Kept:
    """The session that is saved by itself.

    Parameters
    ----------
    folder : Folder

    Attributes
    ----------
    when : str
        Day and time of the session that was found at the start; "" if there was none, or it was resumed or dismissed.
    """

    def __init__(self, folder: Folder) -> None:
        self._folder, self._seen = folder, -1
        self.when, self._text, self._in_the_way = "", "", False
        path = None if folder.path is None else folder.path / NAME
        if path is not None and path.is_file():
            self._in_the_way = True
            with contextlib.suppress(OSError, UnicodeDecodeError):
                if path.stat().st_size <= LARGEST:
                    self._text = path.read_text(encoding="utf-8")
                    self.when = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))

    def resume(self, document: Document) -> None:
        """Take over the session that was found, as a step that can be undone.

        Raises
        ------
        ParameterError
            If it is no session, or needs a face that is not open.
        """
        if self.when:
            document.load(self._text)
            self.when, self._in_the_way = "", False

    def dismiss(self) -> None:
        """Leave the session that was found; it is kept under another name."""
        self.when = ""

    def keep(self, document: Document) -> None:
        """Save the session if it was changed. A file of an earlier start that was not resumed gets another name."""
        if self._folder.path is None or self._seen == document.version:
            return
        if self._seen < 0:  # nothing is set yet
            self._seen = document.version
            return
        with contextlib.suppress(OutputError):  # tried again the next time
            if self._in_the_way and os.path.lexists(self._folder.path / NAME):  # it may have been moved since
                self._folder.set_aside(NAME)
            self._in_the_way = False
            self._folder.write(NAME, document.text().encode(), anew=False)
            self._seen = document.version
