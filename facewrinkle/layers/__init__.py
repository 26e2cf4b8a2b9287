"""What is laid on the moving surface."""

from ..geometry import profile

__all__ = ["profile"]
