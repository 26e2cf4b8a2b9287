"""Frames and pictures as files: the mesh of one frame, a time series, a movie; and the folder they go to."""

from ..files import output_folder
from .meshes import write_mesh
from .movies import movie_writer, write_movie
from .series import write_series

__all__ = ["movie_writer", "output_folder", "write_mesh", "write_movie", "write_series"]
