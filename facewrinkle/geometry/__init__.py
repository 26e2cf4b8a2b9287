"""Algorithms on triangle meshes as plain arrays, without faces and without VTK."""

from . import interpolation, least_squares, normals, refinement, topology

__all__ = ["interpolation", "least_squares", "normals", "refinement", "topology"]
