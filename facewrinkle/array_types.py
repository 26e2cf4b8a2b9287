"""Types of arrays, for annotations."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Single = npt.NDArray[np.float32]
IntArray = npt.NDArray[Any]
"""Integers of any size: type checkers take none of them for another."""
BoolArray = npt.NDArray[np.bool_]
Image = npt.NDArray[np.uint8]
