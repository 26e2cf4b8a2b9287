"""The loop: a motion moves the base mesh, refinement gives the layers triangles, layers displace, a frame comes out."""

from ..layers.base import FINEST
from .loop import Simulation
from .refinement import PRINTED, Refinement

__all__ = ["FINEST", "PRINTED", "Refinement", "Simulation"]
