"""Triangles that are turned over: against what was turned, whatever else the surface does."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from facewrinkle.geometry.unfolding import Unfolding


@pytest.fixture(scope="module")
def sheet():
    grid = pv.Plane(i_size=10.0, j_size=10.0, i_resolution=10, j_resolution=10).triangulate()
    return np.asarray(grid.points, np.float64), np.asarray(grid.regular_faces)


def rolled(points, radius):
    """A sheet around a cylinder."""
    angle = points[:, 0] / radius
    return np.stack([radius * np.sin(angle), points[:, 1], radius * np.cos(angle)], axis=1)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(4.0, 50.0))
def test_no_rotation_bend_or_stretch_turns_a_triangle_over(sheet, seed, radius):
    points, triangles = sheet
    random = np.random.default_rng(seed)
    stretched = points * random.uniform(0.5, 2.0, 3)
    moved = Rotation.random(random_state=seed % 2**32).apply(rolled(stretched, radius)) + random.normal(size=3)
    unfolding = Unfolding(points, triangles)
    assert not len(unfolding.turned_over(moved))
    np.testing.assert_allclose(unfolding.mended(moved), moved, atol=1e-12)


@pytest.mark.parametrize("vertex", [36, 60, 84])
def test_what_is_turned_over_on_a_bent_sheet_is_found_and_mended(sheet, vertex):
    points, triangles = sheet
    pulled = points.copy()
    pulled[vertex] += [1.4, 0.2, 0.0]  # beyond its neighbour, in the plane
    a, b, c = (pulled[triangles[:, k]] for k in range(3))
    expected = np.flatnonzero(np.cross(b - a, c - a)[:, 2] <= 0.0)
    assert len(expected)
    unfolding, moved = Unfolding(points, triangles), rolled(pulled, 20.0)
    np.testing.assert_array_equal(unfolding.turned_over(moved), expected)
    mended = unfolding.mended(moved)
    assert not len(unfolding.turned_over(mended))
    changed = np.flatnonzero((mended != moved).any(axis=1))
    assert vertex in changed
    assert np.linalg.norm(points[changed] - points[vertex], axis=1).max() < 3.0  # nothing far away
