"""What is drawn beside the skin: painted eyes, brows of tapered hairs, and the dark behind parted lips."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv

from .anatomy.eyes import Eyeball
from .anatomy.face import Face
from .anatomy.head import Hairs
from .geometry.topology import boundary_loops

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

PUPIL, IRIS = 10.5, 29.0
"""Angles from the middle of the eye, degrees."""

RINGS = np.array([0.0, 5, 10, 11.5, 14, 17, 20, 23, 25.5, 27.5, 29, 30.5, 32.5, 36, 42, 50, 60, 72, 85, 100])
SPOKES = 96


def painted_eye(eye: Eyeball, gaze: Array | None = None) -> pv.PolyData:
    """The front of an eyeball with `paint` (rgb): pupil, streaked iris, dark rim, sclera under the lid's shadow.

    It looks along the unit direction `gaze`; default: straight ahead.
    """
    lid = eye.up
    eye = eye if gaze is None else eye.looking(gaze)
    side = np.cross(eye.up, eye.gaze)
    side /= np.linalg.norm(side)
    up = np.cross(eye.gaze, side)
    turn = np.arange(SPOKES) * (2.0 * np.pi / SPOKES)
    ring, spoke = (grid.ravel() for grid in np.meshgrid(RINGS, turn, indexing="ij"))
    away = np.sin(np.radians(ring))
    height = away * np.sin(spoke)
    normals = (
        np.cos(np.radians(ring))[:, None] * eye.gaze + (away * np.cos(spoke))[:, None] * side + height[:, None] * up
    )
    here = np.arange(SPOKES) + SPOKES * np.arange(len(RINGS) - 1)[:, None]
    after = (np.arange(SPOKES) + 1) % SPOKES + SPOKES * np.arange(len(RINGS) - 1)[:, None]
    quads = np.stack([here, here + SPOKES, after + SPOKES, after], axis=-1).reshape(-1, 4)
    ball = pv.PolyData.from_regular_faces(eye.centre + eye.radius * normals, quads)
    ball.point_data["Normals"] = normals
    ball.point_data["paint"] = _paint(ring, spoke, normals @ lid)
    return ball


def _paint(angle: Array, spoke: Array, height: Array) -> npt.NDArray[np.uint8]:
    """Colours (n, 3) of points at an angle from the middle, on a spoke, at a height above the middle (in radii)."""
    across = np.clip((angle - PUPIL) / (IRIS - PUPIL), 0.0, 1.0)
    streaks = 1.0 + 0.10 * np.sin(23.0 * spoke) * np.sin(9.0 * spoke + 4.0 * across) + 0.06 * np.sin(47.0 * spoke)
    iris = np.array([92.0, 116.0, 128.0]) * (streaks * (0.72 + 0.45 * across - 0.25 * across**4))[:, None]
    iris += (1.0 - across)[:, None] ** 2 * [30.0, 16.0, -8.0]  # a warmer ring around the pupil
    sclera = np.tile([226.0, 218.0, 210.0], (len(angle), 1))
    sclera -= np.clip((angle - 40.0) / 45.0, 0.0, 1.0)[:, None] * [10.0, 42.0, 44.0]  # redder towards the corners
    rim = np.array([34.0, 40.0, 46.0])
    paint = _mixed(iris, rim, (angle - 25.0) / 3.5)
    paint = _mixed(paint, sclera, (angle - IRIS) / 3.5)
    paint = _mixed(np.tile([9.0, 9.0, 11.0], (len(angle), 1)), paint, (angle - PUPIL) / 1.0)
    shadow = 1.0 - 0.55 * _smooth((height - 0.12) / 0.4)
    return np.clip(paint * shadow[:, None], 0.0, 255.0).astype(np.uint8)


class Brows:
    """Tapered ribbons for the hairs of the eyebrows, in the unit of the mesh.

    Parameters
    ----------
    hairs : Hairs
    width : float
        Of a hair at its root.
    """

    STRANDS = 3
    """Ribbons per hair, shifted and shortened at random: the brow is dense and its hairs are thin."""

    def __init__(self, hairs: Hairs, width: float) -> None:
        self.hairs = hairs
        self.width = width
        k, p = hairs.triangles.shape
        random = np.random.default_rng(7)
        share = np.linspace(0.0, 1.0, p)[:, None]
        shape = (k, self.STRANDS, 1, 1)
        self._length = random.uniform(0.55, 1.0, shape)
        self._aside = width * (
            random.uniform(-7.0, 7.0, shape) * (1.0 - 0.5 * share) + random.normal(0.0, 3.0, shape) * share**2
        )
        self._half = 0.5 * width * (1.0 - 0.8 * share**2)
        tint = np.array([64.0, 46.0, 36.0]) * random.uniform(0.7, 1.25, shape)
        paint = tint * (1.0 - share**2) + np.array([118.0, 88.0, 70.0]) * share**2
        self._paint = np.repeat(paint.reshape(-1, 3), 2, axis=0).astype(np.uint8)
        corner = 2 * p * np.arange(k * self.STRANDS)[:, None] + 2 * np.arange(p - 1)
        self._quads = np.stack([corner, corner + 1, corner + 3, corner + 2], axis=-1).reshape(-1, 4)

    def on(self, points: Array, triangles: IntArray, normals: Array) -> pv.PolyData:
        """The ribbons, with `paint` (rgb), on the skin as it is now: its points and vertex normals (n, 3)."""
        lines = self.hairs.polylines(points, triangles, normals)
        up = np.einsum("kpc,kpci->kpi", self.hairs.weights, normals[triangles[self.hairs.triangles]])
        along = np.gradient(lines, axis=1)
        side = np.cross(along, up)
        side /= np.maximum(np.linalg.norm(side, axis=2, keepdims=True), 1e-12)
        lines, up, side = (array[:, None] for array in (lines, up, side))
        strands = lines[..., :1, :] + self._length * (lines - lines[..., :1, :]) + self._aside * side
        half = self._half * side
        ribbons = np.stack([strands - half, strands + half], axis=3)
        mesh = pv.PolyData.from_regular_faces(ribbons.reshape(-1, 3), self._quads)
        mesh.point_data["Normals"] = np.broadcast_to(up[:, :, :, None], ribbons.shape).reshape(-1, 3)
        mesh.point_data["paint"] = self._paint
        return mesh


class MouthCavity:
    """The dark pocket behind parted lips: nothing else would stand between the camera and the back of the head.

    Parameters
    ----------
    face : Face
        Where its mesh has no opening at the mouth, there is no pocket (`loop` is empty).
    """

    COLOUR = (66, 26, 24)

    def __init__(self, face: Face) -> None:
        self.loop = np.empty(0, np.int64)
        if not face.landmarks:
            return
        centre = 0.5 * (face.landmarks["upper_lip_mid"] + face.landmarks["lower_lip_mid"])
        size = face.frame.pupil_distance
        self._back = -0.2 * size * face.frame.axes[2]
        for loop in boundary_loops(face.triangles):
            near = np.linalg.norm(face.points[loop] - centre, axis=1)
            if near.max() < 0.8 * size and np.linalg.norm(face.points[loop].mean(axis=0) - centre) < 0.3 * size:
                self.loop = np.asarray(loop, dtype=np.int64)

    def on(self, points: Array) -> pv.PolyData:
        """The pocket behind the lips as they are now: positions (n, 3) of the face's vertices."""
        rim = points[self.loop]
        n, middle = len(rim), rim.mean(axis=0)
        pocket = np.vstack([rim, middle + 0.9 * (rim - middle) + self._back, middle + self._back])
        here = np.arange(n)
        after = (here + 1) % n
        sides = [np.stack(corners, axis=1) for corners in ((here, here + n, after), (after, here + n, after + n))]
        cap = np.stack([here + n, np.full(n, 2 * n), after + n], axis=1)
        return pv.PolyData.from_regular_faces(pocket, np.vstack([*sides, cap]))


def _smooth(t: Array) -> Array:
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def _mixed(first: Array, second: Array, t: Array) -> Array:
    share = _smooth(t)[:, None]
    return np.asarray(first * (1.0 - share) + second * share)
