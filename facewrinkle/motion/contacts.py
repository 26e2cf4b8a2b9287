"""Contacts of the skin with eyeballs, teeth, the other lip and the other lid.

Each contact is an energy that is zero until two surfaces meet, and grows with the square of the depth to which one has
entered the other. It depends on nothing but the present place of the skin. The steps of the skin minimize it together
with all other energies, and the quadratic model of each iteration knows every contact that its step would meet. So
stiff contacts cost no iterations, and steps end at what they meet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..anatomy import Face, JointWeights, per_face
from ..array_types import Array, IntArray
from ..geometry import double_areas, side_lengths, triangle_normals
from . import _contact_kernels as kernels
from ._skin_kernels import shares_of_area
from .self_contact import behind_lips, facing_lids, facing_lips
from .solids import SLACK, Samples, Solids, met_solids

FLAT = {0.2: 100.0, 0.1: 1000.0}
"""Shares of the area, seen along the normal that joints have turned, below which triangles are held back, and the
stiffness that comes on top from there, relative to the resistance of the skin when one vertex alone is moved: muscles
that jump press many times as hard as they hold. Poses that are held hardly get to the second, and settle as fast as
without.
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
        Twice the area, the least height, and the stiffness against the loss of height: `FLAT` times it.
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
    points, triangles = face.points_mm, face.triangles.astype(np.int64)
    double, longest = double_areas(points, triangles), side_lengths(points[triangles]).max(axis=1)
    stiffness = resistance[triangles].mean(axis=1)
    return FlatTriangles(triangles, triangle_normals(points, triangles), double, double / longest, stiffness)


Rows = tuple[IntArray, Array, Array, Array]
"""Vertices (m, 6), slopes of their gaps (m, 6, 3), depths (m,) and stiffness (m,) of contacts."""


