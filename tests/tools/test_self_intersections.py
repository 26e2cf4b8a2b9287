"""Intersections of a mesh with itself: checked against pymeshlab, and on meshes that are known to cross or not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from small_meshes import arrays, sphere

from tools.self_intersections import self_intersections


def ball():
    return arrays(sphere((0.0, 0.0, 0.0), 1.0, 16))


def crossed(points, triangles):
    mask = np.zeros(len(triangles), bool)
    mask[self_intersections(points, triangles)] = True
    return mask


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 0.6), st.sampled_from([1e-6, 1.0, 1e7]))
def test_the_same_triangles_as_pymeshlab(seed, spread, scale):
    pymeshlab = pytest.importorskip("pymeshlab")
    random = np.random.default_rng(seed)
    points, triangles = ball()
    points = scale * (points + random.normal(0.0, spread * 0.2, points.shape))
    work = pymeshlab.MeshSet(verbose=False)
    work.add_mesh(pymeshlab.Mesh(points / scale, triangles))
    work.compute_selection_by_self_intersections_per_face()
    np.testing.assert_array_equal(crossed(points, triangles), work.current_mesh().face_selection_array())


def test_every_pair_of_a_soup():
    """All pairs, tried one by one: a triangle crosses another where the signed volumes say so."""
    random = np.random.default_rng(5)
    points = random.normal(size=(60, 3)) + np.repeat(random.normal(0.0, 1.5, (20, 3)), 3, axis=0)
    triangles = random.permutation(60).reshape(20, 3)

    def volume(a, b, c, d):
        return np.linalg.det([b - a, c - a, d - a])

    expected = set()
    for one in range(20):
        for other in set(range(20)) - {one}:
            a, b, c = points[triangles[other]]
            for k in range(3):
                p, q = points[triangles[one, k]], points[triangles[one, (k + 1) % 3]]
                around = {volume(p, q, *side) > 0 for side in ((a, b), (b, c), (c, a))}
                if volume(a, b, c, p) * volume(a, b, c, q) < 0 and len(around) == 1:
                    expected.add((one, other))
    assert len(expected) > 10
    assert set(map(tuple, self_intersections(points, triangles).tolist())) == expected


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1])
def test_neighbors_and_touching_sheets_do_not_cross(angle):
    turn = Rotation.from_rotvec([angle, 0.5 * angle, -angle]).as_matrix()
    points, triangles = ball()
    assert not len(self_intersections(points @ turn.T, triangles))
    apart = points[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)  # a soup, side by side
    assert not len(self_intersections(apart[0] @ turn.T, apart[1]))
    on_each_other = np.vstack([triangles, triangles[:, ::-1] + len(points)])
    assert not len(self_intersections(np.vstack([points, points]) @ turn.T, on_each_other))


def test_nothing_crosses_nothing():
    assert self_intersections(np.zeros((3, 3)), np.zeros((0, 3), int)).shape == (0, 2)
    assert not len(self_intersections(np.eye(3), np.array([[0, 1, 2]])))
