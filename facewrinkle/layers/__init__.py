"""What is laid on the moving surface."""

from . import profile

__all__ = ["profile"]
