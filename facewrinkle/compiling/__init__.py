"""Compiling what is needed at the first use of an installation, in all cores: beside a command, or ahead of all."""

from .ahead import compile_ahead

__all__ = ["compile_ahead"]
