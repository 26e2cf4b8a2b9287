"""Vertex normals.

what            checked against
vertex_normals  sums of cross products in numpy
detail_normals  its definition in numpy; the smooth normals, exactly, where nothing is displaced
vertex_areas    the area of the mesh; Heron's formula
"""

import numpy as np
import pytest
import pyvista as pv
from small_meshes import arrays

from facewrinkle.geometry import (
    cotangent_laplacian,
    detail_normals,
    graph_laplacian,
    neighbor_mean,
    unique_edges,
    vertex_areas,
    vertex_normals,
)


def plain_sums(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    total = np.zeros_like(points)
    for k in range(3):
        np.add.at(total, triangles[:, k], np.cross(b - a, c - a))
    return total


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@pytest.fixture
def dented():
    points, triangles = arrays(pv.Icosphere(radius=2.0, nsub=2).clean())
    return points + 0.1 * np.random.default_rng(0).normal(size=points.shape), triangles


def test_vertex_normals_are_the_sums_of_cross_products(dented):
    points, triangles = dented
    np.testing.assert_allclose(vertex_normals(points, triangles), unit(plain_sums(points, triangles)), atol=1e-14)


def test_unused_and_degenerate_vertices_have_no_normal():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5], [2, 0, 0]])
    normals = vertex_normals(points, [[0, 1, 2]])
    assert normals[:3].tolist() == [[0.0, 0.0, 1.0]] * 3
    assert not normals[3:].any()
    assert not vertex_normals(points, [[0, 1, 4]]).any()


def test_detail_normals_are_smooth_where_nothing_is_displaced(dented):
    points, triangles = dented
    smooth = unit(np.random.default_rng(4).normal(size=points.shape))
    np.testing.assert_allclose(detail_normals(points, points.copy(), triangles, smooth), smooth, rtol=0, atol=5e-16)
    # A displacement of one vertex changes the normals of its ring and of no other.
    moved = points.copy()
    moved[7] *= 1.2
    changed = np.abs(detail_normals(points, moved, triangles, smooth) - smooth).max(axis=1) > 1e-12
    assert set(np.flatnonzero(changed)) <= set(np.unique(triangles[(triangles == 7).any(axis=1)]).tolist())
    assert changed.sum() > 3


def test_detail_normals_add_the_change_of_the_mesh_normals(dented):
    points, triangles = dented
    displaced = points + 0.05 * np.sin(9.0 * points)
    smooth = unit(points)
    change = unit(plain_sums(displaced, triangles)) - unit(plain_sums(points, triangles))
    out = detail_normals(points, displaced, triangles, smooth)
    np.testing.assert_allclose(out, unit(smooth + change), atol=1e-13)


def test_vertex_areas_share_out_the_mesh(dented):
    points, triangles = dented
    areas = vertex_areas(points, triangles)
    sides = [np.linalg.norm(points[triangles[:, k]] - points[triangles[:, k - 1]], axis=1) for k in range(3)]
    half = sum(sides) / 2.0
    heron = np.sqrt(half * np.prod([half - s for s in sides], axis=0))
    assert areas.sum() == pytest.approx(heron.sum(), rel=1e-12)
    own = np.array([heron[(triangles == v).any(axis=1)].sum() / 3.0 for v in range(0, len(points), 37)])
    np.testing.assert_allclose(areas[::37], own, rtol=1e-11)
    assert vertex_areas([[0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 9, 9]], [[0, 1, 2]])[3] == 0.0


# --- Laplacians -----------------------------------------------------------------------------------


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


def test_mean_of_neighbors_is_what_the_laplacian_compares_with():
    plane = pv.Plane(i_resolution=4, j_resolution=3).triangulate()
    edges, _ = unique_edges(plane.regular_faces)
    n, values = plane.n_points, np.random.default_rng(0).normal(size=plane.n_points)
    laplacian = graph_laplacian(edges, np.ones(len(edges)), n)
    expected = values - (laplacian @ values) / laplacian.diagonal()
    np.testing.assert_allclose(neighbor_mean(edges, n) @ values, expected, atol=1e-12)
