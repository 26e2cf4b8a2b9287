"""The face held in each shape, and performing a take: its muscles, and what is modeled besides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..array_types import Array
from ..errors import ParameterError, check_range, check_type, warn
from ..geometry import Untangling, smoothstep, vertex_rings
from ..motion.base import Undriven
from ..motion.skin import Skin
from .modeled import Movements
from .shapes import Shape, Side, shapes_named
from .takes import Take

CLEARING = 0.0005
"""Time of the step that takes skin out of eyes, teeth and the other lip where modeled movements have brought it, s."""


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
    age : float
        Of lines at rest, in [0, 1]; 0 for those that the face has.
    """

    base: Array
    rates: Array
    mandible: Array
    age: float = 0.0


class Held(Undriven):
    """A motion that holds a face in one pose, which may be exchanged; its muscles are as in that pose.

    Parameters
    ----------
    face : Face
    """

    time_step = 0.02

    def __init__(self, face: Face) -> None:
        self.points = face.points_mm
        self.names = tuple(face.muscles)
        self.reset()

    def reset(self) -> None:
        """Hold the face at rest."""
        self.base, self.rates, self.mandible = self.points, np.zeros(len(self.names)), np.eye(4)

    def hold(self, pose: Pose) -> None:
        """Hold the face in a pose."""
        self.base, self.rates, self.mandible = pose.base, pose.rates, pose.mandible

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
        self.face, self.rest = face, face.points_mm
        self._skin, self._clearing = Skin(face, 1.0), Skin(face, CLEARING)
        self._movements = Movements(face)
        self._untangling = Untangling(self.rest, face.triangles, *vertex_rings(face.triangles, len(self.rest)))

    def neutral(self) -> Pose:
        """Return the face at rest."""
        return Pose(self.rest, np.zeros(len(self._skin.names)), np.eye(4))

    def at(self, mixture: Mapping[str, tuple[Shape, float]]) -> Pose:
        """Return the pose of shapes at weights, muscles of both sides unless a shape has a side."""
        rates = np.zeros(len(self._skin.names))
        modeled: dict[tuple[str, Side | None], float] = {}
        for shape, weight in mixture.values():
            rates = np.maximum(rates, contractions_of(self._skin, self.face, shape, weight))
            _, below = mixture.get(shape.beyond, (shape, weight))
            full = max(weight, below) or 1.0  # of lips over a jaw that is half open, half the weight closes all
            for name, share in shape.modeled.items():
                key = name, shape.side
                modeled[key] = max(modeled.get(key, 0.0), share * (weight / full if shape.beyond else weight))
        moved = self._settled(rates) / self.face.unit
        mandible = np.eye(4)
        for (name, side), share in modeled.items():
            own = share_of_side(self.face, self.face.points, side)
            moved = moved + share * own * self._movements.of(name, moved)
            mandible += share * (self._movements.mandible(name) - np.eye(4))
        base = self.rest + self.face.unit * moved
        if modeled:
            self._clearing.set_rates(rates)
            base = self.rest + self._clearing.cleared(base - self.rest)
        age = max((shape.age * weight for shape, weight in mixture.values()), default=0.0)
        return Pose(self._clear_of_eyes(self._untangling.untangled(base)), rates, mandible, age)

    def _settled(self, rates: Array) -> Array:
        """Displacement (n, 3), mm, at which the skin rests."""
        skin = self._skin
        skin.reset()
        if not rates.any():
            return np.zeros_like(self.rest)
        skin.set_rates(rates)
        before = skin.displacement
        for _ in range(30):  # steps of a second, which suffice
            skin.step()
            now = skin.displacement
            if np.abs(now - before).max() < 0.005:  # mm
                break
            before = now
        return np.array(now)

    def _clear_of_eyes(self, base: Array) -> Array:
        """Return positions (n, 3), mm, pushed out so far that the straight way to them from rest clears the balls.

        A blend shape moves each vertex along a chord, and the skin of a lid goes along an arc around the ball.
        """
        out, triangles = base.copy(), self.face.triangles
        # Barycentric coordinates of the points of a triangle that must clear the balls: corners, middles, centre.
        inside = np.concatenate([np.eye(3), 0.5 * (1.0 - np.eye(3)), np.full((1, 3), 1.0 / 3.0)])
        for eye in self.face.eyes:
            centre, radius = eye.centre * self.face.unit, eye.radius * self.face.unit
            near = triangles[(np.linalg.norm(self.rest - centre, axis=1) < 2.0 * radius)[triangles].any(axis=1)]
            start, end = (np.einsum("bc,tcx->tbx", inside, (x - centre)[near]) for x in (self.rest, base))
            allowed = np.minimum(np.linalg.norm(start, axis=2), np.linalg.norm(end, axis=2))
            floor = np.minimum(allowed, radius) - 0.05  # so much closer than at rest lids may come, mm
            low = _closest(start, end) < floor
            if not low.any():
                continue
            lifts = np.zeros(low.shape)
            lifts[low] = _lifts(start[low], end[low], floor[low])
            lift = np.zeros(len(base))  # of each vertex, the largest in the triangles around it
            for corner in range(3):
                np.maximum.at(lift, near[:, corner], (lifts * (inside[:, corner] > 0.0)).max(axis=1))
            # Skin that is pushed out takes along what lies around it, of either lid.
            out += _spread(lift, base, 0.4 * radius)[:, None] * (base - centre)
        return out


