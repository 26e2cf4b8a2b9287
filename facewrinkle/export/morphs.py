"""Blend shapes of a mesh as morph targets of glTF, and the animation of their weights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..array_types import Single


@dataclass(frozen=True, eq=False)
class Morphs:
    """Blend shapes of one mesh.

    Attributes
    ----------
    names : sequence of str
        Names of the k shapes.
    deltas, normals : ndarray of float32, shape (k, n, 3)
        What is added to points and normals at weight 1.
    drivers : mapping of str to sequence of str
        Shapes whose weight is the product of the weights of others; written beside the names, for programs that ask.

    Examples
    --------
    One shape that moves one of three points:

    >>> deltas = np.zeros((1, 3, 3), np.float32)
    >>> deltas[0, 2] = [0.0, 1.0, 0.0]
    >>> morphs = Morphs(["up"], deltas, np.zeros_like(deltas))
    """

    names: Sequence[str]
    deltas: Single
    normals: Single
    drivers: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class WeightTrack:
    """Weights of shapes over time.

    Attributes
    ----------
    times : ndarray, shape (f,)
        Seconds, rising.
    weights : ndarray, shape (f, k)
    name : str
    """

    times: npt.NDArray[np.float64]
    weights: npt.NDArray[np.float64]
    name: str = "animation"
