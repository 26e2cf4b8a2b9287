"""What is drawn beside the skin: painted eyes, what came with the face, and the dark behind parted lips."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.spatial.transform import Rotation

from ._lid_rims import LidRim
from .anatomy.cavities import Cavities
from .anatomy.eyes import RADIUS, Eyeball, lid_margins
from .anatomy.face import Face
from .anatomy.muscles import JawMuscle
from .anatomy.parts import Part
from .anatomy.teeth import teeth_of
from .geometry.blending import smoothstep
from .geometry.normals import vertex_normals
from .geometry.topology import boundary_loops
from .mesh import POSE, split_at_seams, to_polydata

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

PUPIL, IRIS = 9.0, 28.5
"""Angles from the middle of the eye, degrees."""

RINGS = np.concatenate([np.linspace(0.0, 8.0, 4), np.linspace(8.5, 34.0, 27), np.linspace(37.0, 97.0, 11)])
SPOKES = 96

COLOURS = {
    name: np.array(colour, dtype=np.float64)
    for name, colour in {
        "iris": (98, 116, 122),
        "collar": (128, 104, 72),
        "limbus": (34, 38, 42),
        "sclera": (212, 204, 199),
        "corner": (202, 148, 138),
        "caruncle": (196, 120, 108),
        "tears": (226, 186, 180),
    }.items()
}


PART_COLOURS = {
    "teeth": (214, 205, 186), "tongue": (176, 92, 88), "glasses": (40, 40, 44), "other": (150, 140, 134),
    "hair": (62, 46, 38),
}  # fmt: skip
"""Of what came with a face, where it has no colours."""


def has_colours(mesh: pv.PolyData) -> bool:
    """Whether the points of a mesh have colours, of uint8 or from 0 to 1."""
    colours = mesh.point_data.get("Colors")
    if colours is None or colours.ndim != 2 or colours.shape[1] not in (3, 4):
        return False
    return colours.dtype == np.uint8 or (colours.dtype.kind == "f" and 0.0 <= colours.min() <= colours.max() <= 1.0)


def is_drawn(name: str, part: Part) -> bool:
    """Whether a part is drawn as it is: an eye without colours, or of one, would be blind, and is painted; lashes are
    in place of cards that lack their picture.
    """
    if name.startswith("lashes"):
        return not part.lacks_picture
    if part.texture is not None or not name.startswith("eye"):
        return True
    return has_colours(part.mesh) and bool(np.ptp(part.mesh.point_data["Colors"], axis=0).any())


def own_parts(face: Face, frame: pv.PolyData) -> dict[str, pv.PolyData]:
    """What came with the face and is drawn as it is, where it is in a frame: with `paint` where it has no texture."""
    if not face.parts:
        return {}
    parts = {name: part for name, part in face.parts_at(frame).items() if is_drawn(name, face.parts[name])}
    for name, part in parts.items():
        if face.parts[name].texture is not None:
            parts[name] = split_at_seams(part)
        elif has_colours(part):
            part.point_data["paint"] = np.asarray(part.point_data["Colors"])
        else:
            colour = next((c for stem, c in PART_COLOURS.items() if stem in name), PART_COLOURS["hair"])
            part.point_data["paint"] = np.tile(np.array(colour, np.uint8), (part.n_points, 1))
    return parts


class PaintedEye:
    """The front of an eyeball: pupil, streaked iris, dark rim, sclera; darker under the lids, wherever these are.

    Parameters
    ----------
    eye : Eyeball
    face : Face
    """

    def __init__(self, eye: Eyeball, face: Face) -> None:
        self.eye = eye
        self._margins = lid_margins(eye, face.points, face.triangles, face.landmarks)
        self._corners = [face.landmarks[f"eye_{eye.side}_{end}"] for end in ("inner", "outer")]
        self._ring, self._spoke = (
            grid.ravel() for grid in np.meshgrid(RINGS, np.arange(SPOKES) * (2.0 * np.pi / SPOKES), indexing="ij")
        )
        adult = RADIUS * face.frame.pupil_distance  # irises are as large in larger eyes
        self._paint = _eye_paint(self._ring * eye.radius / adult, self._spoke)
        here = np.arange(SPOKES) + SPOKES * np.arange(len(RINGS) - 1)[:, None]
        after = (np.arange(SPOKES) + 1) % SPOKES + SPOKES * np.arange(len(RINGS) - 1)[:, None]
        self._quads = np.stack([here, here + SPOKES, after + SPOKES, after], axis=-1).reshape(-1, 4)

    @property
    def open(self) -> bool:
        """Whether the skin before the eye has an opening; otherwise lids, or an eye of the mesh's own, cover it."""
        return self._margins is not None

    def on(self, points: Array, gaze: Array | None = None) -> pv.PolyData:
        """The eyeball, with `paint` (rgb), between lids whose vertices are where they are now (n, 3).

        Normals are those of the cornea, which is more curved than the ball.
        """
        eye = self.eye
        gaze = eye.gaze if gaze is None else gaze
        side = np.cross(eye.up, gaze)
        side /= np.linalg.norm(side)
        axes = np.stack([side, np.cross(gaze, side), gaze])
        share = 1.0 - smoothstep((self._ring - 25.0) / 9.0)
        directions = _directions(self._ring, self._spoke) @ axes
        ball = pv.PolyData.from_regular_faces(eye.centre + eye.radius * directions, self._quads)
        ball.point_data["Normals"] = _directions(self._ring * (1.0 + 0.5 * share), self._spoke) @ axes
        paint = self._between_lids(directions, points)
        ball.point_data["paint"] = np.rint(np.clip(paint, 0.0, 255.0)).astype(np.uint8)
        return ball

    def _between_lids(self, directions: Array, points: Array) -> Array:
        """The paint, with the lids' shadows, the wet lower margin and the flesh of the inner corner."""
        inner, outer = (corner - self.eye.centre for corner in self._corners)
        near = np.degrees(np.arccos(np.clip(directions @ inner / np.linalg.norm(inner), -1.0, 1.0)))
        paint = _mixed(self._paint, np.broadcast_to(COLOURS["caruncle"], self._paint.shape), 1.25 - near / 11.0)
        if self._margins is None:
            return paint
        lateral = (outer - inner) / np.linalg.norm(outer - inner)
        up = self.eye.up - (self.eye.up @ lateral) * lateral
        up /= np.linalg.norm(up)
        forward = self.eye.gaze - (self.eye.gaze @ lateral) * lateral
        place = directions @ lateral
        height = np.degrees(np.arctan2(directions @ up, directions @ forward))
        from_margin = []
        for chain in self._margins:
            offset = (points[chain] - self.eye.centre) / self.eye.radius
            order = np.argsort(offset @ lateral, kind="stable")
            elevation = np.degrees(np.arctan2(offset @ up, offset @ forward))
            from_margin.append(np.interp(place, (offset @ lateral)[order], elevation[order]))
        below, above = from_margin[0] - height, height - from_margin[1]
        wet = 0.6 * np.exp(-((np.maximum(above, 0.0) / 2.2) ** 2))[:, None]
        paint = paint + wet * (COLOURS["tears"] - paint)
        shade = 0.62 * np.exp(-np.maximum(below, 0.0) / 6.5) + 0.22 * np.exp(-np.maximum(above - 1.0, 0.0) / 4.0)
        return np.asarray(paint * (1.0 - np.minimum(shade, 0.85)[:, None] * [0.92, 1.0, 1.0]))


