"""What is laid on the moving surface."""

from ..geometry import profile
from . import patterns

__all__ = ["patterns", "profile"]
