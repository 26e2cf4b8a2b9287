"""Nested dissection against its definition on grids, and minimum degree by SciPy; Morton's curve on blocks of cells."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from scipy.sparse import eye_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from facewrinkle.geometry.laplacian import graph_laplacian
from facewrinkle.geometry.orders import SMALLEST, morton_order, nested_dissection
from facewrinkle.geometry.topology import unique_edges


def grid(side, rng):
    """A flat grid whose vertices are numbered at random, and a positive definite matrix on its edges."""
    plane = pv.Plane(i_resolution=side - 1, j_resolution=side - 1).triangulate()
    n = plane.n_points
    number = rng.permutation(n)
    points, triangles = np.empty((n, 3)), number[plane.regular_faces].astype(np.int32)
    points[number] = plane.points
    edges, _ = unique_edges(triangles)
    return points, (graph_laplacian(edges, np.ones(len(edges)), n) + 0.1 * eye_array(n)).tocsr()


def filled(matrix, ordering):
    options = {"SymmetricMode": True}
    return splu(matrix.tocsc(), permc_spec=ordering, diag_pivot_thresh=0.0, options=options).L.nnz


@pytest.mark.parametrize("bending", [False, True])
def test_factors_are_about_as_sparse_as_by_minimum_degree(bending):
    points, matrix = grid(70, np.random.default_rng(4))
    matrix = (matrix @ matrix).tocsr() if bending else matrix
    order = nested_dissection((matrix.indptr, matrix.indices), points)
    assert np.array_equal(np.sort(order), np.arange(len(points)))
    ours, minimum = filled(matrix[order][:, order], "NATURAL"), filled(matrix, "MMD_AT_PLUS_A")
    assert ours < 1.3 * minimum


def test_without_the_links_the_halves_are_apart():
    points, matrix = grid(40, np.random.default_rng(5))
    order = nested_dissection((matrix.indptr, matrix.indices), points)
    links = 40  # a column of the grid
    rest = order[:-links]
    count, label = connected_components(matrix[rest][:, rest], directed=False)
    assert count == 2
    sizes = np.bincount(label)
    assert abs(sizes[0] - sizes[1]) <= links
    assert np.array_equal(np.sort(label), label)  # one after the other


def test_small_parts_and_points_in_one_place_keep_their_order():
    _, matrix = grid(7, np.random.default_rng(6))
    assert matrix.shape[0] <= SMALLEST
    order = nested_dissection((matrix.indptr, matrix.indices), np.zeros((49, 3)))
    assert order.tolist() == list(range(49))
    _, matrix = grid(30, np.random.default_rng(6))
    order = nested_dissection((matrix.indptr, matrix.indices), np.zeros((900, 3)))
    assert np.array_equal(np.sort(order), np.arange(900))


# --- Morton order ---------------------------------------------------------------------------------


@pytest.mark.parametrize("axes", [2, 3])
def test_cells_of_a_block_follow_each_other(axes):
    cells = np.stack(np.meshgrid(*[np.arange(8)] * axes, indexing="ij"), axis=-1).reshape(-1, axes)
    cells = np.random.default_rng(0).permutation(cells)
    order = morton_order(cells, bits=3)
    assert np.array_equal(np.sort(order), np.arange(len(cells)))
    for size in (2, 4):
        blocks = (cells[order] // size).reshape(-1, size**axes, axes)
        assert (blocks == blocks[:, :1]).all()


def test_equal_cells_keep_their_order():
    assert morton_order(np.zeros((5, 2), np.int64), bits=4).tolist() == [0, 1, 2, 3, 4]
