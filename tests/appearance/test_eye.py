"""Painted eyes: pupils where they look, and shade where the lids are."""

from __future__ import annotations

import numpy as np
from drawing import held

from facewrinkle.appearance.eye import PaintedEye


def blink(face):
    """Base points with both eyes closed."""
    return np.asarray(held("AU43").points)[: face.mesh.n_points]


def test_pupil_is_where_the_eye_looks(face):
    for eye in face.eyes:
        painted = PaintedEye(eye, face)
        for gaze in (eye.gaze, np.array([0.48, 0.0, np.sqrt(1.0 - 0.48**2)])):
            ball = painted.at(face.points, gaze)
            dark = np.asarray(ball["paint"]).max(axis=1) < 12
            dark &= (ball.points - eye.centre) @ gaze > 0.96 * eye.radius
            assert dark.sum() > 100
            middle = ball.points[dark].mean(axis=0) - eye.centre
            assert middle @ gaze / np.linalg.norm(middle) > np.cos(np.radians(1.0))
            np.testing.assert_allclose(np.linalg.norm(ball.points - eye.centre, axis=1), eye.radius, rtol=1e-5)


def test_eye_is_darker_under_the_upper_lid_wherever_it_is(face):
    eye = face.eyes[0]
    painted = PaintedEye(eye, face)
    first, second = (painted.at(points)["paint"].astype(int) for points in (face.points, blink(face)))
    assert second.mean() < 0.85 * first.mean()
    upper = face.eyelid_openings[eye.side].upper
    ball = painted.at(face.points)
    top = face.points[upper][:, 1].max()
    white = (ball.points[:, 0] - eye.centre[0] > 6.5) & (ball.points[:, 0] - eye.centre[0] < 8.5)
    height = ball.points[:, 1]
    near, far = white & (np.abs(height - top + 3.0) < 1.0), white & (np.abs(height - eye.centre[1]) < 1.0)
    assert near.any()
    assert first[near].mean() < 0.9 * first[far].mean()
