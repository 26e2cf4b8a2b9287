"""What comes with a face beside its skin: eyes, teeth, lashes, brows, hair, glasses. They are carried along."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..geometry.normals import vertex_normals
from ..geometry.rigid import Rigid
from ..geometry.topology import unique_edges, vertex_rings
from ..mesh import laid_image, to_polydata
from ..mesh.arrays import OF_PART, SOURCE, with_data
from ..mesh.checks import PART
from ..mesh.reading import COLORS
from .eyes import RADIUS, Eyeball
from .guides import Guide
from .landmarks import FaceFrame
from .muscles import JawMuscle

if TYPE_CHECKING:
    from .face import Face

Array = npt.NDArray[np.float64]
Follows = Literal["skull", "mandible", "eye", "skin"]

NEAR_EYE, AROUND_EYE = 1.6, 0.1
"""What lies within so many radii of the middle of an eye, and this farther, in distances between the pupils, belongs
to it.
"""

BALLS = (0.7, 2.6)
"""Radii of balls that may be eyes, relative to an adult's: up to where those of a child or a cartoon touch."""

UNEVEN, OPEN = 0.25, 1.2
"""How far a ball may bulge, as with its cornea, and how broad the piece of it is that there is at least, in radii."""

ARCH, ROWS, TONGUE = 0.4, 0.04, 0.2
"""How broad a row of teeth is, how far apart two are, and how broad a tongue is, in distances between the pupils."""

ON_SKIN = 0.12
"""Parts that nowhere are farther from the skin than this, in distances between the pupils, follow the skin."""

STILL = 0.01
"""Vertices that move by less than this, in distances between the pupils, go with the head."""

SPECK = 0.02
"""Parts smaller than this, in distances between the pupils, are dropped, unless they belong to an eye or a mouth."""


CARD = 0.04
"""Sheets wider than this share of all lashes are cards with a picture of many hairs; a hair is a tenth as wide."""


@dataclass(frozen=True, eq=False)
class Part:
    """Something that comes with a face beside its skin.

    Attributes
    ----------
    mesh : pyvista.PolyData
        At rest, in the coordinates of the face, with the point data of the input.
    follows : {"skull", "mandible", "eye", "skin"}
        What carries it.
    side : {"l", "r", ""}
        Of an eye.
    texture : ndarray of uint8, shape (h, w, 3 or 4), optional
        Colour, and how opaque it is, over the mesh's texture coordinates.
    source_points : ndarray of int, shape (k,), optional
        The number that each point has in the mesh that the face was made from.
    """

    mesh: pv.PolyData
    follows: Follows
    side: str = ""
    texture: npt.NDArray[np.uint8] | None = None
    source_points: npt.NDArray[np.int64] | None = None

    @cached_property
    def lacks_picture(self) -> bool:
        """Whether it is cards, flat and wide, that should show a picture of hairs, and has neither that nor colours."""
        if self.texture is not None or COLORS in self.mesh.point_data:
            return False
        points, triangles = np.asarray(self.mesh.points), np.asarray(self.mesh.regular_faces)
        label = np.asarray(self.mesh.cell_data[PART])
        a, b, c = (points[triangles[:, corner]] for corner in range(3))
        across = 0.5 * np.cross(b - a, c - a)
        area = np.bincount(label, np.linalg.norm(across, axis=1))
        flat = np.linalg.norm([np.bincount(label, values) for values in across.T], axis=0) > 0.5 * area  # no tube
        edges, sides = unique_edges(triangles)
        length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        length[np.bincount(sides.ravel()) > 1] = 0.0
        border = np.bincount(label, length[sides].sum(axis=1))
        cards = flat & (2.0 * area > CARD * np.ptp(points, axis=0).max() * border)
        return bool(area[cards].sum() > 0.5 * area.sum())


def follower(name: str, mesh: pv.PolyData, texture: npt.NDArray[np.uint8] | None = None) -> Part:
    """The part of a name: ``eye_l`` turns with the eye, lower teeth and tongue with the jaw, lashes with the skin."""
    source, side = mesh.point_data.pop(SOURCE, None), ""  # of a new object
    follows: Follows = "skin" if name.split("_")[0] in ("lashes", "fuzz") else "skull"
    if name.startswith("eye_"):
        follows, side = "eye", name[-1]
    elif name in ("lower_teeth", "tongue"):
        follows = "mandible"
    return Part(mesh, follows, side, texture, None if source is None else np.asarray(source))


