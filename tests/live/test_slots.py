"""Lasting places: things keep theirs, none is shared, and what is compact has no holes."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from facewrinkle.live.slots import FREE, keys_of, placed

THINGS = st.lists(st.sets(st.integers(1, 40)), min_size=1, max_size=6)


@settings(max_examples=200)
@given(THINGS, st.booleans())
def test_things_keep_their_places(steps, compact):
    before, where = np.empty(0, np.uint64), {}
    for things in steps:
        keys = np.array(sorted(things), np.uint64)
        places, before = placed(before, keys, compact)
        assert len(set(places.tolist())) == len(keys)
        assert np.array_equal(before[places], keys)
        assert np.count_nonzero(before != FREE) == len(keys)
        if compact:
            assert sorted(places.tolist()) == list(range(len(keys)))
        now = dict(zip(keys.tolist(), places.tolist(), strict=True))
        for key, place in now.items():
            if key in where and (not compact or where[key] < len(keys)):
                assert place == where[key]
        where = now


@settings(max_examples=100)
@given(st.lists(st.tuples(st.integers(-2, 2), st.integers(-2, 2)), max_size=30))
def test_keys_are_those_of_values_and_all_different(rows):
    keys = keys_of(np.array(rows, np.float64).reshape(-1, 2))
    assert len(set(keys.tolist())) == len(rows)
    assert FREE not in keys
    first = dict(reversed(list(zip(rows, keys.tolist(), strict=True))))
    alone = keys_of(np.array(sorted(first), np.float64).reshape(-1, 2))
    assert [first[row] for row in sorted(first)] == alone.tolist()
