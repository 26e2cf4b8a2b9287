"""The mouth and the nostrils: how far behind the front of a face its skin lies there.

Lengths are mm on a face whose pupils are 63 mm apart.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..geometry.depth_buffer import sampled_depth_buffer
from ..geometry.normals import vertex_normals
from ..geometry.smoothstep import smoothstep
from .landmarks import FaceFrame

Array = npt.NDArray[np.float64]

STEP = 0.5
"""Of the grid."""

HALF, ABOVE, BELOW = 34.0, 16.0, 30.0
"""Half the width of what is seen, and how far it reaches above the base of the nose and below the lower lip."""

BACK = 130.0
"""What lies farther behind is the other side of the head."""

GROOVES = 7.5
"""So far above the base of the nose begin the grooves behind its wings: open to the front, but deep from below."""

INSIDE = 3.0
"""Skin that lies deeper behind lips or the rims of nostrils than this is inside."""

BACKWARD = -0.5
"""Skin that faces forward less than this (a cosine) is not seen from the front, however thin lips are before it."""

WIDE = {"nose": 9.0, "mouth": 13.0}
"""Hollows narrower than this are cavities, there and there."""


class Cavities:
    """Where mouth and nostrils of a face at rest are, from what is seen of it from the front.

    A grey-scale closing of the depth map fills all hollows that are narrow; what lies deeper than it is inside them.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    landmarks : mapping of str to ndarray, shape (3,)
    frame : FaceFrame

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> cavities = Cavities(face.points, face.triangles, face.landmarks, face.frame)
    >>> inside = 0.5 * (face.landmarks["upper_lip_mid"] + face.landmarks["lower_lip_mid"]) - [0, 0, 20]
    >>> bool(cavities.depth(inside[None])[0] > 10.0), float(cavities.depth(face.landmarks["malar_l"][None])[0])
    (True, 0.0)
    """

    def __init__(
        self,
        points: Array,
        triangles: npt.NDArray[np.int32],
        landmarks: Mapping[str, Array],
        frame: FaceFrame,
    ) -> None:
        self.frame = frame
        marks = {name: frame.local_mm(place) for name, place in landmarks.items()}
        nose = marks["subnasale"]
        self._low = np.array([-HALF, marks["lower_lip_mid"][1] - BELOW])
        shape = np.ceil((np.array([HALF, nose[1] + ABOVE]) - self._low) / STEP).astype(int) + 1
        front = _front(frame.local_mm(points)[triangles], self._low, shape)
        x, y = (low + STEP * np.arange(n) for low, n in zip(self._low, shape, strict=True))
        self._base = nose[1]
        self._border = 0.5 * (nose[1] + marks["upper_lip_mid"][1])
        upper = self._above(y)[None, :]
        corner = np.abs([marks["mouth_l"][0], marks["mouth_r"][0]]).max()
        wing = np.abs([marks["ala_l"][0], marks["ala_r"][0]]).max()
        across = np.abs(x)[:, None]
        within = smoothstep((wing + 1.0 - across) / 2.0)  # behind the wings of the nose it is skin, too
        near = upper * within + (1.0 - upper) * smoothstep((corner + 4.0 - across) / 4.0)
        near = near * smoothstep((y - marks["lower_lip_mid"][1] + 4.0) / 4.0)[None, :]
        closed = [_closed(front, WIDE[what]) for what in ("nose", "mouth")]
        self._cover = front + near * (upper * closed[0] + (1.0 - upper) * closed[1] - front)
        self._within = 1.0 - upper * (1.0 - within)
        self._lowest = 0.5 * (marks["lower_lip_mid"][1] + marks["menton"][1])

    def _above(self, y: Array) -> Array:
        """How much (0 to 1) heights are those of the nose: there nostrils are what is hollow, below it the lips."""
        return smoothstep((y - self._border) / 4.0 + 0.5)

    def at_nostrils(self, points: Array) -> Array:
        """How much (0 to 1) points (n, 3) are where nostrils may be: over the lips, not in the grooves of the wings."""
        y = self.frame.local_mm(points)[:, 1]
        below, behind = smoothstep((self._base + GROOVES - y) / 4.0), smoothstep((self.depth(points) - 0.3) / 0.5)
        high = smoothstep((self._base + 1.7 * GROOVES - y) / 4.0)
        return self._above(y) * np.maximum(below, behind * high)

    def _behind(self, points: Array) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
        """How far points are behind what is seen, how much of that may be a cavity, and which are where those are."""
        where = self.frame.local_mm(points)
        at = (where[:, :2] - self._low) / STEP
        inside = ((at >= 0.0) & (at <= np.array(self._cover.shape) - 1.0)).all(axis=1)
        cover, within = (
            ndimage.map_coordinates(grid, at.T, order=1, mode="nearest") for grid in (self._cover, self._within)
        )
        behind = cover - where[:, 2]
        return behind, within, inside & (where[:, 1] > self._lowest) & (behind < BACK)

    def depth(self, points: Array) -> Array:
        """How far (n,) points lie inside, from the skin that is seen from the front; 0 outside."""
        behind, within, near = self._behind(points)
        return np.asarray(np.where(near, np.maximum(behind * within, 0.0), 0.0))

    def outer(self, points: Array) -> npt.NDArray[np.bool_]:
        """Which points (n,) are on the skin that is seen from the front, where mouth and nostrils may be."""
        behind, _, near = self._behind(points)
        return np.asarray(near & (behind < INSIDE))


class Lining:
    """The lining of mouth and nostrils: all of the skin that is behind lips and rims.

    Parameters
    ----------
    cavities : Cavities
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    landmarks : mapping of str to ndarray, shape (3,)

    Attributes
    ----------
    vertices : ndarray of bool, shape (n,)
        Those that belong to the lining.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> lining = fw.default_face().lining
    >>> bool(lining.holds(fw.default_face().landmarks["nose_tip"][None])[0])
    False
    """

    def __init__(
        self, cavities: Cavities, points: Array, triangles: npt.NDArray[np.int32], landmarks: Mapping[str, Array]
    ) -> None:
        depth, forward = cavities.depth(points), vertex_normals(points, triangles) @ cavities.frame.axes[2]
        free = ~cavities.outer(points) | (forward < BACKWARD)
        edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        edges = edges[free[edges].all(axis=1)]
        n = len(points)
        graph = coo_array((np.ones(len(edges)), tuple(edges.T)), shape=(n, n))
        label = connected_components(graph, directed=False)[1]
        # Of the face itself, or where it is reached by another way, only what is seen to be inside counts.
        self._tree = cKDTree(points)
        tops = self._tree.query([landmarks[name] for name in ("glabella", "zygion_l", "zygion_r")])[1]
        inner = np.isin(label, np.setdiff1d(label[depth >= INSIDE], label[tops]))
        self.vertices = np.asarray(free & inner | (depth >= INSIDE))
        self._cavities = cavities

    def holds(self, points: Array) -> npt.NDArray[np.bool_]:
        """Tell which points (n,) of the face at rest belong to the lining, as the vertices nearest to them do."""
        away, nearest = self._tree.query(points)
        return np.asarray(self.vertices[nearest] & ((away == 0.0) | ~self._cavities.outer(points)))


def _closed(front: Array, wide: float) -> Array:
    radius = round(0.5 * wide / STEP)
    i = np.arange(-radius, radius + 1)
    disc = i[:, None] ** 2 + i[None, :] ** 2 <= radius**2
    return np.asarray(ndimage.grey_closing(front, footprint=disc, mode="nearest"))


def _front(corners: Array, low: Array, shape: npt.NDArray[np.int64]) -> Array:
    """The foremost place of triangles (m, 3, 3) over each node of a grid; where there is none, that of the nearest."""
    high = low + STEP * (shape - 1)
    flat = corners[:, :, :2]
    seen = ((flat.max(axis=1) >= low) & (flat.min(axis=1) <= high)).all(axis=1)
    corners = corners[seen & (corners[:, :, 2].max(axis=1) > -40.0)]
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.ceil(1.5 * edge / STEP).astype(int)
    found = [np.empty((0, 3))]
    for k in np.unique(parts):
        i, j = np.divmod(np.arange((k + 1) ** 2), k + 1)
        i, j = i[i + j <= k], j[i + j <= k]
        weights = np.stack([i, j, k - i - j], axis=1) / max(k, 1)
        found.append((weights @ corners[parts == k]).reshape(-1, 3))
    samples = np.concatenate(found)
    node = np.rint((samples[:, :2] - low) / STEP).astype(int)
    kept = ((node >= 0) & (node < shape)).all(axis=1)
    front = sampled_depth_buffer(node[kept], samples[kept, 2], shape)
    empty = ~np.isfinite(front)
    if empty.all():
        return np.zeros(shape)
    nearest = ndimage.distance_transform_edt(empty, return_distances=False, return_indices=True)
    return np.asarray(front[tuple(nearest)])
