"""Rotations and shifts between two sets of points.

what               checked against
closest_rotations  scipy's `Rotation.align_vectors`; batches against one at a time; determinants for mirrored points
rigid_motion       a known rotation and shift, with some points that moved otherwise
"""

import numpy as np
from scipy.spatial.transform import Rotation

from facewrinkle.geometry.rigid_alignment import closest_rotations, rigid_motion


def test_rotations_are_those_of_scipy():
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(2, 20, 3))
    expected = Rotation.align_vectors(y, x)[0].as_matrix()
    assert np.allclose(closest_rotations(x.T @ y).T, expected, atol=1e-12)


def test_batches_are_as_one_at_a_time():
    covariances = np.random.default_rng(1).normal(size=(2, 5, 3, 3))
    turns = closest_rotations(covariances)
    assert turns.shape == (2, 5, 3, 3)
    assert np.allclose(np.linalg.det(turns), 1.0)
    assert np.allclose(turns[1, 2], closest_rotations(covariances[1, 2]), atol=1e-14)


def test_mirrored_points_are_not_mirrored_back():
    x = np.random.default_rng(2).normal(size=(20, 3))
    turn = closest_rotations(x.T @ (x * [-1.0, 1.0, 1.0]))
    assert np.isclose(np.linalg.det(turn), 1.0)


def test_points_that_moved_otherwise_do_not_count():
    rng = np.random.default_rng(3)
    rest = rng.normal(size=(200, 3))
    turn, shift = Rotation.from_rotvec([0.1, 0.2, -0.3]).as_matrix(), np.array([5.0, -2.0, 1.0])
    now = rest @ turn.T + shift
    now[:30] += rng.normal(size=(30, 3))
    pose = rigid_motion(rest, now, 1e-3)
    assert np.allclose(pose[:3, :3], turn, atol=1e-4)
    assert np.allclose(pose[:3, 3], shift, atol=1e-4)
