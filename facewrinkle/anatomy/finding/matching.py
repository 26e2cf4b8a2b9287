"""Surfaces in a pose, compared with the template by their depth maps seen from the front.

The exact pose: the depth of a surface is aligned with the template's. A match: the warp that takes each place of the
template to its counterpart, and the confidence that the surface is a face.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial.transform import Rotation

from ...array_types import Array, IntArray
from .template import Grid, Pose, curvature, depth_map, openings_closed, template

# --- warps: smooth maps from the template's front view to a face's ----------------------------------------------------

SPACING = 0.24
"""Spacing of the control points, in distances between the pupils."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Products of cubic B-splines down a grid and across it, and the stiffness of their shifts (m, n, 2).

    Attributes
    ----------
    down, across : ndarray, shape (rows, m) and (columns, n)
        The splines.
    stiffness : ndarray, shape (2 m n, 2 m n)
        For shifts in the order in which they lie in memory.
    """

    down: Array
    across: Array
    stiffness: Array

    def solved(self, metric: Array, right: Array) -> Array:
        """Solve (metric + stiffness) shift = right for the shift (m, n, 2).

        The metric (2, 2, rows, columns) is symmetric: entries for x and x, x and y, y and x, y and y.
        """
        m, n, _ = right.shape
        across = np.einsum("cj,cl->cjl", self.across, self.across).reshape(-1, n * n)
        matrix = self.stiffness.copy().reshape(m, n, 2, m, n, 2)
        for apart in range(4):  # splines farther apart do not overlap
            i = np.arange(m - apart)
            products = (self.down[:, i + apart] * self.down[:, i]).T @ metric @ across
            matrix[i + apart, :, :, i] += products.reshape(2, 2, -1, n, n).transpose(2, 3, 0, 4, 1)
        lower = matrix.reshape(2 * m * n, 2 * m * n)
        diagonals = [np.append(np.diagonal(lower, -k), np.zeros(k)) for k in range(6 * n + 8)]
        return np.asarray(solveh_banded(diagonals, right.ravel(), lower=True)).reshape(right.shape)


def _splines(low: float, high: float, at: Array) -> Array:
    """Values (points, n) of the cubic B-splines on an interval."""
    n = int(np.ceil((high - low) / SPACING))
    n += 1 - n % 2  # a control point in the middle
    knots = 0.5 * (low + high) + SPACING * (np.arange(n + 4) - 0.5 * (n + 3))
    inside = np.clip(at, knots[3] + 1e-9, knots[-4] - 1e-9)
    return np.asarray(BSpline.design_matrix(inside, knots, 3).toarray())


@cache
def basis(grid: Grid) -> Basis:
    """Return the basis of the warps over a grid."""
    margin = 2.0 * SPACING
    across = _splines(grid.low[0] - margin, grid.high[0] + margin, grid.x)
    down = _splines(grid.low[1] - margin, grid.high[1] + margin, grid.y)
    return Basis(down, across, _stiffness(down.shape[1], across.shape[1]))


def _stiffness(m: int, n: int) -> Array:
    """Resistance of m times n control points to bending, and to differences of left and right."""
    one_x, one_y = sparse.identity(n), sparse.identity(m)
    second = [
        sparse.kron(one_y, np.diff(np.eye(n), 2, axis=0)),
        sparse.kron(np.diff(np.eye(m), 2, axis=0), one_x),
        np.sqrt(2.0) * sparse.kron(np.diff(np.eye(m), axis=0), np.diff(np.eye(n), axis=0)),
    ]
    bending = sum(d.T @ d for d in second)
    flip = sparse.kron(one_y, one_x.tocsr()[::-1])
    odd_x, odd_y = sparse.identity(m * n) + flip, sparse.identity(m * n) - flip
    asymmetry = sparse.kron(odd_x.T @ odd_x, np.diag([1.0, 0.0])) + sparse.kron(odd_y.T @ odd_y, np.diag([0.0, 1.0]))
    resistance = 0.02 * sparse.kron(bending, np.eye(2)) + 0.02 * asymmetry
    return np.asarray((resistance + 1e-4 * sparse.identity(2 * m * n)).toarray())


@dataclass(frozen=True, eq=False)
class Warp:
    """A warp, given by the shifts (m, n, 2) of its control points."""

    grid: Grid
    shift: Array

    def field(self) -> Array:
        """Shift (2, rows, columns) over the grid, x and y."""
        splines = basis(self.grid)
        return np.asarray(splines.down @ np.moveaxis(self.shift, 2, 0) @ splines.across.T)

    def __call__(self, xy: Array) -> Array:
        """Return the places (n, 2) on the face of places (n, 2) on the template."""
        at = self.grid.index(xy)
        return xy + np.stack([map_coordinates(f, at, order=1, mode="nearest") for f in self.field()], axis=1)


def resampled(image: Array, grid: Grid, field: Array) -> Array:
    """Return an image (rows, columns) at the shifted points of its grid."""
    rows, columns = np.meshgrid(np.arange(grid.shape[0]), np.arange(grid.shape[1]), indexing="ij")
    at = np.array([rows + field[1] / grid.step, columns + field[0] / grid.step])
    return np.asarray(map_coordinates(image, at, order=1, mode="nearest"))


def fitted_warp(
    faces: Array, shown: Array, template: Array, weight: Array, grid: Grid, start: Warp | None = None,
    steps: int = 8,
) -> Warp:  # fmt: skip
    """Return the warp that makes channels of a face most like the template's, by Gauss-Newton steps.

    Parameters
    ----------
    faces, template : ndarray, shape (c, rows, columns)
    shown : ndarray, shape (rows, columns)
        1 where the face is seen, 0 where it is not.
    weight : ndarray, shape (rows, columns)
        Weight of each place of the template.
    grid : Grid
    start : Warp, optional
        Default: no shift.
    steps : int
    """
    base = basis(grid)
    shift = start.shift if start is not None else np.zeros((base.down.shape[1], base.across.shape[1], 2))
    images = np.concatenate([shown[None], faces, *np.gradient(faces, grid.step, axis=(2, 1))])
    weight = weight / weight.sum()
    for _ in range(steps):
        field = Warp(grid, shift).field()
        pull, metric = _gauss_newton_sums(images, template, weight, field / grid.step)
        right = np.moveaxis(base.down.T @ pull @ base.across, 0, 2) + (base.stiffness @ shift.ravel()).reshape(
            shift.shape
        )
        change = base.solved(metric, -right)
        shift = shift + change * min(1.0, 0.1 / max(float(np.abs(change).max()), 1e-12))  # in small steps
    return Warp(grid, shift)


def contrast_normalized(curvature: Array, weight: Array, grid: Grid) -> Array:
    """Return curvature (c, rows, columns) over its strength around each place, as large on shallow as on deep faces.

    `weight` (rows, columns) is the weight of each place in the mean strength of its surroundings, which is 0.04 at
    least.
    """
    sigma, weight = 0.3 / grid.step, weight.astype(float)
    share = np.maximum(gaussian_filter(weight, sigma), 1e-3)
    return np.array([c / np.sqrt(gaussian_filter(weight * c * c, sigma) / share + 0.04**2) for c in curvature])


def _gauss_newton_sums(images: Array, template: Array, weight: Array, field: Array) -> tuple[Array, Array]:
    """Sums over the channels for a Gauss-Newton step of a warp.

    Returns slopes times differences (2, rows, columns), and slopes times slopes (2, 2, rows, columns). The images are
    what is shown of a face, its c channels, and their slopes along x and y. They are read at the template's places
    shifted by a field (2, rows, columns), x and y in steps of the grid; beyond the border, the value at the border
    counts.
    """
    i, j = np.nonzero(weight)
    x, y = field[:, i, j] + [j, i]
    values = np.array([map_coordinates(image, (y, x), order=1, mode="nearest") for image in images])
    shown, (faces, *slopes) = values[0], np.split(values[1:], 3)
    difference = faces - template[:, i, j]
    robust = weight[i, j] * shown / (1.0 + difference * difference)
    pull, metric = np.zeros((2, *weight.shape)), np.zeros((2, 2, *weight.shape))
    pull[:, i, j] = [(robust * slope * difference).sum(axis=0) for slope in slopes]
    metric[:, :, i, j] = [[(robust * a * b).sum(axis=0) for a in slopes] for b in slopes]
    return pull, metric


# --- the exact pose ---------------------------------------------------------------------------------------------------

COARSE, FINE = Grid(0.07), Grid(0.035)
SCALES = (0.06, 0.11, 0.22)
"""Sizes of bulges and hollows that are compared, in distances between the pupils."""


# How likely a pose is to be that of a face.
DEPTH_PENALTY = 3.0
"""Loss of likelihood per median difference of depth of one distance between the pupils."""


@dataclass(frozen=True, eq=False)
class SurfaceMap:
    """A surface seen from the front, over a grid.

    Attributes
    ----------
    depth : ndarray, shape (rows, columns)
        With closed openings.
    curvature : ndarray, shape (c, rows, columns)
        At each of :data:`SCALES`, compressed where it is strong.
    weight : ndarray, shape (rows, columns)
        0 outside of the face and where no surface is seen.
    known : ndarray, shape (rows, columns)
        1 where a surface is seen, falling to 0 where there is none.
    """

    depth: Array
    curvature: Array
    weight: Array
    known: Array


@cache
def template_map(grid: Grid, variant: int = 0) -> SurfaceMap:
    """Return the map of one of the template's variants."""
    depth, weight = template(variant).depth(grid)
    return SurfaceMap(depth, _compressed(curvature(depth, grid, SCALES)), weight, (weight > 0.0).astype(np.float64))


