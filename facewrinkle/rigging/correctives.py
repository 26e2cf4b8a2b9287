"""Shapes that do not add up: which pairs of them, by how much, and what corrects their sum.

A rig adds displacements, and skin does not: lips that are pursed and open are not pursed lips plus open lips. A
corrective shape is the difference of a pair, to be driven by the product of the two weights.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..progress import Progress
from .poses import Pose, Posing
from .shapes import Shape, Side

Movement = tuple[object, ...]

MOVED = 0.1
"""Skin that a shape moves by more counts for the error of a pair, mm; smaller errors on average are not corrected."""

TOGETHER, SEVERAL = 0.5, 5
"""Shapes can only disturb each other if both move so many vertices by more than this, mm."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two movements that do not add up.

    Attributes
    ----------
    first, second : tuple
        The movements, of both sides where they have sides.
    targets : tuple of tuple of str, str and side
        Names of the shapes that have these movements, by the side that they share, or None.
    pose : Pose
        Both at full strength.
    error : float
        Mean distance of their sum from that pose, over the vertices that either moves, mm.
    """

    first: Movement
    second: Movement
    targets: tuple[tuple[str, str, Side | None], ...]
    pose: Pose
    error: float


def worst_pairs(
    shapes: Mapping[str, Shape], poses: Mapping[Movement, Pose], posing: Posing, count: int, progress: Progress
) -> list[Pair]:
    """Return the pairs of shapes whose sum is farthest from what the muscles do together, the worst first.

    Parameters
    ----------
    shapes : mapping of str to Shape
    poses : mapping of tuple to Pose
        Of all their movements, alone and of both sides.
    posing : Posing
    count : int
        At most so many pairs.
    progress : callable
        As in :func:`facewrinkle.rig`.

    Examples
    --------
    Lips that are pursed to a funnel and puckered:

    >>> import facewrinkle as fw
    >>> posing, units = Posing(fw.default_face()), {"mouthFunnel": "AU22", "mouthPucker": "AU18", "browInnerUp": "AU1"}
    >>> shapes = {name: Shape({unit: 1.0}) for name, unit in units.items()}
    >>> poses = {shape.movement: posing.at({"": (shape, 1.0)}) for shape in shapes.values()}
    >>> (pair,) = worst_pairs(shapes, poses, posing, 8, lambda pairs, what, total: iter(pairs))
    >>> pair.targets, pair.error > 1.0
    ((('mouthFunnel', 'mouthPucker', None),), True)
    """
    names: dict[Movement, list[str]] = {}
    for name, shape in shapes.items():
        if not shape.beyond and shape.movement != Shape().movement:
            names.setdefault(shape.movement, []).append(name)
    moved = {movement: poses[movement].base - posing.rest for movement in names}
    way = {movement: np.linalg.norm(each, axis=1) for movement, each in moved.items()}
    pairs = [
        (one, other)
        for one, other in combinations(names, 2)
        if (np.minimum(way[one], way[other]) > TOGETHER).sum() > SEVERAL and _targets(shapes, names[one], names[other])
    ]
    found = []
    for one, other in progress(pairs, "Comparing pairs", len(pairs)):
        both = {str(k): (replace(shapes[names[m][0]], side=None), 1.0) for k, m in enumerate((one, other))}
        pose = posing.at(both)
        off = np.linalg.norm(pose.base - posing.rest - moved[one] - moved[other], axis=1)
        error = float(off[np.maximum(way[one], way[other]) > MOVED].mean())
        if error > MOVED:
            found.append(Pair(one, other, _targets(shapes, names[one], names[other]), pose, error))
    return sorted(found, key=lambda pair: -pair.error)[:count]


def _targets(
    shapes: Mapping[str, Shape], first: list[str], second: list[str]
) -> tuple[tuple[str, str, Side | None], ...]:
    """Return the pairs of shapes of two movements that act on the same side, and that side."""
    return tuple(
        (a, b, shapes[a].side or shapes[b].side)
        for a in first
        for b in second
        if shapes[a].side is None or shapes[b].side is None or shapes[a].side == shapes[b].side
    )
