"""Folds as waves: lines found once per face where its motions compress the skin, as deep as it is compressed now."""

from .families import GROUPS, FoldShapes
from .layer import WaveFolds

__all__ = ["GROUPS", "FoldShapes", "WaveFolds"]
