"""A smooth map from the template's front view to a face's: where each place of the template lies in the face."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.sparse.linalg import splu

from .depth import Grid

Array = npt.NDArray[np.float64]

SPACING = 0.24
"""Of the control points, in distances between the pupils."""


STIFFNESS, SYMMETRY = 0.02, 0.02
"""Resistance to bending, and to left and right that differ."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Cubic B-splines over a grid: values (p, k) at its points, and energies (2 k, 2 k) of fields (x, then y)."""

    values: sparse.csr_array
    bending: sparse.csr_array
    lopsided: sparse.csr_array


def _splines(low: float, high: float, at: Array) -> tuple[sparse.csr_array, int]:
    count = int(np.ceil((high - low) / SPACING))
    count += 1 - count % 2  # a control point in the middle
    knots = 0.5 * (low + high) + SPACING * (np.arange(count + 4) - 0.5 * (count + 3))
    inside = np.clip(at, knots[3] + 1e-9, knots[-4] - 1e-9)
    return sparse.csr_array(BSpline.design_matrix(inside, knots, 3)), count


@cache
def basis(grid: Grid) -> Basis:
    margin = 2.0 * SPACING
    bx, nx = _splines(grid.low[0] - margin, grid.high[0] + margin, grid.x)
    by, ny = _splines(grid.low[1] - margin, grid.high[1] + margin, grid.y)
    values = sparse.csr_array(sparse.kron(by, bx))
    dx, dy = (sparse.diags_array([np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1], shape=(n - 1, n)) for n in (nx, ny))
    one_x, one_y = sparse.identity(nx), sparse.identity(ny)
    second = [sparse.kron(one_y, _twice(dx)), sparse.kron(_twice(dy), one_x), np.sqrt(2.0) * sparse.kron(dy, dx)]
    energy = sum(d.T @ d for d in second)
    flip = sparse.kron(one_y, one_x.tocsr()[::-1])
    odd_x, odd_y = sparse.identity(nx * ny) + flip, sparse.identity(nx * ny) - flip
    lopsided = sparse.block_diag([odd_x.T @ odd_x, odd_y.T @ odd_y])
    return Basis(values, sparse.csr_array(sparse.block_diag([energy, energy])), sparse.csr_array(lopsided))


def _twice(first: sparse.sparray) -> sparse.sparray:
    n = first.shape[1]
    return sparse.diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(n - 2, n))


@dataclass(frozen=True, eq=False)
class Warp:
    """Shift (k, 2) of the control points."""

    grid: Grid
    shift: Array

    def field(self) -> Array:
        """Shift over the grid (2, rows, columns): x and y."""
        return np.array([(basis(self.grid).values @ s).reshape(self.grid.shape) for s in self.shift.T])

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
    k = base.values.shape[1]
    shift = start.shift if start is not None else np.zeros((k, 2))
    gradients = [np.gradient(channel, grid.step) for channel in faces]
    stiff = STIFFNESS * base.bending + SYMMETRY * base.lopsided + 1e-4 * sparse.identity(2 * k)
    for _ in range(steps):
        field = Warp(grid, shift).field()
        w = (weight * sampled(seen, grid, field) / weight.sum()).ravel()
        # The sums over the channels of a Gauss-Newton step: slopes times slopes, and slopes times differences.
        pull, metric = np.zeros((2, w.size)), np.zeros((2, 2, w.size))
        for channel, target, (slope_y, slope_x) in zip(faces, template, gradients, strict=True):
            difference = (sampled(channel, grid, field) - target).ravel()
            slope = np.array([sampled(s, grid, field).ravel() for s in (slope_x, slope_y)])
            robust = w / (1.0 + difference**2)
            pull += robust * slope * difference
            metric += robust * slope[:, None] * slope
        right = np.concatenate([base.values.T @ p for p in pull]) + stiff @ shift.T.ravel()
        blocks = [[base.values.T @ sparse.diags_array(m) @ base.values for m in row] for row in metric]
        change = _symmetric(sparse.block_array(blocks) + stiff).solve(-right).reshape(2, k).T
        shift = shift + change * min(1.0, 0.1 / max(float(np.abs(change).max()), 1e-12))
    return Warp(grid, shift)


def _symmetric(matrix: sparse.sparray) -> Any:
    """The factors of a symmetric positive definite matrix."""
    return splu(sparse.csc_array(matrix), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})


def evened(relief: Array, weight: Array, grid: Grid, width: float = 0.3, floor: float = 0.04) -> Array:
    """Relief over its strength round about: a shallow face's is as large as a deep one's."""
    sigma, weight = width / grid.step, weight.astype(float)
    share = np.maximum(gaussian_filter(weight, sigma), 1e-3)
    return np.array([r / np.sqrt(gaussian_filter(weight * r * r, sigma) / share + floor**2) for r in relief])
