"""The mass-spring skin: muscles move the face, as the base mesh M0.

Each vertex is a mass, each edge a biphasic spring. Bending stiffness keeps the skin smooth, tethers of soft tissue hold
every vertex to its anchor on the bone, stiffer along the normal than along the surface (skin glides), and muscles pull.
All weights are by area, so that the triangles hardly affect the motion. A step is implicit Euler, which is stable at
any time step: the positions minimize the sum of inertia and energy.
"""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array, diags_array

from ..anatomy import Face, Muscle, SphincterMuscle, per_face, within
from ..array_types import Array, IntArray
from ..errors import (
    LandmarkError,
    ParameterError,
    UnknownNameError,
    check_positive,
    check_range,
    check_type,
    check_whole,
    unknown_name,
)
from ..geometry import (
    cotangent_laplacian,
    double_areas,
    graph_laplacian,
    triangle_normals,
    unique_edges,
    unit,
    vertex_areas,
)
from . import _skin_kernels as kernels
from .base import NONE_BY_NAME
from .constraints import lip_tethers, modioli, on_gums, tip_of_nose
from .contacts import Contacts
from .joints import Joints
from .minimizer import Factors, Minimizer
from .self_contact import closing_forces, tied_lips
from .skin_mesh import SKIN_VERTICES, SkinMesh


