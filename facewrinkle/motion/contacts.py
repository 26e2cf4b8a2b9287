"""Contacts of the skin with eyeballs, teeth, the other lip and the other lid.

Each contact is an energy that is zero until two surfaces meet, and grows with the square of the depth to which one has
entered the other. It depends on nothing but the present place of the skin. The steps of the skin minimise it together
with all other energies, and the quadratic model of each iteration knows every contact that its step would meet. So
stiff contacts cost no iterations, and steps end at what they meet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face, per_face
from ..anatomy.muscles import JointWeights
from ..array_types import Array, IntArray
from ..mesh.repair.topology_repair import areas_doubled
from . import _contact_kernels as kernels
from .lid_surfaces import facing_lids
from .lip_surfaces import FacingSkin, behind_lips, facing_lips
from .solids import Solids, dental_arches, eyeballs

LEAST_AREA = 0.2
"""Triangles are kept from falling below this share of their area, seen along the normal that joints have turned."""

FIRMER = 100.0
"""Stiffness of this contact, relative to the resistance of the skin when one vertex alone is moved."""

LAST_AREA, FIRMEST = 0.1, 1000.0
"""Share of their area below which as much stiffness comes on top: muscles that jump press many times as hard as they
hold. Poses that are held hardly get there, and settle as fast as without.
"""


@dataclass(frozen=True, eq=False)
class FlatTriangles:
    """Triangles at rest; mm.

    Attributes
    ----------
    triangles : ndarray of int, shape (m, 3)
    facing : ndarray, shape (m, 3)
        Unit normals.
    double_area, heights, stiffness : ndarray, shape (m,)
        Twice the area, the least height, and the stiffness against the loss of height.
    """

    triangles: IntArray
    facing: Array
    double_area: Array
    heights: Array
    stiffness: Array


def flat_triangles(face: Face, resistance: Array) -> FlatTriangles:
    """Return the triangles of a face, given the force (n,) per mm with which the skin resists when one vertex is moved.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> flats = flat_triangles(face, np.ones(len(face.points)))
    >>> bool((flats.heights > 0.0).all())
    True
    """
    points, triangles = face.points * face.unit, face.triangles.astype(np.int64)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    double = np.linalg.norm(cross, axis=1)
    longest = np.sqrt(np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0))
    stiffness = FIRMER * resistance[triangles].mean(axis=1)
    return FlatTriangles(triangles, cross / double[:, None], double, double / longest, stiffness)


Responses = npt.NDArray[np.float32]
Rows = tuple[IntArray, Array, Array, Array]
"""Vertices (m, 6), slopes of their gaps (m, 6, 3), depths (m,) and stiffness (m,) of contacts."""

REACH, STALE = 3.0, 1.0
"""Contacts are looked for within the first distance, and anew when the skin has moved by the second, mm."""

FAR_AWAY = 1e9
"""Coordinates at which contacts have never been looked for, mm."""


def _surfaces(face: Face, area: Array, angles: Array) -> tuple[Solids, FacingSkin, FacingSkin, FacingSkin]:
    """Return the solids, lips, lids and flesh of a face whose skin turns by these angles (n,) with the mandible."""
    widest = float(angles.max(initial=0.0))
    solids = Solids.joined([eyeballs(face, area), dental_arches(face, area, widest)])
    lips = facing_lips(face, area, angles / max(widest, 1e-12))
    return solids, lips, facing_lids(face, area), behind_lips(face, area)


class Contacts:
    """All contacts of a face; lengths in mm.

    Parameters
    ----------
    face : Face
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.
    resistance : ndarray, shape (n,)
        Force per mm with which the skin resists when one vertex alone is moved.
    mandible : JointWeights, optional
        Turn of the skin with the mandible, in mm.

    Attributes
    ----------
    solids : Solids
        Eyeballs and dental arches.
    lips, lids, flesh : FacingSkin
        Lips that meet each other, lids that do, and lips that are pressed flat.

    Examples
    --------
    At rest nothing has entered anything; skin that is pushed back by 2 mm meets eyes and teeth:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> each = np.ones(len(face.points))
    >>> contacts = Contacts(face, each, each)
    >>> still = np.zeros_like(face.points)
    >>> contacts.energy(still, still.copy())
    0.0
    >>> gradient = still.copy()
    >>> contacts.energy(still - [0, 0, 2], gradient) > 0.0, bool(gradient[:, 2].sum() < 0.0)
    (True, True)
    """

    def __init__(self, face: Face, area: Array, resistance: Array, mandible: JointWeights | None = None) -> None:
        self._points, self._mandible = face.points * face.unit, mandible
        self._still = np.zeros_like(self._points)
        angles = np.zeros(len(area))
        if mandible is not None:
            angles[mandible.vertices] = mandible.angles
        self.solids, self.lips, self.lids, self.flesh = per_face(
            face, "surfaces", (area.tobytes(), angles.tobytes()), lambda: _surfaces(face, area, angles)
        )
        self._eyes = np.array([eye.centre * face.unit for eye in face.eyes]).reshape(-1, 3)
        self.flats = flat_triangles(face, resistance)
        firmest = self.flats.stiffness * (FIRMEST / FIRMER)
        self._flat_levels = [(LEAST_AREA, self.flats.stiffness), (LAST_AREA, firmest)]
        self._shares, self._ahead = np.empty(len(face.triangles)), np.empty(len(face.triangles))
        rest = np.concatenate([self._points, self._eyes])
        self._full = [LEAST_AREA * areas_doubled(rest, skin.triangles) for skin in (self.lips, self.lids, self.flesh)]
        most = sum(len(each.corners) for each in (self.solids, self.lips, self.lids, self.flesh))
        most += len(self._flat_levels) * len(face.triangles)
        self._rows: Rows = (
            np.zeros((most, 6), np.int64), np.zeros((most, 6, 3)), np.zeros(most), np.zeros(most)
        )  # fmt: skip
        self._known: tuple[Array, float, Array] | None = None
        self._rate = np.nan
        self._meeting_solids = np.unique(self.solids.corners)
        self._facing: Array = self.flats.facing
        self.place(0.0, self._facing)

    def reset(self) -> None:
        """Forget where contacts were looked for."""
        self._known = None
        self._looked_at = np.full_like(self._points, FAR_AWAY)

    def place(self, rate: float, facing: Array) -> None:
        """Let teeth go along with the mandible at its contraction rate, and triangles face (m, 3)."""
        if rate == self._rate and np.array_equal(facing, self._facing):
            return
        self._facing, self._known, same = facing, None, rate == self._rate
        if same:
            return
        self._rate = rate
        s = self.solids
        origins, axes = s.turned(self._mandible, rate)
        self._placed = s.corners, s.shares, s.allowed, origins, axes, s.halves
        self._looked_at = np.full_like(self._points, FAR_AWAY)

    def _look(self, u: Array) -> Array:
        """Return positions of vertices and eyes; look for contacts near them unless they were looked for close by."""
        x = np.concatenate([self._points + u, self._eyes])
        if not kernels.farthest_moved(x, self._looked_at, self._meeting_solids) <= STALE:
            self._looked_at = x
            self._near_solids = kernels.near_solids(x, *self._placed, REACH)
        return x

    def energy(self, u: Array, gradient: Array) -> float:
        """Return the energy at displacements `u`; add its gradient."""
        if self._known is None or not np.array_equal(u, self._known[0]):
            own = np.zeros_like(u)
            self._known = u.copy(), self._energy(u, own), own
        gradient += self._known[2]
        return self._known[1]

    def _energy(self, u: Array, gradient: Array) -> float:
        self._x, f = self._look(u), self.flats
        kernels.shares_of_area(self._x, f.triangles, self._facing, f.double_area, self._shares)
        return float(kernels.energy_of(self._rows, self._find(self._still, self._shares), gradient))

    def rows(self, ahead: Array) -> Rows:
        """Return the contacts that press at the displacements of the last `energy`, or would after a further
        displacement `ahead`.
        """
        f, rows = self.flats, self._rows
        there = self._x[: len(ahead)] + ahead
        kernels.shares_of_area(there, f.triangles, self._facing, f.double_area, self._ahead)
        m = self._find(ahead, self._ahead)
        return rows[0][:m], rows[1][:m], rows[2][:m], rows[3][:m]

    def _find(self, ahead: Array, shares: Array) -> int:
        """Write the rows of all contacts that press, or would after a displacement `ahead` (n, 3), which leaves these
        `shares` (m,) of the areas of triangles; return their number.
        """
        x, rows, f, s, still = self._x, self._rows, self.flats, self.solids, ahead is self._still
        m = kernels.solid_rows(x, ahead, still, self._near_solids, *self._placed, s.stiffness, rows, 0)
        for skin, full in zip((self.lips, self.lids, self.flesh), self._full, strict=True):
            m = kernels.plane_rows(
                x, ahead, still, skin.corners, skin.shares, skin.allowed, skin.stiffness, skin.triangles, full, rows, m
            )
        lowest = min(self._shares.min(initial=1.0), shares.min(initial=1.0))
        for least, stiffness in self._flat_levels:
            if not lowest >= least:
                m = kernels.flat_rows(
                    x, ahead, self._shares, shares, least, f.triangles, self._facing, f.double_area, f.heights,
                    stiffness, rows, m,
                )  # fmt: skip
        return int(m)


def compacted(
    vertices: IntArray, slopes: Array, involved: IntArray, slots: IntArray
) -> tuple[Array, IntArray, IntArray, IntArray, IntArray]:
    """Return the `vertices` (m, 6) and `slopes` (m, 6, 3) of rows as the loops read them.

    That is: slopes, their number (m,) without the zeros at the end, the vertices that are `involved` (k,), sorted, the
    place of each vertex among them (m, 6), and their `slots`, of those (n,) of all.
    """
    sizes = 6 - (slopes != 0.0).any(axis=2)[:, ::-1].argmax(axis=1)
    return slopes, sizes, involved, np.searchsorted(involved, vertices), slots[involved]


class Compliance:
    """Responses of the skin to forces at single vertices, solved for when a contact first needs them, and then kept.

    They take 12 bytes for each vertex that ever met something and each vertex of the skin.

    Parameters
    ----------
    solved : callable
        Returns the displacements (n, 3) of all vertices under forces (n, 3).
    solve_for_units : callable
        Writes those under unit forces along the coordinates at each of some vertices (k,) to its second argument, of
        float32 and shape (k, n, 3).
    n : int
        Number of vertices.

    Examples
    --------
    Two rows along the first coordinate at vertices that do not feel each other, one 0.1 and one -0.1 mm deep:

    >>> responses = np.eye(2)[:, :, None].repeat(3, axis=2) / 4.0
    >>> compliance = Compliance(lambda forces: forces / 4.0, lambda at, out: np.copyto(out, responses[at]), n=2)
    >>> vertices, slopes = np.array([[0] * 6, [1] * 6]), np.zeros((2, 6, 3))
    >>> slopes[:, 0, 0] = 1.0
    >>> rows = vertices, slopes, np.array([0.1, -0.1]), np.array([1e9, 1e9])
    >>> compliance.forces(rows).round(6).tolist()  # the first is pushed out
    [[0.4, 0.0, 0.0], [0.0, 0.0, 0.0]]
    """

    ROUNDS, TOLERANCE, FEW = 12, 1e-8, 40

    def __init__(
        self, solved: Callable[[Array], Array], solve_for_units: Callable[[IntArray, Responses], None], n: int
    ) -> None:
        self._solved, self._solve_for_units, self._n = solved, solve_for_units, n
        self._slots = np.full(n, -1)
        self._columns = np.empty((0, n, 3), np.float32)
        self._filled = 0

    def forces(self, rows: Rows, ahead: Array | None = None) -> Array:
        """Return the forces (n, 3) of contacts, given their depths after a displacement `ahead` (n, 3) without them.

        Only the change of the forces is returned if contacts press already before this displacement: this change is
        small where the skin comes to rest, and is not lost in the rounding of large forces that balance others.
        """
        vertices, slopes, depths, stiffness = rows
        involved = np.unique(vertices)
        self._solve_for(involved)
        now = np.zeros(len(depths))
        if ahead is not None:
            now = stiffness * np.maximum(depths + np.einsum("rck,rck->r", slopes, ahead[vertices]), 0.0)
        compact = compacted(vertices, slopes, involved, self._slots)
        forces = kernels.contact_forces(compact, self._columns, depths, stiffness, now, self.ROUNDS, self.TOLERANCE)
        out = np.zeros((self._n, 3))
        np.add.at(out, vertices, (forces - now)[:, None, None] * slopes)
        return out

    def response(self, rows: Rows, ahead: Array | None = None) -> Array:
        """Return the displacements (n, 3) by the forces of contacts, or by their change; see :meth:`forces`."""
        forces = self.forces(rows, ahead)
        pushed = np.flatnonzero(forces.any(axis=1))
        if len(pushed) > self.FEW:
            return self._solved(forces)
        return np.asarray(kernels.added_up(forces, pushed, self._slots, self._columns))

    def _solve_for(self, vertices: IntArray) -> None:
        new = vertices[self._slots[vertices] < 0]
        if self._filled + len(new) > len(self._columns):
            longer = np.empty((2 * (self._filled + len(new)), self._n, 3), np.float32)
            longer[: self._filled] = self._columns[: self._filled]
            self._columns = longer
        filled = self._filled + len(new)
        self._solve_for_units(new, self._columns[self._filled : filled])
        self._slots[new] = np.arange(self._filled, filled)
        self._filled = filled
