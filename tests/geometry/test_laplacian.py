"""Laplacians against closed forms: constants, linear functions, and the eigenvalues of a path; means of neighbours."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from facewrinkle.geometry.laplacian import cotangent_laplacian, graph_laplacian, neighbour_mean
from facewrinkle.geometry.topology import unique_edges


def test_path_has_the_known_eigenvalues():
    n = 7
    edges = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1).astype(np.int32)
    values = np.linalg.eigvalsh(graph_laplacian(edges, np.full(n - 1, 3.0), n).toarray())
    np.testing.assert_allclose(values, 6.0 * (1.0 - np.cos(np.pi * np.arange(n) / n)), atol=1e-12)


def test_cotangents_annihilate_linear_functions_inside_a_flat_mesh():
    plane = pv.Plane(i_resolution=6, j_resolution=5).triangulate()
    points, triangles = np.rint(np.asarray(plane.points, float) * 30.0) / 30.0, plane.regular_faces
    laplacian = cotangent_laplacian(points, triangles)
    inside = (np.abs(points[:, 0]) < 0.49) & (np.abs(points[:, 1]) < 0.49)
    np.testing.assert_allclose((laplacian @ (points @ [2.0, -3.0, 0.0]))[inside], 0.0, atol=1e-12)
    np.testing.assert_allclose(laplacian @ np.ones(len(points)), 0.0, atol=1e-12)
    # x^2 has the Laplacian 2: -L x^2 is twice the area of the vertex (mixed cells of a grid: its own area).
    cell = 1.0 / 30.0
    np.testing.assert_allclose(-(laplacian @ points[:, 0] ** 2)[inside], 2.0 * cell, rtol=1e-12)


def test_mean_of_neighbours_is_what_the_laplacian_compares_with():
    plane = pv.Plane(i_resolution=4, j_resolution=3).triangulate()
    edges, _ = unique_edges(plane.regular_faces)
    n, values = plane.n_points, np.random.default_rng(0).normal(size=plane.n_points)
    laplacian = graph_laplacian(edges, np.ones(len(edges)), n)
    expected = values - (laplacian @ values) / laplacian.diagonal()
    np.testing.assert_allclose(neighbour_mean(edges, n) @ values, expected, atol=1e-12)
