"""Joints of the skin: the mandible and the plates of the lids carry the tissue that is tethered to them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..anatomy import Face, JointWeights
from ..array_types import Array, IntArray
from ._skin_kernels import add_turns

LONGEST_PART = 1.5
"""Joints carry the skin no farther than this in one part of a step, mm."""


class _Joint(NamedTuple):
    """A joint; mm.

    It carries vertices by a `share` (k,) of its turn, and turns `triangles` (j,) by the angles `of_triangles` (j,) at
    full contraction of its `muscle`, unless this `yields` to others. No vertex goes farther than its `reach`.
    """

    weights: JointWeights
    share: Array
    triangles: IntArray
    of_triangles: Array
    muscle: int
    yields: list[int]
    reach: float


class Joints:
    """Joints of a face.

    Parameters
    ----------
    face : Face
    names : sequence of str
        The face's muscles, in the order of the rates.
    tethers : ndarray, shape (n,)
        Stiffness of the tethers to bone.
    plates : mapping of str to ndarray, shape (k,)
        Stiffness of the tethers to the plates of lids, for the vertices of each of the joints.

    Examples
    --------
    The way that the chin is carried as the jaw opens, mm down:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> none = {name: np.zeros(len(joint.vertices)) for name, joint in face.joint_weights.items()}
    >>> joints = Joints(face, tuple(face.muscles), np.ones(len(face.points)), none)
    >>> rates = np.array([name == "jaw" for name in face.muscles], dtype=float)
    >>> chin = face.mesh.find_closest_point(face.landmarks["menton"])
    >>> round(float(-joints.shift(rates)[chin, 1]))
    25
    """

    def __init__(self, face: Face, names: Sequence[str], tethers: Array, plates: dict[str, Array]) -> None:
        self._points, muscles = face.points_mm, list(names)
        self._joints: dict[str, _Joint] = {}
        for name, plate in plates.items():
            joint = dataclasses.replace(face.joint_weights[name], centre=face.joint_weights[name].centre * face.unit)
            with np.errstate(invalid="ignore"):
                share = np.ones(len(plate)) if joint.bone else plate / (plate + tethers[joint.vertices])
            share = np.nan_to_num(share)
            angles = np.zeros(len(self._points))
            angles[joint.vertices] = share * joint.angles
            of_triangles = np.mean([angles[corner] for corner in face.triangles.T], axis=0)
            arm = np.linalg.norm(self._points[joint.vertices] - joint.centre, axis=1)
            self._joints[name] = _Joint(
                joint,
                share,
                np.flatnonzero(of_triangles),
                of_triangles[of_triangles != 0.0],
                muscles.index(name),
                [muscles.index(other) for other in joint.yields if other in muscles],
                float((np.abs(share * joint.angles) * arm).max(initial=0.0)),
            )
        self._bone = next((name for name, joint in self._joints.items() if joint.weights.bone), "")

    @property
    def mandible(self) -> JointWeights | None:
        """The joint that is a bone, in mm."""
        return self._joints[self._bone].weights if self._bone else None

    def mandible_rate(self, rates: Array) -> float:
        """Return the contraction rate of the mandible."""
        return self._rates(rates).get(self._bone, 0.0)

    def free_share(self, name: str) -> tuple[IntArray, Array] | None:
        """Return the vertices of a muscle's joint and the shares of its force that the joint does not take."""
        if name not in self._joints:
            return None
        return self._joints[name].weights.vertices, 1.0 - self._joints[name].share

    def _rates(self, rates: Array) -> dict[str, float]:
        """Contraction rates of the joints, which yield to others; those at rest are left out."""
        out = {}
        for name, joint in self._joints.items():
            if rate := float(rates[joint.muscle]):
                for other in joint.yields:
                    rate *= 1.0 - float(rates[other])
                out[name] = rate
        return out

    def _changes(self, before: Array, after: Array) -> dict[str, float]:
        """Changes of the joints' contraction rates that are not 0."""
        old, new = self._rates(before), self._rates(after)
        return {name: turn for name in self._joints if (turn := new.get(name, 0.0) - old.get(name, 0.0)) != 0.0}

    def shift(self, rates: Array) -> Array:
        """Return the displacements (n, 3) of what the skin is tethered to."""
        return self.carried(self._points, np.zeros_like(rates), rates) - self._points

    def turn_lids(self, out: Array, rates: Array, sign: float) -> None:
        """Add to `out` (n, 3) the displacements by each joint that is no bone alone, times a sign."""
        self._turn(self._points, {n: turn for n, turn in self._rates(rates).items() if n != self._bone}, sign, out)

    def _turn(self, points: Array, turns: Mapping[str, float], sign: float, out: Array) -> None:
        """Add to `out` (n, 3) the ways on which joints carry points (n, 3), times a sign, one joint after the other."""
        for name, turn in turns.items():
            weights, share = self._joints[name].weights, self._joints[name].share
            add_turns(points, weights.vertices, weights.centre, weights.axis, turn * share * weights.angles, sign, out)

    def facing(self, normals: Array, rates: Array) -> Array:
        """Return the normals (m, 3) of triangles as the joints turn them."""
        normals = normals.copy()
        for name, rate in self._rates(rates).items():
            if rate > 0.0:
                joint = self._joints[name]
                angles = rate * joint.of_triangles
                add_turns(normals, joint.triangles, np.zeros(3), joint.weights.axis, angles, 1.0, normals)
        return normals

    def carried(self, points: Array, before: Array, after: Array) -> Array:
        """Return points (n, 3) as they ride on the joints while the contraction rates change."""
        points = points.copy()
        self._turn(points, self._changes(before, after), 1.0, points)
        return points

    def parts(self, before: Array, after: Array) -> int:
        """Return the number of parts in which a change of the rates is made, so that none carries the skin far."""
        count = 1
        while (farthest := self._farthest(before, after, count)) > LONGEST_PART:
            count = max(count + 1, math.ceil(count * farthest / LONGEST_PART))
        return count

    def _farthest(self, before: Array, after: Array, count: int) -> float:
        """Return a bound of the way on which joints carry skin in the longest of so many parts, mm."""
        rates = [before + (after - before) * (part / count) for part in range(count + 1)]
        return max(
            sum(abs(turn) * self._joints[name].reach for name, turn in self._changes(old, new).items())
            for old, new in pairwise(rates)
        )