def surface_map(points: Array, triangles: IntArray, pose: Pose, grid: Grid, variant: int = 0) -> SurfaceMap:
    """Return the map of a surface in a pose; places that are not seen weigh nothing."""
    base = template_map(grid, variant)
    depth = depth_map(pose.local(points), triangles, grid)
    depth[np.abs(depth - base.depth - _median_offset(depth, base)) > 0.35] = np.nan  # so far off is not the face
    closed, known = openings_closed(depth, grid, template(variant).mouth_open, base.depth)
    certain = gaussian_filter(known.astype(float), SCALES[0] / grid.step) ** 2
    return SurfaceMap(closed, _compressed(curvature(closed, grid, SCALES)), base.weight * certain, certain)


def _median_offset(depth: Array, base: SurfaceMap) -> float:
    inside = (base.weight > 0.0) & (np.abs(depth - base.depth) < 1.0)
    return float(np.median((depth - base.depth)[inside])) if inside.any() else 0.0


def _compressed(curvature: Array) -> Array:
    """Curvature below 0.5, in which the rims of masks, hair and cloth do not outweigh a face."""
    return np.asarray(curvature / np.sqrt(1.0 + (curvature / 0.5) ** 2))


def pose_score(found: SurfaceMap, base: SurfaceMap) -> float:
    """Likeness of a surface to the template, at most 1: the mean correlation of curvature.

    Less where little is seen of a quarter of the face, and where depth differs.
    """
    correlations = [_correlation_of(a, b, found.weight) for a, b in zip(found.curvature, base.curvature, strict=True)]
    return float(np.mean(correlations)) * coverage(found, base) ** 0.5 - DEPTH_PENALTY * depth_difference(found, base)