# --- what is what -----------------------------------------------------------------------------------------


def named_parts(
    others: pv.PolyData, skin: pv.PolyData, landmarks: Mapping[str, Array], frame: FaceFrame
) -> tuple[dict[str, Part], int]:
    """Eyes, teeth, tongue, lashes, glasses, hair, told apart by size and place, and how many specks were dropped.

    Parameters
    ----------
    others : pyvista.PolyData
        All that is not skin; its cell data "part" number what is connected.
    skin : pyvista.PolyData
    landmarks : dict of str to ndarray, shape (3,)
    frame : FaceFrame
    """
    triangles, label = np.asarray(others.regular_faces), np.asarray(others.cell_data[PART])
    local = (np.asarray(others.points) - frame.origin) @ frame.axes.T / frame.pupil_distance
    marks = {n: (p - frame.origin) @ frame.axes.T / frame.pupil_distance for n, p in landmarks.items()}
    away = cKDTree(np.asarray(skin.points)).query(others.points)[0] / frame.pupil_distance
    order = np.argsort(label, kind="stable")
    ends = np.flatnonzero(np.diff(label[order], prepend=-1, append=label.max() + 1))
    pieces = [(piece, np.unique(triangles[piece])) for piece in (order[begin:end] for begin, end in pairwise(ends))]
    eyes = {side: _socket([local[used] for _, used in pieces], marks[f"eye_{side}_centre"]) for side in "lr"}
    kinds = [_kind(local[used], away[used], marks, eyes) for _, used in pieces]
    inside = [local[used] for (_, used), kind in zip(pieces, kinds, strict=True) if kind == "teeth"]
    line = _bite(inside, _lips(marks)[1])
    rows: dict[str, list[npt.NDArray[np.int64]]] = {}
    for (piece, used), kind in zip(pieces, kinds, strict=True):
        name = _jaw_with(local[used], line) + "_teeth" if kind == "teeth" else kind
        rows.setdefault(name, []).append(piece)
    specks = len(rows.pop("speck", []))
    found = {}
    for name in sorted(rows):
        chosen = np.sort(np.concatenate(rows[name]))
        kept, renumbered = np.unique(triangles[chosen], return_inverse=True)
        mesh = with_data(others, renumbered.reshape(-1, 3), kept)
        for array in others.cell_data:
            mesh.cell_data[array] = np.asarray(others.cell_data[array])[chosen]
        if COLORS in mesh.point_data and np.asarray(mesh.point_data[COLORS]).min() == 255:
            del mesh.point_data[COLORS]  # where others have colours
        found[name] = follower(name, mesh, laid_image(mesh))
    return found, specks


def _socket(pieces: list[Array], centre: Array) -> tuple[Array, float]:
    """Centre and radius of an eye: of the largest ball that there is about where it is expected, or as expected."""
    balls = [ball for ball in (_eyeball(points, centre, RADIUS) for points in pieces) if ball is not None]
    return max(balls, key=lambda ball: ball[1], default=(centre, RADIUS))


