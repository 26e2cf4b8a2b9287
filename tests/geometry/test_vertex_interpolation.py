"""Interpolation from some vertices of a mesh to all.

what                                 checked against
constants                            themselves, to rounding
linear and quadratic fields, flat    themselves
turns of a sphere                    the turn
values at nodes                      the values that were given
a slit                               the sides do not know each other
smoothness                           bend of the interpolated field between the triangles of the nodes
"""

import numpy as np
import pytest
import pyvista as pv
from scipy.spatial.transform import Rotation
from small_meshes import arrays

from facewrinkle.geometry.decimation import decimated
from facewrinkle.geometry.topology import unique_edges
from facewrinkle.geometry.vertex_interpolation import VertexInterpolation


def grid(n=81):
    """A flat sheet n - 1 wide, of edges 1."""
    return arrays(pv.Plane(i_size=n - 1.0, j_size=n - 1.0, i_resolution=n - 1, j_resolution=n - 1).triangulate())


def reduced(points, triangles, size):
    nodes, between = decimated(points, triangles, np.full(len(points), size))
    return nodes, VertexInterpolation(points, triangles, nodes, between)


@pytest.fixture(scope="module")
def flat():
    points, triangles = grid()
    return points, triangles, *reduced(points, triangles, 6.0)


@pytest.fixture(scope="module")
def ball():
    points, triangles = arrays(pv.Icosphere(radius=50.0, nsub=5))
    return points, triangles, *reduced(points, triangles, 10.0)


def test_constants_are_kept_to_rounding(flat, ball):
    for points, _, nodes, smooth in (flat, ball):
        constant = np.tile([1.0, -2.0, 0.5], (len(nodes), 1))
        np.testing.assert_allclose(smooth.at(constant), np.tile(constant[0], (len(points), 1)), rtol=0.0, atol=1e-13)
        assert not smooth.at(np.zeros((len(nodes), 3))).any()


def test_linear_fields_on_a_plane_are_exact_and_quadratic_ones_nearly(flat):
    points, _, nodes, smooth = flat
    x, y, _ = points.T
    linear = np.column_stack([x, y - 2.0 * x, 3.0 * y + 1.0])
    np.testing.assert_allclose(smooth.at(linear[nodes]), linear, atol=1e-5)
    quadratic = np.column_stack([x**2, x * y, y**2]) / 40.0
    error = np.abs(smooth.at(quadratic[nodes]) - quadratic)
    assert error[np.abs(points[:, :2]).max(axis=1) < 30.0].max() < 0.01
    assert error.max() < 0.3  # at the border; linear interpolation between nodes 9 apart is off by 0.5


def test_turns_of_a_ball_are_nearly_exact(ball):
    points, _, nodes, smooth = ball
    turn = Rotation.from_rotvec([0.2, -0.1, 0.15]).apply(points) - points
    assert np.linalg.norm(turn, axis=1).max() > 10.0
    assert np.abs(smooth.at(turn[nodes]) - turn).max() < 0.05


def test_no_triangles_of_the_nodes_are_seen(ball):
    """Second differences along lines of the fine mesh: linear interpolation bends only at edges between nodes."""
    points, triangles, nodes, smooth = ball
    wave = 5.0 * np.sin(points[:, :1] / 25.0) * [0.0, 0.0, 1.0]
    error = smooth.at(wave[nodes]) - wave
    edges, _ = unique_edges(triangles)
    slope = np.linalg.norm(error[edges[:, 0]] - error[edges[:, 1]], axis=1)
    slope /= np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    assert slope.max() < 0.02  # of a field whose slope is 0.2; linear interpolation is off by about 0.03 to 0.04


def test_the_sides_of_a_slit_do_not_know_each_other():
    points, triangles = grid()
    n = 81
    # The sheet is cut along y = 0 from x = -20 to x = 20: vertices there are doubled.
    cut = np.flatnonzero((points[:, 1] == 0.0) & (np.abs(points[:, 0]) <= 20.0))
    double = np.arange(len(points))
    double[cut] = len(points) + np.arange(len(cut))
    above = points[triangles].mean(axis=1)[:, 1] > 0.0
    triangles = np.where(above[:, None], double[triangles], triangles).astype(np.int32)
    points = np.concatenate([points, points[cut]])
    ends = np.flatnonzero(np.abs(points[:, 0]) == 20.0)
    assert len(points) == n * n + 41
    assert len(ends) > 0
    nodes, smooth = reduced(points, triangles, 5.0)
    middle = np.abs(points[:, 0]) < 6.0
    near = middle & (np.abs(points[:, 1]) < 3.0)
    upper = np.zeros(len(points), bool)
    upper[np.unique(triangles[above])] = True
    jump = np.where(upper[:, None], [0.0, 1.0, 0.0], 0.0)
    np.testing.assert_allclose(smooth.at(jump[nodes])[near], jump[near], atol=1e-9)


def test_one_node_moves_a_whole_piece():
    points, triangles = grid(21)
    smooth = VertexInterpolation(points, triangles, np.array([0, 1, 21]), np.array([[0, 1, 2]], np.int32))
    np.testing.assert_allclose(smooth.at(np.ones((3, 3))), 1.0)