def coverage(found: SurfaceMap, base: SurfaceMap) -> float:
    """Share of the template that is seen in the quarter of the face that shows least."""
    rows, columns = (length // 2 for length in base.weight.shape)
    quarters = [np.s_[i, j] for i in (np.s_[:rows], np.s_[rows:]) for j in (np.s_[:columns], np.s_[-columns:])]
    return float(min(found.weight[quarter].sum() / base.weight[quarter].sum() for quarter in quarters))


def depth_difference(found: SurfaceMap, base: SurfaceMap) -> float:
    """Median difference of depth about a common offset, in distances between the pupils."""
    difference = (found.depth - base.depth)[found.weight > 0.2]
    return float(np.median(np.abs(difference - np.median(difference)))) if difference.size else 1.0


def _correlation_of(a: Array, b: Array, weight: Array) -> float:
    norm = np.sqrt((weight * a * a).sum() * (weight * b * b).sum())
    return float((weight * a * b).sum() / max(norm, 1e-12))


def aligned(points: Array, triangles: IntArray, pose: Pose, variant: int = 0) -> Pose:
    """Return the pose in which the depth is closest to the template's: Gauss-Newton over turn, shift, size and stretch.

    The more a place differs, the less it counts.
    """
    grid, base = COARSE, template_map(COARSE, variant)
    for step in range(14):
        depth = depth_map(pose.local(points), triangles, grid)
        depth -= _median_offset(depth, base) if step == 0 else 0.0
        stiffness = 0.003 if step >= 4 else 1.0  # at first proportions hardly change: size and place come first
        pose = _moved(pose, _gauss_newton_step(depth, base, pose, 0.25 * 0.85**step + 0.05, stiffness))
    return pose


def _gauss_newton_step(depth: Array, base: SurfaceMap, pose: Pose, tolerance: float, stiffness: float) -> Array:
    """The change (w, t, s, stretch) that brings a depth map closer to the template's.

    A surface of height h(x, y) that moves by a small (a, b, c) has the new height h + c - a dh/dx - b dh/dy at the
    same place. Turns and shifts, growth, and stretch upward and forward have these derivatives; the more a place
    differs, and the steeper it is, the less it weighs.
    """
    slope_y, slope_x = np.array(np.gradient(depth, COARSE.step))
    difference = depth - base.depth
    near = (base.weight > 0.0) & (np.abs(difference) < 3.0 * tolerance) & np.isfinite(slope_x) & np.isfinite(slope_y)
    x, y = (axis[near] for axis in np.meshgrid(COARSE.x, COARSE.y))
    d, z, u, v = difference[near], depth[near], slope_x[near], slope_y[near]
    derivatives = np.array(
        [y + v * z, -x - u * z, u * y - v * x, -u, -v, np.ones_like(z), z - u * x - v * y, -v * y, z]
    )
    weights = base.weight[near] / (1.0 + (d / tolerance) ** 2) ** 2 / (1.0 + u * u + v * v)
    weight, weighted = weights.sum(), derivatives * weights
    square, right = weighted @ derivatives.T, weighted @ d
    stiff = max(weight, 1.0) * np.array([*[1e-3] * 7, *[stiffness] * 2])
    stretch = np.array([*[0.0] * 7, *np.log(pose.stretch[1:])])
    change = -np.linalg.solve(square + np.diag(stiff), right - stiff * stretch)
    return np.asarray(change * min(1.0, 0.3 / max(float(np.abs(change).max()), 1e-12)))  # in steps that are not large


def _moved(pose: Pose, change: Array) -> Pose:
    """The pose whose local coordinates are stretched exp(s) R(w) local + t, for change = (w, t, s, stretch)."""
    turn, growth = Rotation.from_rotvec(change[:3]).as_matrix(), float(np.exp(change[6]))
    origin = pose.world(-(change[3:6] @ turn / growth)[None])[0]
    return Pose(turn @ pose.axes, origin, pose.size / growth, pose.stretch * np.exp([0.0, *-change[7:9]]))


# --- matches ------------------------------------------------------------------------------------------------

AROUND = 0.2
"""Size of the surroundings that are compared, in distances between the pupils."""


@dataclass(frozen=True, eq=False)
class Match:
    """A surface in a pose and its likeness to a variant of the template.

    Attributes
    ----------
    pose : Pose
    surface : SurfaceMap
        Map of the surface seen in this pose.
    warp : Warp
    correlation : ndarray, shape (rows, columns)
        Correlation of curvature around every place of the template, less where little is seen.
    confidence : float
        0 to 1.
    mouth_open : bool
        True if the variant's mouth is open.
    """

    pose: Pose
    surface: SurfaceMap
    warp: Warp
    correlation: Array
    confidence: float
    mouth_open: bool


def matched(points: Array, triangles: IntArray, pose: Pose, variant: int = 0) -> Match:
    """Match a surface in a pose with a variant of the template: a warp by coarse curvature first, then by finer one."""
    surface, base = surface_map(points, triangles, pose, FINE, variant), template_map(FINE, variant)
    face, model = _channels(surface, base), _channels(base, base)
    shown = np.clip(surface.weight / np.maximum(base.weight, 1e-3), 0.0, 1.0)
    warp = None
    # Channels that lead it (curvature by size, then depth), and steps: more would bring other things closer to a face.
    for channels, steps in (([2, 3], 5), ([1, 2, 3], 5), ([0, 1, 2, 3], 8)):
        warp = fitted_warp(face[channels], shown, model[channels], base.weight, FINE, warp, steps)
    assert warp is not None
    warp = Warp(FINE, certain(warp.shift))
    field = warp.field()
    weight = base.weight * resampled(shown, FINE, field)
    alike = _correlation(np.array([resampled(channel, FINE, field) for channel in face[:-1]]), model[:-1], weight)
    sigma = AROUND / FINE.step
    seen = np.clip(gaussian_filter(weight, sigma) / np.maximum(gaussian_filter(base.weight, sigma), 1e-3), 0.0, 1.0)
    # Is it a face? The confidence is a product of shares, each 0 at the first and 1 at the second number of a pair.
    # Measured by `python -m tools.trials finding likeness` on faces and other things, each warped to be most like the
    # template: spheres and other things have a mean correlation of curvature of 0.57 to 0.92, faces 0.82 and more.
    likeness = share(_mean(alike, weight), (0.5, 1.0)) - DEPTH_PENALTY * depth_difference(surface, base)
    # By what the quarter of the face shows that shows least, half a face is refused, and no torn or narrow one.
    likeness *= share(coverage(surface, base), (0.0, 0.35)) * _nose(alike, weight, variant)
    confidence = float(np.clip(likeness, 0.0, 1.0))
    return Match(pose, surface, warp, alike * seen, confidence, template(variant).mouth_open)


def certain(shift: Array) -> Array:
    """Return shifts (..., 2), those below 0.04 reduced: the curvature of faces differs also where their landmarks lie
    alike.
    """
    square = (shift**2).sum(axis=-1, keepdims=True)
    return np.asarray(shift * square / (square + 0.04**2))


def share(value: float, limits: tuple[float, float]) -> float:
    """Return 0 up to the first limit, 1 from the second one on, and in between what lies between."""
    return float(np.clip((value - limits[0]) / (limits[1] - limits[0]), 0.0, 1.0))


def _mean(values: Array, weight: Array) -> float:
    return float((values * weight).sum() / max(weight.sum(), 1e-9))


def _nose(alike: Array, weight: Array, variant: int) -> float:
    """Likeness (0 to 1) of the supposed nose and its surroundings to a nose."""
    tip = template(variant).landmarks["nose_tip"]
    x, y = np.meshgrid(FINE.x - tip[0], FINE.y - tip[1])
    near = weight * np.exp(-(x * x + y * y) / 0.25**2)
    return share(_mean(alike, near), (0.80, 0.94))  # other things have a correlation of 0.93 and less, faces more


def _channels(surface: SurfaceMap, base: SurfaceMap) -> Array:
    """Curvature by size, with normalized contrast, and depth (c + 1, rows, columns), of which 0.8 counts as much.

    Where there is no surface it drops, which keeps the template from being warped off the surface.
    """
    seen = (surface.weight > 0.05).astype(np.float64)
    curved = contrast_normalized(curvature(surface.depth, FINE, SCALES), seen, FINE)
    inside = surface.weight > 0.2
    offset = np.median((surface.depth - base.depth)[inside]) if inside.any() else 0.0
    depth = np.maximum(surface.depth - 0.5 * (1.0 - surface.known) - offset, -1.0)
    return np.concatenate([curved, depth[None] / 0.8])


def _correlation(face: Array, model: Array, weight: Array) -> Array:
    """Correlation of channels (c, rows, columns) around every place (rows, columns)."""

    def mean(values: Array) -> Array:
        return np.asarray(gaussian_filter(weight * values, AROUND / FINE.step))

    product = np.sum([mean(a * b) for a, b in zip(face, model, strict=True)], axis=0)
    norm = np.sum([np.sqrt(mean(a * a) * mean(b * b)) for a, b in zip(face, model, strict=True)], axis=0)
    return np.asarray(product / np.maximum(norm, 1e-9))