def _kind(points: Array, away: Array, marks: Mapping[str, Array], eyes: Mapping[str, tuple[Array, float]]) -> str:
    """What a part is, from its points (n, 3) [left, up, forward] and their distances from the skin.

    All lengths are in distances between the pupils.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    middle, extent = 0.5 * (low + high), high - low
    for side, (centre, radius) in eyes.items():
        if np.linalg.norm(points - centre, axis=1).max() > NEAR_EYE * radius + AROUND_EYE:
            continue
        # Balls, corneas and irises are round and lie before or about the middle of the eye; lashes stand off its rim.
        flat = np.linalg.norm(middle[:2] - centre[:2])
        lengths = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        hair = lengths[1] < 0.2 * lengths[0]
        round_ = not hair and (extent[1] > 0.6 * extent[0] or extent[:2].max() < 0.8 * RADIUS)
        return f"eye_{side}" if flat < 0.5 * radius and round_ else f"lashes_{side}"
    lips = _lips(marks)
    within = np.abs(middle - lips)
    behind = middle[2] < lips[2] + 0.05 and high[2] < lips[2] + 0.25
    if behind and within[0] < 0.55 and within[1] < 0.5 and middle[2] > lips[2] - 1.2 and extent.max() < 1.4:
        tongue = extent[0] > TONGUE and extent[2] > 1.2 * extent[0] and within[0] < 0.1  # deep, and in the middle
        return "tongue" if tongue else "teeth"
    if extent.max() < SPECK:
        return "speck"
    if away.max() < ON_SKIN:
        return "fuzz"
    bridge = marks["nasion"]
    if high[2] > bridge[2] and high[1] < bridge[1] + 0.7 and low[1] > bridge[1] - 0.9 and extent[0] > 0.4:
        return "glasses"
    hangs = low[2] < marks["nose_tip"][2] - 1.2 and high[1] > lips[1]  # what ends below is a neck or a pedestal
    fringe = high[1] > bridge[1] + 1.0  # from above the forehead, however far down
    return "hair" if middle[1] > bridge[1] or hangs or fringe else "other"


def _lips(marks: Mapping[str, Array]) -> Array:
    return np.asarray(np.mean([marks[n] for n in ("upper_lip_mid", "lower_lip_mid", "mouth_l", "mouth_r")], axis=0))


def _bite(pieces: list[Array], lips: float) -> float:
    """The height at which two rows of teeth meet: between the highest and the lowest, or the lips' if there is one."""
    heights = [0.5 * (points[:, 1].min() + points[:, 1].max()) for points in pieces if np.ptp(points[:, 0]) > ARCH]
    return 0.5 * (min(heights) + max(heights)) if heights and max(heights) - min(heights) > ROWS else lips


def _jaw_with(points: Array, line: float) -> str:
    return "lower" if points[:, 1].min() + points[:, 1].max() <= 2.0 * line else "upper"


def ball_of(points: Array) -> tuple[Array, float]:
    """Centre and radius of the sphere that fits points (n, 3) best.

    Examples
    --------
    >>> centre, radius = ball_of(np.array([[2.0, 0, 0], [0, 2, 0], [-2, 0, 0], [0, 0, 2], [0, -2, 0]]))
    >>> np.allclose(centre, 0.0), round(radius, 9)
    (True, 2.0)
    """
    middle = points.mean(axis=0)
    offset = points - middle
    right = (offset**2).sum(axis=1)
    solution = np.linalg.lstsq(np.column_stack([2.0 * offset, np.ones(len(offset))]), right, rcond=None)[0]
    radius = float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 0.0)))
    return middle + solution[:3], radius


def _eyeball(points: Array, centre: Array, adult: float) -> tuple[Array, float] | None:
    """Centre and radius of the ball, or its front, that points (n, 3) are; none if it is no eye about this place.

    `adult` is the radius of an eye as it is expected.
    """
    if len(points) < 9:
        return None
    middle, radius = ball_of(points)
    across = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    extent = np.sort(np.ptp(points @ across.T, axis=0))
    even = np.abs(np.linalg.norm(points - middle, axis=1) - radius).max() < UNEVEN * radius
    right = BALLS[0] < radius / adult < BALLS[1] and np.linalg.norm(middle - centre) < radius
    return (middle, radius) if even and right and extent[1] > OPEN * radius else None


def eyes_of(eyes: list[Eyeball], parts: Mapping[str, Part], frame: FaceFrame) -> list[Eyeball]:
    """The eyeballs, moved to the eyes that came with the face where these are balls."""
    out = []
    for eye in eyes:
        part = parts.get(f"eye_{eye.side}")
        if part is not None:
            label = np.asarray(part.mesh.cell_data[PART])
            largest = np.asarray(part.mesh.regular_faces)[label == np.argmax(np.bincount(label))]
            points = np.asarray(part.mesh.points)[np.unique(largest)]
            ball = _eyeball(points, eye.centre, RADIUS * frame.pupil_distance)
            if ball is not None:
                eye = replace(eye, centre=ball[0], radius=ball[1])
        out.append(eye)
    return out


# --- how it moves -----------------------------------------------------------------------------------------


