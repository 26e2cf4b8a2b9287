"""Motion of the parts that come with a face: with its skin, its mandible and its eyes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from ..array_types import Array
from ..geometry import closest_rotations, rigid_motion, vertex_normals, vertex_rings
from ..mesh import COLORS, OF_PART, PART, PARTS, joined, to_polydata
from ..mesh.arrays import use_texture
from .eyeball import Eyeball
from .parts import ALONG, Part
from .skull import Mandible

STILL = 0.01
"""Vertices farther than this off the motion of the head, in distances between the pupils, count little in finding it.
"""


class Attachments:
    """Moves the parts of a face with its skin, its mandible and its eyes.

    Parameters
    ----------
    parts : dict of str to Part
    eyes : list of Eyeball
    mandible : Mandible, optional
    points : ndarray, shape (n, 3)
        The skin at rest.
    triangles : ndarray of int, shape (m, 3)
    size : float
        Distance between the pupils.

    Examples
    --------
    A hat goes up with the head:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> hat = Part(pv.Sphere(radius=90.0, center=(0, 120, 0)), follows="skull")
    >>> skin = face.points, face.triangles, face.frame.pupil_distance
    >>> moved = Attachments({"hat": hat}, face.eyes, face.mandible, *skin).at(face.points + [0, 10, 0], {})["hat"]
    >>> (moved.points - hat.mesh.points).mean(axis=0).round(3) + 0.0
    array([ 0., 10.,  0.])
    """

    def __init__(
        self,
        parts: Mapping[str, Part],
        eyes: list[Eyeball],
        mandible: Mandible | None,
        points: Array,
        triangles: npt.NDArray[np.int32],
        size: float,
    ) -> None:
        self._parts, self._eyes, self._mandible, self._size = parts, eyes, mandible, size
        self._still = points
        self._on_skin = {
            name: _OnSkin(part, points, triangles, size) for name, part in parts.items() if part.follows == "skin"
        }
        given = {name: part.mesh.point_data.get("Normals") for name, part in parts.items()}
        self._normals = {
            name: _normals(parts[name].mesh) if normals is None else np.asarray(normals)
            for name, normals in given.items()
        }

    def at(
        self,
        points: Array,
        gazes: Mapping[str, Array],
        pose: Array | None = None,
        given: Mapping[str, Array] | None = None,
        jaw_angle: float | None = None,
        mandible: Array | None = None,
    ) -> dict[str, pv.PolyData]:
        """Return the parts by name, moved with the face's vertices (n, 3) and its eyes' directions `gazes`.

        `pose`, a matrix (4, 4), is the motion of the head; without it, the motion is found from the vertices. `given`
        holds points (k, 3) of parts that move by themselves, by name; those that are NaN move as if not given. Without
        `jaw_angle`, radians, the turn of the mandible is measured on the skin; `mandible`,
        a matrix (4, 4), moves it after that turn.
        """
        mandible = np.eye(4) if mandible is None else mandible
        pose = rigid_motion(self._still, points, STILL * self._size) if pose is None else pose
        turn, shift = pose[:3, :3], pose[:3, 3]
        eyes = {eye.side: eye for eye in self._eyes}
        out = {}
        for name, part in self._parts.items():
            rest, normals = np.asarray(part.mesh.points, dtype=np.float64), self._normals[name]
            if name in self._on_skin:
                out[name] = _with(part.mesh, self._on_skin[name].at(points), None)
                continue
            own, centre, thrust = np.eye(3), np.zeros(3), np.zeros(3)
            if part.follows == "eye" and part.side in eyes:
                eye = eyes[part.side]
                own, centre = _axes(eye.looking(gazes.get(part.side, eye.gaze))).T @ _axes(eye), eye.centre
            elif part.follows == "mandible" and self._mandible is not None:
                own = self._mandible.rotation((points - shift) @ np.linalg.inv(turn).T, jaw_angle)
                centre = self._mandible.hinge
                thrust = mandible[:3, :3] @ centre + mandible[:3, 3] - centre
                own = mandible[:3, :3] @ own
            moved = ((rest - centre) @ own.T + centre + thrust) @ turn.T + shift
            turned = (turn @ own).T
            out[name] = _with(part.mesh, moved, normals @ turned)
            if ALONG in part.mesh.point_data:
                out[name].point_data[ALONG] = part.mesh.point_data[ALONG] @ turned
        for name, itself in (given or {}).items():
            out[name] = _with(out[name], np.where(np.isnan(itself), out[name].points, itself), None)
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


class _OnSkin:
    """A part that follows the skin: each point moves rigidly with the two rings of vertices around its root.

    Parameters
    ----------
    part : Part
    skin : ndarray, shape (n, 3)
        At rest.
    triangles : ndarray of int, shape (m, 3)
    size : float
        Distance between the pupils.
    """

    def __init__(self, part: Part, skin: Array, triangles: npt.NDArray[np.int32], size: float) -> None:
        points = np.asarray(part.mesh.points, dtype=np.float64)
        height, below = cKDTree(skin).query(points)
        label = np.empty(len(points), np.int64)
        label[np.asarray(part.mesh.regular_faces)] = part.pieces[:, None]
        root = np.arange(len(points))
        for piece in np.unique(label):
            mine = np.flatnonzero(label == piece)
            low, high = height[mine].min(), height[mine].max()
            roots = mine[height[mine] <= low + 0.3 * (high - low)]  # the lowest third of a piece, above the skin
            root[mine] = roots[cKDTree(points[roots]).query(points[mine])[1]]
        places = np.unique(below[root])
        start, ring = vertex_rings(triangles, len(skin))
        first = csr_array((np.ones(len(ring)), ring, start), shape=(len(skin), len(skin)))
        two = (first[places] @ first + first[places]).astype(bool).astype(np.float64)
        self._mean = csr_array(two.multiply(1.0 / two.sum(axis=1)[:, None]))
        self._points, self._rest = points, self._mean @ skin
        self._skin = skin
        count = min(6, len(places))  # vertices of the skin that carry each root
        distance, nearest = cKDTree(skin[places]).query(points[root], k=list(range(1, count + 1)))
        weights = 1.0 / (distance + 0.05 * size) ** 2  # those very near count alike
        self._nearest, self._weights = nearest, weights / weights.sum(axis=1, keepdims=True)

    def at(self, points: Array) -> Array:
        """Points (k, 3) of the part, for the vertices of the face (n, 3) as they are now."""
        now = self._mean @ points
        pairs = (self._skin[:, :, None] * points[:, None, :]).reshape(len(points), 9)
        spread = (self._mean @ pairs).reshape(-1, 3, 3) - self._rest[:, :, None] * now[:, None, :]
        turn = closest_rotations(spread)[self._nearest]
        offset = self._points[:, None, :] - self._rest[self._nearest]
        moved = now[self._nearest] + np.einsum("nki,nkij->nkj", offset, turn)
        return np.asarray(np.einsum("nk,nkj->nj", self._weights, moved))


def combined_mesh(skin: pv.PolyData, parts: Mapping[str, pv.PolyData]) -> pv.PolyData:
    """Return skin and parts in one mesh, the points of the skin first; array "part" indexes `field_data["parts"]`.

    It has the arrays of the skin; where a part lacks one, it is zero. Colors are kept even if only parts have them;
    points without colors are white.

    Examples
    --------
    >>> head, hat = pv.Sphere(radius=100.0), pv.Sphere(radius=50.0, center=(0, 120, 0))
    >>> whole = combined_mesh(head, {"hat": hat})
    >>> whole.n_points == head.n_points + hat.n_points, whole.field_data["parts"].tolist()
    (True, ['skin', 'hat'])
    """
    meshes = [skin, *parts.values()]
    names = [*skin.point_data, *({COLORS} & {name for mesh in meshes[1:] for name in mesh.point_data})]
    each = [(mesh.points, mesh.regular_faces, mesh.point_data) for mesh in meshes]
    whole = to_polydata(*joined(each, dict.fromkeys(names), {COLORS: 255}))
    owner: np.ndarray = np.repeat(np.arange(len(meshes), dtype=np.int32), [mesh.n_points for mesh in meshes])
    whole.point_data.set_array(owner, PART)
    whole.field_data.update({key: value for key, value in skin.field_data.items() if not key.startswith(OF_PART)})
    whole.field_data[PARTS] = ["skin", *parts]
    use_texture(whole, skin.point_data.active_texture_coordinates_name)
    whole.point_data.active_normals_name = "Normals" if "Normals" in names else None
    return whole