def contractions_of(skin: Skin, face: Face, shape: Shape, weight: float) -> Array:
    """Return the contraction rates (k,) of a shape at a weight, of the muscles of its side alone.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> skin = Skin(face)
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

    Those of the left and of the right add up to 1, and blend over the middle, 0.3 distances between the pupils wide.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> share_of_side(face, face.frame.origin + [[30.0, 0, 0], [0, 0, 0], [-30, 0, 0]], "l").ravel()
    array([1. , 0.5, 0. ])
    """
    if side is None:
        return np.ones((len(points), 1))
    left = smoothstep(0.5 + 0.5 * face.frame.local(points)[:, :1] / 0.15)
    return np.asarray(left if side == "l" else 1.0 - left)


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


class Performer(Undriven):
    """A motion that makes a face perform a take, in place of a linear mixture of blend shapes.

    At each time the muscles of all shapes contract as strongly as the weights say, those that several shapes ask for as
    the strongest says; the skin moves as in any simulation, with its contacts. What no muscle does (the jaw forward or
    aside, cheeks puffed, lips rolled in or sealed) is added to that, and cleared of teeth and of the other lip.

    Parameters
    ----------
    take : Take
        Of :func:`facewrinkle.read_take`.
    face : Face
        With muscles.
    time_step : float
        Seconds per step.
    speed : float
        Seconds of the take in one second.
    head : bool
        Turn the head as the take says.

    Attributes
    ----------
    left_out : dict of str to str
        Shapes of the take that the face cannot make, with the reason.

    Raises
    ------
    ParameterError
        If the face can make none of the shapes.

    Warns
    -----
    FaceWrinkleWarning
        For shapes that the take shows and the face cannot make.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> take = fw.Take(("browInnerUp",), np.array([0.0, 0.3]), np.array([[0.0], [1.0]]))
    >>> sim = fw.Simulation(face, motion=Performer(take, face))
    >>> *_, frame = sim.run(20)
    >>> float(np.ptp(frame["W"])) > 0.2
    True
    """

    def __init__(
        self,
        take: Take,
        face: Face,
        *,
        time_step: float = 0.02,
        speed: float = 1.0,
        head: bool = True,
    ) -> None:
        check_type("take", take, Take)
        check_type("face", face, Face)
        self.take, self.face, self.head = take, face, head and take.head is not None
        self.speed = check_range("speed", speed, 1e-6, 1e6)
        used = [name for name, most in zip(take.names, take.weights.max(axis=0), strict=True) if most > 0.0]
        shapes, self.left_out = shapes_named(used or take.names, face)
        shown = [n for n in self.left_out if take.weights[:, take.names.index(n)].max() > 0.02]
        if shown:
            reasons = "; ".join(dict.fromkeys(self.left_out[name] for name in shown))
            warn(f"{len(shown)} shapes of the take are left out ({reasons}): {', '.join(shown)}.")
        self._skin = Skin(face, time_step)
        self.time_step, self.points = self._skin.time_step, self._skin.points
        self.names = self._skin.names
        self._movements = Movements(face)
        self._contractions = {
            name: contractions_of(self._skin, face, shape, 0.0 if shape.beyond else 1.0)  # correctives have none
            for name, shape in shapes.items()
        }
        self._ways, self._thrusts = self._modeled(shapes)
        modeled = self._ways or "mouthClose" in shapes
        self._clearing = Skin(face, CLEARING) if modeled else None
        self.reset()

    def _modeled(self, shapes: dict[str, Shape]) -> tuple[dict[str, Array], dict[str, Array]]:
        """Return the displacements (n, 3) and the motions of the mandible (4, 4) that are not muscles', by shape."""
        ways: dict[str, Array] = {}
        thrusts: dict[str, Array] = {}
        for name, shape in shapes.items():
            for movement, weight in shape.modeled.items():
                if movement == "seal":
                    continue
                own = weight * share_of_side(self.face, self.face.points, shape.side)
                ways[name] = ways.get(name, 0.0) + own * self._movements.of(movement)
                thrust = self._movements.mandible(movement) - np.eye(4)
                if thrust.any():
                    thrusts[name] = thrusts.get(name, 0.0) + weight * thrust
        return ways, thrusts

    def reset(self) -> None:
        """See :class:`facewrinkle.Motion`."""
        self._skin.reset()
        self._steps = 0.0
        self.rates, self.pose, self.mandible = self._skin.rates, self._pose(0.0), None

    def seek(self, time: float) -> None:
        """Let the next step lead towards the weights at a time, s; the skin goes there from where it is."""
        self._steps = time / self.time_step - 1.0

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """Return the present rates; raise a ParameterError if others are asked for."""
        if rates:
            raise ParameterError(
                f"this face performs a take, which contracts its muscles; asked for were {', '.join(map(str, rates))}. "
                "Leave motion out to contract them yourself."
            )
        return self.rates

    def step(self) -> Array:
        """See :class:`facewrinkle.Motion`; the first step leads to the time `time_step`."""
        self._steps += 1
        time = self._steps * self.time_step * self.speed
        weights = self.take.at(time)
        self._skin.set_rates(np.max([weights[name] * own for name, own in self._contractions.items()], axis=0))
        moved = self._skin.step()
        self.rates = self._skin.rates
        moved = self._added(moved, weights)
        thrust = sum(weights[name] * own for name, own in self._thrusts.items())
        self.mandible = np.eye(4) + thrust if self._thrusts else None
        self.pose = self._pose(time)
        if self.pose is None:
            return moved
        return np.asarray(moved @ self.pose[:3, :3].T + self.face.unit * self.pose[:3, 3])

    def _added(self, moved: Array, weights: Mapping[str, float]) -> Array:
        """Return positions (n, 3), mm, with what is modeled besides."""
        way = np.zeros_like(moved)
        for name, own in self._ways.items():
            way += weights[name] * own
        closing = weights["mouthClose"] if "mouthClose" in self._contractions else 0.0
        if closing > 0.0:
            # A corrective of as much weight as that of the open jaw closes the lips, whatever that weight is.
            share = closing / max(closing, weights.get("jawOpen", 0.0))
            parted = (moved - self.points) / self.face.unit + way
            way += share * self._movements.seal(parted)
        if self._clearing is None or not way.any():
            return moved
        self._clearing.set_rates(self.rates)
        return self.points + self._clearing.cleared(moved + self.face.unit * way - self.points)

    def _pose(self, time: float) -> Array | None:
        """Return the matrix (4, 4) of the head at a time, in the unit of the face."""
        if not self.head:
            return None
        frame, out = self.face.frame, np.eye(4)
        pivot = frame.origin + np.array([0.0, -0.6, -1.3]) @ frame.axes * frame.pupil_distance  # in the neck
        out[:3, :3] = frame.axes.T @ self.take.turn(time) @ frame.axes
        out[:3, 3] = pivot - out[:3, :3] @ pivot
        return out
