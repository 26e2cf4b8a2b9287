"""The face held in each shape: the base mesh at rest under its muscles, with what is modelled besides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..array_types import Array
from ..geometry.smoothstep import smoothstep
from ..geometry.topology import vertex_rings
from ..geometry.untangling import Untangling
from ..motion.base import Undriven
from ..motion.skin import Skin
from .modelled import Movements
from .shapes import Shape, Side

STEP, STEPS, STILL = 1.0, 30, 0.005
"""Skin comes to rest within so many steps of so many seconds; it is at rest when no vertex moves further, mm."""

BAND = 0.15
"""Half the width of the band in the middle of the face over which a movement of both sides is divided into shapes of
the left and the right, in distances between the pupils.
"""

CLEARING = 0.0005
"""Time of the step that takes skin out of eyes, teeth and the other lip where modelled movements have brought it, s."""

INSIDE = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0], [0, 0.5, 0.5], [0.5, 0, 0.5], [1 / 3, 1 / 3, 1 / 3]])
"""Barycentric coordinates of the points of a triangle that must clear the balls."""

REACH = 0.4
"""Skin that is pushed out of a ball takes along what lies within so many radii of the ball, of either lid."""

GRAZING = 0.05
"""Lids may come closer to a ball than at rest by this, in mm, on their straight way from rest to a shape."""


@dataclass(frozen=True, eq=False)
class Pose:
    """The face held in a shape.

    Attributes
    ----------
    base : ndarray, shape (n0, 3)
        Positions of the base mesh, mm.
    rates : ndarray, shape (k,)
        Contraction rates of the muscles.
    mandible : ndarray, shape (4, 4)
        Motion of the mandible beside the turn by its muscle, in the unit of the face.
    """

    base: Array
    rates: Array
    mandible: Array


class Held(Undriven):
    """A motion that holds a face in one pose, which may be exchanged; its muscles are as in that pose.

    Parameters
    ----------
    face : Face
    """

    time_step = 0.02

    def __init__(self, face: Face) -> None:
        self.points = face.points * face.unit
        self.names = tuple(face.muscles)
        self.reset()

    def reset(self) -> None:
        """Hold the face at rest."""
        self.base, self.rates, self.mandible = self.points, np.zeros(len(self.names)), np.eye(4)

    def hold(self, pose: Pose) -> None:
        """Hold the face in a pose."""
        self.base, self.rates, self.mandible = pose.base, pose.rates, pose.mandible

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """Return the rates of the pose."""
        return self.rates

    def step(self) -> Array:
        """Return the positions (n, 3) of the pose."""
        return self.base


class Posing:
    """Brings a face into the poses of shapes and of their mixtures.

    Parameters
    ----------
    face : Face

    Examples
    --------
    >>> import facewrinkle as fw
    >>> posing = Posing(fw.default_face())
    >>> pose = posing.at({"smile": (Shape({"AU12": 1.0}), 1.0)})
    >>> bool(np.abs(pose.base - posing.rest).max() > 5.0)
    True
    """

    def __init__(self, face: Face) -> None:
        self.face, self.rest = face, face.points * face.unit
        self._skin, self._clearing = Skin(face, STEP), Skin(face, CLEARING)
        self._movements = Movements(face)
        self._untangling = Untangling(self.rest, face.triangles, *vertex_rings(face.triangles, len(self.rest)))

    def neutral(self) -> Pose:
        """Return the face at rest."""
        return Pose(self.rest, np.zeros(len(self._skin.names)), np.eye(4))

    def at(self, mixture: Mapping[str, tuple[Shape, float]]) -> Pose:
        """Return the pose of shapes at weights, muscles of both sides unless a shape has a side."""
        rates = np.zeros(len(self._skin.names))
        modelled: dict[tuple[str, Side | None], float] = {}
        for shape, weight in mixture.values():
            rates = np.maximum(rates, contractions_of(self._skin, self.face, shape, weight))
            _, below = mixture.get(shape.beyond, (shape, weight))
            full = max(weight, below) or 1.0  # of lips over a jaw that is half open, half the weight closes all
            for name, share in shape.modelled.items():
                key = name, shape.side
                modelled[key] = max(modelled.get(key, 0.0), share * (weight / full if shape.beyond else weight))
        moved = self._settled(rates) / self.face.unit
        mandible = np.eye(4)
        for (name, side), share in modelled.items():
            own = share_of_side(self.face, self.face.points, side)
            moved = moved + share * own * self._movements.of(name, moved)
            mandible += share * (self._movements.mandible(name) - np.eye(4))
        base = self.rest + self.face.unit * moved
        if modelled:
            self._clearing.set_rates(rates)
            base = self.rest + self._clearing.cleared(base - self.rest)
        return Pose(self._clear_of_eyes(self._untangling.untangled(base), self.rest), rates, mandible)

    def _settled(self, rates: Array) -> Array:
        """Displacement (n, 3), mm, at which the skin rests."""
        skin = self._skin
        skin.reset()
        if not rates.any():
            return np.zeros_like(self.rest)
        skin.set_rates(rates)
        before = skin.displacement
        for _ in range(STEPS):
            skin.step()
            now = skin.displacement
            if np.abs(now - before).max() < STILL:
                break
            before = now
        return np.array(now)

    def between(self, half: Pose, full: Pose) -> Pose:
        """Return the half way to a pose, pushed out of the balls so far that the second half of the way clears them."""
        return replace(half, base=self._clear_of_eyes(half.base, full.base))

    def _clear_of_eyes(self, base: Array, other: Array) -> Array:
        """Return positions (n, 3), mm, pushed out so far that the straight way to them from others clears the balls.

        A blend shape moves each vertex along a chord, and the skin of a lid goes along an arc around the ball.
        """
        out, triangles = base.copy(), self.face.triangles
        for eye in self.face.eyes:
            centre, radius = eye.centre * self.face.unit, eye.radius * self.face.unit
            near = triangles[(np.linalg.norm(self.rest - centre, axis=1) < 2.0 * radius)[triangles].any(axis=1)]
            start, end = (np.einsum("bc,tcx->tbx", INSIDE, (x - centre)[near]) for x in (other, base))
            allowed = np.minimum(np.linalg.norm(start, axis=2), np.linalg.norm(end, axis=2))
            floor = np.minimum(allowed, radius) - GRAZING
            low = _closest(start, end) < floor
            if not low.any():
                continue
            lifts = np.zeros(low.shape)
            lifts[low] = _lifts(start[low], end[low], floor[low])
            lift = _at_corners(lifts, near, len(base))
            out += _spread(lift, base, REACH * radius)[:, None] * (base - centre)
        return out


def contractions_of(skin: Skin, face: Face, shape: Shape, weight: float) -> Array:
    """Return the contraction rates (k,) of a shape at a weight, of the muscles of its side alone.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> skin = Skin(face, STEP)
    >>> rates = contractions_of(skin, face, Shape({"AU12": 1.0}, side="l"), 0.5)
    >>> [name for name, rate in zip(skin.names, rates, strict=True) if rate]
    ['zygomaticus_major_l']
    """
    units = {unit: weight * rate for unit, rate in shape.units.items()}
    rates = skin.rates_of(face.atlas.contractions(units))
    if shape.side is not None:
        rates *= [not name.endswith("_r" if shape.side == "l" else "_l") for name in skin.names]
    return rates


def share_of_side(face: Face, points: Array, side: Side | None) -> Array:
    """Return the share (n, 1) of a movement of both sides that the shape of one side has, at points (n, 3) at rest.

    Those of the left and of the right add up to 1.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> share_of_side(face, face.frame.origin + [[30.0, 0, 0], [0, 0, 0], [-30, 0, 0]], "l").ravel()
    array([1. , 0.5, 0. ])
    """
    if side is None:
        return np.ones((len(points), 1))
    left = smoothstep(0.5 + 0.5 * face.frame.local(points)[:, :1] / BAND)
    return np.asarray(left if side == "l" else 1.0 - left)


def _at_corners(lifts: Array, triangles: npt.NDArray[np.integer], n: int) -> Array:
    """Largest lifts (n,) of the points INSIDE the triangles around each vertex, given those (m, 7) of the points."""
    out = np.zeros(n)
    for corner in range(3):
        np.maximum.at(out, triangles[:, corner], (lifts * (INSIDE[:, corner] > 0.0)).max(axis=1))
    return out


def _closest(start: Array, end: Array) -> Array:
    """Least distance (...) from the origin of the ways (..., 3) from start to end."""
    way = end - start
    t = -(start * way).sum(axis=-1) / np.maximum((way * way).sum(axis=-1), 1e-300)
    return np.asarray(np.linalg.norm(start + np.clip(t, 0.0, 1.0)[..., None] * way, axis=-1))


def _spread(values: Array, points: Array, reach: float) -> Array:
    """Return values (n,) that fall smoothly to 0 within a distance from each point (n, 3) that has one.

    Examples
    --------
    >>> _spread(np.array([1.0, 0.0, 0.0]), np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), 2.0)
    array([1. , 0.5, 0. ])
    """
    sources = np.flatnonzero(values)
    pairs = cKDTree(points[sources]).sparse_distance_matrix(cKDTree(points), reach, output_type="ndarray")
    out = values.copy()
    shares = smoothstep(1.0 - pairs["v"] / reach)
    np.maximum.at(out, pairs["j"], shares * values[sources[pairs["i"]]])
    return out


def _lifts(start: Array, end: Array, floor: Array) -> Array:
    """Factors (n,) less 1 by which ends (n, 3) must move away from the origin for the ways from start to clear a
    distance (n,), by bisection.
    """
    low, high = np.ones(len(end)), np.full(len(end), 2.0)
    for _ in range(40):
        middle = 0.5 * (low + high)
        clear = _closest(start, middle[:, None] * end) >= floor
        low, high = np.where(clear, low, middle), np.where(clear, middle, high)
    return np.asarray(high - 1.0)
