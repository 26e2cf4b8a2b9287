"""Creases: the folds that all people have at the same places, beside the nose, around the mouth, between the brows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..anatomy.face import Face
from ..anatomy.muscles import Crease, Muscle
from ..array_types import Array
from ..errors import check_range
from .base import Displacement, SurfaceState
from .compression import Gathered
from .muscle_wrinkles import MuscleWrinkles

KEPT = 0.1
"""Depth of creases at rest at age 1, relative to skin that is pushed together altogether."""


class Creases(MuscleWrinkles):
    """The layer of the anatomical folds, each a :class:`facewrinkle.Crease` that one or more muscles fold.

    A crease is as deep as the skin of its whole width is compressed. All together hold no net volume: their bulges, or
    their furrows, are lowered by up to a fifth, and where that is not enough the others get up to 7 % higher.

    Parameters
    ----------
    depth : float
        Multiplies the depth of all creases.
    inextensible : bool
        If True, creases stay within what skin of fixed length can fold; see :class:`facewrinkle.MuscleWrinkles`.
    age : float, optional
        In [0, 1]: creases of old skin stay at rest, where the skin is not stretched across them, and deepen in motion.
        Default: the age of the face.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), layers=[Creases()])
    >>> sim.express("happiness")
    >>> *_, frame = sim.run(20)
    >>> bool(frame["W"].min() < -0.5)
    True
    """

    def __init__(self, depth: float = 1.0, inextensible: bool = True, age: float | None = None) -> None:
        super().__init__(depth, inextensible)
        self.age = None if age is None else check_range("age", age, 0.0, 1.0, "0 has no lines at rest.")

    def draws(self, pattern: Muscle) -> bool:
        """Tell whether the folds of a muscle are a crease."""
        return isinstance(pattern, Crease)

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.layers.base.Layer`."""
        super().attach(face)
        # Several muscles fold one crease; at rest it is there once.
        deepest = {self._muscles[k].path.tobytes(): k for k in np.argsort(self._k0) if self._drawn[k]}
        self._kept[list(deepest.values())] = KEPT * (max(face.age, 0.0) if self.age is None else self.age)
        self._gathered = Gathered(face, self._muscles, self._zones, self._metric)

    def displacement(self, state: SurfaceState) -> Displacement:
        """See :class:`facewrinkle.layers.base.Layer`."""
        found = super().displacement(state)
        self._relief = relief = self._relief.levelled(state.areas)
        return replace(found, height=relief.height, shading_offset=relief.shown - relief.height)

    def _compressed(self, state: SurfaceState) -> Array:
        return self._gathered.at(state.strain, self._folds.muscle, self._folds.coordinates[:, 0])