class Carriers:
    """Moves the parts of a face with its skin, its mandible and its eyes.

    Parameters
    ----------
    face : Face
    """

    def __init__(self, face: Face) -> None:
        self.face = face
        self._still = Rigid(face.points)
        self._jaw = _jaw_of(face)
        self._tied = {name: _Tied(part.mesh, face) for name, part in face.parts.items() if part.follows == "skin"}
        self._bent = {name: _normals(part.mesh) for name, part in face.parts.items()}

    def on(
        self,
        points: Array,
        gazes: Mapping[str, Array],
        pose: Array | None = None,
        given: Mapping[str, Array] | None = None,
    ) -> dict[str, pv.PolyData]:
        """The parts by name, for the face's vertices (n, 3) and the eyes' directions as they are now.

        Where it is not known how the head has moved, a matrix (4, 4), the vertices tell. Parts that move by themselves
        are `given`, points (k, 3) by name; those of them that are NaN are carried like the others.
        """
        carried = self._carried(points, gazes, pose)
        for name, own in (given or {}).items():
            part = carried[name]
            carried[name] = _with(part, np.where(np.isnan(own), part.points, own), None)
        return carried

    def _carried(self, points: Array, gazes: Mapping[str, Array], pose: Array | None) -> dict[str, pv.PolyData]:
        face = self.face
        pose = self._still.pose(points, STILL * face.frame.pupil_distance) if pose is None else pose
        turn, shift = pose[:3, :3], pose[:3, 3]
        eyes = {eye.side: eye for eye in face.eyes}
        out = {}
        for name, part in face.parts.items():
            rest, normals = np.asarray(part.mesh.points, dtype=np.float64), self._bent[name]
            if name in self._tied:
                out[name] = _with(part.mesh, self._tied[name].on(points), None)
                continue
            own, centre = np.eye(3), np.zeros(3)
            if part.follows == "eye" and part.side in eyes:
                eye = eyes[part.side]
                own, centre = _axes(eye.looking(gazes.get(part.side, eye.gaze))).T @ _axes(eye), eye.centre
            elif part.follows == "mandible" and self._jaw is not None:
                own, centre = self._jaw.turn((points - shift) @ np.linalg.inv(turn).T), self._jaw.hinge
            moved = ((rest - centre) @ own.T + centre) @ turn.T + shift
            out[name] = _with(part.mesh, moved, normals @ (turn @ own).T)
        return out


def _axes(eye: Eyeball) -> Array:
    return np.stack([np.cross(eye.up, eye.gaze), eye.up, eye.gaze])


def _normals(mesh: pv.PolyData) -> Array:
    return vertex_normals(np.asarray(mesh.points, dtype=np.float64), np.asarray(mesh.regular_faces, dtype=np.int32))


def _with(mesh: pv.PolyData, points: Array, normals: Array | None) -> pv.PolyData:
    """A copy of a mesh with other points and normals."""
    moved = mesh.copy()
    moved.points = points
    moved.point_data["Normals"] = _normals(moved) if normals is None else normals
    moved.point_data.active_normals_name = "Normals"
    return moved


@dataclass(frozen=True, eq=False)
class _Jaw:
    """Vertices that go wholly with the mandible, their offsets from its hinge at rest, the hinge, and its axis."""

    vertices: npt.NDArray[np.int64]
    before: Array
    hinge: Array
    axis: Array

    def turn(self, points: Array) -> Array:
        """Rotation of the mandible about its hinge, as the skin over it tells."""
        now = points[self.vertices] - self.hinge
        flat, turned = (offset - np.outer(offset @ self.axis, self.axis) for offset in (self.before, now))
        angle = np.arctan2((np.cross(flat, turned) @ self.axis).sum(), (flat * turned).sum())
        return np.asarray(Rotation.from_rotvec(angle * self.axis).as_matrix())


def _jaw_of(face: Face) -> _Jaw | None:
    for name, muscle in face.muscles.items():
        if isinstance(muscle, JawMuscle) and name in face.guides:
            guide: Guide = face.guides[name]
            vertices = guide.vertices[guide.angles > 0.98 * muscle.angle]
            if len(vertices):
                return _Jaw(vertices, face.points[vertices] - muscle.hinge, muscle.hinge, muscle.axis)
    return None


