"""Creases: the folds that all people have at the same places, beside the nose, around the mouth, between the brows."""

from __future__ import annotations

import zlib

import numpy as np
import numpy.typing as npt

from ..anatomy import Crease, Face, Muscle, zones
from ..array_types import Array, BoolArray, IntArray
from ..errors import check_range, check_whole
from ..geometry import BoxTree, Change, interpolated, unit
from .base import SurfacePoints, SurfaceState
from .compression import per_length, shortening, tangents_of
from .muscle_wrinkles import MuscleWrinkles
from .wave_folds.tissue import kept_at_rest


class Creases(MuscleWrinkles):
    """The layer of the anatomical folds, each a :class:`facewrinkle.Crease` that one or more muscles fold.

    A crease is as deep as the skin of its whole width is compressed, a step of flesh that in the old hangs over
    (:attr:`facewrinkle.Crease.worn`). All together hold no net volume: their bulges, or
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
    seed : int
        Another seed is another person: uprights of a frown differ in depth and place, left and right each for itself.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> sim = fw.Simulation(fw.default_face(), layers=[Creases()])
    >>> sim.express("happiness")
    >>> *_, frame = sim.run(20)
    >>> bool(frame["W"].min() < -0.5)
    True
    """

    def __init__(
        self, depth: float = 1.0, *, inextensible: bool = True, age: float | None = None, seed: int = 0
    ) -> None:
        super().__init__(depth, inextensible=inextensible)
        self.age = None if age is None else check_range("age", age, 0.0, 1.0, "0 has no lines at rest.")
        self.seed = check_whole("seed", seed, 0, 2**63)

    @property
    def leveled(self) -> bool:
        """True: creases hold no net volume."""
        return True

    def draws(self, pattern: Muscle) -> bool:
        """Tell whether the folds of a muscle are a crease."""
        return isinstance(pattern, Crease)

    def patterns(self, face: Face) -> tuple[list[Muscle], BoolArray]:
        """Return the fold patterns of the muscles of a face, and the base triangles (k, m0) that each may touch."""
        patterns, touched = super().patterns(face)
        worn, touched = self._worn_on(face), touched.copy()
        for k, (name, pattern) in enumerate(zip(face.muscles, patterns, strict=True)):
            if isinstance(pattern, Crease):
                patterns[k] = own = pattern.replaced(worn=worn)
                if pattern.variety > 0.0:
                    patterns[k] = own.of_person(np.random.default_rng([self.seed, zlib.crc32(name.encode())]))
                    touched[k] = zones([patterns[k]], face.points, face.triangles)[0]
        return patterns, touched

    def _worn_on(self, face: Face) -> float:
        # Skin that always folds at the same place keeps that fold earlier than others.
        return (max(face.age, 0.0) if self.age is None else self.age) ** 0.75

    def attach(self, face: Face) -> None:
        """See :class:`facewrinkle.Layer`."""
        super().attach(face)
        # Several muscles fold one crease; at rest it is there once, and none that only a part of a line folds into.
        deepest = {self._muscles[k].path.tobytes(): k for k in np.argsort(self._k0) if self._drawn[k]}
        rows = [k for k in deepest.values() if self._muscles[k].span == (0.0, 1.0)]
        middles = np.array([self._muscles[k].path[1] for k in rows]).reshape(-1, 3)
        # At age 1 it is 0.26 times as deep as in skin that is pushed together altogether.
        self._kept[rows] = 0.26 * self._worn_on(face) * kept_at_rest(face, middles)
        self._gathered = Gathered(face, self._muscles, self._zones, self._metric)

    def follow(self, change: Change, created: SurfacePoints) -> None:
        """See :class:`facewrinkle.Layer`."""
        super().follow(change, created)
        self._places = self._gathered.places(self._folds.muscle, self._folds.coordinates[:, 0])

    def _compressed(self, state: SurfaceState) -> Array:
        return self._gathered.at(state.strain, *self._places)


PLACES = 17
"""Number of places along a crease at which its compression is measured."""

