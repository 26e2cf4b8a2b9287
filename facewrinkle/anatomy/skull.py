"""The bones under the skin: the skull, the soft tissue over it, and the mandible, which turns about its hinge."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from ..array_types import Array, BoolArray, IntArray
from ..geometry.laplacian import graph_laplacian, symmetric_factors
from ..geometry.normals import unit, vertex_normals
from ..geometry.topology import unique_edges
from .landmarks import FaceFrame, mouth_middle
from .muscles import JawMuscle, JointWeights

# Lengths are in distances between the pupils.


@dataclass(frozen=True, eq=False)
class Tissue:
    """Soft tissue between skin and bone, per vertex of the skin.

    Attributes
    ----------
    depth : ndarray, shape (n,)
        Thickness, in the unit of the mesh.
    stiffness : ndarray, shape (n,)
        Of the tethers to the bone, relative to that of the forehead.
    normals : ndarray, shape (n, 3)
        Unit normals of the skin, smoothed over about the thickness: the direction of the tethers.
    anchors : ndarray, shape (n, 3)
        Ends of the tethers on the bone: the vertices of the skull.
    across : ndarray, shape (n,)
        Stiffness of the tethers across the skin, relative to the forehead's.
    bulge : ndarray, shape (n,)
        Height that tissue gains where the skin over it loses area, relative to its thickness times the share that is
        lost: half for tissue that keeps its volume and whose base on the bone stays, more for fat that is squeezed out
        of its compartment, less for flesh that is bound to what is beneath it.

    Examples
    --------
    Tissue is thin on the forehead and thick in the cheeks; millimeters:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> for name in ("forehead_mid", "malar_l", "mouth_l"):
    ...     print(round(float(face.tissue.depth[face.mesh.find_closest_point(face.landmarks[name])])))
    5
    10
    12
    """

    depth: Array
    stiffness: Array
    normals: Array
    anchors: Array
    across: Array
    bulge: Array


def tissue_of(
    points: Array,
    triangles: npt.NDArray[np.int32],
    loops: Sequence[IntArray],
    samples: tuple[Array, Array],
    size: float,
) -> Tissue:
    """Return the soft tissue, from samples of its depth and mechanics at landmarks.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    loops : sequence of ndarray of int
        Vertices around each hole of the mesh.
    samples : tuple of ndarray
        Positions (k, 3), and what holds there (k, 4): depth in the unit of the mesh, relative stiffness along and
        across the skin, and bulge.
    size : float
        Distance between the pupils, in the unit of the mesh.

    Notes
    -----
    Samples are spread with inverse distance weights (Shepard), stiffness by its logarithm. The skull is the skin
    moved inwards by the depth along the smoothed normals, and smoothed (implicitly, so any mesh resolution will do).

    Examples
    --------
    A sheet 40 mm wide, with samples of 4 mm at its left border and 12 mm at its right:

    >>> import pyvista as pv
    >>> from facewrinkle.geometry.topology import boundary_loops
    >>> sheet = pv.Plane(i_size=40.0, j_size=40.0, i_resolution=4)
    >>> samples = np.array([[-20.0, 0, 0], [20, 0, 0]]), np.array([[4.0, 1, 1, 0.5], [12, 0.5, 1, 0.5]])
    >>> triangles = sheet.triangulate().regular_faces
    >>> tissue = tissue_of(sheet.points.astype(float), triangles, boundary_loops(triangles), samples, size=63.0)
    >>> tissue.depth[:5].round(1)
    array([ 4.7,  5.5,  8. , 10.5, 11.3])
    """
    where, values = samples
    square = cdist(points, where, "sqeuclidean") / size**2 + 0.03**2  # no more than finite at a sample
    weights = 1.0 / (square * np.sqrt(square))
    weights /= weights.sum(axis=1, keepdims=True)
    depth, bulge = weights @ values[:, 0], weights @ values[:, 3]
    stiffness, across = np.exp(weights @ np.log(values[:, 1:3])).T
    if loops:  # at the outer border of an open mesh tethers are 12 times stiffer, as the skin beyond would hold it
        longest = max(loops, key=lambda loop: np.linalg.norm(points[loop] - points[np.roll(loop, 1)], axis=1).sum())
        away = cKDTree(points[longest]).query(points, distance_upper_bound=size)[0]  # beyond it makes no difference
        stiffness = stiffness * (1.0 + 12.0 * np.exp(-((away / (0.15 * size)) ** 2)))
    smooth = _smoother(points, triangles, 0.12 * size)  # the skull does not follow lips, nostrils and lids
    normals = unit(smooth(vertex_normals(points, triangles)))
    anchors = smooth(points - depth[:, None] * normals)
    above = ((points - anchors) * normals).sum(axis=1)
    # Smoothing cuts corners where a face is concave: a third of the tissue is left over the bone.
    anchors -= np.maximum(1.0 / 3.0 * depth - above, 0.0)[:, None] * normals
    return Tissue(depth, stiffness, normals, anchors, across, bulge)


def _smoother(points: Array, triangles: npt.NDArray[np.int32], radius: float):  # type: ignore[no-untyped-def]
    """Implicit Laplacian smoothing over about `radius`: (I + r^2 L)^-1, with weights by edge length."""
    edges, sides = unique_edges(triangles)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    weight = np.bincount(sides.ravel()) / np.maximum(length, 1e-12 * radius) ** 2  # edges count once per triangle
    degree = np.bincount(edges.ravel(), minlength=len(points))
    # Both sides times the degrees: so the matrix is symmetric, and its factors stay small if they are well ordered.
    mass = np.maximum(degree, 1).astype(float)
    system = diags_array(mass) + radius**2 * graph_laplacian(edges, weight, len(points))
    factor = symmetric_factors(system.tocsc())

    def smooth(values: Array) -> Array:
        return np.asarray(factor.solve(mass[:, None] * values))

    return smooth


# --- the mandible: a bone that turns about its hinge, and the skin that goes with it ----------------------------------


def jaw_weights(
    jaw: JawMuscle, points: Array, edges: npt.NDArray[np.int32], landmarks: Mapping[str, Array], frame: FaceFrame
) -> JointWeights:
    """Turn of each vertex of a mesh, given by its edges (e, 2), with the mandible.

    Chin and jaw go with the bone, the face above the lips stays. In between, the share of the turn is harmonic on the
    surface: it is soft in the cheeks, and jumps where the mouth is open.

    Examples
    --------
    The share of the mandible's turn that chin, corner of the mouth and nose take:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> jaw, share = face.muscles["jaw"], np.zeros(len(face.points))
    >>> weights = jaw_weights(jaw, face.points, face.edges, face.landmarks, face.frame)
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
    # Skin above the first of these bounds stays with the skull, skin below the second goes with the mandible, in
    # distances between the pupils. Near the middle of the mouth both shrink to a fifth.
    fixed, turning = 0.16, -0.24
    aside = np.minimum(0.2 + np.abs((points - mouth) @ frame.axes[0]) / (0.4 * size), 1.0)
    behind = (points - hinge) @ frame.axes[2] < 0.0
    # The lips, and the skin beyond both bounds above and below them, lie within this distance from the mouth.
    near = (np.linalg.norm(points - mouth, axis=1) < 1.2 * size) & ~behind
    upper, lower = _lips(points, edges, near & (over > fixed), near & (over < turning), near)
    # Far below the lower border of the mandible skin stays; in between, the neck follows less and less.
    fixed_up = ((over > fixed * aside) & ~lower) | behind | (under > 0.55)
    fixed_down = (over < turning * aside) & ~upper & (under < 0.0) & ~fixed_up
    share = _harmonic(points, edges, fixed_up, fixed_down)
    vertices = np.flatnonzero(share > 1e-4)
    return JointWeights(vertices, jaw.angle * share[vertices], np.zeros(len(vertices)), hinge, axis, bone=True)