def _directions(ring: Array, spoke: Array) -> Array:
    """Unit vectors (n, 3) [aside, up, ahead] at angles from the middle, degrees, on spokes, radians."""
    away = np.sin(np.radians(ring))
    return np.stack([away * np.cos(spoke), away * np.sin(spoke), np.cos(np.radians(ring))], axis=1)


def _eye_paint(angle: Array, spoke: Array) -> Array:
    """Colours (n, 3) of points at an angle from the middle, degrees, on a spoke, radians."""
    across = np.clip((angle - PUPIL) / (IRIS - PUPIL), 0.0, 1.0)
    wave = 0.5 * np.sin(7.0 * across + 3.0 * np.sin(5.0 * spoke))
    fibres = 0.55 * np.sin(29.0 * spoke + wave) * np.sin(11.0 * spoke + 4.0 * across) + 0.45 * np.sin(
        47.0 * spoke - wave
    )
    collar = np.exp(-(((across - 0.28 - 0.05 * np.sin(9.0 * spoke)) / 0.16) ** 2))[:, None]
    # Light from above gathers in the lower half of the iris.
    glow = 0.86 + 0.24 * np.clip(-np.sin(spoke), -0.6, 1.0) * across
    iris = COLOURS["iris"] + 0.75 * collar * (COLOURS["collar"] - COLOURS["iris"])
    iris = iris * ((1.0 + 0.20 * fibres) * (0.66 + 0.55 * across - 0.18 * across**4) * glow)[:, None]
    vein = smoothstep((np.sin(13.0 * spoke + 3.0 * np.sin(0.11 * angle + 4.0 * spoke)) - 0.93) / 0.07)
    red = smoothstep((angle - 36.0) / 50.0) + 0.25 * vein * smoothstep((angle - 38.0) / 14.0)
    sclera = COLOURS["sclera"] + np.clip(red, 0.0, 1.0)[:, None] * (COLOURS["corner"] - COLOURS["sclera"])
    paint = _mixed(iris, np.broadcast_to(COLOURS["limbus"], iris.shape), 0.9 * (angle - 23.5) / 4.0)
    paint = _mixed(paint, sclera, (angle - IRIS + 1.2) / 4.2)
    return _mixed(np.tile([8.0, 8.0, 10.0], (len(angle), 1)), paint, (angle - PUPIL) / 1.3)


