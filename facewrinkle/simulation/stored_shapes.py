"""Shapes of the built-in head in full motion, and its lines, stored with it.

Nothing is simulated, or compiled, to find them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..anatomy.head import load_head
from ..array_types import Array
from ..mesh.keeping import digest

FILE = Path(__file__).parent / "data" / "shapes.npz"
"""The file, which ``python -m tools.build_shapes`` makes anew."""

KEY = "key"
"""Array of the file with the digest of the face and the skin that the shapes are of."""

LINES = "lines: "
"""Beginning of the names of arrays of the lines, which were found from the shapes as they are stored."""

STEP = 1e-5
"""Moves are stored as whole multiples of this, mm."""

DECIMALS = 6
"""Digits after the point that a face must have in common with the one that was stored; other computers round the
last digits otherwise.
"""


def stored_shapes(face: Face, inputs: object) -> tuple[dict[str, Array], dict[str, npt.NDArray[Any]]] | None:
    """Return positions (n0, 3), mm, by action unit, and the arrays of the lines that are found from all of these.

    None if it is not those of this face that are stored.

    Parameters
    ----------
    face : Face
    inputs : object
        All that the shapes depend on; see :func:`.keeping.kept`.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> stored_shapes(fw.surface(fw.default_face().mesh), "something else") is None
    True
    """
    if not np.array_equal(face.points, load_head().points) or not FILE.exists():
        return None
    with np.load(FILE, allow_pickle=False) as stored:
        if str(stored[KEY]) != digest(inputs, DECIMALS):
            return None
        arrays = {name: stored[name] for name in stored.files if name != KEY}
    lines = {name.removeprefix(LINES): arrays.pop(name) for name in list(arrays) if name.startswith(LINES)}
    return {name: face.points + STEP * moves for name, moves in arrays.items()}, lines


def packed(
    face: Face,
    inputs: object,
    shapes: Mapping[str, Array],
    lines: Callable[[dict[str, Array]], Mapping[str, npt.NDArray[Any]]],
) -> dict[str, npt.NDArray[Any]]:
    """Return shapes as they are stored, and the lines that are found from these."""
    moves = {name: np.rint((shape - face.points) / STEP).astype(np.int32) for name, shape in shapes.items()}
    found = lines({name: face.points + STEP * move for name, move in moves.items()})
    return {KEY: np.array(digest(inputs, DECIMALS)), **moves, **{LINES + name: own for name, own in found.items()}}
