"""Closest points.

what                 checked against
closest_point        brute force over a fine sampling of the triangles
degenerate triangle  the segment or point that it is
"""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.geometry.closest_point import closest_point


def test_no_sampled_point_is_closer():
    plane = pv.Plane(i_size=10.0, j_size=10.0, i_resolution=6, j_resolution=6).triangulate()
    points, triangles = np.array(plane.points, dtype=float), np.asarray(plane.regular_faces, np.int32)
    points[:, 2] = np.sin(points[:, 0])
    rng = np.random.default_rng(1)
    weights = rng.dirichlet(np.ones(3), (len(triangles), 400))
    cloud = np.einsum("msc,mcx->msx", weights, points[triangles]).reshape(-1, 3)
    for query in rng.uniform(-7, 7, (40, 3)):
        found = closest_point(points, triangles, query)
        sampled = np.linalg.norm(cloud - query, axis=1).min()
        assert found.distance <= sampled + 1e-12
        assert found.distance > sampled - 0.15
        assert np.linalg.norm(found.point - query) == pytest.approx(found.distance, abs=1e-12)
        assert found.barycentric.min() >= 0.0
        np.testing.assert_allclose(found.barycentric @ points[triangles[found.triangle]], found.point, atol=1e-12)


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ([[0.0, 0, 0], [4, 0, 0], [4, 0, 0]], [1.0, 0, 0]),
        ([[0.0, 0, 0], [0, 0, 0], [4, 0, 0]], [1.0, 0, 0]),
        ([[0.0, 0, 0], [4, 0, 0], [2, 0, 0]], [1.0, 0, 0]),
        ([[3.0, 0, 0], [3, 0, 0], [3, 0, 0]], [3.0, 0, 0]),
    ],
)
def test_degenerate_triangles_are_segments_or_points(corners, expected):
    found = closest_point(np.array(corners), np.array([[0, 1, 2]], np.int32), [1.0, 2.0, 0.0])
    np.testing.assert_allclose(found.point, expected, atol=1e-12)
    assert found.distance == pytest.approx(np.linalg.norm(np.array(expected) - [1.0, 2.0, 0.0]))
    assert not found.normal.any()
