"""Movements that no muscle of the atlas makes: of the jaw, of sealed lips, of the mouth as a whole, and puffed cheeks.

Each is a displacement of the base mesh at full strength, in the unit of the mesh, made from landmarks and from the
share of the mandible's turn that each vertex takes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..anatomy.face import Face
from ..anatomy.joint_weights import turned
from ..anatomy.landmarks import lips_middle
from ..anatomy.muscles import JawMuscle
from ..geometry.laplacian import cotangent_laplacian
from ..geometry.normals import vertex_areas, vertex_normals
from ..geometry.smoothstep import smoothstep

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

# Lengths are in distances between the pupils (63 mm).

FORWARD, DOWN = 0.085, 0.02
"""Way of a jaw that is thrust forward, and the way down that the incisors need to clear each other."""

ASIDE = 0.1
"""Way of the chin when the jaw goes to one side."""

MOUTH_ASIDE, MOUTH_REACH, ARCH = 0.2, 1.15, 0.55
"""Way of a mouth that goes to one side, distance from its middle at which the skin stays, and radius of the dental arch
around which it slides.
"""

PUFFED = 0.2
"""Height of puffed cheeks at their highest."""

PUFF_WIDTH, PUFF_ABOVE, PUFF_BELOW, PUFF_DEPTH = 0.95, 0.6, 0.6, 0.75
"""Half the width, and the heights and the depth of the region about the mouth that air under pressure fills."""

SEALED_WITHIN, SEAL_REACH, SEAL_UP = 0.1, 0.95, 0.9
"""Lips at rest are this close at most; what the sealing of the lips moves lies this close to the mouth; and the share
of the way back to rest that sealed lips take: the lower lip comes to the upper one.
"""

ROLL_AXIS, ROLL_ANGLE, ROLL_SIZE = np.array([0.16, -0.09]), np.deg2rad(45.0), 0.2
"""Height of the axis about which a lip rolls in, away from the line of the lips, and its depth; the angle; and the size
of what rolls.
"""

LIFTED, LIFT_SIZE = 0.09, np.array([0.3, 0.24, 0.4])
"""Way of an upper lip that a lower one pushes up, and the size of what goes along, [lateral, up, forward]."""

LID_SHARE, LID_TURN = 0.2, np.deg2rad(30.0)
"""Share of a sideways turn of the eye that the lids follow, and that turn."""

LID_SHELL = (1.1, 1.75)
"""Skin nearer to the centre of a ball than the first follows it so, and none beyond the second, in its radii."""


@dataclass(frozen=True, eq=False)
class Movements:
    """The modelled movements of a face.

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
    >>> (Movements(face).jaw_forward()[chin] @ face.frame.axes.T).round(1) + 0.0
    array([ 0. , -1.3,  5.4])
    """

    face: Face

    @cached_property
    def lower(self) -> Array:
        """Share (n,) of the mandible's turn that each vertex takes: 1 on the lower lip, 0 on the upper one."""
        face, share = self.face, np.zeros(len(self.face.points))
        for name, weights in face.joint_weights.items():
            muscle = face.muscles[name]
            if isinstance(muscle, JawMuscle):
                share[weights.vertices] = weights.angles / muscle.angle
        return np.clip(share, 0.0, 1.0)

    @cached_property
    def _local(self) -> Array:
        """Places (n, 3) as [left, up, forward] from the middle of the lips, in distances between the pupils."""
        frame = self.face.frame
        return frame.local(self.face.points) - frame.local(lips_middle(self.face.landmarks))

    def _world(self, local: Array) -> Array:
        return np.asarray(local @ self.face.frame.axes * self.face.frame.pupil_distance)

    def mandible(self, name: str) -> Array:
        """Return the matrix (4, 4) that moves the mandible in a modelled movement; the identity if it stays."""
        frame, out = self.face.frame, np.eye(4)
        hinges = [m.hinge for m in self.face.muscles.values() if isinstance(m, JawMuscle)]
        if name == "jaw_forward":
            out[:3, 3] = self._world(np.array([0.0, -DOWN, FORWARD]))
        elif name in ("jaw_left", "jaw_right") and hinges:
            chin = self.face.landmarks["pogonion"]
            hinge = hinges[0] - ((hinges[0] - frame.origin) @ frame.axes[0]) * frame.axes[0]
            lever = float((chin - hinge) @ frame.axes[2]) / frame.pupil_distance
            angle = np.arcsin(ASIDE / max(lever, 2.0 * ASIDE)) * (1.0 if name == "jaw_left" else -1.0)
            turn = Rotation.from_rotvec(angle * frame.axes[1]).as_matrix()
            out[:3, :3], out[:3, 3] = turn, hinge - turn @ hinge
        return out

    def _with_jaw(self, name: str) -> Array:
        matrix, points = self.mandible(name), self.face.points
        return np.asarray(self.lower[:, None] * (points @ matrix[:3, :3].T + matrix[:3, 3] - points))

    def jaw_forward(self) -> Array:
        """Displacement (n, 3) of a jaw that is thrust forward."""
        return self._with_jaw("jaw_forward")

    def jaw_left(self) -> Array:
        """Displacement (n, 3) of a jaw that goes to the subject's left."""
        return self._with_jaw("jaw_left")

    def jaw_right(self) -> Array:
        """Displacement (n, 3) of a jaw that goes to the subject's right."""
        return self._with_jaw("jaw_right")

    def mouth_left(self) -> Array:
        """Displacement (n, 3) of a mouth that slides to the subject's left around the dental arch."""
        return self._aside(1.0)

    def mouth_right(self) -> Array:
        """Displacement (n, 3) of a mouth that slides to the subject's right."""
        return self._aside(-1.0)

    def _aside(self, sign: float) -> Array:
        local = self._local
        away = np.linalg.norm(local * [1.0, 1.25, 0.8], axis=1) / MOUTH_REACH
        weight = smoothstep((1.0 - away) / 0.8)
        angle, centre = sign * MOUTH_ASIDE / ARCH * weight, np.array([0.0, 0.0, -ARCH])
        x, z = local[:, 0] - centre[0], local[:, 2] - centre[2]
        cos, sin = np.cos(angle), np.sin(angle)
        moved = np.stack([cos * x + sin * z - x, np.zeros(len(x)), cos * z - sin * x - z], axis=1)
        return self._world(moved)

    def puff(self) -> Array:
        """Displacement (n, 3) of cheeks and lips under pressure from inside: a membrane held at the rim of the cheeks.

        Its displacement u solves ``-laplace u = p n`` (p the pressure, n the normals), with u = 0 at the rim; the
        lining behind the lips, on which the pressure does not act, goes along.
        """
        face, local = self.face, self._local
        tall = np.where(local[:, 1] > 0.0, PUFF_ABOVE, PUFF_BELOW)
        ways = np.stack([local[:, 0] / PUFF_WIDTH, local[:, 1] / tall, np.minimum(local[:, 2], 0.0) / PUFF_DEPTH])
        away = np.linalg.norm(ways, axis=0)
        pressure = (1.0 - smoothstep((away - 0.6) / 0.4)) * (face.cavities.depth(face.points) <= 0.0)
        normals = vertex_normals(face.points, face.triangles)
        field = _membrane(face.points, face.triangles, pressure[:, None] * normals, away > 1.0)
        top = float(np.linalg.norm(field, axis=1).max())
        return np.asarray(field / max(top, 1e-300) * PUFFED * face.frame.pupil_distance)

    def roll_upper(self) -> Array:
        """Displacement (n, 3) of an upper lip that rolls in over the teeth."""
        return self._rolled(1.0, 1.0 - self.lower)

    def roll_lower(self) -> Array:
        """Displacement (n, 3) of a lower lip that rolls in over the teeth."""
        return self._rolled(-1.0, self.lower)

    def _rolled(self, sign: float, lip: Array) -> Array:
        local, half = self._local, self._half_width
        y, z = sign * local[:, 1] - ROLL_AXIS[0], local[:, 2] - ROLL_AXIS[1]
        outside = 1.0 - smoothstep(np.hypot(y, z) / ROLL_SIZE - 0.6)
        weight = outside * lip * (1.0 - smoothstep((np.abs(local[:, 0]) / half - 0.35) / 0.75))
        angle = ROLL_ANGLE * weight
        cos, sin = np.cos(angle), np.sin(angle)  # towards the axis is up for the lower lip: its margin goes back
        moved = np.stack([np.zeros(len(y)), sign * (cos * y - sin * z - y), sin * y + cos * z - z], axis=1)
        return self._world(moved)

    def lift_upper(self) -> Array:
        """Displacement (n, 3) of an upper lip that the lower one pushes up."""
        local = self._local - [0.0, 0.06, 0.0]
        weight = np.exp(-((local / LIFT_SIZE) ** 2).sum(axis=1)) * (1.0 - self.lower)
        weight = np.where(weight > 0.02, weight - 0.02, 0.0)
        return self._world(LIFTED * weight[:, None] * np.array([0.0, 1.0, 0.15]))

    def lids_in(self) -> Array:
        """Displacement (n, 3) of the lids of eyes that look at the nose."""
        return self._lids_aside(-1.0)

    def lids_out(self) -> Array:
        """Displacement (n, 3) of the lids of eyes that look away from the nose."""
        return self._lids_aside(1.0)

    def _lids_aside(self, outwards: float) -> Array:
        moved, points = np.zeros_like(self.face.points), self.face.points
        for eye in self.face.eyes:
            offset = points - eye.centre
            away = np.linalg.norm(offset, axis=1) / eye.radius
            weight = 1.0 - smoothstep((away - LID_SHELL[0]) / (LID_SHELL[1] - LID_SHELL[0]))
            near = np.flatnonzero((weight > 0.0) & (offset @ eye.gaze > 0.0))
            angle = outwards * (1.0 if eye.side == "l" else -1.0) * LID_SHARE * LID_TURN * weight[near]
            moved[near] = turned(offset[near], eye.up, angle)
        return moved

    def seal(self, moved: Array) -> Array:
        """Displacement (n, 3) that closes lips which a displacement `moved` (n, 3) has parted.

        Opposite points of the lips come as close as they are at rest, and the skin around bends as little as it can: of
        all displacements that do so, this has the least squares of the Laplacian.
        """
        upper, lower = self._pairs
        target, (free, bending, solve) = np.zeros(moved.shape), self._sealing
        target[lower] = (1.0 - SEAL_UP) * moved[upper] - moved[lower]
        target[upper] = -SEAL_UP * moved[upper]
        target[free] = solve(-(bending[:, free].T @ (bending @ target)))
        return target

    @cached_property
    def _sealing(self) -> tuple[IntArray, csr_array, Callable[[Array], Array]]:
        """Vertices that follow sealed lips, the bending (n, n) of the skin, and what solves its least squares."""
        held = np.zeros(len(self.face.points), bool)
        held[np.concatenate(self._pairs)] = True
        near = np.linalg.norm(self._local, axis=1) < SEAL_REACH
        free = np.flatnonzero(near & ~held)
        points = self.face.points / self.face.frame.pupil_distance
        area = vertex_areas(points, self.face.triangles)
        weights = diags_array(1.0 / np.sqrt(np.maximum(area, 1e-9)))
        bending = csr_array(weights @ cotangent_laplacian(points, self.face.triangles))
        system = bending[:, free]
        damped = system.T @ system + 1e-6 * diags_array(np.ones(len(free)))
        return free, bending, splu(damped.tocsc()).solve

    @cached_property
    def _half_width(self) -> float:
        """Half the width of the mouth."""
        ends = [self.face.frame.local(self.face.landmarks[f"mouth_{side}"])[0] for side in "lr"]
        return 0.5 * float(ends[0] - ends[1])

    @cached_property
    def _pairs(self) -> tuple[IntArray, IntArray]:
        """Vertices of the upper lip and of the lower one that lie opposite each other at rest."""
        local, size = self._local, self.face.frame.pupil_distance
        near = (np.abs(local[:, 0]) < 1.05 * self._half_width) & (np.abs(local[:, 1]) < 0.2) & (local[:, 2] > -0.25)
        upper, lower = (np.flatnonzero(near & part) for part in (self.lower < 0.35, self.lower > 0.65))
        if not len(upper) or not len(lower):
            return np.empty(0, np.int64), np.empty(0, np.int64)
        points = self.face.points / size
        there, back = cKDTree(points[lower]), cKDTree(points[upper])
        gaps, partner = there.query(points[upper])
        other_gaps, other = back.query(points[lower])
        close, other_close = gaps < SEALED_WITHIN, other_gaps < SEALED_WITHIN
        pairs = np.concatenate(
            [
                np.stack([upper[close], lower[partner[close]]], axis=1),
                np.stack([upper[other[other_close]], lower[other_close]], axis=1),
            ]
        )
        gap = np.concatenate([gaps[close], other_gaps[other_close]])
        touching = gap <= np.quantile(gap, 0.35)
        pairs = np.unique(pairs[touching], axis=0)
        return pairs[:, 0], pairs[:, 1]


