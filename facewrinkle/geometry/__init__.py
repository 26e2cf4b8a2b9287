"""Triangle meshes as plain arrays; knows nothing of faces and does not import VTK."""

from . import interpolation, least_squares, normals, refinement, seams, topology

__all__ = ["interpolation", "least_squares", "normals", "refinement", "seams", "topology"]
