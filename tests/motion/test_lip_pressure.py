"""The pressure with which a muscle closes the lips.

what                    checked against
what lips face          every vertex with every triangle
forces                  their sum and moment: they move nothing as a whole; towards each other
"""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.motion.lip_surfaces import _facing, _seen, closing_forces


def lowest_under(local, i, triangles, sign, far):
    """The triangle that vertex i sees, by looking at all of them: its gap and its number."""
    seen = []
    for t, corners in enumerate(triangles):
        if i in corners:
            continue
        flat = np.vstack([local[corners][:, [0, 2]].T, np.ones(3)])
        if abs(np.linalg.det(flat)) < 1e-12:
            continue
        share = np.linalg.solve(flat, [*local[i, [0, 2]], 1.0])
        gap = sign * (local[i, 1] - share @ local[corners, 1])
        if share.min() >= 0.0 and 0.0 <= gap < far:
            seen.append((gap, t))
    return min(seen, default=None)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_nearest_triangle_is_found_among_large_and_small_ones(sign):
    rng = np.random.default_rng(11)
    large, small = rng.uniform(-1.0, 1.0, (12, 3, 3)), rng.uniform(-1.0, 1.0, (60, 1, 3))
    corners = np.concatenate([large, small + rng.uniform(-0.05, 0.05, (60, 3, 3))])
    local = np.concatenate([corners.reshape(-1, 3), rng.uniform(-1.0, 1.0, (80, 3))])
    triangles = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
    own = np.arange(100, len(local))
    vertices, found, shares, gaps, signs = _seen(local, own, triangles, sign, 0.6)
    expected = {i: hit for i in own if (hit := lowest_under(local, i, triangles, sign, 0.6))}
    assert 20 < len(expected) < len(own)
    assert {t < 12 for _, t in expected.values()} == {True, False}
    assert vertices.tolist() == list(expected)
    assert found.tolist() == [triangles[t].tolist() for _, t in expected.values()]
    np.testing.assert_allclose(gaps, [gap for gap, _ in expected.values()], atol=1e-9)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-12)
    assert set(signs) == {sign}


def test_nothing_is_seen_where_there_is_nothing():
    nothing, triangle = np.empty(0, int), np.array([[0, 1, 2]], np.int32)
    for own, triangles in ((nothing, triangle), (np.arange(3), triangle[:0]), (np.arange(3), triangle)):
        assert all(len(part) == 0 for part in _seen(np.eye(3), own, triangles, 1.0, 9.0))


@pytest.mark.parametrize("stem", [None, "ict_face_narrow", "makehuman_head_male"])
def test_lips_face_each_other_along_the_height(face, real_face, stem):
    face = face if stem is None else real_face(stem)
    points, up = face.points * face.unit, face.frame.axes[1]
    vertices, corners, shares, signs = _facing(face)
    assert len(vertices) > 20
    way = points[vertices] - np.einsum("kc,kcj->kj", shares, points[corners])
    height = way @ up
    np.testing.assert_allclose(way, height[:, None] * up, atol=1e-9)
    assert (signs * height >= 0.0).all()
    middle = 0.5 * (face.landmarks["upper_lip_mid"] + face.landmarks["lower_lip_mid"]) @ up * face.unit
    assert (points[vertices[signs > 0]] @ up > middle - 2.0).all()  # upper lip
    assert not set(vertices[signs > 0]) & set(vertices[signs < 0])


def test_the_pressure_of_the_lips_on_each_other_moves_nothing_as_a_whole(face):
    rng = np.random.default_rng(0)
    area = rng.uniform(0.5, 2.0, len(face.points))
    forces = closing_forces(face, area)
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.cross(face.points, forces).sum(axis=0), 0.0, atol=1e-8)
    vertices, corners, shares, signs = _facing(face)
    opposite = np.einsum("kc,kci->ki", shares, forces[corners])
    parting = ((forces[vertices] - opposite) @ face.frame.axes[1]) * signs
    assert (parting < 0.0).all()
    # Twice the area, twice the force.
    np.testing.assert_allclose(closing_forces(face, 2.0 * area), 2.0 * forces, rtol=1e-12)
