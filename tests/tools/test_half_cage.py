"""The linings of the lips opposite each other, and the refusal of a head that crosses itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facewrinkle.anatomy.head import cage_data, load_head
from tools.build_head.build import refuse_crossings
from tools.build_head.half_cage import half_surface, lining_places, opposite_on_lips


def test_places_on_the_linings_run_from_lip_to_lip_and_inwards():
    half = half_surface(cage_data())
    places = lining_places(half)
    for ring, depth in ((3, 0.0), (4, 1.0)):
        for number in range(9):
            np.testing.assert_allclose(places[half.of(f"mouth_ring{ring}.{number}")], [number, depth], atol=1e-12)
    assert np.isnan(places[half.of("mouth_ring2.0")]).all()


def test_opposite_places_are_found_between_coarser_ones():
    upper = [[0.0, 0.0], [2.5, 0.0], [3.5, 0.0], [0.0, 1.0]]
    lower = [[4.0, 0.0], [5.0, 0.0], [5.5, 0.0], [8.0, 0.0], [8.0, 1.0]]
    rows = opposite_on_lips(np.array([*upper, *lower, [np.nan, np.nan]]))
    assert rows.tolist() == [[3, 3, 8, 8], [0, 3, 7, 7], [1, 1, 6, 6], [2, 2, 4, 5]]


def test_a_head_whose_lips_are_not_parted_is_refused():
    head = load_head()
    touching = replace(head.mould, lips=head.mould.lips[:0])
    eye = head.eyes[0]
    points = touching(np.array(list(cage_data()["points"].values())), eye.centre, eye.radius)
    with pytest.raises(ValueError, match="the head crosses itself: 118 triangles run through each other, around"):
        refuse_crossings(points, head.triangles)
    refuse_crossings(head.points, head.triangles)
