"""The loop: a motion moves the base mesh, refinement gives the layers triangles, layers displace, a frame comes out."""

from .loop import Simulation
from .refinement import FINEST, PRINTED, Refinement

__all__ = ["FINEST", "PRINTED", "Refinement", "Simulation"]
