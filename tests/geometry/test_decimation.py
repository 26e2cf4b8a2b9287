"""Decimation of triangle meshes.

what                            checked against
topology                        that of the given mesh: Euler characteristic, loops, manifold edges, orientation
vertices                        a subset; those that lines hold; the neighbors along lines
lengths of edges                those that were asked for
triangles                       none turns over on a bumpy sheet; shapes on a sphere
"""

import numpy as np
import pyvista as pv
from hypothesis import example, given, settings
from hypothesis import strategies as st
from small_meshes import area_vectors, delaunay

from facewrinkle.geometry.decimation import FACING, LEAST_OF_LINE, decimated
from facewrinkle.geometry.normals import unit, vertex_normals
from facewrinkle.geometry.topology import (
    boundary_loops,
    components,
    euler_characteristic,
    is_oriented,
    non_manifold_edges,
    unique_edges,
)


def sheet(seed, count=400, holes=2):
    """A bumpy sheet of random triangles with some holes, and a surface normal that points up everywhere."""
    rng = np.random.default_rng(seed)
    flat = rng.uniform(-1.0, 1.0, (count, 2))
    triangles = delaunay(flat)
    centres = flat[triangles].mean(axis=1)
    for centre in rng.uniform(-0.6, 0.6, (holes, 2)):
        triangles, centres = (part[np.linalg.norm(centres - centre, axis=1) > 0.2] for part in (triangles, centres))
    height = 0.1 * np.sin(3.0 * flat[:, 0] + rng.uniform()) * np.cos(2.0 * flat[:, 1])
    return np.column_stack([flat, height]), triangles.astype(np.int32)


def facing(points, triangles, normals):
    """Least cosine between the normal of each triangle and those at its corners."""
    return np.einsum("ij,ikj->ik", unit(area_vectors(points, triangles)), normals[triangles]).min(axis=1)


def lengths(points, triangles):
    edges, _ = unique_edges(triangles)
    return np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.floats(0.02, 1.0), st.integers(0, 3))
@example(16208, 1.0, 0)  # a sliver at the rim that is nearly upright
def test_topology_stays_and_no_triangle_turns_over(seed, size, holes):
    points, triangles = sheet(seed, holes=holes)
    vertices, fewer = decimated(points, triangles, np.full(len(points), size))
    assert np.isin(vertices, np.unique(triangles)).all()
    assert np.array_equal(np.unique(fewer), np.arange(len(vertices)))
    assert euler_characteristic(fewer) == euler_characteristic(triangles)
    assert not len(non_manifold_edges(fewer))
    assert is_oriented(fewer)
    assert components(fewer).max() == components(triangles).max()
    assert len(np.unique(np.sort(fewer, axis=1), axis=0)) == len(fewer)
    before, after = boundary_loops(triangles), boundary_loops(fewer)
    assert len(before) == len(after)
    rims = [set(loop.tolist()) for loop in before]
    for loop in after:
        # Each loop keeps to the vertices of one of the given loops, or of those that touch each other.
        assert any(set(vertices[loop].tolist()) <= rim for rim in rims) or any(
            rims[i] & rims[j] for i in range(len(rims)) for j in range(i)
        )
    normals = vertex_normals(points, triangles)
    least = facing(points, triangles, normals).min()  # of slivers at the rim
    assert facing(points[vertices], fewer, normals[vertices]).min() >= min(FACING, least) - 1e-12


def test_edges_are_about_as_long_as_wanted():
    ball = pv.Icosphere(radius=50.0, nsub=5)
    points, triangles = ball.points.astype(float), ball.regular_faces
    vertices, fewer = decimated(points, triangles, np.where(points[:, 2] > 0.0, 5.0, 10.0))
    kept, edges = points[vertices], unique_edges(fewer)[0]
    length = lengths(kept, fewer)
    for sign, wanted in ((1.0, 5.0), (-1.0, 10.0)):
        inside = (sign * kept[edges][:, :, 2] > 8.0).all(axis=1)
        assert 0.85 < np.median(length[inside]) / wanted < 1.2
        assert length[inside].max() < 1.7 * wanted
    assert euler_characteristic(fewer) == 2


def test_every_removed_vertex_was_too_close_and_a_coarse_mesh_stays():
    ball = pv.Icosphere(radius=50.0, nsub=3)
    points, triangles = ball.points.astype(float), ball.regular_faces
    vertices, fewer = decimated(points, triangles, np.full(len(points), 5.0))
    assert np.array_equal(vertices, np.arange(len(points)))
    assert np.array_equal(fewer, triangles)


def test_lines_stay_lines():
    points, triangles = sheet(3, holes=0)
    edges, _ = unique_edges(triangles)
    across = edges[(points[edges][:, :, 0] > 0.0).sum(axis=1) == 1]
    # The border between what is left and right of the middle, as a path of edges.
    left = (points[triangles].mean(axis=1)[:, 0] < 0.0)[:, None]
    sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 3, 2), axis=2)
    ours, theirs = sides[left[:, 0]].reshape(-1, 2), sides[~left[:, 0]].reshape(-1, 2)
    line = np.array(sorted(set(map(tuple, ours)) & set(map(tuple, theirs))))
    assert len(line) > 10
    assert len(across) > 10
    vertices, fewer = decimated(points, triangles, np.full(len(points), 0.4), line)
    now = np.sort(vertices[unique_edges(fewer)[0]], axis=1)
    on_line = now[np.isin(now, line).all(axis=1)]
    ends = np.flatnonzero(np.bincount(line.ravel(), minlength=len(points)) == 1)
    assert len(ends) == 2
    assert np.isin(ends, vertices).all()
    degree = np.bincount(on_line.ravel(), minlength=len(points))
    assert (degree[np.intersect1d(line, vertices)] >= 1).all()
    assert len(np.intersect1d(line, vertices)) < len(np.unique(line))


def test_small_loops_keep_their_vertices():
    points, triangles = sheet(5, count=1500, holes=1)
    sizes = [len(loop) for loop in boundary_loops(triangles)]
    vertices, fewer = decimated(points, triangles, np.full(len(points), 10.0))
    assert len(vertices) < 0.2 * len(points)
    assert all(len(loop) >= min(LEAST_OF_LINE, *sizes) for loop in boundary_loops(fewer))
