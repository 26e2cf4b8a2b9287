"""The mandible: a bone that turns about its hinge, and the skin that goes with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from ..array_types import Array, BoolArray
from ..geometry.laplacian import graph_laplacian
from ..geometry.topology import unique_edges
from .landmarks import FaceFrame, mouth_middle
from .muscles import JawMuscle, JointWeights

# Lengths are in distances between the pupils; heights are above the plane through hinge and mouth.

FIXED_ABOVE = 0.16
"""Skin higher than this stays with the skull."""

TURNING_BELOW = 0.24
"""Skin lower than this goes with the mandible."""

LIPS_WIDTH, LIPS_LEAST = 0.4, 0.2
"""Near the middle of the mouth both bounds shrink: to the second share there, which grows by 1 over the first distance.
"""

NECK = 0.55
"""Skin farther than this below the lower border of the mandible stays; in between, the neck follows less and less."""

AROUND_MOUTH = 1.2
"""The lips, and the skin beyond both bounds above and below them, lie within this distance from the mouth."""

WHOLLY = 0.98
"""Skin that takes this share of the mandible's turn goes wholly with it."""


def jaw_weights(
    jaw: JawMuscle, points: Array, triangles: npt.NDArray[np.int32], landmarks: Mapping[str, Array], frame: FaceFrame
) -> JointWeights:
    """Turn of each vertex with the mandible.

    Chin and jaw go with the bone, the face above the lips stays. In between, the share of the turn is harmonic on the
    surface: it is soft in the cheeks, and jumps where the mouth is open.

    Examples
    --------
    The share of the mandible's turn that chin, corner of the mouth and nose take:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> jaw, share = face.muscles["jaw"], np.zeros(len(face.points))
    >>> weights = jaw_weights(jaw, face.points, face.triangles, face.landmarks, face.frame)
    >>> share[weights.vertices] = weights.angles / jaw.angle
    >>> for name in ("menton", "mouth_l", "nose_tip"):
    ...     print(share[face.mesh.find_closest_point(face.landmarks[name])].round(1))
    1.0
    0.5
    0.0
    """
    size, hinge, axis = frame.pupil_distance, jaw.hinge, jaw.axis
    mouth = mouth_middle(landmarks)
    border = landmarks["menton"] - 0.5 * (landmarks["gonion_l"] + landmarks["gonion_r"])
    # Heights above the plane through hinge and mouth, and below the one along the lower border of the mandible.
    up = _normal_of_plane(axis, mouth - hinge, frame.axes[1])
    over = (points - hinge) @ up / size
    under = (landmarks["menton"] - points) @ _normal_of_plane(axis, border, frame.axes[1]) / size
    aside = np.minimum(LIPS_LEAST + np.abs((points - mouth) @ frame.axes[0]) / (LIPS_WIDTH * size), 1.0)
    behind = (points - hinge) @ frame.axes[2] < 0.0
    near = (np.linalg.norm(points - mouth, axis=1) < AROUND_MOUTH * size) & ~behind
    upper, lower = _lips(points, triangles, near & (over > FIXED_ABOVE), near & (over < -TURNING_BELOW), near)
    fixed_up = ((over > FIXED_ABOVE * aside) & ~lower) | behind | (under > NECK)
    fixed_down = (over < -TURNING_BELOW * aside) & ~upper & (under < 0.0) & ~fixed_up
    share = _harmonic(points, triangles, fixed_up, fixed_down)
    vertices = np.flatnonzero(share > 1e-4)
    return JointWeights(vertices, jaw.angle * share[vertices], np.zeros(len(vertices)), hinge, axis, bone=True)


def _normal_of_plane(axis: Array, forward: Array, up: Array) -> Array:
    """Unit normal, on the side of `up`, of the plane through `axis` and `forward`."""
    normal = np.cross(axis, forward)
    normal /= np.linalg.norm(normal)
    return np.asarray(normal * np.sign(normal @ up))


def _lips(
    points: Array, triangles: npt.NDArray[np.int32], above: BoolArray, below: BoolArray, near: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Return what is the upper and what is the lower lip (n,): the `near` skin that is nearer, along the surface, to
    skin far above the mouth, or to skin far below it. A lip may hang over the other.
    """
    some = np.flatnonzero(near)
    upper, lower = np.zeros((2, len(points)), bool)
    if above.any() and below.any():
        edges, _ = unique_edges(triangles)
        edges = edges[near[edges].all(axis=1)]
        length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1) + 1e-12
        graph = csr_array((length, tuple(np.searchsorted(some, edges).T)), shape=(len(some), len(some)))
        up, down = (
            dijkstra(graph, directed=False, indices=np.flatnonzero(seeds[some]), min_only=True)
            for seeds in (above, below)
        )
        upper[some], lower[some] = up < down, down < up
    return upper, lower


def _harmonic(points: Array, triangles: npt.NDArray[np.int32], zero: BoolArray, one: BoolArray) -> Array:
    """The harmonic function (n,) with given vertices at 0 and at 1; edges weigh by their inverse length."""
    n = len(points)
    edges, _ = unique_edges(triangles)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    laplacian = graph_laplacian(edges, 1.0 / np.maximum(length, 1e-12), n)
    values = one.astype(np.float64)
    free = ~(zero | one)
    if free.any():
        right = -(laplacian[free] @ values)
        values[free] = spsolve(laplacian[free][:, free].tocsc(), right)
    return np.clip(values, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Mandible:
    """The bone of the lower jaw. Where nobody knows its turn, it is measured on the skin that goes wholly with it.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
        Vertices of this skin.
    offsets : ndarray, shape (k, 3)
        Offsets of these vertices from the hinge, at rest.
    hinge, axis : ndarray, shape (3,)

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> face.mandible.rotation(face.points).round(9) + 0.0
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """

    vertices: npt.NDArray[np.int64]
    offsets: Array
    hinge: Array
    axis: Array

    @classmethod
    def of(cls, jaw: JawMuscle, weights: JointWeights, points: Array) -> Mandible | None:
        """Return the mandible of a face at rest; None if no skin goes wholly with it."""
        vertices = weights.vertices[weights.angles > WHOLLY * jaw.angle]
        return cls(vertices, points[vertices] - jaw.hinge, jaw.hinge, jaw.axis) if len(vertices) else None

    def rotation(self, points: Array, angle: float | None = None) -> Array:
        """Rotation (3, 3) about the hinge by an angle, or else that which the skin (n, 3) shows, for a head that has
        not moved.
        """
        if angle is None:
            now = points[self.vertices] - self.hinge
            flat, turned = (offset - np.outer(offset @ self.axis, self.axis) for offset in (self.offsets, now))
            angle = float(np.arctan2((np.cross(flat, turned) @ self.axis).sum(), (flat * turned).sum()))
        return np.asarray(Rotation.from_rotvec(angle * self.axis).as_matrix())
