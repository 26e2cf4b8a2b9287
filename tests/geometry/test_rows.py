"""Rows that are appended: the same as concatenating, whatever came before, and earlier arrays keep their values."""

from __future__ import annotations

import numpy as np
import pytest

from facewrinkle.geometry.refinement import Room


def columns(rng, n):
    return [rng.normal(size=n), rng.integers(9, size=(n, 3)).astype(np.int32), rng.random((n, 2)) < 0.5]


def test_the_same_as_concatenating():
    rng, room = np.random.default_rng(0), Room()
    now, kept = columns(rng, 5), []
    for step in range(40):
        before, new = [each.copy() for each in now], columns(rng, int(rng.integers(12)))
        if step % 7 == 3:  # some go, and what is left lies elsewhere
            some = rng.random(len(now[0])) < 0.5
            now, before = [each[some] for each in now], [each[some] for each in before]
        now = room.appended(now, new)
        for each, old, added in zip(now, before, new, strict=True):
            np.testing.assert_array_equal(each, np.concatenate([old, added]))
            assert each.dtype == old.dtype
            assert each.flags.c_contiguous
        kept.append([(each, each.copy()) for each in now])
    for arrays in kept:
        for each, copy in arrays:
            np.testing.assert_array_equal(each, copy)


@pytest.mark.parametrize("more", [0, 1, 100])
def test_two_futures_of_the_same_rows_are_independent(more):
    room = Room()
    (start,) = room.appended([np.zeros(8)], [np.zeros(more)])
    (one,), (other,) = (room.appended([start], [np.full(1, value)]) for value in (1.0, 2.0))
    assert one[-1] == 1.0
    assert other[-1] == 2.0
    assert not np.shares_memory(one, other)
    assert not start.any()
