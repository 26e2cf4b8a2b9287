"""The measures of soundness against known cases, and expressions that keep the skin sound."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from analysis.folds import Orientation, Soundness, mixtures, report, soundness


def test_turning_and_scaling_turn_nothing_over(face):
    orientation = Orientation(face.points, face.triangles)
    turn = Rotation.from_rotvec([0.4, 2.0, -0.7]).as_matrix()
    np.testing.assert_allclose(orientation.shares(2.0 * face.points @ turn.T + [5.0, 3.0, 1.0]), 4.0)


def test_a_vertex_that_is_pulled_across_its_ring_turns_triangles_over(face):
    points, triangles = face.points.copy(), face.triangles
    chosen = triangles[np.argmax(points[triangles, 1].mean(axis=1) * (np.abs(points[triangles, 0]).max(axis=1) < 20.0))]
    i, others = chosen[0], chosen[1:]
    points[i] += 2.0 * (points[others].mean(axis=0) - points[i])
    over = Orientation(face.points, triangles).shares(points) < 0.0
    assert over.any()
    assert (triangles[over] == i).any(axis=1).all()


def test_mixtures_are_all_expressions_and_pairs_of_them(face):
    names = [names for names, _ in mixtures(face)]
    alone = {n[0] for n in names if len(n) == 1}
    assert len(names) == len(set(names)) == len(alone) * (len(alone) + 1) // 2
    assert set(face.atlas.expressions) <= alone
    assert all(0.0 <= rate <= 1.0 for _, rates in mixtures(face, every=50) for rate in rates.values())


def test_expressions_and_some_of_their_pairs_keep_the_head_sound(face):
    for row in soundness(face, every=29):
        assert row.turned_over == 0, row
        assert row.in_eyes < 0.1, row
        assert row.in_lips < 0.1, row


def test_the_report_lists_what_is_not_sound():
    sound, over, deep = (
        Soundness(("a",), 0, -0.2, 0.0),
        Soundness(("b", "c"), 3, 0.0, 0.0),
        Soundness(("d",), 0, 0.0, 0.5),
    )
    made = report([sound, over, deep])
    assert made.tables[0].rows == [("b + c", 3, 0.0, 0.0), ("d", 0, 0.0, 0.5)]
    assert made.numbers == {"mixtures": 3, "turned over": 1, "in eyes": 0.0, "in lips": 0.5}
    assert report([sound]).tables[0].rows == []


@pytest.mark.parametrize("stem", ["ict_face_narrow", "makehuman_head_male"])
def test_expressions_keep_real_faces_sound(real_face, stem):
    """But for slivers in the corners of the mouth of one of them, where the lips purse."""
    face = real_face(stem)
    rates = dict(mixtures(face, every=10**6))
    for row in soundness(face, every=10**6):
        pursed = stem.startswith("ict") and rates[row.names].get("orbicularis_oris", 0.0) > 0.5
        assert row.turned_over <= (4 if pursed else 0), row
        assert row.in_eyes < 0.1, row
        assert row.in_lips < 0.1, row
