"""The mass-spring skin: how muscles move the face (the base mesh M0).

Each vertex is a mass, each edge a biphasic spring; bending stiffness keeps the skin smooth, tethers of soft tissue hold
every vertex to its foot on the bone, stiffer along the normal than along the surface (skin glides), and muscles pull.
All weights are by area, so that the mesh does not shape the motion. A step is implicit Euler: the positions minimise
the sum of inertia and energy, found by a quasi-Newton iteration with a constant, prefactored matrix and a line search,
so that it is stable at any time step.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from ..anatomy.face import Face
from ..anatomy.joint_weights import JointWeights, turned
from ..errors import ParameterError, check_range, unknown_name
from ..geometry.laplacian import cotangent_laplacian, graph_laplacian
from ..geometry.nested_dissection import nested_dissection
from ..geometry.normals import vertex_areas, vertex_normals
from ..geometry.topology import unique_edges, vertex_rings
from . import _skin_kernels as kernels
from .constraints import on_gums, tip_of_nose
from .contacts import STIFFNESS, Contacts, lip_tethers

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class SkinMaterial:
    """Mechanics of the skin, relative to its membrane stiffness of 1. Lengths in mm, times in s.

    Attributes
    ----------
    decay : float
        Distance over which a local pull dies out on the forehead: sqrt(membrane stiffness / stiffness of the tethers).
    normal_ratio : float
        How much stiffer the tethers are along the normal than along the surface.
    bending : float
        Biharmonic bending stiffness, mm^2.
    threshold, stiffening : float
        Strain beyond which a spring is stiffer, and by how many times its stiffness.
    pull : float
        What a muscle of strength 1 would move wide, free skin of the forehead by, mm.
    rate : float
        Natural frequency of the skin on its tethers, rad/s.
    damping : float
        Relative to critical damping.
    smallest_area : float
        Triangles are kept from falling below this share of their area.
    lid_stiffness : float
        Of the tethers of the lids' plates, relative to the forehead's.
    lip_firmness : float
        How much stiffer the tethers of the lips are along the surface: flesh does not glide as skin on bone does.
    cartilage : float
        How much stiffer than skin the tip of the nose is: it goes along, and stays whole, when its wings rise.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> soft = fw.SkinMaterial(decay=20.0, damping=0.3)  # felt further away, and it swings
    >>> sim = fw.Simulation(fw.default_face(), material=soft)
    """

    decay: float = 14.0
    normal_ratio: float = 6.0
    bending: float = 20.0
    threshold: float = 0.3
    stiffening: float = 2.0
    pull: float = 18.0
    rate: float = 30.0
    damping: float = 1.0
    smallest_area: float = 0.3
    lid_stiffness: float = 5000.0
    lip_firmness: float = 1.3
    cartilage: float = 10.0

    def __post_init__(self) -> None:
        for name, value in dataclasses.asdict(self).items():
            smallest = 1e-6 if name in ("decay", "rate", "normal_ratio") else 0.0
            check_range(name, value, smallest, 1e9)


class Skin:
    """The skin of a face, moved by the contraction rates of its muscles.

    Parameters
    ----------
    face : Face
    time_step : float
        Seconds per step, > 0; any value is stable.
    material : SkinMaterial, optional
    iterations : int
        Quasi-Newton iterations per step at most; fewer are made once the step has converged.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Rest positions, mm.
    displacement, velocity : ndarray, shape (n, 3)
        mm and mm/s.

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

    def __init__(
        self, face: Face, time_step: float = 0.02, material: SkinMaterial | None = None, iterations: int = 3
    ) -> None:
        if not (np.isfinite(time_step) and time_step > 0.0):
            raise ParameterError(f"time_step must be a positive number of seconds, received {time_step!r}.")
        if not iterations >= 1:
            raise ParameterError(f"iterations must be at least 1, received {iterations!r}.")
        self.material = material or SkinMaterial()
        self.time_step = float(time_step)
        self.iterations = int(iterations)
        self.names = tuple(face.muscles)
        self.points = face.points * face.unit
        self._build_membrane(face)
        self._build_ties(face)
        self._build_contacts(face)
        stiffness = self._stiffness_matrices()
        resistance = np.mean([matrix.diagonal() for matrix in stiffness], axis=0)
        self.contacts = Contacts(face, resistance, self._area)
        self._pull = csr_array(self._forces(face).reshape(len(self.names), -1).T)
        self._bone_weight = STIFFNESS * resistance[self._stopped]
        self._factor(stiffness)
        self.reset()

    # --- what the skin is made of -------------------------------------------------------------

    def _build_membrane(self, face: Face) -> None:
        points, self._triangles = self.points, face.triangles
        edges, sides = unique_edges(self._triangles)
        self._rest = np.ascontiguousarray(points[edges[:, 1]] - points[edges[:, 0]])
        self._length = np.linalg.norm(self._rest, axis=1)
        a, b, c = (points[self._triangles[:, k]] for k in range(3))
        cross = np.cross(b - a, c - a)
        self._double_area = np.linalg.norm(cross, axis=1)
        self._facing = cross / self._double_area[:, None]
        beside = np.bincount(sides.ravel(), np.repeat(0.5 * self._double_area, 3), minlength=len(edges))
        # Van Gelder: springs of this stiffness behave like a membrane of stiffness 1, whatever the triangles.
        firm = 1.0 + self.material.cartilage * tip_of_nose(face)[0][edges].min(axis=1)
        self._stiffness = firm * beside / self._length**2
        self._area = vertex_areas(points, self._triangles)
        laplacian = cotangent_laplacian(points, self._triangles)
        full = self.material.bending
        stiffness = np.full(len(points), full)
        for guide in face.joint_weights.values():  # lids have the thinnest skin of the body
            thin = (1.0 - 0.97 * guide.hold) * full
            stiffness[guide.vertices] = np.minimum(stiffness[guide.vertices], thin)
        bending = laplacian.T @ diags_array(stiffness / self._area) @ laplacian
        self._bending = csr_array(0.5 * (bending + bending.T))
        # Unsigned, for the loops: no number counts from the end.
        self._edges, self._corners, self._bent = (
            i.astype(np.uint32) for i in (edges, self._triangles, self._bending.indices)
        )

    def _build_ties(self, face: Face) -> None:
        m = self.material
        base = self._area / m.decay**2
        lips, directions = lip_tethers(face)
        self._normals = np.ascontiguousarray(directions)
        tethers = base * face.tissue.stiffness * (1.0 - tip_of_nose(face)[1])
        plates = np.zeros_like(tethers)
        shares = {}
        for name, guide in face.joint_weights.items():
            plate = base[guide.vertices] * m.lid_stiffness * guide.hold
            shares[name] = np.ones(len(plate)) if guide.bone else plate / (plate + tethers[guide.vertices])
            plates[guide.vertices] = np.maximum(plates[guide.vertices], plate)
        self._guides = {
            name: (dataclasses.replace(guide, centre=guide.centre * face.unit), shares[name])
            for name, guide in face.joint_weights.items()
        }
        self._carried = {
            name: self._turns_of_triangles(guide, shares[name]) for name, guide in face.joint_weights.items()
        }
        self._along = (1.0 + m.lip_firmness * lips) * tethers + plates
        self._across = m.normal_ratio * tethers + plates

    def _turns_of_triangles(self, guide: JointWeights, share: Array) -> tuple[npt.NDArray[np.int64], Array]:
        """Triangles that a guide carries, and their angles."""
        angles = np.zeros(len(self.points))
        angles[guide.vertices] = share * guide.angles
        mean = angles[self._triangles].mean(axis=1)
        faces = np.flatnonzero(mean)
        return faces, mean[faces]

    def _forces(self, face: Face) -> Array:
        """Force (k, n, 3) of each muscle at full contraction."""
        m, n = self.material, self._normals
        pull, pulled = np.zeros((len(self.names), len(self.points), 3)), 1.0 - on_gums(face)
        for k, muscle in enumerate(face.muscles.values()):
            force = muscle.force(face.points) * (muscle.strength * m.pull / m.decay**2)
            out = (force * n).sum(axis=1, keepdims=True)
            force -= (1.0 - muscle.normal_share) * out * n
            swell = muscle.swell * muscle.strength * m.pull / m.decay**2
            force += (swell * muscle.bunched(face.points))[:, None] * n
            pull[k] = force * (self._area * pulled)[:, None]
        for name, (guide, share) in self._guides.items():
            pull[self.names.index(name)][guide.vertices] *= (1.0 - share)[:, None]
        closing = np.array([muscle.closing * muscle.strength for muscle in face.muscles.values()])
        some = np.flatnonzero(closing)
        pull[some] += (closing[some] * m.pull / m.decay**2)[:, None, None] * self.contacts.closing()
        return pull

    def _build_contacts(self, face: Face) -> None:
        self._anchors = np.ascontiguousarray(face.tissue.anchors * face.unit)
        self._bone_normals = vertex_normals(self._anchors, self._triangles)
        self._anchors[~face.tissue.solid] = FAR
        self._ring = vertex_rings(self._triangles, len(self.points))
        self._stopped = self._bone = np.arange(len(self.points))
        self._nearest = self._bone.copy()
        self._stop_at_bone(np.zeros_like(self.points))
        # Only skin that the bone lies straight below is stopped by it.
        below = (self.points - self._anchors[self._nearest]) * self._bone_normals[self._nearest]
        depth = face.tissue.depth * face.unit
        self._stopped = np.flatnonzero((below.sum(axis=1) > 0.25 * depth) & (np.abs(below).sum(axis=1) < 2.0 * depth))
        self._bone = self._nearest.copy()

    def _stiffness_matrices(self) -> list[csr_array]:
        """One matrix per coordinate that stands for the curvature of the skin's energy; the line search covers what it
        leaves out: springs beyond their threshold, and turned ones.
        """
        direction, tethers = np.abs(self._rest / self._length[:, None]), np.abs(self._normals)
        matrices = []
        for k in range(3):
            # |e_k| sum|e| on the diagonal dominates the outer product e e^T (Gershgorin), and so for the normals.
            weight = self._stiffness * direction[:, k] * direction.sum(axis=1) * (1.0 + 0.25 * self.material.stiffening)
            tie = self._along + (self._across - self._along) * tethers[:, k] * tethers.sum(axis=1)
            matrices.append(
                self._bending + graph_laplacian(self._edges.astype(np.int32), weight, len(tie)) + diags_array(tie)
            )
        return matrices

    def _factor(self, stiffness: list[csr_array]) -> None:
        m, h = self.material, self.time_step
        self._mass = self._area / (m.decay * m.rate) ** 2
        self._drag = 2.0 * m.damping * m.rate * h
        inertia = diags_array(self._mass * (1.0 + self._drag) / h**2)
        self._solver = _Factors([matrix + inertia for matrix in stiffness], self.points)

    # --- use ----------------------------------------------------------------------------------

    def reset(self) -> None:
        """Back to rest, without motion, all muscles relaxed."""
        shape = self.points.shape
        self.displacement, self.velocity = np.zeros(shape), np.zeros(shape)
        self.rates = np.zeros(len(self.names))
        self._shift, self._force, self._upright = np.zeros(shape), np.zeros(shape), self._facing
        self._nearest = self._bone.copy()
        self._memory: list[tuple[Array, Array, float]] = []

    def contract(self, rates: Mapping[str, float]) -> None:
        """Set the contraction rates of all muscles; those not named relax.

        Raises
        ------
        UnknownNameError, ParameterError
            For a muscle that the face does not have, or a rate outside [0, 1].
        """
        self.set_rates(self.rates_of(rates))

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """Contraction rates (k,) in the order of `names`, checked; muscles that are not named get 0.

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
        self._shift, self._upright = np.zeros_like(self.points), self._facing.copy()
        for name, (guide, share) in self._guides.items():
            rate = rates[self.names.index(name)]
            for other in guide.yields:
                if other in self.names:
                    rate *= 1.0 - rates[self.names.index(other)]
            if rate > 0.0:
                self._shift[guide.vertices] += share[:, None] * guide.turned(self.points, rate)
                # Triangles are guarded from turning over as they are carried.
                faces, angles = self._carried[name]
                self._upright[faces] += turned(self._upright[faces], guide.axis, rate * angles)

    def step(self) -> Array:
        """Advance by one time step; returns the positions (n, 3) in mm."""
        old, h = self.displacement, self.time_step
        target = old + h * self.velocity
        u = self._minimised(target, old)
        self._stop_at_bone(u)
        self.contacts.keep_off_eyes(u)
        self.displacement, self.velocity = u, (u - old) / h
        return self.points + u

    def _stop_at_bone(self, u: Array) -> None:
        bone = self._anchors, self._bone_normals, self._bone, self._nearest
        kernels.keep_off_bone(u, self.points, self._stopped, *bone, *self._ring)

    def energy(self) -> float:
        """Kinetic plus potential energy; without the work of the muscles, in units of the membrane stiffness times
        mm^2.
        """
        kinetic = 0.5 * float((self._mass[:, None] * self.velocity**2).sum())
        return kinetic + self._potential(self.displacement, np.empty_like(self.displacement))

    # --- one step -----------------------------------------------------------------------------

    def _potential(self, u: Array, gradient: Array) -> float:
        """Energy of springs, inversion barrier, bending, tethers and contacts; writes its gradient to `gradient`."""
        m = self.material
        gradient[:] = 0.0
        energy = kernels.springs(
            u, self._edges, self._rest, self._length, self._stiffness, m.threshold, m.stiffening, gradient
        )
        energy += kernels.inversion_barrier(
            u, self._corners, self.points, self._upright, self._double_area, m.smallest_area, GUARD, gradient
        )
        b = self._bending
        energy += kernels.tethers(
            u, self._shift, self._normals, self._along, self._across, b.indptr, self._bent, b.data, gradient
        )
        energy += kernels.bone(
            u, self.points, self._stopped, self._anchors, self._bone_normals, self._nearest, OFF_BONE,
            self._bone_weight, gradient,
        )  # fmt: skip
        return float(energy) + self.contacts.energy(u, self._shift, gradient)

    def _objective(self, u: Array, target: Array, old: Array, gradient: Array) -> float:
        """What implicit Euler minimises: inertia, drag, potential, and the work of the muscles."""
        value = self._potential(u, gradient)
        return value + kernels.inertia(u, target, old, self._mass, self._drag, self.time_step, self._force, gradient)

    def _minimised(self, target: Array, old: Array) -> Array:
        """L-BFGS with the prefactored matrix as the first guess of the curvature, and a backtracking line search."""
        gradient, trial = np.empty_like(old), np.empty_like(old)
        u = old.copy()
        value = self._objective(u, target, old, gradient)
        enough = ENOUGH * self._residual(gradient)
        for _ in range(self.iterations):
            direction = -self._inverse_curvature(gradient)
            slope = _inner(direction, gradient)
            if slope >= 0.0:
                self._memory.clear()
                direction = -self._solver.solved(gradient)
                slope = _inner(direction, gradient)
            if -slope < TOLERANCE * self._area.sum():
                break
            length = 1.0
            for _ in range(MAX_HALVINGS):
                candidate = u + length * direction
                new = self._objective(candidate, target, old, trial)
                if new <= value + 1e-4 * length * slope + ROUNDING * abs(value):
                    break
                length *= 0.5
            else:
                self._memory.clear()
                break
            self._remember(candidate - u, trial - gradient)
            u, value = candidate, new
            gradient, trial = trial, gradient
            if self._residual(gradient) < enough:
                break
        return u

    def _residual(self, gradient: Array) -> float:
        return float(np.einsum("nk,nk,n->", gradient, gradient, 1.0 / self._area))

    def _inverse_curvature(self, gradient: Array) -> Array:
        """The two loops of L-BFGS over the remembered steps."""
        q, taken = gradient.copy(), []
        for step, change, curvature in reversed(self._memory):
            taken.append(kernels.two_loop_update(q, change, step, curvature, 0.0))
        q = self._solver.solved(q)
        for (step, change, curvature), share in zip(self._memory, reversed(taken), strict=True):
            kernels.two_loop_update(q, step, change, curvature, share)
        return q

    def _remember(self, step: Array, change: Array) -> None:
        curvature = _inner(step, change)
        if curvature > 1e-12 * _inner(step, step):
            self._memory = [*self._memory[-(MEMORY - 1) :], (step, change, curvature)]


def _inner(left: Array, right: Array) -> float:
    return float(np.vdot(left, right))


class _Factors:
    """Factors L D L^T of symmetric matrices of one pattern, one per coordinate, kept side by side.

    Kept in single precision: they only guess which way to go, and how fast they are read is how fast they are solved.
    """

    def __init__(self, matrices: list[csr_array], points: Array) -> None:
        n = len(points)
        self._inverse, self._scratch = np.empty((n, 3)), np.empty((n, 3))
        order, ordering = np.arange(n), "MMD_AT_PLUS_A"
        if n > LARGE:
            order, ordering = nested_dissection((matrices[0].indptr, matrices[0].indices), points), "NATURAL"
        options = {"SymmetricMode": True}
        for k, matrix in enumerate(matrices):  # one by one: on fine meshes factors take gigabytes
            ordered = matrix[order][:, order].tocsc()
            self._keep(k, order, splu(ordered, permc_spec=ordering, diag_pivot_thresh=0.0, options=options))

    def _keep(self, k: int, order: npt.NDArray[np.int64], factor: SuperLU) -> None:
        """Of the factors of coordinate k what the solution needs."""
        self._inverse[:, k] = 1.0 / factor.U.diagonal()
        lower = factor.L.tocsc()
        lower.sort_indices()
        if k == 0:
            self._pattern = lower.indptr, lower.indices.astype(np.uint32)
            self._lower = np.empty((lower.nnz, 3), np.float32)
            self._order = np.empty_like(factor.perm_r), np.empty_like(factor.perm_c)
            self._order[0][order], self._order[1][order] = factor.perm_r, factor.perm_c
        self._lower[:, k] = lower.data

    def solved(self, right: Array) -> Array:
        """The solutions (n, 3) for the right-hand sides (n, 3)."""
        out = np.empty_like(right)
        kernels.solve(*self._pattern, self._lower, self._inverse, *self._order, right, self._scratch, out)
        return out


LARGE = 50_000
"""Vertices from which on nested dissection orders the factors: minimum degree takes many times as long there, and
leaves a twentieth less below.
"""
TOLERANCE = 1e-18
"""Predicted decrease of the energy per area at which a step has converged: displacements of less than 1e-6 mm."""
ENOUGH = 0.05
"""Share of the squared residual that is left to the next step."""
ROUNDING = 1e-14
FAR = 1e6
OFF_BONE = 0.15
"""From so far above the bone on the skin is pushed off it, mm."""
MAX_HALVINGS = 12
MEMORY = 5
GUARD = 20.0
"""Stiffness of the inversion barrier against triangles that turn over, relative to the membrane stiffness."""
