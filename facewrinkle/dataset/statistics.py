"""Statistics of a set: sums over pictures, which a shard keeps and which add up, whoever made them and in any order."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..errors import OutputError
from ..files import opened
from .labels import PARTS
from .sample import Sample

LARGEST = 128
"""Width and height of the mean picture, pixels, at most."""

Sums = dict[str, npt.NDArray[Any]]


def sums_of(sample: Sample) -> Sums:
    """Return the sums of one picture.

    Returns
    -------
    dict of str to ndarray of uint64
        ``pictures``, 1; ``pixels`` of each part (len(PARTS),); ``colors`` and ``squares``, the sums of red, green and
        blue over the pixels, and of their squares (3,); ``small`` and ``small_squares``, the picture reduced to
        :data:`LARGEST`, and its square (h, w, 3).

    Examples
    --------
    >>> sample = Sample(0, np.full((4, 4, 3), 10, np.uint8), {"part": np.ones((4, 4), np.uint8)}, {})
    >>> sums = added(sums_of(sample), sums_of(sample))
    >>> sums["pictures"].tolist(), sums["pixels"][:3].tolist(), sums["squares"].tolist(), sums["small"].shape
    (2, [0, 32, 0], [3200, 3200, 3200], (4, 4, 3))
    """
    from PIL import Image as Pillow

    reduced = Pillow.fromarray(sample.image)
    reduced.thumbnail((LARGEST, LARGEST), Pillow.Resampling.BOX)
    small, colors = np.array(reduced, np.uint64), sample.image.reshape(-1, 3).astype(np.uint64)
    return {
        "pictures": np.array(1, np.uint64),
        "pixels": np.bincount(sample.labels["part"].ravel(), minlength=len(PARTS)).astype(np.uint64),
        "colors": colors.sum(axis=0),
        "squares": (colors**2).sum(axis=0),
        "small": small,
        "small_squares": small**2,
    }


def added(one: Sums, other: Sums) -> Sums:
    """Return the sums of the pictures of both; those of none are an empty dictionary."""
    return {name: np.add(one.get(name, 0), other.get(name, 0), dtype=np.uint64) for name in one | other}


def sums_in(folder: Path) -> Sums:
    """Return the sums of all shards of a set."""
    sums: Sums = {}
    for path in sorted((folder / "statistics").glob("shard-*.npz")):
        try:
            with opened(path, kept=False) as file, np.load(file) as stored:
                sums = added(sums, dict(stored))
        except (OSError, ValueError, BadZipFile):
            raise OutputError(
                f"{path.name} is damaged. Remove it, and run again: the shard {path.stem} will be made again."
            ) from None
    return sums


def mean_and_deviation(count: npt.ArrayLike, total: npt.NDArray[Any], squares: npt.NDArray[Any]) -> tuple[Array, Array]:
    """Return the mean and the standard deviation of numbers, from their sum and the sum of their squares.

    Examples
    --------
    >>> mean_and_deviation(np.array(2), np.array([4, 10]), np.array([16, 52]))
    (array([2., 5.]), array([2., 1.]))
    """
    mean = total / np.maximum(count, 1)
    return mean, np.sqrt(np.maximum(squares / np.maximum(count, 1) - mean**2, 0.0))