class _Tied:
    """A part that follows the skin at its roots, bodily: as two rings of skin around them turn and go.

    Parameters
    ----------
    mesh : pyvista.PolyData
    face : Face
    """

    ROOT = 0.3
    """Points nearer to the skin than this share of a part's height over it are its roots."""

    BLENDED = 6
    """Each point goes with so many places of the skin."""

    def __init__(self, mesh: pv.PolyData, face: Face) -> None:
        points, skin = np.asarray(mesh.points, dtype=np.float64), face.points
        height, below = cKDTree(skin).query(points)
        label = np.empty(len(points), np.int64)
        label[np.asarray(mesh.regular_faces)] = np.asarray(mesh.cell_data[PART])[:, None]
        root = np.arange(len(points))
        for part in np.unique(label):
            mine = np.flatnonzero(label == part)
            low, high = height[mine].min(), height[mine].max()
            roots = mine[height[mine] <= low + self.ROOT * (high - low)]
            root[mine] = roots[cKDTree(points[roots]).query(points[mine])[1]]
        places = np.unique(below[root])
        start, ring = vertex_rings(face.triangles, len(skin))
        first = csr_array((np.ones(len(ring)), ring, start), shape=(len(skin), len(skin)))
        two = (first[places] @ first + first[places]).astype(bool).astype(np.float64)
        self._mean = csr_array(two.multiply(1.0 / two.sum(axis=1)[:, None]))
        self._points, self._rest = points, self._mean @ skin
        self._skin = skin
        count = min(self.BLENDED, len(places))
        distance, nearest = cKDTree(skin[places]).query(points[root], k=list(range(1, count + 1)))
        weights = 1.0 / (distance + 0.05 * face.frame.pupil_distance) ** 2
        self._nearest, self._weights = nearest, weights / weights.sum(axis=1, keepdims=True)

    def on(self, points: Array) -> Array:
        """Where the points of the part (k, 3) are, for the vertices of the face (n, 3) as they are now."""
        now = self._mean @ points
        pairs = (self._skin[:, :, None] * points[:, None, :]).reshape(len(points), 9)
        spread = (self._mean @ pairs).reshape(-1, 3, 3) - self._rest[:, :, None] * now[:, None, :]
        left, _, right = np.linalg.svd(spread)
        left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
        turn = (left @ right)[self._nearest]
        offset = self._points[:, None, :] - self._rest[self._nearest]
        there = now[self._nearest] + np.einsum("nki,nkij->nkj", offset, turn)
        return np.asarray(np.einsum("nk,nkj->nj", self._weights, there))


def joined(skin: pv.PolyData, parts: Mapping[str, pv.PolyData]) -> pv.PolyData:
    """Skin and parts in one mesh: the points of the skin first; "part" tells which of `field_data["parts"]` it is.

    The parts keep those arrays that the skin has; where they have none, there are zeros. Colours of parts are kept, and
    what has none is white.
    """
    meshes = [skin, *parts.values()]
    starts = np.cumsum([0, *(mesh.n_points for mesh in meshes[:-1])])
    data = {}
    for name in (*skin.point_data, *({COLORS} - set(skin.point_data))):
        values = next((mesh.point_data[name] for mesh in meshes if name in mesh.point_data), None)
        if values is None:
            continue
        rows = []
        for mesh in meshes:
            own = mesh.point_data.get(name)
            fits = own is not None and own.shape[1:] == values.shape[1:]
            nothing = np.full((mesh.n_points, *values.shape[1:]), 255 if name == COLORS else 0, values.dtype)
            rows.append(np.asarray(own, values.dtype) if fits else nothing)
        data[name] = np.concatenate(rows)
    data[PART] = np.repeat(np.arange(len(meshes), dtype=np.int32), [mesh.n_points for mesh in meshes])
    whole = to_polydata(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([mesh.regular_faces + start for mesh, start in zip(meshes, starts, strict=True)]),
        data,
    )
    whole.field_data.update({key: value for key, value in skin.field_data.items() if not key.startswith(OF_PART)})
    whole.field_data["parts"] = ["skin", *parts]
    texture = skin.point_data.active_texture_coordinates_name
    if texture is not None:
        whole.point_data.active_texture_coordinates_name = texture
    whole.point_data.active_normals_name = "Normals" if "Normals" in data else None
    return whole
