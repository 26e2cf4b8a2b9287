"""Catmull-Clark subdivision reproduces planes, bicubic B-splines, and itself at other levels."""

from __future__ import annotations

import numpy as np
import pytest

from tools.build_head.cage import subdivided

CUBE = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6]]
)  # open: the side 3, 0, 4, 7 is missing


def grid(n: int) -> np.ndarray:
    """Quads of an n x n grid of cells, vertex (i, j) at i (n + 1) + j."""
    i, j = np.divmod(np.arange(n * n), n)
    first = i * (n + 1) + j
    return np.stack([first, first + n + 1, first + n + 2, first + 1], axis=1)


@pytest.mark.parametrize("quads", [CUBE, grid(3)])
def test_weights_sum_to_one(quads: np.ndarray) -> None:
    fine = subdivided(quads, 3)
    np.testing.assert_allclose(fine.limit.sum(axis=1), 1.0, atol=1e-12)
    assert len(fine.quads) == len(quads) * 64


@pytest.mark.parametrize("quads", [CUBE, grid(4)])
def test_limit_points_do_not_depend_on_the_level(quads: np.ndarray) -> None:
    points = np.random.default_rng(0).normal(size=(quads.max() + 1, 3))
    coarse, fine = subdivided(quads, 1), subdivided(quads, 3)
    np.testing.assert_allclose(
        (coarse.limit @ points)[coarse.grids], (fine.limit @ points)[fine.grids[:, ::4, ::4]], atol=1e-12
    )


def test_regular_patch_is_the_bicubic_b_spline() -> None:
    n, levels = 5, 3
    points = np.random.default_rng(1).normal(size=(n + 1, n + 1))
    fine = subdivided(grid(n), levels)
    limit = (fine.limit @ points.ravel())[fine.grids]
    t = np.linspace(0.0, 1.0, 2**levels + 1)
    basis = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]) / 6.0
    i, j = 2, 2
    exact = basis.T @ points[i - 1 : i + 3, j - 1 : j + 3] @ basis
    np.testing.assert_allclose(limit[i * n + j], exact, atol=1e-12)


def test_boundary_is_a_cubic_b_spline_of_the_boundary_alone() -> None:
    n = 4
    points = np.random.default_rng(2).normal(size=(n + 1, n + 1))
    fine = subdivided(grid(n), 2)
    limit = (fine.limit @ points.ravel())[fine.grids]
    t = np.linspace(0.0, 1.0, 5)
    basis = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]) / 6.0
    np.testing.assert_allclose(limit[1, 0], basis.T @ points[0, 0:4], atol=1e-12)


def test_grids_meet_along_shared_edges() -> None:
    fine = subdivided(grid(2), 2)
    assert (fine.grids[0, :, -1] == fine.grids[1, :, 0]).all()
    assert (fine.grids[0, -1, :] == fine.grids[2, 0, :]).all()
    assert (np.unique(fine.grids) == np.arange(fine.limit.shape[0])).all()
