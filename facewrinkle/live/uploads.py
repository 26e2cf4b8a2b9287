"""Files that a page sends: checked names and sizes, into a folder that was made for them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from aiohttp import BodyPartReader, web

from ..errors import ParameterError
from .library import COMPANIONS, MESHES

LARGEST_UPLOAD = 256 * 2**20
"""Bytes of all files that are sent together."""

MOST_FILES = 32

NAME = re.compile(r"[\w][\w .()+,=-]{0,99}")
"""Names of files that are taken: no folders, and nothing hidden."""


def checked_name(name: Any) -> str:
    """Return the name of a file, if it is one that is taken.

    Examples
    --------
    >>> checked_name("my head.obj")
    'my head.obj'
    >>> checked_name("../head.obj")
    Traceback (most recent call last):
    facewrinkle.errors.ParameterError: a file may not be called '../head.obj': letters, digits, spaces and ._-+,=() ...
    """
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise ParameterError(
            f"a file may not be called {str(name)[:120]!r}: letters, digits, spaces and ._-+,=() are allowed."
        )
    endings = (*MESHES, ".face", *COMPANIONS)
    if not name.lower().endswith(endings):
        raise ParameterError(f"{name!r} is no file that the studio reads; these are: {', '.join(endings)}.")
    return name


async def received(request: web.Request, folder: Path) -> list[str]:
    """Write the files of a request into a folder, and return their names.

    Raises
    ------
    ParameterError
        For names that are not taken, and for too many or too large files.
    """
    if not request.content_type.startswith("multipart/"):
        raise ParameterError("files are sent as a form with several parts.")
    names: list[str] = []
    size = 0
    async for part in await request.multipart():
        if not isinstance(part, BodyPartReader) or part.filename is None:
            raise ParameterError("the form may hold files only.")
        name = checked_name(part.filename)
        if name in names or len(names) >= MOST_FILES:
            raise ParameterError(f"at most {MOST_FILES} files of different names are taken.")
        names.append(name)
        with (folder / name).open("xb") as file:
            while chunk := await part.read_chunk(2**16):
                size += len(chunk)
                if size > LARGEST_UPLOAD:
                    raise ParameterError(f"the files are too large; {LARGEST_UPLOAD // 2**20} MB are allowed.")
                file.write(chunk)
    if not names:
        raise ParameterError("no file was sent.")
    return names
