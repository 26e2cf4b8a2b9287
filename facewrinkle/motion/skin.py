"""The mass-spring skin: muscles move the face, as the base mesh M0.

Each vertex is a mass, each edge a biphasic spring. Bending stiffness keeps the skin smooth, tethers of soft tissue hold
every vertex to its anchor on the bone, stiffer along the normal than along the surface (skin glides), and muscles pull.
All weights are by area, so that the triangles hardly affect the motion. A step is implicit Euler, which is stable at
any time step: the positions minimise the sum of inertia and energy.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array

from ..anatomy.face import Face
from ..anatomy.joint_weights import JointWeights, turned
from ..errors import ParameterError, check_range, unknown_name
from ..geometry.laplacian import cotangent_laplacian, graph_laplacian
from ..geometry.normals import vertex_areas, vertex_normals
from ..geometry.topology import unique_edges, vertex_rings
from . import _skin_kernels as kernels
from .base import NONE_BY_NAME
from .constraints import on_gums, tip_of_nose
from .contacts import CONTACT_STIFFNESS, Contacts, lip_tethers
from .material import SkinMaterial
from .minimiser import Minimiser
from .skin_mesh import SKIN_VERTICES, SkinMesh

__all__ = ["Skin", "SkinMaterial"]

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.integer]

NOWHERE = 1e6
"""Coordinates of anchors without solid bone, mm: no skin comes near them."""

OFF_BONE = 0.15
"""Distance from the bone at which the skin begins to be pushed off it, mm."""

INVERSION_STIFFNESS = 20.0
"""Stiffness of the inversion barrier against triangles that turn over, relative to the membrane stiffness."""

THIN_LIDS = 0.97
"""Share of its bending stiffness that the skin of the lids, the thinnest of the body, lacks."""


class Skin:
    """The skin of a face, moved by the contraction rates of its muscles.

    Parameters
    ----------
    face : Face
    time_step : float
        Seconds per step, > 0; any value is stable.
    material : SkinMaterial, optional
    iterations : int
        The most quasi-Newton iterations per step; fewer are made if the step converges.
    vertices : int, optional
        A face with more than 1.5 times as many vertices is simulated on a coarser mesh of about this many, which its
        own vertices follow smoothly. None: every vertex is simulated, however many there are.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Rest positions, mm.
    displacement, velocity : ndarray, shape (n, 3)
        mm and mm/s.
    mesh : SkinMesh
        The mesh on which the skin is simulated.
    names : tuple of str
        The face's muscles.
    rates : ndarray, shape (k,)
        Their contraction rates.
    contacts : Contacts
        Contacts with the eyeballs, the other lip and the teeth.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> skin = Skin(fw.default_face())
    >>> skin.contract({"frontalis_inner_l": 1.0})
    >>> for _ in range(20):
    ...     moved = skin.step()
    >>> bool(skin.displacement[:, 1].max() > 3.0)
    True
    """

    pose: Array | None = None
    gazes: Mapping[str, Array] = NONE_BY_NAME
    parts: Mapping[str, Array] = NONE_BY_NAME

    def __init__(
        self,
        face: Face,
        time_step: float = 0.02,
        material: SkinMaterial | None = None,
        iterations: int = 3,
        vertices: int | None = SKIN_VERTICES,
    ) -> None:
        if not (np.isfinite(time_step) and time_step > 0.0):
            raise ParameterError(f"time_step must be a positive number of seconds, received {time_step!r}.")
        if not iterations >= 1:
            raise ParameterError(f"iterations must be at least 1, received {iterations!r}.")
        m = self.material = material or SkinMaterial()
        self.time_step = float(time_step)
        self.names = tuple(face.muscles)
        self.points, self.mesh = face.points * face.unit, SkinMesh(face, vertices)
        face = self.mesh.face
        self._rest_points, self._triangles = face.points * face.unit, face.triangles
        self._area = vertex_areas(self._rest_points, self._triangles)
        self._build_springs(face)
        self._build_bending(face)
        self._build_tethers(face)
        self._build_bone(face)
        stiffness = self._stiffness_matrices()
        resistance = np.mean([matrix.diagonal() for matrix in stiffness], axis=0)
        self.contacts = Contacts(face, resistance, self._area)
        self._bone_weight = CONTACT_STIFFNESS * resistance[self._over_bone]
        self._pull = csr_array(self._forces(face).reshape(len(self.names), -1).T)
        self._mass = self._area / (m.decay * m.rate) ** 2
        self._drag = 2.0 * m.damping * m.rate * self.time_step
        inertia = diags_array(self._mass * (1.0 + self._drag) / self.time_step**2)
        self._minimiser = Minimiser(
            [matrix + inertia for matrix in stiffness], self._rest_points, self._area, int(iterations)
        )
        self.reset()

    # --- what the skin is made of -------------------------------------------------------------

    def _build_springs(self, face: Face) -> None:
        """Springs along the edges, and the areas and normals of triangles that the inversion barrier compares with."""
        points = self._rest_points
        edges, sides = unique_edges(self._triangles)
        # Unsigned, for the loops: no number counts from the end.
        self._edges, self._corners = edges.astype(np.uint32), self._triangles.astype(np.uint32)
        self._rest = np.ascontiguousarray(points[edges[:, 1]] - points[edges[:, 0]])
        self._length = np.linalg.norm(self._rest, axis=1)
        a, b, c = (points[self._triangles[:, k]] for k in range(3))
        cross = np.cross(b - a, c - a)
        self._double_area = np.linalg.norm(cross, axis=1)
        self._facing = cross / self._double_area[:, None]
        area_of_edge = np.bincount(sides.ravel(), np.repeat(0.5 * self._double_area, 3), minlength=len(edges))
        # Van Gelder: springs of this stiffness behave like a membrane of stiffness 1, whatever the triangles.
        firm = 1.0 + self.material.cartilage * tip_of_nose(face)[0][edges].min(axis=1)
        self._stiffness = firm * area_of_edge / self._length**2

    def _build_bending(self, face: Face) -> None:
        laplacian = cotangent_laplacian(self._rest_points, self._triangles)
        full = self.material.bending
        stiffness = np.full(len(self._rest_points), full)
        for joint in face.joint_weights.values():
            thin = (1.0 - THIN_LIDS * joint.hold) * full
            stiffness[joint.vertices] = np.minimum(stiffness[joint.vertices], thin)
        bending = laplacian.T @ diags_array(stiffness / self._area) @ laplacian
        self._bending = csr_array(0.5 * (bending + bending.T))
        self._bent = self._bending.indices.astype(np.uint32)

    def _build_tethers(self, face: Face) -> None:
        """Tethers to the bone, their stiffness along and across the surface, and the joints that carry them."""
        m = self.material
        base = self._area / m.decay**2
        lips, directions = lip_tethers(face)
        self._normals = np.ascontiguousarray(directions)
        tethers = base * face.tissue.stiffness * (1.0 - tip_of_nose(face)[1])
        plates = np.zeros_like(tethers)
        self._joints: dict[str, tuple[JointWeights, Array]] = {}
        self._turning: dict[str, tuple[IntArray, Array]] = {}
        for name, joint in face.joint_weights.items():
            plate = base[joint.vertices] * m.lid_stiffness * joint.hold
            share = np.ones(len(plate)) if joint.bone else plate / (plate + tethers[joint.vertices])
            plates[joint.vertices] = np.maximum(plates[joint.vertices], plate)
            self._joints[name] = dataclasses.replace(joint, centre=joint.centre * face.unit), share
            self._turning[name] = self._turning_triangles(joint, share)
        self._along = (1.0 + m.lip_firmness * lips) * tethers + plates
        self._across = m.normal_ratio * tethers + plates

    def _turning_triangles(self, joint: JointWeights, share: Array) -> tuple[IntArray, Array]:
        """Return the triangles (j,) that a joint turns, and their angles (j,) at full contraction."""
        angles = np.zeros(len(self._rest_points))
        angles[joint.vertices] = share * joint.angles
        mean = angles[self._triangles].mean(axis=1)
        triangles = np.flatnonzero(mean)
        return triangles, mean[triangles]

    def _build_bone(self, face: Face) -> None:
        """Anchors on the skull, and the vertices that the skull stops."""
        n = len(self._rest_points)
        self._anchors = np.ascontiguousarray(face.tissue.anchors * face.unit)
        self._bone_normals = vertex_normals(self._anchors, self._triangles)
        self._anchors[~face.tissue.solid] = NOWHERE
        self._ring = vertex_rings(self._triangles, n)
        # The walk over the skull begins at each vertex's own anchor, and finds the nearest one.
        self._over_bone = self._bone_at_rest = np.arange(n)
        self._bone_now = self._bone_at_rest.copy()
        self._stop_at_bone(np.zeros_like(self._rest_points))
        self._bone_at_rest = self._bone_now.copy()
        # Only skin that the bone lies straight below is stopped by it.
        above = (self._rest_points - self._anchors[self._bone_at_rest]) * self._bone_normals[self._bone_at_rest]
        depth = face.tissue.depth * face.unit
        straight = (above.sum(axis=1) > 0.25 * depth) & (np.abs(above).sum(axis=1) < 2.0 * depth)
        self._over_bone = np.flatnonzero(straight)

    def _forces(self, face: Face) -> Array:
        """Return the force (k, n, 3) of each muscle at full contraction."""
        m, n = self.material, self._normals
        pull, pulled = np.zeros((len(self.names), len(self._rest_points), 3)), 1.0 - on_gums(face)
        for k, muscle in enumerate(face.muscles.values()):
            force = muscle.force(face.points) * (muscle.strength * m.pull / m.decay**2)
            out = (force * n).sum(axis=1, keepdims=True)
            force -= (1.0 - muscle.normal_share) * out * n
            swell = muscle.swell * muscle.strength * m.pull / m.decay**2
            force += (swell * muscle.bunched(face.points))[:, None] * n
            pull[k] = force * (self._area * pulled)[:, None]
        for name, (joint, share) in self._joints.items():
            pull[self.names.index(name)][joint.vertices] *= (1.0 - share)[:, None]
        closing = np.array([muscle.closing * muscle.strength for muscle in face.muscles.values()])
        some = np.flatnonzero(closing)
        pull[some] += (closing[some] * m.pull / m.decay**2)[:, None, None] * self.contacts.closing()
        return pull

    def _stiffness_matrices(self) -> list[csr_array]:
        """Return a matrix for each coordinate that approximates the curvature of the skin's energy.

        The line search makes up for effects that they leave out: springs beyond their threshold, and turned springs.
        """
        direction, tethers = np.abs(self._rest / self._length[:, None]), np.abs(self._normals)
        matrices = []
        for k in range(3):
            # |e_k| sum|e| on the diagonal dominates the outer product e e^T (Gershgorin), and so for the normals.
            weight = self._stiffness * direction[:, k] * direction.sum(axis=1) * (1.0 + 0.25 * self.material.stiffening)
            tether = self._along + (self._across - self._along) * tethers[:, k] * tethers.sum(axis=1)
            edges = graph_laplacian(self._edges.astype(np.int32), weight, len(tether))
            matrices.append(self._bending + edges + diags_array(tether))
        return matrices

    # --- use ----------------------------------------------------------------------------------

    @property
    def displacement(self) -> Array:
        """Displacement (n, 3) of the face's vertices, mm."""
        return self.mesh.follow(self._displacement)

    @displacement.setter
    def displacement(self, displacement: Array) -> None:
        self._displacement = displacement[self.mesh.vertices]

    @property
    def velocity(self) -> Array:
        """Velocity (n, 3) of the face's vertices, mm/s."""
        return self.mesh.follow(self._velocity)

    def reset(self) -> None:
        """Go back to rest, without motion, all muscles relaxed."""
        shape = self._rest_points.shape
        self._displacement, self._velocity = np.zeros(shape), np.zeros(shape)
        self.rates = np.zeros(len(self.names))
        self._force, self._shift, self._facing_now = np.zeros(shape), np.zeros(shape), self._facing
        self._bone_now = self._bone_at_rest.copy()
        self._minimiser.reset()

    def contract(self, rates: Mapping[str, float]) -> None:
        """Set the contraction rates of all muscles; those not named relax.

        Raises
        ------
        UnknownNameError, ParameterError
            For a muscle that the face does not have, or a rate outside [0, 1].
        """
        self.set_rates(self.rates_of(rates))

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """Return contraction rates (k,) in the order of `names`, checked; muscles that are not named get 0.

        Raises
        ------
        UnknownNameError, ParameterError
            For a muscle that the face does not have, or a rate outside [0, 1].
        """
        if not isinstance(rates, Mapping):
            raise ParameterError(
                f"rates must be a dictionary of muscles and rates, received {rates!r}. Names of expressions and action "
                "units are for express()."
            )
        out = np.zeros(len(self.names))
        for name, rate in rates.items():
            if name not in self.names:
                raise unknown_name("muscle", name, self.names)
            out[self.names.index(name)] = check_range(f"the contraction rate of {name}", rate, 0.0, 1.0)
        return out

    def set_rates(self, rates: Array) -> None:
        """Set the contraction rates (k,) in the order of `names`, without checks."""
        if np.array_equal(rates, self.rates):
            return
        self.rates = rates.copy()
        self._force = (self._pull @ rates).reshape(-1, 3)
        self._shift, self._facing_now = np.zeros_like(self._rest_points), self._facing.copy()
        for name, (joint, share) in self._joints.items():
            rate = rates[self.names.index(name)]
            for other in joint.yields:
                if other in self.names:
                    rate *= 1.0 - rates[self.names.index(other)]
            if rate > 0.0:
                self._shift[joint.vertices] += share[:, None] * joint.turned(self._rest_points, rate)
                # Triangles that a joint turns are kept from turning over relative to it.
                triangles, angles = self._turning[name]
                self._facing_now[triangles] += turned(self._facing_now[triangles], joint.axis, rate * angles)

    def step(self) -> Array:
        """Advance by one time step and return the positions (n, 3) in mm."""
        old, h = self._displacement, self.time_step
        target = old + h * self._velocity

        def objective(u: Array, gradient: Array) -> float:
            """Sum inertia, drag and potential energy, less the work of the muscles: implicit Euler minimises this."""
            value = self._potential(u, gradient)
            return value + kernels.inertia(u, target, old, self._mass, self._drag, h, self._force, gradient)

        u = self._minimiser.minimised(objective, old)
        self._stop_at_bone(u)
        self.contacts.keep_off_eyes(u)
        self._displacement, self._velocity = u, (u - old) / h
        return self.points + self.displacement

    def _stop_at_bone(self, u: Array) -> None:
        """Push vertices out that a step which did not converge has left in the bone."""
        bone = self._anchors, self._bone_normals, self._bone_at_rest, self._bone_now
        kernels.keep_off_bone(u, self._rest_points, self._over_bone, *bone, *self._ring)

    def energy(self) -> float:
        """Return kinetic plus potential energy without the work of the muscles, in membrane stiffness times mm^2."""
        kinetic = 0.5 * float((self._mass[:, None] * self._velocity**2).sum())
        return kinetic + self._potential(self._displacement, np.empty_like(self._displacement))

    def _potential(self, u: Array, gradient: Array) -> float:
        """Return the energy of springs, inversion barrier, bending, tethers and contacts; write its gradient."""
        m, bending = self.material, self._bending
        gradient[:] = 0.0
        energy = kernels.springs(
            u, self._edges, self._rest, self._length, self._stiffness, m.threshold, m.stiffening, gradient
        )
        energy += kernels.inversion_barrier(
            u, self._corners, self._rest_points, self._facing_now, self._double_area, m.smallest_area,
            INVERSION_STIFFNESS, gradient,
        )  # fmt: skip
        energy += kernels.tethers(
            u, self._shift, self._normals, self._along, self._across, bending.indptr, self._bent, bending.data, gradient
        )
        energy += kernels.bone(
            u, self._rest_points, self._over_bone, self._anchors, self._bone_normals, self._bone_now, OFF_BONE,
            self._bone_weight, gradient,
        )  # fmt: skip
        return float(energy) + self.contacts.energy(u, self._shift, gradient)
