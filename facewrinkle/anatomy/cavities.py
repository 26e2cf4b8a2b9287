"""The mouth and the nostrils: depth of the skin behind the front of a face.

Lengths are mm on a face whose pupils are 63 mm apart. Heights are along the face's vertical.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import cKDTree

from ..array_types import Array, BoolArray
from ..geometry import connected, sampled_depth_buffer, side_lengths, smoothstep, vertex_normals
from .landmarks import FaceFrame

# --- The depth map of the face from the front ---------------------------------------------------------------

STEP = 0.5
"""Spacing of the map's grid."""

BACK_OF_MAP, BACK_OF_MOUTH = 40.0, 130.0
"""Skin farther behind the eyes than the first is not in the map; points farther behind the map than the second are on
the other side of the head.
"""

# --- Narrow hollows of the map are cavities -----------------------------------------------------------------

BLEND = 4.0
"""Height or width over which the region of nostrils, that of the mouth and the skin around blend into each other; half
as much beside the nose.
"""


# --- Skin in a cavity ---------------------------------------------------------------------------------------

INSIDE_DEPTH = 3.0
"""Skin that lies deeper than this behind lips or the rims of nostrils is inside."""


IN_MOUTH = 14.0
"""Skin that lies deeper than this behind the lips lines a mouth: the furrow between closed lips is half as deep."""