@dataclass(frozen=True, kw_only=True)
class SkinMaterial:
    """Mechanics of the skin, relative to its membrane stiffness of 1. Lengths in mm, times in s.

    Attributes
    ----------
    decay : float
        Distance over which a local pull dies out on the forehead: sqrt(membrane stiffness / stiffness of the tethers).
    normal_ratio : float
        Stiffness of the tethers along the normal, relative to that along the surface, for tissue as on the forehead.
    bending : float
        Biharmonic bending stiffness, mm^2.
    threshold, stiffening : float
        Strain beyond which a spring gets stiffer, and the stiffness that is added then, relative to its own.
    pull : float
        Distance by which a muscle of strength 1 would move wide, free skin of the forehead, mm.
    rate : float
        Natural frequency of the skin on its tethers, rad/s.
    damping : float
        Relative to critical damping.
    smallest_area : float
        Triangles are kept from falling below this share of their area.
    lid_stiffness : float
        Stiffness of the tethers of the lids' plates, relative to those of the forehead.
    lip_firmness : float
        Stiffness that is added to the tethers of the lips along the surface, relative to their own: flesh does not
        glide as skin on bone does.
    cartilage : float
        Stiffness that is added to the springs at the tip of the nose, relative to their own: the tip goes along, and
        stays whole, when the wings of the nose rise.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> soft = fw.SkinMaterial(decay=20.0, damping=0.3)  # pulls reach further, and the skin swings
    >>> sim = fw.Simulation(fw.default_face(), material=soft)
    """

    decay: float = 14.0
    normal_ratio: float = 2.5
    bending: float = 20.0
    threshold: float = 0.3
    stiffening: float = 2.0
    pull: float = 18.0
    rate: float = 30.0
    damping: float = 1.0
    smallest_area: float = 0.3
    lid_stiffness: float = 5000.0
    lip_firmness: float = 1.3
    cartilage: float = 13.0

    def __post_init__(self) -> None:
        for name, value in dataclasses.asdict(self).items():
            smallest = 1e-6 if name in ("decay", "rate", "normal_ratio", "bending") else 0.0
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
        The most quasi-Newton iterations per step; fewer are made if the step converges.
    vertices : int, optional
        A face with more than 1.5 times as many vertices is simulated on a coarser mesh of about this many, which its
        own vertices follow smoothly. None: every vertex is simulated, however many there are.

    Raises
    ------
    LandmarkError
        For a surface without landmarks.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Rest positions, mm.
    displacement : ndarray, shape (n, 3)
        mm
    mesh : SkinMesh
        The mesh on which the skin is simulated.
    names : tuple of str
        The face's muscles.
    rates : ndarray, shape (k,)
        Their contraction rates.
    contacts : Contacts
        Contacts of the vertices of this mesh with the eyeballs, the other lip and the teeth.
    joints : Joints
        The mandible and the lids, which carry the vertices of this mesh along.

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
    mandible: Array | None = None
    _followed: tuple[Any, ...] = (None,) * 3
    """What the vertices that are not simulated followed last, and the displacement of all."""

    def __init__(
        self,
        face: Face,
        time_step: float = 0.02,
        *,
        material: SkinMaterial | None = None,
        iterations: int = 25,
        vertices: int | None = SKIN_VERTICES,
    ) -> None:
        check_type("face", face, Face)
        check_type("material", material, SkinMaterial, optional=True)
        if not face.landmarks:
            raise LandmarkError(
                "a Skin is held by bone, lids and lips, which are placed by landmarks, and this surface has none. Use "
                "fit_face(mesh), or move the surface by a Recorded or a motion of your own (facewrinkle.Motion)."
            )
        self.time_step = check_positive("time_step", time_step, "It is in seconds.")
        iterations = check_whole("iterations", iterations, 1, 1e9)
        m = self.material = material or SkinMaterial()
        self.names = tuple(face.muscles)
        self.points, self.mesh = face.points_mm, SkinMesh.of(face, vertices)
        self._joints_of_face = None if self.mesh.face is face else Joints(face, self.names, *self._held(face))
        whole, face = face, self.mesh.face
        self._rest_points, self._triangles = face.points_mm, face.triangles
        self._area = vertex_areas(self._rest_points, self._triangles)
        self._build_springs(face, tied_lips(face) if whole.mouth_half_open else None)
        self._build_tethers(face)
        self._bending, self._pull, resistance = per_face(face, "matrices", m, lambda: self._matrices(face))
        self._bent = self._bending.indices.astype(np.uint32)
        self.contacts = Contacts(face, self._area, resistance, self.joints.mandible)
        self._shares, flats = np.empty(len(self._corners)), self.contacts.flats
        self._shares_at_rest = np.empty_like(self._shares)
        kernels.shares_of_area(self._rest_points, self._corners, flats.facing, flats.double_area, self._shares_at_rest)
        self._mass = self._area / (m.decay * m.rate) ** 2
        self._drag = 2.0 * m.damping * m.rate * self.time_step
        factors = per_face(face, "factors", (m, self.time_step), self._factors)
        self._minimizer = Minimizer(factors, self._area, iterations, self.contacts)
        self.reset()

    # --- what the skin is made of -------------------------------------------------------------

    def _build_springs(self, face: Face, tied: IntArray | None) -> None:
        """Springs along the edges, and between vertices of the lips that are tied (k, 2)."""
        points = self._rest_points
        edges, sides = unique_edges(self._triangles)
        # Unsigned, for the loops: no number counts from the end.
        self._edges, self._corners = edges.astype(np.uint32), self._triangles.astype(np.uint32)
        self._rest = np.ascontiguousarray(points[edges[:, 1]] - points[edges[:, 0]])
        self._length = np.linalg.norm(self._rest, axis=1)
        areas = 0.5 * double_areas(points, self._triangles)
        self._area_of_edge = np.bincount(sides.ravel(), np.repeat(areas, 3), minlength=len(edges))
        # Van Gelder: springs of this stiffness behave like a membrane of stiffness 1, whatever the triangles.
        firm = 1.0 + self.material.cartilage * tip_of_nose(face)[0][edges].min(axis=1)
        self._stiffness = firm * self._area_of_edge / self._length**2
        if tied is not None:  # by springs ten times as stiff
            ties = np.ascontiguousarray(points[tied[:, 1]] - points[tied[:, 0]])
            self._edges, self._rest = np.vstack([self._edges, tied.astype(np.uint32)]), np.vstack([self._rest, ties])
            self._length = np.append(self._length, np.linalg.norm(ties, axis=1))
            self._stiffness = np.append(self._stiffness, np.full(len(tied), 10.0 * np.median(self._stiffness)))

    def _matrices(self, face: Face) -> tuple[csr_array, csr_array, Array]:
        """Return those of the stiffness in bending (n, n) and of the forces (3 n, k), and the resistance (n,)."""
        bending = self._bending_matrix(face)
        resistance = np.mean([matrix.diagonal() for matrix in self._stiffness_matrices(bending)], axis=0)
        return bending, csr_array(self._forces(face).reshape(len(self.names), -1).T), resistance

    def _factors(self) -> Factors:
        """Return those of the curvature of what a step minimizes."""
        inertia = diags_array(self._mass * (1.0 + self._drag) / self.time_step**2)
        return Factors([matrix + inertia for matrix in self._stiffness_matrices(self._bending)])

    def _bending_matrix(self, face: Face) -> csr_array:
        laplacian = cotangent_laplacian(self._rest_points, self._triangles)
        full = self.material.bending
        stiffness = np.full(len(self._rest_points), full)
        for joint in face.joint_weights.values():
            thin = (1.0 - 0.97 * joint.hold) * full  # the skin of the lids is the thinnest of the body
            stiffness[joint.vertices] = np.minimum(stiffness[joint.vertices], thin)
        bending = laplacian.T @ diags_array(stiffness / self._area) @ laplacian
        return csr_array(0.5 * (bending + bending.T))

    def _build_tethers(self, face: Face) -> None:
        """Tethers to the bone, their stiffness along and across the surface, and the joints that carry them."""
        m = self.material
        base = self._area / m.decay**2
        lips, directions = lip_tethers(face)
        self._normals = np.ascontiguousarray(directions)
        tethers, of_lids = self._held(face)
        self.joints = Joints(face, self.names, tethers, of_lids)
        plates = (1.0 + m.lid_stiffness) ** face.shut_lids - 1.0
        for name, joint in face.joint_weights.items():
            plates[joint.vertices] = np.maximum(plates[joint.vertices], of_lids[name])
        self._along = base * ((1.0 + m.lip_firmness * lips) * tethers + plates)
        self._across = base * np.maximum(m.normal_ratio * face.tissue.across - 1.0, 0.0) * tethers
        self._heights = face.tissue.bulge * face.tissue.depth * face.unit / (3.0 * np.maximum(self._area, 1e-300))
        self._excess = np.empty_like(self._heights)

    def _columns(self) -> list[csr_array]:
        """Return matrices (n, n), one for each coordinate of displacements, that say to first order by how much each
        column of tissue is too high for the area of the skin on it.
        """
        n, corners = len(self._rest_points), self._triangles
        a, b, c = (self._rest_points[corners[:, k]] for k in range(3))
        facing = triangle_normals(self._rest_points, corners)
        growth = 0.5 * np.stack([np.cross(facing, side) for side in (c - b, a - c, b - a)], axis=1)
        ends = 3 * np.arange(len(corners) + 1)
        at = csr_array((np.ones(corners.size), corners.ravel(), ends), shape=(len(corners), n))
        grown = [csr_array((growth[:, :, k].ravel(), corners.ravel(), ends), shape=at.shape) for k in range(3)]
        return [
            csr_array(diags_array(self._normals[:, k]) + diags_array(self._heights) @ at.T @ grown[k]) for k in range(3)
        ]

    def _held(self, face: Face) -> tuple[Array, dict[str, Array]]:
        """Return the stiffness (n,) of the tethers to bone, and to each plate, relative to the forehead."""
        plates = {name: self.material.lid_stiffness * joint.hold for name, joint in face.joint_weights.items()}
        return face.tissue.stiffness * (1.0 - tip_of_nose(face)[1]), plates

    def _pulled(self, muscle: Muscle, points: Array, normals: Array) -> Array:
        """Return the force (n, 3) of a muscle at full contraction per area, at points with normals (n, 3)."""
        m = self.material
        force = muscle.force(points) * (muscle.strength * m.pull / m.decay**2)
        out = (force * normals).sum(axis=1, keepdims=True)
        force -= (1.0 - muscle.normal_share) * out * normals
        swell = muscle.swell * muscle.strength * m.pull / m.decay**2
        return np.asarray(force + (swell * muscle.bunched(points))[:, None] * normals)

    def _forces(self, face: Face) -> Array:
        """Return the force (k, n, 3) of each muscle at full contraction.

        On a mesh of the skin's own it is averaged from the middles of the edges around each vertex: between vertices
        that are far apart it may change.
        """
        m = self.material
        pull, pulled = np.zeros((len(self.names), len(self._rest_points), 3)), 1.0 - on_gums(face)
        corners, knots = modioli(face)
        places, normals, around = face.points, self._normals, None
        if self._joints_of_face is not None:
            places, normals = places[face.edges].mean(axis=1), unit(normals[face.edges].mean(axis=1))
            ends, area, middles = face.edges.T.ravel(), np.tile(self._area_of_edge, 2), np.arange(len(places))
            around = csr_array((area / np.bincount(ends, area)[ends], (ends, np.tile(middles, 2))))
        for k, (name, muscle) in enumerate(face.muscles.items()):
            near, force = within(places, *muscle.reach), np.zeros_like(places)
            force[near] = self._pulled(muscle, places[near], normals[near])
            force = force if around is None else around @ force
            at_corners = np.linalg.norm(muscle.force(corners), axis=1) @ knots
            tied = muscle.modiolus * muscle.strength * m.pull / m.decay**2 * at_corners
            pull[k] = (force - tied[:, None] * self._normals) * (self._area * pulled)[:, None]
            if (free := self.joints.free_share(name)) is not None:
                pull[k][free[0]] *= free[1][:, None]
            elif name in face.eyes_without_lids:
                closes = isinstance(muscle, SphincterMuscle)  # and has nothing left to do
                pull[k] *= 0.0 if closes else (1.0 - face.shut_lids)[:, None]
        closing = np.array([muscle.closing * muscle.strength for muscle in face.muscles.values()])
        some = np.flatnonzero(closing)
        pull[some] += (closing[some] * m.pull / m.decay**2)[:, None, None] * closing_forces(face, self._area)
        return pull

    def _stiffness_matrices(self, bending: csr_array) -> list[csr_array]:
        """Return a matrix for each coordinate that approximates the curvature of the skin's energy.

        The line search makes up for effects that they leave out: springs beyond their threshold, and turned springs.
        """
        # No exact zeros, of springs along an axis: all three matrices have the same entries.
        direction = np.maximum(np.abs(self._rest / self._length[:, None]), 1e-9)
        columns, matrices = self._columns(), []
        sizes = np.sqrt([column.power(2).sum(axis=1) for column in columns])
        for k in range(3):
            # |e_k| sum|e| on the diagonal dominates the outer product e e^T (Gershgorin), and so for the columns.
            weight = self._stiffness * direction[:, k] * direction.sum(axis=1) * (1.0 + 0.25 * self.material.stiffening)
            edges = graph_laplacian(self._edges.astype(np.int32), weight, len(self._along))
            across = self._across * sizes.sum(axis=0) / np.maximum(sizes[k], 1e-12)
            kept = columns[k].T @ diags_array(across) @ columns[k]
            matrices.append(csr_array(bending + edges + diags_array(self._along) + kept))
        return matrices

    # --- use ----------------------------------------------------------------------------------

    @property
    def displacement(self) -> Array:
        """Displacement (n, 3) of the face's vertices, mm.

        Vertices that are not simulated go along with the lids as these turn, and follow the rest; triangles that this
        would turn over are turned back.
        """
        if self._joints_of_face is None:
            return self._displacement
        of = self._displacement, self._placed
        if not all(map(operator.is_, of, self._followed)):
            beyond = self._displacement.copy()
            self.joints.turn_lids(beyond, self._placed, -1.0)
            out = self.mesh.follow(beyond)
            self._joints_of_face.turn_lids(out, self._placed, 1.0)
            self._followed = *of, self.mesh.untangled(out)
        return self._followed[2]

    @displacement.setter
    def displacement(self, displacement: Array) -> None:
        self._displacement = displacement[self.mesh.vertices]

    def reset(self) -> None:
        """Go back to rest, without motion, all muscles relaxed."""
        shape = self._rest_points.shape
        self._displacement, self._velocity = np.zeros(shape), np.zeros(shape)
        self._stepped_from: tuple[object, ...] = (None,) * 4
        self.rates = np.zeros(len(self.names))
        self._place(self.rates)
        self._minimizer.reset()
        self.contacts.reset()

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
        others = "Names of expressions and action units, and of pairs of muscles, are for express()."
        if not isinstance(rates, Mapping):
            raise ParameterError(f"rates must be a dictionary of muscles and rates, received {rates!r}. {others}")
        out = np.zeros(len(self.names))
        for name, rate in rates.items():
            if name not in self.names:
                raise UnknownNameError(f"{unknown_name('muscle', name, self.names)} {others}")
            out[self.names.index(name)] = check_range(f"the contraction rate of {name}", rate, 0.0, 1.0)
        return out

    def set_rates(self, rates: Array) -> None:
        """Set the contraction rates (k,) in the order of `names`, without checks."""
        self.rates = rates.copy()

    def _place(self, rates: Array) -> None:
        """Pull at the skin and turn the joints as these contraction rates say."""
        self._placed = rates
        self._force = (self._pull @ rates).reshape(-1, 3)
        self._shift = self.joints.shift(rates)
        self._facing_now = self.joints.facing(self.contacts.flats.facing, rates)
        self.contacts.place(self.joints.mandible_rate(rates), self._facing_now)

    def step(self) -> Array:
        """Advance by one time step and return the positions (n, 3) in mm."""
        self.advance()
        return self.points + self.displacement

    def advance(self) -> float:
        """Advance by one time step, and return how far a simulated vertex went at most, along an axis, mm.

        Joints carry the skin along as their muscles contract. They turn in parts, each a step of its own, so that
        lips that are flung at each other meet, and the skin settles on the way. A step that left everything as it was
        is not made again.
        """
        before, after, left = self._placed, self.rates, self._displacement
        if np.array_equal(before, after):
            state = self._displacement, self._minimizer.memory, self.contacts.looked_at, bool(self._velocity.any())
            if all(map(operator.is_, state, self._stepped_from)):
                return 0.0
            self._stepped_from = state
            self._advance(self.time_step)
        else:
            parts = self.joints.parts(before, after)
            for part in range(1, parts + 1):
                riding = self._placed
                self._place(after if part == parts else before + (after - before) * (part / parts))
                x = self._rest_points + self._displacement
                self._displacement = self.joints.carried(x, riding, self._placed) - self._rest_points
                self._advance(self.time_step)
        self._come_to_rest()
        return float(np.abs(self._displacement - left).max())

    def cleared(self, displacement: Array) -> Array:
        """Return a displacement (n, 3), mm, near a given one, in which the skin is out of eyes, teeth, lips and lids.

        That is where a few steps from there, each without velocity and with the present rates, lead: in a short time
        step contacts act, and the elastic energy hardly.

        Examples
        --------
        Skin that was pushed 1 mm back:

        >>> import facewrinkle as fw
        >>> skin = fw.Skin(fw.default_face(), 0.0005)
        >>> pushed = np.zeros_like(skin.points) - [0.0, 0.0, 1.0]
        >>> bool((skin.cleared(pushed)[:, 2] - pushed[:, 2]).max() > 0.5)
        True
        """
        self.displacement = displacement
        self._minimizer.reset()
        self.contacts.reset()
        self._place(self.rates)
        for _ in range(6):  # steps that take the skin out
            self._velocity = np.zeros_like(self._rest_points)
            self._advance(self.time_step)
        return self.displacement

    def _come_to_rest(self) -> None:
        """End at rest, exactly, once nothing pulls at skin that is as good as there."""
        if not self._placed.any():
            left = max(np.abs(self._displacement).max(), self.time_step * np.abs(self._velocity).max())
            if 0.0 < left < 1e-6:  # mm
                self.reset()

    def _advance(self, h: float, halvings: int = 0) -> None:
        """Advance by a time h: implicit Euler, whose step minimizes the sum of inertia, drag and energy.

        A step that does not converge is made in two halves. The energy never grows: of motion that would be more than
        the step has set free, the rest is lost.
        """
        old, velocity = self._displacement, self._velocity
        target, drag = old + h * velocity, self._drag * (h / self.time_step)

        def objective(u: Array, gradient: Array) -> float:
            value = self._elastic(u, gradient)
            return float(value + kernels.inertia(u, target, old, self._mass, drag, h, gradient))

        end = self._minimizer.minimized(objective, old)
        if not end.converged and halvings < 2:
            for _ in range(2):
                self._advance(0.5 * h, halvings + 1)
            return
        self._displacement, self._velocity = end.u, (end.u - old) / h
        moving = self._kinetic()
        inertia = kernels.inertia(end.u, target, old, self._mass, drag, h, np.empty_like(end.u))
        over = end.value - inertia + moving - end.before
        if over > 0.0:
            self._velocity *= math.sqrt(max(1.0 - over / moving, 0.0)) if moving > 0.0 else 0.0

    def energy(self) -> float:
        """Return kinetic plus potential energy less the work of the muscles, in membrane stiffness times mm^2.

        While the contraction rates are held, no step raises it.
        """
        unused = np.empty_like(self._displacement)
        elastic = self._elastic(self._displacement, unused)
        return self._kinetic() + elastic + self.contacts.energy(self._displacement, unused)

    def _kinetic(self) -> float:
        return 0.5 * float(np.einsum("n,nk,nk", self._mass, self._velocity, self._velocity))

    def _elastic(self, u: Array, gradient: Array) -> float:
        """Return the energy of springs, inversion barrier, bending and tethers, less the work of the muscles; write its
        gradient.
        """
        m, bending = self.material, self._bending
        np.negative(self._force, out=gradient)
        energy = -np.einsum("nk,nk", self._force, u)
        energy += kernels.springs(
            u, self._edges, self._rest, self._length, self._stiffness, m.threshold, m.stiffening, gradient
        )
        x, triangles = self._rest_points + u, (self._corners, self._facing_now, self.contacts.flats.double_area)
        kernels.shares_of_area(x, *triangles, self._shares)
        # The barrier is twenty times as stiff as the membrane.
        energy += kernels.volume(
            u, x, *triangles, self._shares, self._shares_at_rest, m.smallest_area, 20.0,
            (self._shift, self._normals, self._across, self._heights), self._excess, gradient,
        )  # fmt: skip
        energy += kernels.tethers(u, self._shift, self._along, bending.indptr, self._bent, bending.data, gradient)
        return float(energy)
