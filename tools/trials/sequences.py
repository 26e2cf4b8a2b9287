"""Random sequences of contraction rates: every sequence depends on a seed, a face's name and a number alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import facewrinkle as fw
from analysis.subjects import generator
from facewrinkle.anatomy.eyelids import LARGEST_TURN
from facewrinkle.anatomy.muscles import EyeMuscle
from facewrinkle.geometry.interpolation import smoothstep

Array = npt.NDArray[np.float64]

LONGEST_RAMP, LONGEST_HOLD = 60, 40
"""Most frames that a change of the rates takes, and most frames that they are then held."""

JUMPS, RELEASES = 0.4, 0.2
"""Share of the changes that are made in one frame, and of the poses that are rest."""

RELEASED = 300
"""Frames of the release at the end of a sequence, after which the skin has to be at rest."""

ENDS_AT_REST = 0.5
"""Share of the sequences that end with such a release; the others end anywhere."""


@dataclass(frozen=True, eq=False)
class Sequence:
    """Contraction rates over time.

    Attributes
    ----------
    rates : ndarray, shape (f, k)
        Of each muscle in each frame.
    starts : tuple of int
        Frames in which the rates begin to change: each of these begins a transition, which ends before the next.
    released : bool
        True if the sequence ends with a release that is long enough to come to rest.
    """

    rates: Array
    starts: tuple[int, ...]
    released: bool

    def transitions(self) -> Iterator[slice]:
        """Yield the frames of each transition and the hold after it."""
        for first, end in zip(self.starts, (*self.starts, len(self.rates))[1:], strict=True):
            yield slice(first, end)


def sequence(face: fw.Face, seed: int, name: str, index: int) -> Sequence:
    """Return one of the sequences of a face.

    Examples
    --------
    >>> face = fw.default_face()
    >>> one, same, other = (sequence(face, 0, "head-0", k) for k in (3, 3, 4))
    >>> np.array_equal(one.rates, same.rates), np.array_equal(one.rates[:10], other.rates[:10])
    (True, False)
    """
    rng = generator(seed, name, index)
    present = np.zeros(len(face.muscles))
    parts, starts, frames = [], [], 0
    poses = [_pose(face, rng) for _ in range(rng.integers(2, 6))]
    released = bool(rng.random() < ENDS_AT_REST)
    for pose in [*poses, np.zeros_like(present)] if released else poses:
        if not frames or not np.array_equal(pose, present):
            starts.append(frames)
        ramp = _ramp(present, pose, rng)
        hold = RELEASED if released and len(parts) == len(poses) else round(float(_log_uniform(rng, LONGEST_HOLD)))
        parts.append(np.concatenate([ramp, np.repeat(pose[None], hold, axis=0)]))
        present, frames = pose, frames + len(parts[-1])
    return Sequence(np.concatenate(parts), tuple(starts), released)


def _ramp(start: Array, end: Array, rng: np.random.Generator) -> Array:
    """Rates (f, k) of a change: a jump in one frame, or a straight or smooth ramp of all muscles together.

    So the poses in between are mixtures of the two ends, and the skin has no reason to go elsewhere.
    """
    if rng.random() < JUMPS:
        return end[None].copy()
    frames = round(float(_log_uniform(rng, LONGEST_RAMP)))
    time = np.arange(1, frames + 1)[:, None] / frames
    share = smoothstep(time) if rng.random() < 0.5 else time
    return np.clip(np.where(share == 1.0, end, (1.0 - share) * start + share * end), 0.0, 1.0)


def _pose(face: fw.Face, rng: np.random.Generator) -> Array:
    """Rates (k,) to go to."""
    if rng.random() < RELEASES:
        return np.zeros(len(face.muscles))
    rates = POSES[rng.integers(len(POSES))](face, rng)
    if rng.random() < 0.25:
        _look(face, rng, rates)
    if rng.random() < 0.15:  # a mouth that opens or shuts beside everything else
        rates[list(face.muscles).index("jaw")] = float(rng.integers(2))
    return rates


def _at_one(face: fw.Face, rng: np.random.Generator) -> Array:
    """Some muscles at 1, the others at 0."""
    rates = np.zeros(len(face.muscles))
    rates[rng.permutation(len(rates))[: rng.integers(1, len(rates) + 1)]] = 1.0
    return rates


def _twenty(face: fw.Face, rng: np.random.Generator) -> Array:
    rates = np.zeros(len(face.muscles))
    rates[rng.permutation(len(rates))[:20]] = 1.0
    return rates


def _all(face: fw.Face, rng: np.random.Generator) -> Array:
    return np.ones(len(face.muscles))


def _mixture(face: fw.Face, rng: np.random.Generator) -> Array:
    """One to all muscles at random rates, of which some are exactly 0 or 1."""
    count = round(float(_log_uniform(rng, len(face.muscles))))
    rates = np.zeros(len(face.muscles))
    drawn = np.clip(rng.uniform(-0.15, 1.15, max(count, 1)), 0.0, 1.0)
    rates[rng.permutation(len(rates))[: len(drawn)]] = drawn
    return rates


def _expressions(face: fw.Face, rng: np.random.Generator) -> Array:
    """One or two expressions or action units, at full intensity or less."""
    library = [*face.atlas.expressions, *face.atlas.action_units]
    chosen = rng.choice(library, rng.integers(1, 3), replace=False)
    weights = {str(name): 1.0 if rng.random() < 0.5 else float(rng.random()) for name in chosen}
    rates = face.atlas.contractions(weights)
    return np.array([rates.get(name, 0.0) for name in face.muscles])


def _look(face: fw.Face, rng: np.random.Generator, rates: Array) -> None:
    """Both eyes look somewhere, up to the farthest."""
    yaw, up = np.clip(rng.uniform(-1.2, 1.2, 2), -1.0, 1.0) * LARGEST_TURN
    for k, muscle in enumerate(face.muscles.values()):
        if isinstance(muscle, EyeMuscle):
            outwards = yaw if muscle.side == "l" else -yaw
            aside = {"up": up, "down": -up, "outwards": outwards, "inwards": -outwards}[muscle.turn]
            rates[k] = np.clip(aside / muscle.angle, 0.0, 1.0)


def _looking(face: fw.Face, rng: np.random.Generator) -> Array:
    rates = np.zeros(len(face.muscles))
    _look(face, rng, rates)
    return rates


POSES = (_at_one, _at_one, _twenty, _all, _mixture, _mixture, _mixture, _expressions, _expressions, _looking)
"""Poses, in the shares in which they are drawn."""


def _log_uniform(rng: np.random.Generator, most: float) -> float:
    """A number from 1 to `most`; one twice as large is half as likely."""
    return float(np.exp(rng.uniform(0.0, np.log(most))))
