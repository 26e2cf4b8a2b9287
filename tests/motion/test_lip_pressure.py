"""What the lips meet, and the pressure with which a muscle closes them.

what                    checked against
partners along a line   where the line meets the planes of all triangles; densely sampled sides, beside it
forces                  their sum and moment: they move nothing as a whole; towards each other
"""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.motion.self_contact import CLOSE_BY, around_mouth, closing_forces, reached


def hits(triangles, place, direction):
    """Where a line meets triangles: their numbers, and how far along it."""
    found = {}
    for number, (a, b, c) in enumerate(triangles):
        weights = np.linalg.solve(np.array([b - a, c - a, -direction]).T, place - a)
        if min(weights[0], weights[1], 1.0 - weights[0] - weights[1]) >= 0.0:
            found[number] = abs(weights[2])
    return found


def test_the_nearest_triangle_on_a_line_is_found_among_large_and_small_ones():
    rng = np.random.default_rng(11)
    small = rng.uniform(-1.0, 1.0, (60, 1, 3)) + rng.uniform(-0.05, 0.05, (60, 3, 3))
    triangles = 3.0 * np.concatenate([rng.uniform(-1.0, 1.0, (12, 3, 3)), small])
    reaching = 0
    for place in rng.uniform(-3.0, 3.0, (80, 3)):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        number, weights, beside = reached(triangles, place, direction)
        foot = weights @ triangles[number] - place
        assert weights.sum() == pytest.approx(1.0)
        found = hits(triangles, place, direction)
        if found:
            reaching += 1
            assert beside < CLOSE_BY
            assert number == min(found, key=found.get)
            np.testing.assert_allclose(foot, (foot @ direction) * direction, atol=1e-4)
    assert 20 < reaching < 75


def test_the_nearest_triangle_beside_a_line_is_that_of_densely_sampled_sides():
    rng = np.random.default_rng(4)
    triangles, share = rng.normal(size=(4, 3, 3)), np.linspace(0.0, 1.0, 2001)[:, None]
    for place in rng.normal([8.0, 0.0, 0.0], size=(30, 3)):
        number, _, beside = reached(triangles, place, np.array([0.0, 1.0, 0.0]))
        sides = [np.concatenate([t[k] + share * (t[k - 1] - t[k]) for k in range(3)]) for t in triangles]
        away = [np.linalg.norm((side - place)[:, [0, 2]], axis=1).min() for side in sides]
        assert number == np.argmin(away)
        assert beside == pytest.approx(min(away), abs=1e-3)


def test_nothing_is_reached_where_there_is_nothing():
    assert reached(np.empty((0, 3, 3)), np.zeros(3), np.array([0.0, 1.0, 0.0]))[2] == np.inf


@pytest.mark.parametrize("stem", [None, "ict_face_narrow", "makehuman_head_male"])
def test_lips_are_pressed_on_each_other_along_the_height(face, real_face, stem):
    face = face if stem is None else real_face(stem)
    up, points = face.frame.axes[1], face.points * face.unit
    forces = closing_forces(face, np.ones(len(points)))
    along = forces @ up
    np.testing.assert_allclose(forces, along[:, None] * up, atol=1e-9)
    assert (along < -0.5).sum() > 20
    assert (along > 0.5).sum() > 20
    assert not along[~around_mouth(face)].any()
    middle = 0.5 * (face.landmarks["upper_lip_mid"] + face.landmarks["lower_lip_mid"]) @ up * face.unit
    assert (points[along < -0.5] @ up).mean() > middle > (points[along > 0.5] @ up).mean() - 2.0


def test_the_pressure_of_the_lips_on_each_other_moves_nothing_as_a_whole(face):
    rng = np.random.default_rng(0)
    area = rng.uniform(0.5, 2.0, len(face.points))
    forces = closing_forces(face, area)
    size = np.abs(forces).sum()
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-9)
    assert np.abs(np.cross(face.points, forces).sum(axis=0)).max() < CLOSE_BY * size
    # Twice the area, twice the force.
    np.testing.assert_allclose(closing_forces(face, 2.0 * area), 2.0 * forces, rtol=1e-12)
