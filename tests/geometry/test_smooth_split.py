"""Split triangles: no cracks, rims stay, and new points lie on the ball that the corners are of."""

import numpy as np
import pytest
import pyvista as pv

from facewrinkle.geometry.smooth_split import lifted, smooth_split
from facewrinkle.geometry.topology import boundary_loops


def ball(cut=False):
    """Points, normals and triangles of a coarse ball of radius 10, or of half of it."""
    mesh = pv.Icosphere(radius=10.0, nsub=2)
    points, triangles = np.asarray(mesh.points, np.float64), np.asarray(mesh.regular_faces)
    if cut:
        triangles = triangles[points[triangles][..., 2].min(axis=1) > -1.0]
    return points, points / np.linalg.norm(points, axis=1, keepdims=True), triangles


def split_of(points, normals, triangles, **rules):
    return smooth_split(points, normals, triangles, **{"longest": 1.4, "bend": 9.0, "sagitta": 0.0} | rules)


def test_middles_lie_on_the_ball_and_the_corners_stay():
    points, normals, triangles = ball()
    places, upright = split_of(points, normals, triangles).places(points, normals)
    assert len(places) > 4 * len(points)
    np.testing.assert_array_equal(places[: len(points)], points)
    flat = np.linalg.norm(points[triangles].mean(axis=1), axis=1).min()
    assert np.abs(np.linalg.norm(places, axis=1) - 10.0).max() < 0.02 * (10.0 - flat)
    np.testing.assert_allclose(upright, places / np.linalg.norm(places, axis=1, keepdims=True), atol=2e-3)


def test_the_surface_stays_closed_and_its_sides_are_kept():
    points, normals, triangles = ball()
    split = split_of(points, normals, triangles, longest=3.0)  # some sides of many triangles
    assert len(triangles) < len(split.triangles) < 4 * len(triangles)
    assert not boundary_loops(split.triangles)
    a, b, c = split.places(points, normals)[0][split.triangles].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a) * (a + b + c)).sum(axis=1).min() > 0.0


def test_rims_stay_whole():
    points, normals, triangles = ball(cut=True)
    split = split_of(points, normals, triangles)
    (before,), (after,) = boundary_loops(triangles), boundary_loops(split.triangles)
    assert set(after) == set(before)


def test_only_edges_that_turn_are_split_where_none_is_long():
    points, normals, triangles = ball()
    assert not sum(map(len, split_of(points, normals, triangles, longest=99.0).rounds))
    assert len(split_of(points, normals, triangles, longest=99.0, bend=0.2).triangles) == 4 * len(triangles)
    flat = split_of(points, normals, triangles, longest=99.0, bend=0.2, sagitta=1.0)
    assert len(flat.triangles) == len(triangles)


@pytest.mark.parametrize("kind", [np.float32, np.uint8, np.int32])
def test_values_of_new_vertices_lie_between_those_of_their_parents(kind):
    points, normals, triangles = ball()
    split, given = split_of(points, normals, triangles), np.arange(len(points)).astype(kind)
    values = split.values(given)
    ends = split.rounds[0]
    assert values.dtype == kind
    np.testing.assert_array_equal(values[: len(points)], given)
    new = values[len(points) : len(points) + len(ends)].astype(float)
    low, high = np.sort(given[ends].astype(float), axis=1).T
    assert ((new >= low) & (new <= high)).all()


def test_shares_tell_where_the_corners_lie_in_the_parents():
    points, normals, triangles = ball()
    split = split_of(points, normals, triangles)
    flat = np.einsum("mck,mkd->mcd", split.shares, points[triangles[split.parent]])
    np.testing.assert_allclose(split.values(points)[split.triangles], flat, atol=1e-12)


def test_points_within_triangles_are_lifted_onto_the_ball():
    points, normals, triangles = ball()
    shares = np.random.default_rng(3).dirichlet([1.0, 1.0, 1.0], len(triangles))
    flat = np.einsum("mk,mkd->md", shares, points[triangles])
    onto = np.linalg.norm(lifted(flat, points[triangles], normals[triangles], shares), axis=1)
    assert np.abs(10.0 - onto).max() < 0.03 * (10.0 - np.linalg.norm(flat, axis=1)).max()