def beside(face: Face, frame: pv.PolyData) -> dict[str, pv.PolyData]:
    """What is beside the skin in a frame, with `paint` (rgb): the parts that came with the face, painted eyes where it
    has none, and between parted lips the dark, teeth and tongue.
    """
    own = own_parts(face, frame)
    pose = np.asarray(frame.field_data.get(POSE, np.eye(4)), dtype=np.float64)
    back = np.linalg.inv(pose)
    points = np.asarray(frame.points, dtype=np.float64)[: face.mesh.n_points] @ back[:3, :3].T + back[:3, 3]
    parts = {}
    for eye in face.eyes:
        gaze = np.array(frame.field_data.get(f"gaze_{eye.side}", eye.gaze), dtype=np.float64).ravel()
        ball, rim = PaintedEye(eye, face), LidRim(eye, face)
        if f"eye_{eye.side}" not in own:
            parts[f"eye_{eye.side}"] = ball.on(points, gaze)
        if ball.open and len(rim.loop):
            parts[f"rim_{eye.side}"] = rim.on(points)
    mouth = Mouth(face)
    if mouth.parted(points):
        inside = {name: part for name, part in mouth.inside(points).items() if name not in own}
        parts |= inside if mouth.bag else {"mouth": mouth.pocket(points)} | inside
    for part in parts.values():
        part.points = np.asarray(part.points, dtype=np.float64) @ pose[:3, :3].T + pose[:3, 3]
        if "Normals" in part.point_data:
            part.point_data["Normals"] = np.asarray(part.point_data["Normals"]) @ pose[:3, :3].T
    return parts | own


IN_MOUTH = 14.0
"""Skin that lies deeper behind the lips is that of a mouth, mm on a face of average size."""


FARTHEST, FADING = np.array([0.07, 0.025, 0.025]), np.array([0.26, 0.22, 0.215])
"""Share of the light that is left far back in a mouth, and how far in it goes, in distances between the pupils: flesh
around it throws back red.
"""


