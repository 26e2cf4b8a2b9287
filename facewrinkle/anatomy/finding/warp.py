"""A smooth map from the template's front view to a face's: where each place of the template lies in the face."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded
from scipy.ndimage import gaussian_filter, map_coordinates

from . import _kernels as kernels
from .depth import Grid

Array = npt.NDArray[np.float64]

SPACING = 0.24
"""Of the control points, in distances between the pupils."""


STIFFNESS, SYMMETRY = 0.02, 0.02
"""Resistance to bending, and to left and right that differ."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Products of cubic B-splines down a grid (rows, m) and across it (columns, n), and what resists their shifts.

    `pairs` are the products of splines that overlap. Shifts (m, n, 2) count as they lie in memory. A matrix
    (2 k, 2 k), k = m n, that is symmetric and of narrow band is kept as its lower diagonals: entry (i, j) at
    (i - j, j), the `places` of those `lower` ones that pairs add to.
    """

    down: Array
    across: Array
    pairs: tuple[Array, Array]
    stiff: sparse.csr_array
    diagonals: Array
    places: tuple[npt.NDArray[np.int64], ...]
    lower: npt.NDArray[np.bool_]

    def solved(self, metric: Array, right: Array) -> Array:
        """The shift on which a metric (2, 2, rows, columns) and the resistance have this effect (m, n, 2)."""
        diagonals = self.diagonals.copy()
        diagonals[self.places] += (self.pairs[0].T @ metric @ self.pairs[1])[self.lower]
        return np.asarray(solveh_banded(diagonals, right.ravel(), lower=True)).reshape(right.shape)


def _pairs(splines: Array) -> Array:
    """Products (points, 7 n) of splines with the 3 before to the 3 after them: others do not overlap."""
    around = sliding_window_view(np.pad(splines, ((0, 0), (3, 3))), 7, axis=1)
    return (splines[:, :, None] * around).reshape(len(splines), -1)


def _splines(low: float, high: float, at: Array) -> Array:
    count = int(np.ceil((high - low) / SPACING))
    count += 1 - count % 2  # a control point in the middle
    knots = 0.5 * (low + high) + SPACING * (np.arange(count + 4) - 0.5 * (count + 3))
    inside = np.clip(at, knots[3] + 1e-9, knots[-4] - 1e-9)
    return np.asarray(BSpline.design_matrix(inside, knots, 3).toarray())


@cache
def basis(grid: Grid) -> Basis:
    margin = 2.0 * SPACING
    across = _splines(grid.low[0] - margin, grid.high[0] + margin, grid.x)
    down = _splines(grid.low[1] - margin, grid.high[1] + margin, grid.y)
    m, n = down.shape[1], across.shape[1]
    stiff = _stiffness(m, n)
    # Rows and columns in the matrix of all pairs of shifts (x, y; m, 7; n, 7); -2 is none.
    number = 2 * np.arange(m * n).reshape(m, n)
    around = sliding_window_view(np.pad(number, 3, constant_values=-2), (7, 7)).swapaxes(1, 2)
    column = number[:, None, :, None] + np.arange(2)[:, None, None, None, None, None]
    row, column = np.broadcast_arrays(around + np.arange(2)[:, None, None, None, None], column)
    lower = row >= column
    i, j = row[lower], column[lower]
    entries = sparse.coo_array(sparse.tril(stiff))
    diagonals = np.zeros(((i - j).max() + 1, 2 * m * n))
    diagonals[entries.row - entries.col, entries.col] = entries.data
    pairs = _pairs(down), _pairs(across)
    return Basis(down, across, pairs, stiff, diagonals, (i - j, j), lower.reshape(2, 2, 7 * m, 7 * n))


def _stiffness(m: int, n: int) -> sparse.csr_array:
    """Resistance of m times n control points to bending, and to left and right that differ."""
    dx, dy = (sparse.diags_array([np.ones(k - 1), -np.ones(k - 1)], offsets=[0, 1], shape=(k - 1, k)) for k in (n, m))
    one_x, one_y = sparse.identity(n), sparse.identity(m)
    second = [sparse.kron(one_y, _twice(dx)), sparse.kron(_twice(dy), one_x), np.sqrt(2.0) * sparse.kron(dy, dx)]
    bending = sum(d.T @ d for d in second)
    flip = sparse.kron(one_y, one_x.tocsr()[::-1])
    odd_x, odd_y = sparse.identity(m * n) + flip, sparse.identity(m * n) - flip
    lopsided = sparse.kron(odd_x.T @ odd_x, np.diag([1.0, 0.0])) + sparse.kron(odd_y.T @ odd_y, np.diag([0.0, 1.0]))
    resistance = STIFFNESS * sparse.kron(bending, np.eye(2)) + SYMMETRY * lopsided
    return sparse.csr_array(resistance + 1e-4 * sparse.identity(2 * m * n))


def _twice(first: sparse.sparray) -> sparse.sparray:
    n = first.shape[1]
    return sparse.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(n - 2, n))


@dataclass(frozen=True, eq=False)
class Warp:
    """Shift (m, n, 2) of the control points."""

    grid: Grid
    shift: Array

    def field(self) -> Array:
        """Shift over the grid (2, rows, columns): x and y."""
        splines = basis(self.grid)
        return np.asarray(splines.down @ np.moveaxis(self.shift, 2, 0) @ splines.across.T)

    def __call__(self, xy: Array) -> Array:
        """Places in the face (n, 2) of places in the template."""
        where = self.grid.index(xy)
        return xy + np.stack([map_coordinates(f, where, order=1, mode="nearest") for f in self.field()], axis=1)


def sampled(image: Array, grid: Grid, field: Array) -> Array:
    """An image at the shifted points of its grid."""
    rows, columns = np.meshgrid(np.arange(grid.shape[0]), np.arange(grid.shape[1]), indexing="ij")
    where = np.array([rows + field[1] / grid.step, columns + field[0] / grid.step])
    return np.asarray(map_coordinates(image, where, order=1, mode="nearest"))


def warped(
    faces: Array, seen: Array, template: Array, weight: Array, grid: Grid, start: Warp | None = None,
    steps: int = 8,
) -> Warp:  # fmt: skip
    """The warp that makes channels of a face (c, rows, columns) most like the template's: Gauss-Newton.

    Parameters
    ----------
    faces, template : ndarray, shape (c, rows, columns)
    seen, weight : ndarray, shape (rows, columns)
        What is seen of the face, 0 to 1, and how much places of the template count.
    """
    base = basis(grid)
    shift = start.shift if start is not None else np.zeros((base.down.shape[1], base.across.shape[1], 2))
    slopes = np.array(np.gradient(faces, grid.step, axis=(2, 1)))
    weight = weight / weight.sum()
    for _ in range(steps):
        field = Warp(grid, shift).field()
        pull, metric = kernels.attraction(faces, slopes, template, seen, weight, field / grid.step)
        right = np.moveaxis(base.down.T @ pull @ base.across, 0, 2) + (base.stiff @ shift.ravel()).reshape(shift.shape)
        change = base.solved(metric, -right)
        shift = shift + change * min(1.0, 0.1 / max(float(np.abs(change).max()), 1e-12))
    return Warp(grid, shift)


def evened(relief: Array, weight: Array, grid: Grid, width: float = 0.3, floor: float = 0.04) -> Array:
    """Relief over its strength round about: a shallow face's is as large as a deep one's."""
    sigma, weight = width / grid.step, weight.astype(float)
    share = np.maximum(gaussian_filter(weight, sigma), 1e-3)
    return np.array([r / np.sqrt(gaussian_filter(weight * r * r, sigma) / share + floor**2) for r in relief])
