"""Layers that displace the moving surface: wrinkles that muscles fold, and patterns."""

from . import patterns

__all__ = ["patterns"]