class Mouth:
    """What shows between parted lips: the dark inside, teeth, gums and tongue.

    Parameters
    ----------
    face : Face
        Its mouth is an opening of the mesh (`loop`), or a bag of skin behind the lips (`bag`); where it is neither,
        there is nothing.
    """

    INSIDE = ("upper_teeth", "lower_teeth", "tongue")

    def __init__(self, face: Face) -> None:
        self.loop, self.bag = np.empty(0, np.int64), False
        if not face.landmarks:
            return
        centre = 0.5 * (face.landmarks["upper_lip_mid"] + face.landmarks["lower_lip_mid"])
        self._size, self._axes = face.frame.pupil_distance, face.frame.axes
        width = 0.5 * float((face.landmarks["mouth_l"] - face.landmarks["mouth_r"]) @ self._axes[0])
        for loop in boundary_loops(face.triangles):
            near, across = np.linalg.norm(face.points[loop] - centre, axis=1), np.ptp(face.points[loop] @ self._axes[0])
            if (
                near.max() < 0.8 * self._size
                and np.linalg.norm(face.points[loop].mean(axis=0) - centre) < 0.3 * self._size
                and across > width  # others are holes beside it
            ):
                self.loop, width = np.asarray(loop, dtype=np.int64), across
        ends = self._middles(face) if len(self.loop) else _lips_of_bag(face)
        if ends is None:
            return
        self._ends, self.bag = ends, not len(self.loop)
        self._rest = self._gap(face.points)
        self._width = float(np.ptp(face.points[self.loop] @ self._axes[0])) if not self.bag else 0.0
        self.teeth = teeth_of(face.landmarks, face.frame)
        self._normals = [vertex_normals(arch.points, arch.triangles) for arch in self.teeth]
        self._bones = [
            self._shaded(arch.points, arch.paint * self._facing(normals), centre)
            for arch, normals in zip(self.teeth, self._normals, strict=True)
        ]
        ball = pv.Sphere(radius=1.0, theta_resolution=24, phi_resolution=16)
        self._tongue = centre + (ball.points * [0.30, 0.15, 0.42] - [0.0, 0.15, 0.62]) * self._size @ self._axes
        self._tongue_triangles = np.asarray(ball.regular_faces, np.int32)
        tint = np.tile(np.array(PART_COLOURS["tongue"], np.float64), (len(self._tongue), 1))
        self._tongue_paint = self._shaded(self._tongue, tint, centre)
        self._jaw = _jaw_bone(face)

    def _middles(self, face: Face) -> tuple[int, int]:
        """The two vertices of the opening in the middle of the lips: nearest to the midline on either side of it."""
        aside = np.abs((face.points[self.loop] - face.frame.origin) @ self._axes[0])
        n, first = len(self.loop), int(np.argmin(aside))
        across = [(first + step) % n for step in range(n // 4, n - n // 4)]
        return int(self.loop[first]), int(self.loop[min(across, key=lambda at: float(aside[at]))])

    def _gap(self, points: Array) -> float:
        return float(abs((points[self._ends[0]] - points[self._ends[1]]) @ self._axes[1]))

    def _shaded(self, points: Array, paint: npt.NDArray[Any], centre: Array) -> npt.NDArray[np.uint8]:
        """Paint, darker and redder the farther back it is."""
        back = np.maximum((centre - points) @ self._axes[2] / self._size - 0.2, 0.0)[:, None]
        return np.rint(paint * (FARTHEST + 0.84 * np.exp(-back / FADING))).astype(np.uint8)

    def _facing(self, normals: Array) -> Array:
        """Share (n, 1) of the light that comes in between the lips: little on the sides towards the tongue."""
        return 0.25 + 0.75 * smoothstep((normals @ self._axes[2] + 0.1) / 0.5)[:, None]

    def parted(self, points: Array) -> bool:
        """Whether the lips are farther apart than at rest."""
        return (self.bag or len(self.loop) > 0) and self._gap(points) - self._rest > 0.012 * self._size

    def pocket(self, points: Array) -> pv.PolyData:
        """The dark inside, with `paint` (rgb), behind the lips as they are now: the face's vertices (n, 3)."""
        rim = points[self.loop]
        n, middle, size = len(rim), rim.mean(axis=0), self._size
        local = (rim - middle) @ self._axes.T
        turn = np.arctan2(local[:, 1] / max(float(np.abs(local[:, 1]).max()), 0.02 * size), local[:, 0] / (0.4 * size))
        oval = np.stack([np.cos(turn), 0.65 * np.sin(turn), np.zeros(n)], axis=1)
        rings = [rim]
        narrow = min(float(np.ptp(local[:, 0])) / self._width, 1.0)  # pursed lips take the cheeks beside them along
        for half, depth in ((0.38 * narrow, 0.12), (0.47 * narrow, 0.3), (0.45, 0.85)):
            rings.append(middle + (half * oval - [0.0, 0.0, depth]) * size @ self._axes)
        here = np.arange(n)
        after = (here + 1) % n
        faces = []
        for k in (0, n, 2 * n):
            faces += [np.stack(c, axis=1) + k for c in ((here, here + n, after), (after, here + n, after + n))]
        faces.append(np.stack([here + 3 * n, np.full(n, 4 * n), after + 3 * n], axis=1))
        rings.append(rings[-1].mean(axis=0)[None])
        pocket = to_polydata(np.vstack(rings), np.vstack(faces))
        tints = [(84, 38, 36), (50, 20, 19), (26, 9, 9), (12, 4, 5), (12, 4, 5)]
        pocket.point_data["paint"] = np.repeat(np.array(tints, np.uint8), [n, n, n, n, 1], axis=0)
        return pocket

    def inside(self, points: Array) -> dict[str, pv.PolyData]:
        """Teeth and tongue by name, with `paint` (rgb): the lower ones go with the mandible."""
        turn, hinge = self._turn(points)
        parts = {}
        for arch, paint, normals in zip(self.teeth, self._bones, self._normals, strict=True):
            moves = arch.jaw == "lower"
            mesh = to_polydata((arch.points - hinge) @ turn.T + hinge if moves else arch.points, arch.triangles)
            mesh.point_data["Normals"] = normals @ turn.T if moves else normals
            mesh.point_data["paint"] = paint
            parts[f"{arch.jaw}_teeth"] = mesh
        tongue = to_polydata((self._tongue - hinge) @ turn.T + hinge, self._tongue_triangles)
        tongue.point_data["Normals"] = vertex_normals(tongue.points, self._tongue_triangles)
        tongue.point_data["paint"] = self._tongue_paint
        return parts | {"tongue": tongue}

    def _turn(self, points: Array) -> tuple[Array, Array]:
        """Rotation of the mandible about a point of its hinge, as the skin over it tells."""
        if self._jaw is None:
            return np.eye(3), np.zeros(3)
        vertices, before, hinge, axis = self._jaw
        now = points[vertices] - hinge
        flat, turned = (offset - np.outer(offset @ axis, axis) for offset in (before, now))
        angle = np.arctan2((np.cross(flat, turned) @ axis).sum(), (flat * turned).sum())
        return Rotation.from_rotvec(angle * axis).as_matrix(), hinge


def _lips_of_bag(face: Face) -> tuple[int, int] | None:
    """The vertices in the middle of the lips where these meet, if the skin goes on from there into a mouth."""
    size = face.frame.pupil_distance
    lips = 0.5 * (face.landmarks["upper_lip_mid"] + face.landmarks["lower_lip_mid"])
    local = (face.points - lips) @ face.frame.axes.T / size
    depth = Cavities(face.points, face.triangles, face.landmarks, face.frame).depth(face.points)
    if not (depth[(np.abs(local[:, :2]) < [0.3, 0.25]).all(axis=1)] > IN_MOUTH).any():
        return None
    up = vertex_normals(face.points, face.triangles) @ face.frame.axes[1]
    near = (np.abs(local[:, 0]) < 0.1) & (np.abs(local[:, 1]) < 0.25) & (local[:, 2] > -0.2)
    ends = []
    for sign in (-1.0, 1.0):  # the upper lip faces down where it meets the lower one
        at = np.flatnonzero(near & (sign * up > 0.5) & (depth < IN_MOUTH))
        if not len(at):
            return None
        ends.append(int(at[np.argmin(np.abs(local[at, 0]) + 2.0 * np.abs(local[at, 1]))]))
    return ends[0], ends[1]


def _jaw_bone(face: Face) -> tuple[npt.NDArray[np.int64], Array, Array, Array] | None:
    """Vertices that go wholly with the mandible, their offsets from its hinge at rest, the hinge, and its axis."""
    for name, muscle in face.muscles.items():
        if isinstance(muscle, JawMuscle) and name in face.guides:
            guide = face.guides[name]
            vertices = guide.vertices[guide.angles > 0.98 * muscle.angle]
            if len(vertices):
                return vertices, face.points[vertices] - muscle.hinge, muscle.hinge, muscle.axis
    return None


def _mixed(first: Array, second: Array, t: Array) -> Array:
    share = smoothstep(t)[:, None]
    return np.asarray(first * (1.0 - share) + second * share)
