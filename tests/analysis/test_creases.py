"""Cuts across creases: known profiles; steps of flesh in the young, lines in the old, on every face and as captured."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from real_faces import FACES

from analysis.creases import CREASES, Cut, captured_creases, creases
from analysis.motion import read_shapes

young = lru_cache(maxsize=2)(creases)
"""The creases of a face at age 0, found once."""

PLACE = np.linspace(-8.0, 8.0, 161)


def test_a_known_valley_is_measured():
    """Walls of 20 degrees on the far side of the line, 30 on the other, in a plane that leans by 10."""
    far, near = np.tan(np.radians([20.0, 30.0]))
    height = np.where(PLACE < 0.0, -far, near) * PLACE
    cut = Cut(PLACE, height, np.stack([PLACE, height], axis=1))
    assert cut.turn == pytest.approx(20.0)
    assert cut.bend == pytest.approx(50.0)
    assert cut.slopes == pytest.approx((-20.0, 30.0))
    assert cut.sharpest == pytest.approx(50.0)


def test_a_step_does_not_turn_back():
    height = 1.0 / (1.0 + np.exp(-PLACE))
    cut = Cut(PLACE, height, np.stack([PLACE, height], axis=1))
    assert cut.turn == 0.0
    assert cut.slopes[0] >= 0.0


@pytest.mark.parametrize("any_face", [None, "ict_face_narrow"], indirect=True)
def test_young_creases_are_steps_of_flesh(any_face):
    """Captured skin, which is smooth over a millimeter or two, bends by up to 33 degrees/mm."""
    found = {row.crease: row for row, _ in young(any_face)}
    assert set(found) == set(CREASES)
    for row in found.values():
        assert row.turn < 10.0, row
        assert row.bend < 25.0, row
    assert min(found[name].turn for name in ("beside the nose", "corner of the mouth")) > 3.0  # they are there


def test_creases_sharpen_with_age(face):
    before, old = ({row.crease: row for row, _ in rows} for rows in (young(face), creases(face, 1.0)))
    for name in ("beside the nose", "corner of the mouth", "below the corner", "between the brows"):
        if name != "between the brows":  # there the old keep less, or they look cross
            assert old[name].turn > before[name].turn
        assert old[name].bend > 1.8 * before[name].bend


def test_a_smile_slopes_as_captured_skin_does(real_face):
    """Across the fold of the mean captured face, in front of the plane of the face."""
    face = real_face("ict_face_narrow")
    shapes = read_shapes(FACES / "ict_face_expressions.npz", len(face.points), 10.0)
    truth, ours = ({row.crease: row for row, _ in rows} for rows in (captured_creases(face, shapes), young(face)))
    smile, captured = ours["beside the nose"], truth["beside the nose"]
    np.testing.assert_allclose(smile.slopes, captured.slopes, atol=10.0)
    assert 0.5 * captured.sharpest < smile.sharpest < 1.5 * captured.sharpest
