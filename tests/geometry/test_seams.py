"""Values at the corners of triangles.

what                checked against
split_vertices      every corner keeps its vertex and its value; no two copies of a vertex have one value
refined values      values that are linear in the plane on each side of a seam: their closed form
both sides          a value that has no seam is bit for bit the same from both sides of an edge, at any depth
of same triangles   the triangles of a mesh, shuffled and turned
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facewrinkle.geometry.interpolation import interpolated, refined_values
from facewrinkle.geometry.refinement import RedGreenForest
from facewrinkle.geometry.topology import split_vertices


def sheet(n):
    """An n x n grid of vertices in the plane."""
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.r_[np.c_[corner, corner + 1, corner + n + 1], np.c_[corner, corner + n + 1, corner + n]]
    return np.c_[x.ravel(), y.ravel(), 0.0 * x.ravel()].astype(float), triangles


POINTS, TRIANGLES = sheet(5)


def grown(triangles, seed, passes=5):
    """A forest with triangles split here and there, some of them taken back."""
    forest, rng = RedGreenForest(triangles, 6), np.random.default_rng(seed)
    for _ in range(passes):
        forest.split(rng.random(len(forest.triangles)) < 0.2)
        forest.coarsen(rng.random(len(forest.triangles)) < 0.5)
    return forest


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_split_vertices_have_one_value_each(seed, kinds):
    values = np.random.default_rng(seed).integers(0, kinds, (*TRIANGLES.shape, 2)) / 8.0
    before = TRIANGLES.copy()
    parts = split_vertices(TRIANGLES, values, len(POINTS))
    np.testing.assert_array_equal(TRIANGLES, before)
    np.testing.assert_array_equal(parts.origin[parts.triangles], TRIANGLES)
    np.testing.assert_array_equal(parts.values[parts.triangles], values)
    np.testing.assert_array_equal(parts.origin[: len(POINTS)], np.arange(len(POINTS)))
    several = {(int(v), *uv) for v, uv in zip(TRIANGLES.ravel(), values.reshape(-1, 2).tolist(), strict=True)}
    assert len(parts.origin) == len(several)
    assert set(range(len(parts.origin))) == set(parts.triangles.ravel().tolist())


@pytest.mark.parametrize("seed", range(4))
def test_values_on_either_side_of_a_seam_have_a_closed_form(seed):
    right = (POINTS[TRIANGLES][:, :, 0].mean(axis=1) > 2.0)[:, None, None]

    def closed_form(where, right):
        uv = where[..., :2] / 7.0
        return np.where(right, uv @ [[0.5, 1.0], [-1.0, 0.5]] + [3.0, 0.25], uv)

    forest = grown(TRIANGLES, seed)
    assert len(forest.triangles) > 3 * len(TRIANGLES)
    fine = interpolated(POINTS, forest.corners, forest.barycentric)
    values = refined_values(closed_form(POINTS[TRIANGLES], right), TRIANGLES, forest)
    sides = (fine[forest.triangles][:, :, 0].mean(axis=1) > 2.0)[:, None, None]
    np.testing.assert_allclose(values, closed_form(fine[forest.triangles], sides), atol=1e-15)
    # The sheet comes apart along x = 2 and nowhere else, each vertex on it in two.
    parts = split_vertices(forest.triangles, values, forest.n_points)
    assert sorted(parts.origin[forest.n_points :]) == np.flatnonzero(fine[:, 0] == 2.0).tolist()


@pytest.mark.parametrize("seed", range(4))
def test_without_a_seam_nothing_is_split_at_any_depth(seed):
    uv = np.random.default_rng(seed).random((len(POINTS), 2))  # not representable sums: roundings would tell
    forest = grown(TRIANGLES, seed, 9)
    assert forest.level.max() == 6
    values = refined_values(uv[TRIANGLES], TRIANGLES, forest)
    assert len(split_vertices(forest.triangles, values, forest.n_points).origin) == forest.n_points