ACROSS = (-0.125, 0.0, 0.125, 0.25)
"""Distances from the furrow, in widths, of the points whose compression is averaged there: over furrow and crest."""


class Gathered:
    """The compression across the creases of a face, by the place along them.

    A crease is one fold. Its furrow and its crest are the same skin, so that both get the same compression, and no
    volume is made where the strain changes across the fold. Along it the compression is averaged with Gaussian weights,
    over a fifth of its length to either side: where skin folds deeply, it takes the skin beside it along.

    Parameters
    ----------
    face : Face
    muscles : list of Muscle
        Fold patterns of the face's muscles.
    zones : ndarray of bool, shape (k, m0)
        Base triangles that each muscle may touch.
    metric : ndarray, shape (n0, 6)
        Rest metric at the base vertices.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> from facewrinkle.layers.compression import StrainField
    >>> face = fw.default_face()
    >>> field = StrainField(face.points, face.triangles)
    >>> patterns = [muscle.fold_pattern for muscle in face.muscles.values()]
    >>> found = Gathered(face, patterns, face.zones, field.metric)
    >>> bool(found.epsilon(field.strain(0.9 * face.points)).round(9).min() == 0.1)
    True
    """

    def __init__(self, face: Face, muscles: list[Muscle], zones: BoolArray, metric: Array) -> None:
        points, triangles = face.points, face.triangles
        own = [k for k, muscle in enumerate(muscles) if isinstance(muscle, Crease) and zones[k].any()]
        self._row = np.full(len(muscles), -1)
        self._row[own] = np.arange(len(own))
        self._spans = np.array([getattr(muscle, "span", (0.0, 1.0)) for muscle in muscles]).reshape(-1, 2)
        corners, weights, tensors = [np.empty((0, 3), np.int32)], [np.empty((0, 3))], [np.empty((0, 6))]
        for k in own:
            crease, inside = muscles[k], triangles[zones[k]]
            assert isinstance(crease, Crease)
            places = crease.points_at(*np.meshgrid(np.linspace(*crease.span, PLACES), ACROSS, indexing="ij"))
            found, share, _ = BoxTree(points, inside).closest(places)
            at = inside[found]
            normal, rest = (interpolated(values, at, share) for values in (face.normals, metric))
            corners.append(at)
            weights.append(share)
            tensors.append(per_length(rest, tangents_of(crease.fold_direction(places), unit(normal))))
        self._corners, self._weights = np.concatenate(corners), np.concatenate(weights)
        self._products = np.concatenate(tensors)
        places = np.linspace(0.0, 1.0, PLACES)
        even = np.exp(-0.5 * ((places[:, None] - places) / 0.2) ** 2)
        self._even = even / even.sum(axis=1, keepdims=True)

    def epsilon(self, strain: Array) -> Array:
        """Return the compression (creases, places) at a strain (n0, 6) of the base mesh."""
        here = interpolated(strain, self._corners, self._weights)
        found = shortening(np.einsum("pk,pk->p", here, self._products))
        return np.asarray(found.reshape(-1, PLACES, len(ACROSS)).mean(axis=2) @ self._even.T)

    def places(self, muscle: npt.NDArray[np.integer], along: Array) -> tuple[IntArray, Array]:
        """Return the numbers (p,) of the last places before points on creases, each given by its muscle (p,) and its
        lambda (p,) there, and the shares (p,) of the way to the next.
        """
        begin, end = self._spans[muscle].T
        step = np.clip((along - begin) / (end - begin), 0.0, 1.0) * (PLACES - 1)
        lower = np.minimum(step.astype(int), PLACES - 2)
        return PLACES * self._row[muscle] + lower, step - lower

    def at(self, strain: Array, places: IntArray, shares: Array) -> Array:
        """Return the compression (p,) at :meth:`places` on creases."""
        values = self.epsilon(strain).ravel()
        low, high = values[places], values[places + 1]
        return np.asarray(low + shares * (high - low))