def _surfaces(face: Face, x: Array, area: Array, angles: Array) -> tuple[Solids, Samples, npt.NDArray[np.str_]]:
    """Return the solids and samples of a face whose skin turns by these angles (n,) with the mandible, and what kind
    (k,) of contact each sample makes. At rest, x (m, 3), none is pushed.
    """
    widest = float(angles.max(initial=0.0))
    solids, on_solids = met_solids(face, area, widest)
    parts = {
        "solids": on_solids,
        "lips": facing_lips(face, area, angles / max(widest, 1e-12)),
        "lids": facing_lids(face, area),
        "flesh": behind_lips(face, area),
    }
    samples = Samples.joined(parts.values())
    room = kernels.gaps_of(x, samples, solids) - SLACK
    kinds = np.repeat(list(parts), [len(part.allowed) for part in parts.values()])
    return solids, Samples(*samples[:3], np.minimum(room, samples.allowed), samples.stiffness), kinds


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
    samples : Samples
        All samples of the skin that can meet something.
    kinds : ndarray of str, shape (k,)
        What they meet: "solids"; "lips" and "lids", the other one; "flesh", the other side of the lip.
    flats : FlatTriangles
        Triangles that can turn over.
    looked_at : ndarray, shape (n, 3)
        Positions at which solids were looked for last.

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
        self._points, self._mandible = face.points_mm, mandible
        self._still = np.zeros_like(self._points)
        angles = np.zeros(len(area))
        if mandible is not None:
            angles[mandible.vertices] = mandible.angles
        eyes = np.array([eye.centre * face.unit for eye in face.eyes]).reshape(-1, 3)
        self._eyes, rest = eyes, np.concatenate([self._points, eyes])
        self.solids, self.samples, self.kinds = per_face(
            face, "surfaces", (area.tobytes(), angles.tobytes()), lambda: _surfaces(face, rest, area, angles)
        )
        self._full = max(FLAT) * double_areas(rest, self.samples.partners)
        self._meeting_solids = np.unique(self.samples.corners[self.kinds == "solids"])
        self.flats = flat_triangles(face, resistance)
        self._shares, self._ahead = np.empty(len(face.triangles)), np.empty(len(face.triangles))
        most = len(self.kinds) + len(FLAT) * len(face.triangles)
        self._rows: Rows = (
            np.zeros((most, 6), np.int64), np.zeros((most, 6, 3)), np.zeros(most), np.zeros(most)
        )  # fmt: skip
        self._rate, self._facing = np.nan, self.flats.facing
        self.place(0.0, self._facing)

    def reset(self) -> None:
        """Forget where solids were looked for."""
        self.looked_at = np.full_like(self._points, np.inf)

    def place(self, rate: float, facing: Array) -> None:
        """Let teeth go along with the mandible at its contraction rate, and triangles face (m, 3)."""
        if rate != self._rate:
            self._rate, self._placed = rate, self.solids.turned(self._mandible, rate)
            self.reset()
        self._facing = facing

    def _look(self, u: Array) -> Array:
        """Return positions of vertices and eyes; look for solids near them unless they were looked for close by."""
        x = np.concatenate([self._points + u, self._eyes])
        # Solids are looked for within 3 mm, and anew when the skin has moved by 1 mm.
        moved = x[self._meeting_solids] - self.looked_at[self._meeting_solids]
        if not np.linalg.norm(moved, axis=1).max(initial=0.0) <= 1.0:
            gaps, of_skin = kernels.gaps_of(x, self.samples, self._placed), self.samples.partners[:, 0] >= 0
            self.looked_at, self._near = x, np.flatnonzero(of_skin | (gaps < self.samples.allowed + 3.0))
        return x

    def energy(self, u: Array, gradient: Array) -> float:
        """Return the energy at displacements `u`; add its gradient."""
        self._x, f, own = self._look(u), self.flats, np.zeros_like(u)
        shares_of_area(self._x, f.triangles, self._facing, f.double_area, self._shares)
        energy = float(kernels.energy_of(self._rows, self._find(self._still, self._shares), own))
        gradient += own
        return energy

    def rows(self, ahead: Array) -> Rows:
        """Return the contacts that press at the displacements of the last `energy`, or would after a further
        displacement `ahead`.
        """
        f, rows = self.flats, self._rows
        there = self._x[: len(ahead)] + ahead
        shares_of_area(there, f.triangles, self._facing, f.double_area, self._ahead)
        m = self._find(ahead, self._ahead)
        return rows[0][:m], rows[1][:m], rows[2][:m], rows[3][:m]

    def _find(self, ahead: Array, shares: Array) -> int:
        """Write the rows of all contacts that press, or would after a displacement `ahead` (n, 3), which leaves these
        `shares` (m,) of the areas of triangles; return their number.
        """
        x, rows, f, still = self._x, self._rows, self.flats, ahead is self._still
        m = kernels.sample_rows(x, ahead, still, self._near, self.samples, self._placed, self._full, rows)
        lowest = min(self._shares.min(initial=1.0), shares.min(initial=1.0))
        for least, firmness in FLAT.items():
            if not lowest >= least:
                m = kernels.flat_rows(
                    x, ahead, self._shares, shares, least, f.triangles, self._facing, f.double_area, f.heights,
                    firmness * f.stiffness, rows, m,
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
    n : int
        Number of vertices.

    Examples
    --------
    Two rows along the first coordinate at vertices that do not feel each other, one 0.1 and one -0.1 mm deep:

    >>> compliance = Compliance(lambda forces: forces / 4.0, n=2)
    >>> vertices, slopes = np.array([[0] * 6, [1] * 6]), np.zeros((2, 6, 3))
    >>> slopes[:, 0, 0] = 1.0
    >>> rows = vertices, slopes, np.array([0.1, -0.1]), np.array([1e9, 1e9])
    >>> compliance.forces(rows).round(6).tolist()  # the first is pushed out
    [[0.4, 0.0, 0.0], [0.0, 0.0, 0.0]]
    """

    ROUNDS, TOLERANCE, FEW = 12, 1e-8, 40

    def __init__(self, solved: Callable[[Array], Array], n: int) -> None:
        self._solved, self._n = solved, n
        self._slots = np.full(n, -1)
        self._columns = np.empty((0, n, 3), np.float32)
        self._filled = 0

    def forces(self, rows: Rows, ahead: Array | None = None) -> Array:
        """Return the forces (n, 3) of contacts, given their depths after a displacement `ahead` (n, 3) without them.

        Only the change of the forces is returned if contacts press already before this displacement: this change is
        small where the skin comes to rest, and is not lost in the rounding of large forces that balance others.
        """
        vertices, slopes, depths, stiffness = rows
        involved = np.flatnonzero(np.bincount(vertices.ravel()))
        self._solve_for(involved)
        now = np.zeros(len(depths))
        if ahead is not None:
            now = stiffness * np.maximum(depths + np.einsum("rck,rck->r", slopes, ahead[vertices]), 0.0)
        compact = compacted(vertices, slopes, involved, self._slots)
        forces = kernels.contact_forces(compact, self._columns, depths, stiffness, now, self.ROUNDS, self.TOLERANCE)
        out = np.zeros((self._n, 3))
        # The energy of rows of stiffness 1 falls by as much force as they are deep.
        kernels.energy_of((vertices, slopes, now - forces, np.ones(len(now))), len(now), out)
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
        for vertex in new:
            unit_forces = np.zeros((self._n, 3))
            unit_forces[vertex] = 1.0
            self._columns[self._filled] = self._solved(unit_forces)
            self._slots[vertex] = self._filled
            self._filled += 1
