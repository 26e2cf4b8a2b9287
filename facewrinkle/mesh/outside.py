"""Files that a mesh file names, which must lie in its own folder: a file from elsewhere could fetch any other."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from ..errors import MeshError

_allowed: ContextVar[bool] = ContextVar("outside_allowed", default=False)


@contextmanager
def outside_allowed() -> Iterator[None]:
    """Read files that a mesh file names outside its own folder, such as ``../textures/skin.png``, within a block.

    Examples
    --------
    >>> with outside_allowed():
    ...     is_outside(Path("scans"), Path("/etc/passwd"))
    False
    """
    token = _allowed.set(True)
    try:
        yield
    finally:
        _allowed.reset(token)


def is_outside(folder: Path, file: Path) -> bool:
    """Return True if a file lies neither in a folder nor below it, and is not to be read.

    Links in the folder are its owner's own, and are followed.

    Examples
    --------
    >>> is_outside(Path("scans"), Path("scans/maps/skin.png")), is_outside(Path("scans"), Path("scans/../skin.png"))
    (False, True)
    """
    if _allowed.get():
        return False
    return not Path(os.path.abspath(file)).is_relative_to(os.path.abspath(folder))


def refused(where: str, name: str) -> MeshError:
    """Return the error for a file that is not read as it lies outside."""
    return MeshError(
        f"{where} names the file {name!r}, which is outside its folder and is not read. Put it beside the mesh, or "
        f"allow it if you trust the file: --allow-outside, or facewrinkle.mesh.outside_allowed()."
    )
