"""A smooth map from the template's front view to a face's, which takes each place to its counterpart."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded
from scipy.ndimage import gaussian_filter, map_coordinates

from ...array_types import Array, BoolArray, IntArray
from .depth import Grid

SPACING = 0.24
"""Spacing of the control points, in distances between the pupils."""

STIFFNESS, SYMMETRY = 0.02, 0.02
"""Resistance to bending, and to differences of left and right."""

LARGEST_SHIFT = 0.1
"""Shift of a control point in one step, at most, in distances between the pupils."""

CONTRAST_RADIUS, CONTRAST_FLOOR = 0.3, 0.04
"""Size of the surroundings by whose strength of curvature a place is normalised, and the least such strength."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Products of cubic B-splines down a grid and across it, and the stiffness of their shifts.

    Shifts (m, n, 2) are numbered as they lie in memory. Of a symmetric matrix (2 m n, 2 m n), of narrow band, the lower
    diagonals are kept: entry (i, j) at (i - j, j).

    Attributes
    ----------
    down, across : ndarray, shape (rows, m) and (columns, n)
        The splines.
    pairs : pair of ndarray
        Products of those splines that overlap: down and across, (rows, p) and (columns, q).
    lower : ndarray of bool, shape (4 p q,)
        True for those of the products, for x and x, x and y, y and x, y and y, that are on the lower diagonals.
    places : tuple of ndarray of int
        Places among the diagonals to which these add.
    stiffness : sparse array, shape (2 m n, 2 m n)
    diagonals : ndarray
        The lower diagonals of the stiffness.
    """

    down: Array
    across: Array
    pairs: tuple[Array, Array]
    lower: BoolArray
    places: tuple[IntArray, ...]
    stiffness: sparse.csr_array
    diagonals: Array

    def solved(self, metric: Array, right: Array) -> Array:
        """Solve (metric + stiffness) shift = right for the shift (m, n, 2).

        The metric (3, rows, columns) is symmetric: entries for x and x, x and y, y and y.
        """
        products = (self.pairs[0].T @ metric @ self.pairs[1])[[0, 1, 1, 2]]
        diagonals = self.diagonals.copy()
        diagonals[self.places] += products.ravel()[self.lower]
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
    m, n = down.shape[1], across.shape[1]
    # Splines overlap with those up to three places away.
    (i, k), (j, l) = (np.nonzero(np.abs(np.subtract.outer(range(s), range(s))) < 4) for s in (m, n))
    components = np.array([(0, 0), (0, 1), (1, 0), (1, 1)]).T[:, :, None, None]
    row, column = (2 * np.array([i[:, None] * n + j, k[:, None] * n + l])[:, None] + components).reshape(2, -1)
    lower, stiffness = row >= column, _stiffness(m, n)
    places = (row - column)[lower], column[lower]
    diagonals = np.zeros((places[0].max() + 1, 2 * m * n))
    entries = sparse.coo_array(sparse.tril(stiffness))
    diagonals[entries.row - entries.col, entries.col] = entries.data
    pairs = down[:, i] * down[:, k], across[:, j] * across[:, l]
    return Basis(down, across, pairs, lower, places, stiffness, diagonals)


def _stiffness(m: int, n: int) -> sparse.csr_array:
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
    resistance = STIFFNESS * sparse.kron(bending, np.eye(2)) + SYMMETRY * asymmetry
    return sparse.csr_array(resistance + 1e-4 * sparse.identity(2 * m * n))


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
        shift = shift + change * min(1.0, LARGEST_SHIFT / max(float(np.abs(change).max()), 1e-12))
    return Warp(grid, shift)


def contrast_normalised(curvature: Array, weight: Array, grid: Grid) -> Array:
    """Return curvature (c, rows, columns) over its strength around each place, as large on shallow as on deep faces.

    `weight` (rows, columns) is the weight of each place in the mean strength.
    """
    sigma, weight = CONTRAST_RADIUS / grid.step, weight.astype(float)
    share = np.maximum(gaussian_filter(weight, sigma), 1e-3)
    return np.array(
        [c / np.sqrt(gaussian_filter(weight * c * c, sigma) / share + CONTRAST_FLOOR**2) for c in curvature]
    )


def _gauss_newton_sums(images: Array, template: Array, weight: Array, field: Array) -> tuple[Array, Array]:
    """Sums over the channels for a Gauss-Newton step of a warp.

    Returns slopes times differences (2, rows, columns), and slopes times slopes (3, rows, columns): x and x, x and y, y
    and y. The images are what is shown of a face, its c channels, and their slopes along x and y. They are read at the
    template's places shifted by a field (2, rows, columns), x and y in steps of the grid; beyond the border, the value
    at the border counts.
    """
    i, j = np.nonzero(weight)
    x, y = field[:, i, j] + [j, i]
    values = bilinear(images, x, y)
    shown, (faces, *slopes) = values[0], np.split(values[1:], 3)
    difference = faces - template[:, i, j]
    robust = weight[i, j] * shown / (1.0 + difference * difference)
    pull, metric = np.zeros((2, *weight.shape)), np.zeros((3, *weight.shape))
    pull[:, i, j] = [(robust * slope * difference).sum(axis=0) for slope in slopes]
    pairs = ((slopes[0], slopes[0]), (slopes[0], slopes[1]), (slopes[1], slopes[1]))
    metric[:, i, j] = [(robust * a * b).sum(axis=0) for a, b in pairs]
    return pull, metric


def bilinear(images: Array, x: Array, y: Array) -> Array:
    """Values (c, n) of images (c, rows, columns) at columns x and rows y (n,); beyond the border, those at the border.

    Examples
    --------
    >>> bilinear(np.array([[[0.0, 2.0], [4.0, 6.0]]]), np.array([0.5, 9.0]), np.array([0.5, 0.0]))
    array([[3., 2.]])
    """
    rows, columns = images.shape[1:]
    x, y = np.clip(x, 0.0, columns - 1.0), np.clip(y, 0.0, rows - 1.0)
    left, top = np.minimum(x.astype(int), columns - 2), np.minimum(y.astype(int), rows - 2)
    flat, at = images.reshape(len(images), -1), top * columns + left
    above, below = (flat[:, start] + (x - left) * (flat[:, start + 1] - flat[:, start]) for start in (at, at + columns))
    return np.asarray(above + (y - top) * (below - above))
