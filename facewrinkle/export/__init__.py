"""Frames and pictures as files: the mesh of one frame, a time series, a movie; and the folder they go to.

Names are loaded when they are first used: a process that only writes a time series starts sooner.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..files import output_folder
    from .meshes import write_mesh
    from .movies import movie_writer, write_movie
    from .series import write_series

__all__ = ["movie_writer", "output_folder", "write_mesh", "write_movie", "write_series"]

_HOME = {
    "movie_writer": ".movies",
    "output_folder": "..files",
    "write_mesh": ".meshes",
    "write_movie": ".movies",
    "write_series": ".series",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_HOME[name], __name__), name)
    return value
