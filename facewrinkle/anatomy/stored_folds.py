"""The built-in head in full motion, and the lines of its wave folds: found in seconds, they come with the package."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from .atlas import Atlas
from .head import load_head

OF_HEAD = Path(__file__).parent / "data" / "folds.npz"
"""The file, which ``python -m tools.build_folds`` makes anew."""

KEY, SHAPE, LINES = "key", "shape: ", "lines: "
"""The array that tells of what atlas the others are, and beginnings of their names."""

STEP = 1e-5
"""Moves are stored as whole multiples of this, mm."""

Shapes = Mapping[str, Array]
Lines = Mapping[str, npt.NDArray[Any]]


def stored_folds(atlas: Atlas) -> tuple[Shapes, Lines] | None:
    """Return the stored shapes (n0, 3) of the mean head, mm, by action unit, and the arrays of its lines.

    None if its skin moves otherwise with the muscles of an atlas.

    Examples
    --------
    >>> from facewrinkle.anatomy.atlas import load_atlas, printed_atlas
    >>> shapes, lines = stored_folds(load_atlas())
    >>> list(shapes)[:3], lines["names"].tolist()[:2], stored_folds(printed_atlas())
    (['AU1', 'AU2', 'AU4'], ['forehead', 'brows'], None)
    """
    stored = _read()
    if str(stored.get(KEY)) != _digest(atlas):
        return None
    shapes = {name.removeprefix(SHAPE): _shape(moves) for name, moves in stored.items() if name.startswith(SHAPE)}
    return shapes, {name.removeprefix(LINES): values for name, values in stored.items() if name.startswith(LINES)}


def store_folds(path: Path, atlas: Atlas, shapes: Shapes, lines: Callable[[Shapes], Lines]) -> None:
    """Store the shapes of the mean head with the muscles of an atlas, and the lines of these, rounded, shapes."""
    moves = {name: np.rint((at - load_head().points) / STEP).astype(np.int32) for name, at in shapes.items()}
    found = lines({name: _shape(whole) for name, whole in moves.items()})
    arrays = {SHAPE + name: whole for name, whole in moves.items()} | {LINES + name: a for name, a in found.items()}
    np.savez_compressed(path, **{KEY: np.array(_digest(atlas)), **arrays})  # type: ignore[arg-type]


def _shape(moves: npt.NDArray[np.int32]) -> Array:
    return load_head().points + STEP * moves


def _digest(atlas: Atlas) -> str:
    """A digest of what skin, muscles and action units of a face take from an atlas."""
    return hashlib.sha256(repr((atlas.muscles, atlas.action_units, atlas.tissue)).encode()).hexdigest()


@cache
def _read() -> dict[str, npt.NDArray[Any]]:
    """The stored arrays; none before they are built."""
    if not OF_HEAD.exists():
        return {}
    with np.load(OF_HEAD, allow_pickle=False) as stored:
        return dict(stored)
