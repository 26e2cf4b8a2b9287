"""Parts as bytes: what is decoded is what was encoded; what a page has is not sent again."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from studio_pages import decoded, restored

from facewrinkle.live.protocol import Box, Part, message, small_normals

ARRAYS = st.sampled_from(["uint8", "int8", "uint16", "uint32", "float32"]).flatmap(
    lambda name: arrays(
        np.dtype(name),
        st.tuples(st.integers(0, 7), st.integers(1, 4)),
        elements={"allow_nan": False} if "f" in name else None,
    )
)


@settings(max_examples=100)
@given(st.dictionaries(st.text(max_size=4), ARRAYS, max_size=5), st.data())
def test_arrays_survive_and_the_same_ones_are_not_sent_again(values, data):
    sent, known = message({"step": 3}, [Part("a", "mesh", values, {"x": 1})], {})
    head, found = decoded(sent)
    assert head["step"] == 3
    assert head["parts"][0]["info"] == {"x": 1}
    assert found["a"].keys() == values.keys()
    for name, array in values.items():
        assert np.array_equal(found["a"][name], array.reshape(-1, array.shape[1]))
        assert found["a"][name].dtype == array.dtype
    others = {name for name in values if data.draw(st.booleans())}
    later = {name: array.copy() if name in others else array for name, array in values.items()}
    head, found = decoded(message({}, [Part("a", "mesh", later)], known)[0])
    assert found["a"].keys() == others
    assert head["parts"][0]["arrays"].keys() == values.keys()  # what is not named is gone


@settings(max_examples=100)
@given(arrays(np.float64, st.tuples(st.integers(1, 20), st.just(3)), elements=st.floats(-1e4, 1e4)))
def test_positions_are_exact_to_half_a_step(points):
    box = Box.around(points, points + 1.0)
    assert box.holds(points)
    again = restored(box.quantised(points), [*box.low, box.size])
    assert np.abs(again - points).max() <= 0.5 * box.size / 65535 * (1 + 1e-6)


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