def _normal_of_plane(axis: Array, forward: Array, up: Array) -> Array:
    """Unit normal, on the side of `up`, of the plane through `axis` and `forward`."""
    normal = unit(np.cross(axis, forward))
    return np.asarray(normal * np.sign(normal @ up))


def _lips(
    points: Array, edges: npt.NDArray[np.int32], above: BoolArray, below: BoolArray, near: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Return what is the upper and what is the lower lip (n,): the `near` skin that is nearer, along the surface, to
    skin far above the mouth, or to skin far below it. A lip may hang over the other.
    """
    some = np.flatnonzero(near)
    upper, lower = np.zeros((2, len(points)), bool)
    if above.any() and below.any():
        edges = edges[near[edges].all(axis=1)]
        length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1) + 1e-12
        graph = csr_array((length, tuple(np.searchsorted(some, edges).T)), shape=(len(some), len(some)))
        up, down = (
            dijkstra(graph, directed=False, indices=np.flatnonzero(seeds[some]), min_only=True)
            for seeds in (above, below)
        )
        upper[some], lower[some] = up < down, down < up
    return upper, lower


def _harmonic(points: Array, edges: npt.NDArray[np.int32], zero: BoolArray, one: BoolArray) -> Array:
    """The harmonic function (n,) with given vertices at 0 and at 1; edges weigh by their inverse length."""
    values, free = one.astype(np.float64), ~(zero | one)
    edges = edges[free[edges].any(axis=1)]
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    rows = graph_laplacian(edges, 1.0 / np.maximum(length, 1e-12), len(points))[free]
    if free.any():
        values[free] = symmetric_factors(rows[:, free].tocsc()).solve(-(rows @ values))
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
        vertices = weights.vertices[weights.angles > 0.98 * jaw.angle]
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
