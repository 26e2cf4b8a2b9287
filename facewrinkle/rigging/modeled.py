"""Movements that no muscle of the atlas makes: of the jaw, of sealed lips, of the mouth as a whole, and puffed cheeks.

Each is a displacement of the base mesh at full strength, in the unit of the mesh, made from landmarks and from the
share of the mandible's turn that each vertex takes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..anatomy import Face, JawMuscle, lips_middle
from ..anatomy.muscles import turned
from ..array_types import Array, IntArray
from ..geometry import cotangent_laplacian, smoothstep, symmetric_factors, vertex_areas

# Lengths are in distances between the pupils (63 mm).

PUFFED = 0.19
"""Height of puffed cheeks at their highest."""


@dataclass(frozen=True, eq=False)
class Movements:
    """The modeled movements of a face.

    Parameters
    ----------
    face : Face
        With landmarks.

    Examples
    --------
    The chin of a jaw that is thrust forward, mm:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> chin = face.mesh.find_closest_point(face.landmarks["pogonion"])
    >>> (Movements(face).of("jaw_forward")[chin] @ face.frame.axes.T).round(1) + 0.0
    array([ 0. , -1.3,  5.4])
    """

    face: Face

    @cached_property
    def _local(self) -> Array:
        """Places (n, 3) as [left, up, forward] from the middle of the lips, in distances between the pupils."""
        frame = self.face.frame
        return frame.local(self.face.points) - frame.local(lips_middle(self.face.landmarks))

    @cached_property
    def _scaled(self) -> Array:
        """Points (n, 3) in distances between the pupils."""
        return np.asarray(self.face.points / self.face.frame.pupil_distance)

    def _world(self, local: Array) -> Array:
        return np.asarray(local @ self.face.frame.axes * self.face.frame.pupil_distance)

    def mandible(self, name: str) -> Array:
        """Return the matrix (4, 4) that moves the mandible in a modeled movement; the identity if it stays."""
        frame, out = self.face.frame, np.eye(4)
        hinges = [m.hinge for m in self.face.muscles.values() if isinstance(m, JawMuscle)]
        if name == "jaw_forward":
            out[:3, 3] = self._world(np.array([0.0, -0.02, 0.085]))  # down, so that the incisors clear each other
        elif name in ("jaw_left", "jaw_right") and hinges:
            chin, aside = self.face.landmarks["pogonion"], 0.1  # the way of the chin
            hinge = hinges[0] - ((hinges[0] - frame.origin) @ frame.axes[0]) * frame.axes[0]
            lever = float((chin - hinge) @ frame.axes[2]) / frame.pupil_distance
            angle = np.arcsin(aside / max(lever, 2.0 * aside)) * (1.0 if name == "jaw_left" else -1.0)
            turn = Rotation.from_rotvec(angle * frame.axes[1]).as_matrix()
            out[:3, :3], out[:3, 3] = turn, hinge - turn @ hinge
        return out

    def of(self, name: str, moved: Array | None = None) -> Array:
        """Return the displacement (n, 3) of a movement, after others have `moved` (n, 3) the face.

        Jaws go as a whole; a mouth slides around the dental arch; lips roll in over the teeth; an upper lip is pushed
        up by the lower one; and the lids follow eyes that look at the nose (`lids_in`) or away from it.
        """
        match name:
            case "puff":
                return self._puffed()
            case "jaw_forward" | "jaw_left" | "jaw_right":
                matrix, points = self.mandible(name), self.face.points
                thrust = points @ matrix[:3, :3].T + matrix[:3, 3] - points
                return np.asarray(self.face.mandible_share[:, None] * thrust)
            case "mouth_left" | "mouth_right":
                return self._aside(1.0 if name == "mouth_left" else -1.0)
            case "roll_upper":
                return self._rolled(1.0, 1.0 - self.face.mandible_share, 0.1)
            case "roll_lower":
                return self._rolled(-1.0, self.face.mandible_share, 0.125)
            case "lift_upper":
                return self._lifted()
            case "lids_in" | "lids_out":
                return self._lids_aside(1.0 if name == "lids_out" else -1.0)
            case _:  # seal
                return self.seal(np.zeros_like(self.face.points) if moved is None else moved)

    def _aside(self, sign: float) -> Array:
        """Displacement (n, 3) of a mouth that slides to one side around the dental arch, up to 1.15 from it."""
        local, way, arch = self._local, 0.2, 0.55
        away = np.linalg.norm(local * [1.0, 1.25, 0.8], axis=1) / 1.15
        angle = sign * way / arch * smoothstep((1.0 - away) / 0.8)
        return self._world(turned(local - np.array([0.0, 0.0, -arch]), np.array([0.0, 1.0, 0.0]), angle))

    def _puffed(self) -> Array:
        """Displacement (n, 3) of cheeks and lips that air pushes away from the teeth.

        It is a smooth field of the place alone, so that lips stay on each other and their lining goes along.
        """
        # Half the width, the heights above and below, and the depth of the room between cheeks and gums.
        local, (wide, above, below, deep) = self._local, (1.15, 0.7, 0.48, 1.6)
        tall = np.where(local[:, 1] > 0.0, above, below)
        ways = np.stack([local[:, 0] / wide, local[:, 1] / tall, np.minimum(local[:, 2], 0.0) / deep])
        away, full = np.cbrt((np.abs(ways) ** 3).sum(axis=0)), 0.35  # up to which the cheeks come out by all
        height = 1.0 - smoothstep((away - full) / (1.0 - full))
        # The nose holds the skin, and the ring of muscle around the mouth the lips.
        height *= smoothstep(np.linalg.norm((local[:, :2] - [0.0, 0.62]) / [0.45, 0.45], axis=1) / 0.6 - 0.4)
        height *= 1.0 - 0.45 * np.exp(-((local[:, 0] / 0.35) ** 2))
        outwards = (local - [0.0, 0.05, -0.8]) * [1.0, 0.4, 1.0]
        outwards /= np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 0.3)
        return self._world(PUFFED * height[:, None] * outwards)

    def _rolled(self, sign: float, lip: Array, amount: float) -> Array:
        """Displacement (n, 3) of skin that slides along its own surface, over the margin of the lip, and inwards.

        Each vertex goes ``dx/dt = x_hat × n(x)``, with the smoothed normals n of the lip at rest: down the skin of the
        upper lip, back under its red, and up again behind it.
        """
        local, half = self._local, self._half_width
        beyond = smoothstep((np.abs(local[:, 0]) / half - 0.65) / 0.5)
        far = smoothstep((np.hypot(local[:, 1], np.minimum(local[:, 2] + 0.1, 0.0)) - 0.2) / (0.5 - 0.2))
        weight = lip * (1.0 - beyond) * (1.0 - far)
        moving, near = np.flatnonzero(weight > 0.0), np.flatnonzero((lip > 0.5) & (np.abs(local).max(axis=1) < 1.0))
        around, steps = 12, 10  # vertices over which normals are averaged, and steps of the way
        if not len(moving) or len(near) < around:
            return np.zeros_like(local)
        tree = cKDTree(local[near])
        normals = (self.face.normals @ self.face.frame.axes.T)[near]
        places, step = local[moving].copy(), amount / steps * weight[moving, None]
        for _ in range(steps):
            normal = normals[tree.query(places, around)[1]].mean(axis=1)
            along = sign * np.stack([np.zeros(len(places)), -normal[:, 2], normal[:, 1]], axis=1)
            places += step * along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 0.3)
        moved = np.zeros_like(local)
        thinner = [0.0, sign * 0.01, 0.0]  # by which a lip comes towards the other one
        moved[moving] = places - local[moving] - thinner * weight[moving, None]
        return self._world(moved)

    def _lifted(self) -> Array:
        """Displacement (n, 3) of an upper lip that the lower one pushes up by 0.09, with the skin around it."""
        local = self._local - [0.0, 0.06, 0.0]
        weight = np.exp(-((local / [0.3, 0.24, 0.4]) ** 2).sum(axis=1)) * (1.0 - self.face.mandible_share)
        weight = np.where(weight > 0.02, weight - 0.02, 0.0)
        return self._world(0.09 * weight[:, None] * np.array([0.0, 1.0, 0.15]))

    def _lids_aside(self, outwards: float) -> Array:
        """Displacement (n, 3) of lids that follow a sideways turn of the eyes by 30 degrees to a fifth.

        Skin within 1.1 radii of a ball follows it so, and none beyond 1.75.
        """
        moved, points = np.zeros_like(self.face.points), self.face.points
        for eye in self.face.eyes:
            offset = points - eye.centre
            away = np.linalg.norm(offset, axis=1) / eye.radius
            weight = 1.0 - smoothstep((away - 1.1) / (1.75 - 1.1))
            near = np.flatnonzero((weight > 0.0) & (offset @ eye.gaze > 0.0))
            angle = outwards * (1.0 if eye.side == "l" else -1.0) * 0.2 * np.deg2rad(30.0) * weight[near]
            moved[near] = turned(offset[near], eye.up, angle)
        return moved

    def seal(self, moved: Array) -> Array:
        """Displacement (n, 3) that closes lips which a displacement `moved` (n, 3) has parted.

        Opposite points of the lips come as close as they are at rest, and the skin around bends as little as it can: of
        all displacements that do so, this has the least squares of the Laplacian.
        """
        upper, lower = self.pairs
        target, (free, bending, solve) = np.zeros(moved.shape), self._sealing
        back = 0.9  # the share of the way to rest that sealed lips take: the lower one comes to the upper one
        target[lower] = (1.0 - back) * moved[upper] - moved[lower]
        target[upper] = -back * moved[upper]
        target[free] = solve(-(bending[:, free].T @ (bending @ target)))
        return target

    @cached_property
    def _sealing(self) -> tuple[IntArray, csr_array, Callable[[Array], Array]]:
        """Vertices that follow sealed lips, the bending (n, n) of the skin, and what solves its least squares."""
        held = np.zeros(len(self.face.points), bool)
        held[np.concatenate(self.pairs)] = True
        near = np.linalg.norm(self._local, axis=1) < 0.95  # so far the sealing moves skin
        free = np.flatnonzero(near & ~held)
        points = self._scaled
        area = vertex_areas(points, self.face.triangles)
        weights = diags_array(1.0 / np.sqrt(np.maximum(area, 1e-9)))
        bending = csr_array(weights @ cotangent_laplacian(points, self.face.triangles))
        system = bending[:, free]
        damped = system.T @ system + 1e-6 * diags_array(np.ones(len(free)))
        return free, bending, symmetric_factors(damped.tocsc()).solve

    @cached_property
    def _half_width(self) -> float:
        """Half the width of the mouth."""
        ends = [self.face.frame.local(self.face.landmarks[f"mouth_{side}"])[0] for side in "lr"]
        return 0.5 * float(ends[0] - ends[1])

    @cached_property
    def pairs(self) -> tuple[IntArray, IntArray]:
        """Vertices of the upper lip and of the lower one that lie opposite each other at rest, if they meet."""
        local = self._local
        near = (np.abs(local[:, 0]) < 1.05 * self._half_width) & (np.abs(local[:, 1]) < 0.2) & (local[:, 2] > -0.25)
        share = self.face.mandible_share
        upper, lower = (np.flatnonzero(near & part) for part in (share < 0.35, share > 0.65))
        points = self._scaled
        gaps, partner = cKDTree(points[lower]).query(points[upper])
        other_gaps, other = cKDTree(points[upper]).query(points[lower])
        close, other_close = gaps < 0.1, other_gaps < 0.1  # as lips at rest are at most
        pairs = np.concatenate(
            [
                np.stack([upper[close], lower[partner[close]]], axis=1),
                np.stack([upper[other[other_close]], lower[other_close]], axis=1),
            ]
        )
        gap = np.concatenate([gaps[close], other_gaps[other_close]])
        if len(gap):
            pairs = np.unique(pairs[gap <= np.quantile(gap, 0.35)], axis=0)
        return pairs[:, 0], pairs[:, 1]