class Cavities:
    """Mouth and nostrils of a face at rest, as they are seen from the front.

    A gray-scale closing of the depth map fills all narrow hollows; what lies deeper than the closed map is inside them.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    landmarks : mapping of str to ndarray, shape (3,)
    frame : FaceFrame

    Examples
    --------
    >>> import facewrinkle as fw
    >>> from facewrinkle.anatomy.landmarks import lips_middle
    >>> face = fw.default_face()
    >>> cavities = Cavities(face.points, face.triangles, face.landmarks, face.frame)
    >>> inside = lips_middle(face.landmarks) - [0, 0, 20]
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
        nose, lower_lip = marks["subnasale"][1], marks["lower_lip_mid"][1]
        # The map reaches 34 mm to either side, 16 mm above the base of the nose and 30 mm below the lower lip.
        self._low = np.array([-34.0, lower_lip - 30.0])
        shape = np.ceil((np.array([34.0, nose + 16.0]) - self._low) / STEP).astype(int) + 1
        front = _front(frame.local_mm(points)[triangles], self._low, shape)
        x, y = (low + STEP * np.arange(n) for low, n in zip(self._low, shape, strict=True))
        self._nose, self._lowest = nose, 0.5 * (lower_lip + marks["menton"][1])
        self._border = 0.5 * (nose + marks["upper_lip_mid"][1])
        upper, across = self._above(y)[None, :], np.abs(x)[:, None]
        corner = np.abs([marks["mouth_l"][0], marks["mouth_r"][0]]).max()
        wing = np.abs([marks["ala_l"][0], marks["ala_r"][0]]).max()
        # Cavities reach 1 mm beside the wings of the nose, beyond which skin lies as deep, and 4 mm beside the mouth.
        self._reach = corner + 4.0
        within = smoothstep((wing + 1.0 - across) / (0.5 * BLEND))
        near = upper * within + (1.0 - upper) * smoothstep((self._reach - across) / BLEND)
        lip = max(0.5 * (marks["upper_lip_mid"][1] - lower_lip), 1.0)
        # In the lower half of the lower lip the mouth fades out: the fold under a full lip is as narrow and deep.
        near = near * smoothstep((y - lower_lip) / (0.5 * lip))[None, :]
        nostrils, mouth = _closed(front, 9.0), _closed(front, 13.0)  # hollows narrower than these, mm
        self._cover = front + near * (upper * nostrils + (1.0 - upper) * mouth - front)
        self._within = 1.0 - upper * (1.0 - within)

    def _above(self, y: Array) -> Array:
        """Weight (0 to 1) of heights at the nose: there hollows are nostrils, below it they are the mouth."""
        return smoothstep((y - self._border) / BLEND + 0.5)

    def at_nostrils(self, points: Array) -> Array:
        """Weight (0 to 1) of points (n, 3) where nostrils may be: above the lips, anywhere up to 7.5 mm above the base
        of the nose, and up to 12.75 mm only where the skin is hollow from the front.

        The grooves behind the wings of the nose are deep only as seen from below, and no nostrils.
        """
        y = self.frame.local_mm(points)[:, 1]
        below = smoothstep((self._nose + 7.5 - y) / BLEND)
        hollow = smoothstep((self.depth(points) - 0.3) / 0.5)
        high = smoothstep((self._nose + 12.75 - y) / BLEND)
        return self._above(y) * np.maximum(below, hollow * high)

    def _behind(self, points: Array) -> tuple[Array, Array, BoolArray]:
        """Depth (n,) of points behind the closed map, the share of it that counts, and True for points in the map."""
        where = self.frame.local_mm(points)
        at = (where[:, :2] - self._low) / STEP
        inside = ((at >= 0.0) & (at <= np.array(self._cover.shape) - 1.0)).all(axis=1)
        cover, within = (
            ndimage.map_coordinates(grid, at.T, order=1, mode="nearest") for grid in (self._cover, self._within)
        )
        behind = cover - where[:, 2]
        return behind, within, inside & (where[:, 1] > self._lowest) & (behind < BACK_OF_MOUTH)

    def depth(self, points: Array) -> Array:
        """Depth (n,) of points in a cavity, behind the skin that is seen from the front; 0 elsewhere."""
        behind, within, near = self._behind(points)
        return np.asarray(np.where(near, np.maximum(behind * within, 0.0), 0.0))

    def beside(self, points: Array) -> BoolArray:
        """True (n,) for points that are farther aside than cavities are seen: there only their lining goes on, and a
        jaw may hang over other skin.
        """
        return np.asarray(np.abs(self.frame.local_mm(points)[:, 0]) >= self._reach)

    def outer(self, points: Array) -> BoolArray:
        """True (n,) for points on the skin that is seen from the front, where mouth and nostrils may be."""
        behind, _, near = self._behind(points)
        return np.asarray(near & (behind < INSIDE_DEPTH))


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
        True for vertices of the lining.

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
        forward = vertex_normals(points, triangles) @ cavities.frame.axes[2]
        deep = (cavities.depth(points) >= INSIDE_DEPTH) & ~cavities.beside(points)
        free = ~cavities.outer(points) | (forward < -0.5)  # turned back, it is not seen, however thin the lips are
        edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        label = connected(edges[free[edges].all(axis=1)], len(points))
        # Skin that is also connected with forehead and cheeks belongs to the lining only where it lies deep.
        self._tree = cKDTree(points)
        face = self._tree.query([landmarks[name] for name in ("glabella", "zygion_l", "zygion_r")])[1]
        inner = np.isin(label, np.setdiff1d(label[deep], label[face]))
        self.vertices = np.asarray(free & inner | deep)
        self._cavities = cavities

    def of_vertices(self, points: Array, vertices: npt.NDArray[np.int64]) -> Lining:
        """Return the lining on some of the vertices (k,), which are at `points` (k, 3)."""
        lining = copy(self)
        lining.vertices, lining._tree = self.vertices[vertices], cKDTree(points)
        return lining

    def holds(self, points: Array) -> BoolArray:
        """True (n,) for points of the face at rest that belong to the lining, as the vertices nearest to them do."""
        away, nearest = self._tree.query(points)
        return np.asarray(self.vertices[nearest] & ((away == 0.0) | ~self._cavities.outer(points)))


def _closed(front: Array, width: float) -> Array:
    """The depth map with hollows narrower than a width filled."""
    radius = round(0.5 * width / STEP)
    i = np.arange(-radius, radius + 1)
    disc = i[:, None] ** 2 + i[None, :] ** 2 <= radius**2
    return np.asarray(ndimage.grey_closing(front, footprint=disc, mode="nearest"))


def _front(corners: Array, low: Array, shape: npt.NDArray[np.int64]) -> Array:
    """Forward coordinate of the foremost triangle (m, 3, 3) at each node of a grid; without one, the nearest node's."""
    high = low + STEP * (shape - 1)
    flat = corners[:, :, :2]
    seen = ((flat.max(axis=1) >= low) & (flat.min(axis=1) <= high)).all(axis=1)
    corners = corners[seen & (corners[:, :, 2].max(axis=1) > -BACK_OF_MAP)]
    edge = side_lengths(corners).max(axis=1)
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
    nearest = ndimage.distance_transform_edt(empty, return_distances=False, return_indices=True)
    return np.asarray(front[tuple(nearest)])
