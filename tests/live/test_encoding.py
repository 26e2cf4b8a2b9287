"""Parts as bytes: what is decoded is what was encoded; what a page has is not sent again."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from facewrinkle.live.encoding import CODES, FEW, Box, Part, decoded, message, small_normals

ARRAYS = st.sampled_from(sorted(CODES)).flatmap(
    lambda name: arrays(
        np.dtype(name),
        st.tuples(st.integers(0, 7), st.integers(1, 4)),
        elements={"allow_nan": False} if "f" in name else None,
    )
)


@settings(max_examples=100)
@given(
    st.dictionaries(st.text(max_size=4), ARRAYS, max_size=5), st.dictionaries(st.text(max_size=4), ARRAYS, max_size=5)
)
def test_arrays_survive(fixed, moving):
    moving = {f"m{name}": values for name, values in moving.items()}
    fixed = {f"f{name}": values for name, values in fixed.items()}
    data, known = message({"step": 3}, [Part("a", "mesh", 1, 1, fixed, moving)], {})
    head, found = decoded(data)
    assert head["step"] == 3
    assert found["a"].keys() == (fixed | moving).keys()
    for name, values in (fixed | moving).items():
        assert np.array_equal(found["a"][name], values.reshape(-1, values.shape[1]))
        assert found["a"][name].dtype == values.dtype
    assert decoded(message({}, [Part("a", "mesh", 1, 1, fixed, moving)], known)[0])[1] == {"a": {}}
    assert decoded(message({}, [Part("a", "mesh", 1, 2, fixed, moving)], known)[0])[1]["a"].keys() == moving.keys()
    assert (
        decoded(message({}, [Part("a", "mesh", 2, 2, fixed, moving)], known)[0])[1]["a"].keys()
        == (fixed | moving).keys()
    )


@settings(max_examples=100)
@given(arrays(np.float64, st.tuples(st.integers(1, 20), st.just(3)), elements=st.floats(-1e4, 1e4)))
def test_positions_are_exact_to_half_a_step(points):
    box = Box.around(points, points + 1.0)
    assert box.holds(points)
    assert np.abs(box.restored(box.quantised(points)) - points).max() <= 0.5 * box.step * (1 + 1e-6)


def test_what_is_outside_the_box_comes_to_its_border():
    box = Box(np.zeros(3), 1.0)
    outside = np.array([[-5.0, 0.5, 7.0]])
    assert not box.holds(outside)
    assert box.quantised(outside).tolist() == [[0, 32768, 65535]]


def test_normals_keep_their_direction():
    random = np.random.default_rng(0).normal(size=(500, 3))
    normals = random / np.linalg.norm(random, axis=1, keepdims=True)
    small = small_normals(normals, np.linspace(0, 1, 500))
    back = small[:, :3] / np.linalg.norm(small[:, :3], axis=1, keepdims=True)
    assert np.degrees(np.arccos(np.clip((back * normals).sum(axis=1), -1, 1))).max() < 0.5
    assert np.abs(small[:, 3] / 127 - np.linspace(0, 1, 500)).max() <= 0.5 / 127 + 1e-9


@settings(max_examples=100)
@given(st.data())
def test_rows_that_changed_are_put_into_what_there_was(data):
    """A page that adds up what it is sent has what the server has, as arrays grow, shrink and change their type."""
    known, has = {}, {}
    for step in range(1, 5):
        n = data.draw(st.sampled_from([0, FEW - 1, FEW, 2 * FEW]))
        dtype = data.draw(st.sampled_from([np.uint16, np.uint32]))
        values = np.zeros((n, 3), dtype)
        few = data.draw(st.lists(st.integers(0, max(n - 1, 0)), max_size=5 if n else 0))
        values[few] = step
        sent, known = message({}, [Part("a", "mesh", step, step, {"x": values})], known)
        has = decoded(sent, has)[1]
        assert has["a"]["x"].dtype == dtype
        assert np.array_equal(has["a"]["x"], values)
