"""Triangle meshes as plain arrays; knows nothing of faces and does not import VTK."""

from . import least_squares, normals, refinement, seams, topology, transfer

__all__ = ["least_squares", "normals", "refinement", "seams", "topology", "transfer"]