def _membrane(points: Array, triangles: npt.NDArray[np.int32], pressure: Array, held: npt.NDArray[np.bool_]) -> Array:
    """Displacement (n, 3) of a membrane under pressure (n, 3) that is held at some vertices."""
    laplacian, free = cotangent_laplacian(points, triangles), np.flatnonzero(~held)
    out = np.zeros_like(points)
    if len(free):
        load = (vertex_areas(points, triangles)[:, None] * pressure)[free]
        out[free] = splu(laplacian[free][:, free].tocsc()).solve(load)
    return out


ADDED: Mapping[str, Callable[[Movements, Array], Array]] = MappingProxyType(
    {
        "puff": lambda m, _: m.puff(),
        "jaw_forward": lambda m, _: m.jaw_forward(),
        "jaw_left": lambda m, _: m.jaw_left(),
        "jaw_right": lambda m, _: m.jaw_right(),
        "mouth_left": lambda m, _: m.mouth_left(),
        "mouth_right": lambda m, _: m.mouth_right(),
        "roll_upper": lambda m, _: m.roll_upper(),
        "roll_lower": lambda m, _: m.roll_lower(),
        "lift_upper": lambda m, _: m.lift_upper(),
        "lids_in": lambda m, _: m.lids_in(),
        "lids_out": lambda m, _: m.lids_out(),
        "seal": lambda m, moved: m.seal(moved),
    }
)
"""Movements by name: each is given what the others have moved so far, and is added to it."""
