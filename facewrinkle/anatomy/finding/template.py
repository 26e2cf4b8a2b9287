"""Faces seen from the front as depth maps, and the built-in head as their template.

The template has variants, with the mouth closed, open or drawn aside; poses place it on a mesh.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import cKDTree

from ...array_types import Array, BoolArray, IntArray
from ...geometry import closest_rotations
from ...geometry.depth_buffer import depth_buffer
from ...geometry.topology import unique_edges
from ..atlas import load_atlas
from ..identity import Identity, head_of
from ..landmarks import NAMES, FaceFrame, frame_of
from ..muscles import JawMuscle
from ..skull import jaw_weights

# --- depth maps -------------------------------------------------------------------------------------------------------

NEAREST, FARTHEST = 1.1, -1.5
"""Range of depth of a face, in distances between the pupils; the tip of the nose is at 0.6."""


@dataclass(frozen=True)
class Grid:
    """A grid over the face, in distances between the pupils from the middle between the eyes."""

    step: float
    low: tuple[float, float] = (-1.32, -2.52)
    high: tuple[float, float] = (1.32, 1.11)

    @property
    def x(self) -> Array:
        return np.arange(self.low[0], self.high[0] + 1e-9, self.step)

    @property
    def y(self) -> Array:
        return np.arange(self.low[1], self.high[1] + 1e-9, self.step)

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.y), len(self.x)

    def index(self, xy: Array) -> Array:
        """Fractional row and column (2, n) of points (n, 2)."""
        return np.stack([(xy[:, 1] - self.low[1]) / self.step, (xy[:, 0] - self.low[0]) / self.step])


def depth_map(local: Array, triangles: IntArray, grid: Grid) -> Array:
    """Depth of the foremost surface over the grid, NaN where there is none."""
    depth = depth_buffer(local, triangles, grid.low, grid.step, grid.shape, (FARTHEST, NEAREST))
    depth[np.isinf(depth)] = np.nan
    return depth


def openings_closed(
    depth: Array, grid: Grid, mouth_open: bool = False, model: Array | None = None
) -> tuple[Array, BoolArray]:
    """Return the map with its openings closed, and True where the surface is known.

    Narrow openings, such as that between the lips, become furrows; wider and deeper ones, such as open eyes, count as
    unknown. An open mouth is kept as a hollow if `mouth_open`. Where the surface is not known, the map goes on
    smoothly, along the depth of a `model` if there is one: a rim must not look like curvature of the face.
    """
    deep = np.where(np.isnan(depth), FARTHEST, depth)
    below = grid.y < -0.8  # the nostrils
    if mouth_open:  # hollows up to 0.9 wide become 0.25 deep
        deep[below] = np.maximum(deep, _gray_closing(deep, 0.9, grid) - 0.25)[below]
    level = np.maximum(deep, _gray_closing(deep, 0.11, grid) - 0.06)
    known = (_gray_closing(level, 0.27, grid) - level < 0.12) & (level > FARTHEST)
    if mouth_open:
        known[below] = level[below] > FARTHEST
    base = np.zeros_like(level) if model is None else model
    return base + _continued(np.where(known, level - base, 0.0), known), known


def _gray_closing(depth: Array, size: float, grid: Grid) -> Array:
    width = 2 * max(int(size / grid.step / 2), 1) + 1
    return np.asarray(ndimage.grey_closing(depth, size=(width, width), mode="constant", cval=FARTHEST))


def _continued(values: Array, known: BoolArray) -> Array:
    """The values, with the unknown ones filled in from the smallest neighborhood that has enough known ones."""
    weight, out = known.astype(float), np.where(known, values, np.nan)
    if not known.any():
        return np.zeros_like(values)
    for sigma in (1.0, 2.0, 4.0, 8.0, 16.0, 32.0):
        share = ndimage.gaussian_filter(weight, sigma)
        mean = ndimage.gaussian_filter(values * weight, sigma) / np.maximum(share, 1e-12)
        out = np.where(np.isnan(out) & (share > 0.2), mean, out)
        if not np.isnan(out).any():
            return out
    return np.where(np.isnan(out), values[known].mean(), out)


def curvature(depth: Array, grid: Grid, scales: tuple[float, ...]) -> Array:
    """Curvature (c, rows, columns) at the given scales: the Laplacian of Gaussian, dimensionless.

    Bulges are positive, hollows negative.
    """
    return np.array([-((s / grid.step) ** 2) * ndimage.gaussian_laplace(depth, s / grid.step) / s for s in scales])


def peak(depth: Array, grid: Grid, start: Array) -> Array:
    """Return the peak (2,) of the bulge at a place: that of a paraboloid through its surroundings.

    Return the place itself where there is no bulge, or none with a peak nearby.
    """
    x, y = np.meshgrid(grid.x, grid.y)
    place = np.asarray(start, dtype=np.float64)
    radius = 0.12  # of the surroundings to which the paraboloid is fitted; a peak farther off is another bulge's
    for _ in range(3):
        u, v = x - place[0], y - place[1]
        weight = np.exp(-1.5 * (u * u + v * v) / radius**2)
        near = weight > 0.05
        u, v, root = u[near], v[near], np.sqrt(weight[near])
        terms = np.stack([np.ones_like(u), u, v, 0.5 * u * u, u * v, 0.5 * v * v], axis=1)
        _, a, b, p, q, r = np.linalg.lstsq(terms * root[:, None], depth[near] * root, rcond=None)[0]
        if not (p < 0.0 and p * r > q * q):
            return start
        step = -np.linalg.solve([[p, q], [q, r]], [a, b])
        place = place + step * min(1.0, 0.08 / max(float(np.linalg.norm(step)), 1e-12))
    return place if np.linalg.norm(place - start) < radius else start


# --- the template -----------------------------------------------------------------------------------------------------

UNMEASURED = (
    "trichion",
    "forehead_mid",
    *(f"brow_{side}_{part}" for side in "lr" for part in ("inner", "mid", "outer")),
    *(f"{name}_{side}" for name in ("malar", "zygion", "gonion") for side in "lr"),
    "eye_l_centre",
    "eye_r_centre",
    "menton",
)
"""Landmarks that the shape does not show, or not from the front: estimates. But the menton is measured on a chin that
is seen to turn under.
"""


@dataclass(frozen=True)
class TemplateVariant:
    """One of the shapes that the template takes.

    Attributes
    ----------
    identity : Identity
    jaw : float
        Contraction of the muscle that opens the jaw; 1 opens it fully.
    mouth_shift : float
        Shift of the mouth to the left, in distances between the pupils.
    """

    identity: Identity = field(default_factory=Identity)
    jaw: float = 0.0
    mouth_shift: float = 0.0


AT_REST = (
    TemplateVariant(),
    TemplateVariant(Identity(length=0.6)),
    TemplateVariant(Identity(width=0.75, cheeks=0.6, nose_width=0.65)),
    TemplateVariant(Identity(width=-0.75, cheeks=-0.6, nose_width=-0.5)),
    TemplateVariant(Identity(age=1.0, lips=-0.7)),
)
"""The mean face, a long, a broad, a narrow and an old one: their mean landmarks depend less on the shape of any one."""

VARIANTS = (
    *AT_REST,
    TemplateVariant(jaw=0.5),
    TemplateVariant(jaw=1.2),
    TemplateVariant(mouth_shift=0.22),
    TemplateVariant(mouth_shift=-0.22),
)
"""All variants, the mean face first; the last four have mouths where a warp from a closed one would not find them."""


@dataclass(frozen=True, eq=False)
class Template:
    """A face in distances between its pupils, from the middle between its eyes, +x to the subject's left, +z forward.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    landmarks : dict of str to ndarray, shape (3,)
    mouth_open : bool
    """

    points: Array
    triangles: IntArray
    landmarks: dict[str, Array]
    mouth_open: bool = False

    def depth(self, grid: Grid) -> tuple[Array, Array]:
        """Depth over a grid with the openings closed, and the weight of every place, 0 outside of the face."""
        depth, known = openings_closed(depth_map(self.points, self.triangles, grid), grid, self.mouth_open)
        # 1 inside an oval from below the hairline to the chin, falling to 0 at its border.
        top, bottom = self.landmarks["forehead_mid"][1] + 0.12, self.landmarks["menton"][1] - 0.22
        side = 0.93 * self.landmarks["zygion_l"][0]
        x, y = np.meshgrid(grid.x, grid.y)
        radius = np.hypot(x / side, (y - 0.5 * (top + bottom)) / (0.5 * (top - bottom)))
        return depth, np.clip((1.0 - radius) / 0.12, 0.0, 1.0) * known


@cache
def template(variant: int = 0) -> Template:
    """Return the built-in head as one of :data:`VARIANTS`, the mean face by default."""
    chosen = VARIANTS[variant]
    head = head_of(chosen.identity)
    marks = {name: head.landmarks[name] for name in NAMES}
    frame = frame_of(marks)
    rest = np.asarray(head.points, dtype=np.float64)
    points = _deformed(rest, head.triangles, marks, frame, chosen)
    nearest = cKDTree(rest).query(np.array(list(marks.values())))[1]
    shift = dict(zip(marks, (points - rest)[nearest], strict=True))
    return Template(
        frame.local(points),
        np.asarray(head.triangles, dtype=np.int64),
        {name: frame.local(point + shift[name]) for name, point in marks.items()},
        chosen.jaw > 0.0,
    )


def _deformed(
    points: Array, triangles: npt.NDArray[np.int32], marks: dict[str, Array], frame: FaceFrame, variant: TemplateVariant
) -> Array:
    """The points of a head with its jaw open, or its mouth drawn aside."""
    moved = points.copy()
    if variant.jaw:
        jaw = load_atlas().place(marks, frame)["jaw"]
        assert isinstance(jaw, JawMuscle)
        weights = jaw_weights(jaw, points, unique_edges(triangles)[0], marks, frame)
        moved[weights.vertices] += weights.turned(points, variant.jaw)
    if variant.mouth_shift:
        offset = (points - 0.5 * (marks["mouth_l"] + marks["mouth_r"])) / frame.pupil_distance
        share = np.exp(-(offset**2).sum(axis=1) / 0.5**2)  # cheeks and chin go along
        moved += variant.mouth_shift * frame.pupil_distance * share[:, None] * frame.axes[0]
    return moved


@dataclass(frozen=True, eq=False)
class Pose:
    """Place, direction and size of a face: local = (point - origin) @ axes.T / (size * stretch).

    Local coordinates are in distances between the pupils.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
        Rows are the subject's left, up and forward.
    origin : ndarray, shape (3,)
        The middle between the eyes.
    size : float
        Distance between the pupils.
    stretch : ndarray, shape (3,)
        Size of the face along the axes over that of the template, apart from `size`.

    Examples
    --------
    A face 60 mm from pupil to pupil, and a place half of this below and in front of its eyes:

    >>> pose = Pose(np.eye(3), origin=np.array([0.0, 100, 0]), size=60.0, stretch=np.ones(3))
    >>> pose.world(np.array([[0.0, -0.5, 0.5]]))
    array([[ 0., 70., 30.]])
    >>> pose.local(np.array([[0.0, 70, 30]]))
    array([[ 0. , -0.5,  0.5]])
    """

    axes: Array
    origin: Array
    size: float
    stretch: Array

    def local(self, points: Array) -> Array:
        """Return points (n, 3), or one (3,), in the template's coordinates."""
        axes = self.axes / (self.size * self.stretch)[:, None]
        return np.asarray((points - self.origin) @ axes.T)

    def world(self, local: Array) -> Array:
        """Return points (n, 3), given in the template's coordinates, in those of the mesh."""
        return local * (self.size * self.stretch) @ self.axes + self.origin


