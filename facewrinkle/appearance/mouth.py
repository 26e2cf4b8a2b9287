"""The inside of the mouth as it shows between parted lips: a dark pocket, teeth, gums and tongue."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import binary_dilation, minimum_filter

from ..anatomy import Face, lips_middle, teeth_of
from ..anatomy.cavities import IN_MOUTH
from ..anatomy.tongue import lip_crest, tongue_paint, tongue_points, tongue_triangles
from ..array_types import Array, IntArray
from ..geometry import ring_triangles, smoothstep, unit, vertex_normals
from ..geometry.depth_buffer import depth_buffer
from ..mesh import reshaped, to_polydata

TONGUE_COLOR = (176, 92, 88)

POCKET_RINGS, OVAL_HEIGHT = ((0.34, 0.05), (0.46, 0.3), (0.45, 0.85)), 0.75
"""Half width of the rings behind the lips and their depth behind these, in distances between the pupils; their height,
relative to their width.
"""

SKIN_STEP, SKIN_LOW, SKIN_HIGH = 0.02, np.array([-0.6, -1.0]), np.array([0.6, 0.4])
"""Grid on which the skin before the lower gum is looked for: [left, up] from the middle of the lips, in
distances between the pupils.
"""


class Mouth:
    """The dark pocket, teeth, gums and tongue of a face.

    Parameters
    ----------
    face : Face
        If its mouth is neither a hole nor a bag, there is nothing inside.

    Attributes
    ----------
    loop : ndarray of int
        Vertices around the mouth in order, if it is a hole of the mesh; otherwise empty.
    bag : bool
        True if the mouth is a bag: the skin goes on behind the lips.
    teeth : tuple of Arch
        The upper and the lower arch at rest, if there is a hole or a bag.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> mouth = Mouth(face)
    >>> mouth.parted(face.points), sorted(mouth.inside(face.points))
    (False, ['lower_teeth', 'tongue', 'upper_teeth'])
    """

    def __init__(self, face: Face) -> None:
        self.loop: IntArray = np.empty(0, np.int64)
        self.bag = False
        if not face.landmarks:
            return
        centre = lips_middle(face.landmarks)
        self._size, self._scale, self._axes = face.frame.pupil_distance, face.frame.scale, face.frame.axes
        self.loop = _mouth_loop(face, centre)
        self._rest_rim = face.points[self.loop]
        # Where it is looked whether lips are apart, to the left of their middle, in distances between the pupils.
        places = np.linspace(-0.25, 0.25, 5)[:, None]
        across = self._lips_of_hole(centre, places) if len(self.loop) else _lips_of_bag(face, centre, places)
        if not across.size:
            return
        self._across, self.bag = across, not len(self.loop)
        self._rest_gaps = self._gaps(face.points)
        self._mandible = face.mandible
        self._centre = centre
        flat, lined = (face.points - centre) @ self._axes[:2].T / self._size, face.lining.vertices
        near = ((flat > 2.0 * SKIN_LOW) & (flat < 2.0 * SKIN_HIGH)).all(axis=1) & ~lined
        self._skin = face.triangles[near[face.triangles].all(axis=1)]
        self.teeth = teeth_of(face.landmarks, face.frame, face.behind_lips)
        self._parts: dict[str, pv.PolyData] = {}
        for arch in self.teeth:
            paint = arch.paint * self._facing(vertex_normals(arch.points, arch.triangles))
            self._parts[f"{arch.jaw}_teeth"] = self._part(arch.points, arch.triangles, paint)
        self._lips = self._lips_at_tongue(face)
        # The paint of the tongue fades backwards as it would if most of it were put out.
        coming_out = self._tongue(0.7, lip_crest(self._from_incisors(face.points[self._lips[1]])))
        self._parts["tongue"] = self._part(coming_out, tongue_triangles().astype(np.int32), tongue_paint())

    def _lips_at_tongue(self, face: Face) -> tuple[IntArray, IntArray]:
        """Vertices of the upper and of the lower lip between which the tongue comes out.

        They are up to 6 and 16 mm to either side, and 12 mm above and below the edges of the lower incisors.
        """
        left, up, forward = self._from_incisors(face.points).T
        near = (np.abs(left) < 16.0) & (np.abs(up) < 12.0) & (forward > 0.0)
        lower = face.mandible_share > 0.5
        middle = np.abs(left) < 6.0
        return np.flatnonzero(near & ~lower & middle), np.flatnonzero(near & lower)

    def _from_incisors(self, points: Array) -> Array:
        """Places (n, 3), [left, up, forward] from the edges of the lower incisors, mm on a face of average size."""
        return np.asarray((points - self.teeth[1].edge) @ self._axes.T / self._scale)

    def _tongue(self, out: float, crest: Array) -> Array:
        """Points (n, 3) of a tongue on a closed jaw; see :func:`facewrinkle.anatomy.tongue.tongue_points`."""
        return np.asarray(self.teeth[1].edge + self._scale * tongue_points(out, crest) @ self._axes)

    def _lips_of_hole(self, centre: Array, places: Array) -> IntArray:
        """Vertices (2, k) of the upper and the lower lip at places (k, 1) to the left of their middle."""
        left = (self._rest_rim - centre) @ self._axes[0] / self._size
        lips = [np.where(one, np.abs(left - places), np.inf) for one in (self._upper, ~self._upper)]
        return np.asarray(self.loop[np.argmin(lips, axis=2)])

    def _gaps(self, points: Array) -> Array:
        """Distances (k,) of the lower lip from the upper one, along the face's vertical."""
        return np.asarray(np.abs((points[self._across[0]] - points[self._across[1]]) @ self._axes[1]))

    def _part(self, points: Array, triangles: IntArray, paint: npt.ArrayLike) -> pv.PolyData:
        """A mesh in the mouth at rest with its normals, and with paint that is darker and redder the farther back."""
        back = np.maximum((self._centre - points) @ self._axes[2] / self._size - 0.2, 0.0)[:, None]
        # Shares of red, green and blue light that are left far back, and the depths over which light fades to a third,
        # in distances between the pupils: the flesh around reflects red.
        least, fading = np.array([0.1, 0.045, 0.04]), np.array([0.38, 0.325, 0.307])
        shaded = np.rint(np.asarray(paint) * (least + 0.8 * np.exp(-back / fading))).astype(np.uint8)
        return to_polydata(points, triangles, {"Normals": vertex_normals(points, triangles), "paint": shaded})

    def _facing(self, normals: Array) -> Array:
        """Share (n, 1) of the light that comes in between the lips: less on sides that face the tongue."""
        return 0.75 + 0.25 * smoothstep((normals @ self._axes[2] + 0.5) / 1.0)[:, None]

    @property
    def opens(self) -> bool:
        """True if the mouth is a hole of the mesh or a bag."""
        return self.bag or len(self.loop) > 0

    def parted(self, points: Array) -> bool:
        """Return True if the lips of a face with vertices at `points` (n, 3) are farther apart than at rest somewhere,
        by more than 1.2 % of the distance between the pupils.
        """
        return self.opens and float((self._gaps(points) - self._rest_gaps).max()) > 0.012 * self._size

    def pocket(self, points: Array, jaw_angle: float | None = None, mandible: Array | None = None) -> pv.PolyData:
        """Return the dark pocket, with `paint` (rgb), behind the lips of a face with vertices at `points` (n, 3).

        It is fixed to the jaws beyond the gums, and stays behind the skin; for the angle and the matrix of the mandible
        see :meth:`inside`.
        """
        turn, shift = self.motion(points, jaw_angle, mandible)
        lower = 0.5 - self._oval[:, 1:2] / (2.0 * OVAL_HEIGHT)

        def ridden(places: Array, share: Array) -> Array:
            """Return the ways of places (k, 3) that ride on the mandible by a share (k, 1)."""
            return np.asarray(share * (places @ turn.T + shift - places))

        # Lips that are pursed or drawn aside take the cheeks along.
        rim, rest = points[self.loop], self._rest_rim
        drawn, middle = rim - ridden(rest, lower), rest.mean(axis=0)
        wide = np.array([np.ptp(rim @ self._axes[0]) / np.ptp(rest @ self._axes[0]), 1.0, 1.0])
        behind = np.maximum((middle - rest) @ self._axes[2], (middle - drawn) @ self._axes[2]) / self._size
        back = np.outer(behind, [0.0, 0.0, 1.0])
        rings = [
            middle + wide * (half * self._oval - back - [0.0, 0.0, depth]) * self._size @ self._axes
            for half, depth in POCKET_RINGS
        ]
        closed = np.vstack([*rings, rings[-1].mean(axis=0)])
        opened = closed + ridden(closed, np.vstack([*([lower] * len(rings)), [[0.5]]]))
        # Triangles from the lips to the first ring span the hollow above the chin.
        return reshaped(self._blank_pocket, np.vstack([rim, self._behind_skin(opened, points, 0.06)]))

    @cached_property
    def _upper(self) -> npt.NDArray[np.bool_]:
        """True for the vertices around the mouth that belong to the upper lip.

        They depend on the lips at rest alone: lips that press on each other have no vertical order.
        """
        left, up = self._axes[:2] @ self._rest_rim.T
        n, first, last = len(left), int(np.argmax(left)), int(np.argmin(left))
        one = (np.arange(n) - first) % n < (last - first) % n  # from the left corner to the right one
        return one if up[one].mean() > up[~one].mean() else ~one

    @cached_property
    def _oval(self) -> Array:
        """Places (n, 3) on an oval, [left, up, 0], that the vertices around the mouth go to behind the lips."""
        local = (self._rest_rim - self._rest_rim.mean(axis=0)) @ self._axes.T
        n = len(local)
        up = np.sqrt(1.0 - (local[:, 0] / np.abs(local[:, 0]).max()) ** 2) * np.where(self._upper, 1.0, -1.0)
        oval = np.stack([local[:, 0] / (0.4 * self._size), up, np.zeros(n)], axis=1)
        return np.asarray(unit(oval) * [1.0, OVAL_HEIGHT, 1.0])

    @cached_property
    def _blank_pocket(self) -> pv.PolyData:
        """The pocket with its triangles and paint, but no shape."""
        n = len(self.loop)
        light = 1.0 - 0.25 * self._oval[:, 1:2] / OVAL_HEIGHT  # what looks up is lighter, and what looks down darker
        # Colors of its rings, from the lips backwards: dark there, for the corners of a smile; cheeks; and the throat,
        # which ends in a point.
        tints = np.array([[56, 21, 19], [72, 28, 25], [56, 21, 18], [28, 10, 9]])
        paint = np.rint(np.vstack([*(light * tint for tint in tints), tints[-1]])).astype(np.uint8)
        triangles = ring_triangles(n, 4, last=4 * n)[:, [0, 2, 1]]
        return to_polydata(np.zeros((len(paint), 3)), triangles, {"paint": paint})

    def inside(
        self, points: Array, jaw_angle: float | None = None, mandible: Array | None = None, out: float = 0.0
    ) -> dict[str, pv.PolyData]:
        """Return teeth and tongue by name, with `paint` (rgb), in a face with vertices at `points` (n, 3).

        The lower teeth and the tongue go with the mandible, which has turned by `jaw_angle`, radians, or else as the
        skin over it shows, and then moved by the matrix (4, 4) `mandible`. The tongue is put `out` by a share in
        [0, 1], if lips and teeth let it.
        """
        turn, shift = self.motion(points, jaw_angle, mandible)
        parts = {}
        for name, part in (self._parts | {"tongue": self.tongue(points, turn, shift, out)}).items():
            rest, normals = np.asarray(part.points), np.asarray(part.point_data["Normals"])
            parts[name] = part
            if name == "upper_teeth":
                continue
            places = rest @ turn.T + shift
            if name == "lower_teeth":  # below the middle of the lips by this, there is gum and no tooth
                gum = (self._centre - rest) @ self._axes[1] > 0.16 * self._size
                places = np.where(gum[:, None], self._behind_skin(places, points, 0.01), places)
            parts[name] = reshaped(part, places, normals @ turn.T)
        return parts

    def tongue(self, points: Array, turn: Array, shift: Array, out: float) -> pv.PolyData:
        """Return the tongue as if the jaw were closed, in a face with vertices at `points` (n, 3).

        It is put `out` by a share in [0, 1], as far as there is room above the lower lip at this :meth:`motion` of the
        mandible.
        """
        upper, lower = ((points[lip] - shift) @ turn for lip in self._lips)
        roof = np.vstack([upper, (self.teeth[0].edge - shift) @ turn])
        crest = lip_crest(self._from_incisors(lower))
        # It comes all the way out where there are 11.6 mm, and stays behind closed teeth on 0.35 of its way.
        room = (self._from_incisors(roof)[:, 1].min() - max(crest[0], 0.0)) / 11.6
        places, blank = self._tongue(min(out, max(room, 0.35)), crest), self._parts["tongue"]
        return reshaped(blank, places, vertex_normals(places, blank.regular_faces))

    def _behind_skin(self, places: Array, points: Array, least: float) -> Array:
        """Places (k, 3) in the mouth, moved back where they came out of skin with vertices at `points` (n, 3).

        Teeth have one size and chins many: gums and the pocket would come through those that recede. They keep the
        `least` depth, in distances between the pupils, behind skin that is farther than 0.06 from an opening.
        """
        local = (points - self._centre) @ self._axes.T / self._size
        shape = np.rint((SKIN_HIGH - SKIN_LOW) / SKIN_STEP).astype(int) + 1
        low = float(SKIN_LOW[0]), float(SKIN_LOW[1])
        depths = -1.0, np.inf  # skin farther back is seen through the mouth
        front = depth_buffer(local, self._skin, low, SKIN_STEP, (int(shape[1]), int(shape[0])), depths)
        open_near = binary_dilation(~np.isfinite(front), iterations=round(0.06 / SKIN_STEP))
        nearest = np.where(open_near, np.inf, minimum_filter(front, size=3))
        inside = (places - self._centre) @ self._axes.T / self._size
        column, row = np.rint((inside[:, :2] - SKIN_LOW) / SKIN_STEP).astype(int).T
        within = (column >= 0) & (column < shape[0]) & (row >= 0) & (row < shape[1])
        most = np.full(len(places), np.inf)
        most[within] = nearest[row[within], column[within]] - least
        inside[:, 2] = np.minimum(inside[:, 2], most)
        return np.asarray(self._centre + self._size * inside @ self._axes)

    def motion(self, points: Array, jaw_angle: float | None, mandible: Array | None = None) -> tuple[Array, Array]:
        """Return the rotation (3, 3) of the mandible and the shift (3,) that follows it; see :meth:`inside`."""
        turn, shift = np.eye(3), np.zeros(3)
        if self._mandible is not None:
            hinge = self._mandible.hinge
            turn = self._mandible.rotation(points, jaw_angle)
            shift = hinge - turn @ hinge
        if mandible is None:
            return turn, shift
        return mandible[:3, :3] @ turn, mandible[:3, :3] @ shift + mandible[:3, 3]


