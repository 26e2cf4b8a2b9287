"""Triangle meshes as plain arrays; knows nothing of faces and does not import VTK."""

from . import normals, refinement, topology, transfer

__all__ = ["normals", "refinement", "topology", "transfer"]
