"""What wave folds find from a face in seconds, and what is stored with it: its shapes in full motion, and its lines."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from .atlas import Atlas
from .face import FOLDS, Face, per_face

VERSION = 6
"""Another number where skin rests at other places, or lines are found otherwise: what was stored is then found anew."""

OF_HEAD = Path(__file__).parent / "data" / "folds.npz"
"""The file of the built-in head, which ``python -m tools.build_folds`` makes anew."""

KEY, SHAPE, LINES = "key", "shape: ", "lines: "
"""The array that tells of what atlas the others are, and beginnings of their names."""

COLUMNS = ("compression", "wave", "phase", "share", "level")
"""What is stored of the lines of each family: at the face's points, and at those of its zone, split `level` times."""

STEP = 1e-5
"""Moves are stored as whole multiples of this, mm."""


@dataclass(eq=False)
class KnownFolds:
    """Shapes of a face in full motion, and the lines of wave folds that are found from them; empty until they are.

    Attributes
    ----------
    shapes : mapping of str to ndarray, shape (n, 3)
        Positions, mm, of skin of the default material that has come to rest, by action unit.
    lines : mapping of str to ndarray
        Arrays of the lines of the default density and style.
    """

    shapes: Mapping[str, Array] = field(default_factory=dict)
    lines: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)


def known_folds(face: Face) -> KnownFolds:
    """Return what is known of the folds of a face: whoever finds them puts them there.

    Examples
    --------
    The built-in head comes with its own:

    >>> import facewrinkle as fw
    >>> head = fw.default_face()
    >>> known_folds(head).shapes["AU1"].shape == head.points.shape
    True
    >>> known_folds(head.with_muscles({})).shapes
    {}
    """
    return per_face(face, FOLDS, None, KnownFolds)


def to_store(face: Face) -> dict[str, npt.NDArray[Any]]:
    """Return what is known of the folds of a face, as arrays of a file; none if its muscles are not those of its atlas,
    which a face that is read has.
    """
    known = known_folds(face)
    if not known.shapes or face.changed_muscles:
        return {}
    rest = face.points_mm
    moves = {SHAPE + name: np.rint((at - rest) / STEP).astype(np.int32) for name, at in known.shapes.items()}
    lines = {LINES + name: values for name, values in known.lines.items()}
    return {KEY: np.array(atlas_key(face.atlas)), **moves, **lines}


def restore(face: Face, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    """Let a face know what :func:`to_store` returned, unless that was found by another atlas, in another way, or is
    damaged: it is found anew then.
    """
    if KEY not in arrays or str(arrays[KEY]) != atlas_key(face.atlas):
        return
    known, rest = known_folds(face), face.points_mm
    moves = {name: values for name, values in arrays.items() if name.startswith(SHAPE)}
    lines = {name: values for name, values in arrays.items() if name.startswith(LINES)}
    of_points = all(values.shape == rest.shape and values.dtype.kind == "i" for values in moves.values())
    if not of_points or not face.atlas.action_units.keys() >= {name.removeprefix(SHAPE) for name in moves}:
        return
    if lines and not _are_lines(lines, len(rest)):
        return
    known.shapes = {name.removeprefix(SHAPE): rest + STEP * values for name, values in moves.items()}
    known.lines = {name.removeprefix(LINES): values for name, values in lines.items()}


def _are_lines(arrays: Mapping[str, npt.NDArray[Any]], n: int) -> bool:
    """Tell whether the arrays of the lines of a face of n points are those that are stored."""
    try:
        for k in range(len(arrays[LINES + "names"])):
            compression, wave, phase, share, level = (arrays[f"{LINES}{name} {k}"] for name in COLUMNS)
            finite = all(np.isfinite(values).all() for values in (compression, wave, phase, share))
            alike = compression.shape == (n,) and wave.shape == (*phase.shape, 3) and phase.shape == share.shape
            if not (finite and alike and level >= 0 and 4 ** int(level) <= 4 * len(phase)):
                return False
    except (LookupError, TypeError, ValueError):
        return False
    return True


def atlas_key(atlas: Atlas) -> str:
    """Return a digest of what skin, muscles and action units of a face take from an atlas.

    Examples
    --------
    >>> from facewrinkle.anatomy.atlas import load_atlas
    >>> len(atlas_key(load_atlas()))
    64
    """
    content = VERSION, atlas.muscles, atlas.action_units, atlas.tissue
    return hashlib.sha256(repr(content).encode()).hexdigest()


@cache
def folds_of_head() -> dict[str, npt.NDArray[Any]]:
    """Return the stored arrays of the built-in head; none before they are built."""
    if not OF_HEAD.exists():
        return {}
    with np.load(OF_HEAD, allow_pickle=False) as stored:
        return dict(stored)