def _mouth_loop(face: Face, centre: Array) -> IntArray:
    """Vertices around the mouth in order: the widest hole near the middle of the lips; empty if there is none.

    Holes that are narrower than half the mouth do not count.
    """
    size, lateral = face.frame.pupil_distance, face.frame.axes[0]
    found = np.empty(0, np.int64)
    width = 0.5 * float((face.landmarks["mouth_l"] - face.landmarks["mouth_r"]) @ lateral)
    for loop in face.boundary_loops:
        rim = face.points[loop]
        reach, across = np.linalg.norm(rim - centre, axis=1).max(), float(np.ptp(rim @ lateral))
        if reach < 0.8 * size and np.linalg.norm(rim.mean(axis=0) - centre) < 0.3 * size and across > width:
            found, width = np.asarray(loop, dtype=np.int64), across
    return found


def _lips_of_bag(face: Face, centre: Array, places: Array) -> IntArray:
    """Vertices (2, k) of the upper and the lower lip where these meet, at those of the places (l, 1) that have both;
    none if the skin does not go on behind the lips.
    """
    local = (face.points - centre) @ face.frame.axes.T / face.frame.pupil_distance
    depth = face.cavities.depth(face.points)
    if not (depth[(np.abs(local[:, :2]) < [0.3, 0.25]).all(axis=1)] > IN_MOUTH).any():
        return np.empty((2, 0), np.int64)
    up = face.normals @ face.frame.axes[1]
    aside, high = np.abs(local[:, 0] - places), np.abs(local[:, 1])
    near = (aside < 0.1) & (high < 0.25) & (local[:, 2] > -0.2) & (depth < IN_MOUTH)
    # The upper lip faces down where it meets the lower one.
    lips = np.stack([np.where(near & (sign * up > 0.5), aside + 2.0 * high, np.inf) for sign in (-1.0, 1.0)])
    return np.asarray(lips.argmin(axis=2)[:, np.isfinite(lips.min(axis=2)).all(axis=0)])
