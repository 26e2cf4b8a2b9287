"""The tongue by itself: a closed body that keeps its volume on its way out."""

from __future__ import annotations

import numpy as np
import pytest
from small_meshes import enclosed_volume

from facewrinkle.anatomy.tongue import lip_crest, tongue_paint, tongue_points, tongue_triangles
from facewrinkle.mesh import to_polydata

LIP = lip_crest(np.array([[0.0, 1.0, 10.0], [3.0, -4.0, 14.0]]))


@pytest.mark.parametrize("out", np.linspace(0.0, 1.0, 11))
def test_a_tongue_is_closed_and_keeps_its_volume(out):
    points, triangles = tongue_points(out, LIP), tongue_triangles()
    assert to_polydata(points, triangles).is_manifold
    assert len(points) == len(tongue_paint())
    at_rest = enclosed_volume(tongue_points(0.0, LIP), triangles)
    assert at_rest > 0.0  # seen from outside, triangles are counter-clockwise
    assert enclosed_volume(points, triangles) == pytest.approx(at_rest, rel=0.1)


def test_a_tongue_in_the_mouth_knows_nothing_of_the_lip():
    np.testing.assert_array_equal(tongue_points(0.0, LIP), tongue_points(0.0, LIP + 5.0))


def test_a_tongue_that_comes_out_lies_on_the_lip():
    higher = LIP + np.array([2.0, 3.0])
    np.testing.assert_allclose(tongue_points(1.0, higher)[-1] - tongue_points(1.0, LIP)[-1], [0.0, 2.0, 3.0])
    for crest in (LIP, higher):
        points = tongue_points(1.0, crest)
        over_lip = points[(np.abs(points[:, 0]) < 3.0) & (np.abs(points[:, 2] - (crest[1] - 6.0)) < 2.0)]
        assert 0.0 < over_lip[:, 1].min() - crest[0] < 2.0


def test_the_sides_of_a_lip_may_be_higher_than_its_middle():
    middle, side, higher_side = [0.0, 0.0, 9.0], [14.0, 1.5, 5.0], [14.0, 4.5, 5.0]
    np.testing.assert_array_equal(lip_crest(np.array([middle, side])), [0.0, 9.0])
    assert lip_crest(np.array([middle, higher_side]))[0] > 1.0
    assert np.isfinite(lip_crest(np.empty((0, 3)))).all()