def pose_from_landmarks(landmarks: Mapping[str, Array]) -> Pose | None:
    """Return the pose in which the template's landmarks are closest to given ones.

    None if fewer than three are given that can be measured, if they lie on a line, or if they do not fit a face.

    Examples
    --------
    >>> marks = template().landmarks
    >>> pose = pose_from_landmarks({name: 7.0 * marks[name] + 1.0 for name in ("nasion", "mouth_l", "mouth_r")})
    >>> round(pose.size, 6), np.allclose(pose.origin, 1.0)
    (7.0, True)
    """
    names = [name for name in NAMES if name in landmarks and name not in UNMEASURED]
    if len(names) < 3:
        return None
    model, face = (np.array([source[name] for name in names]) for source in (template().landmarks, landmarks))
    from_, to = model - model.mean(axis=0), face - face.mean(axis=0)
    if np.linalg.svd(from_, compute_uv=False)[1] < 0.2:  # on a line, about which the turn stays unknown
        return None
    axes = closest_rotations(from_.T @ to)
    size = float((from_ @ axes * to).sum() / (from_**2).sum())
    # Where one lies far from its place on the template, they are swapped, or not of a face.
    if size <= 0.0 or np.linalg.norm(to / size - from_ @ axes, axis=1).max() > 0.45:
        return None
    return Pose(axes, face.mean(axis=0) - size * model.mean(axis=0) @ axes, size, np.ones(3))
