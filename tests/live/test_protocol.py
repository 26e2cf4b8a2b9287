"""Messages between pages and the studio.

what pages send  | whatever comes is a command with checked arguments, or an error of the package
what they get    | what is decoded is what was encoded; what a page has is not sent again
"""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from studio_pages import decoded, restored

from facewrinkle.errors import FaceWrinkleError
from facewrinkle.live.protocol import COMMANDS, Box, Part, key_of, message, parse, small_normals
from facewrinkle.schemas import kinds_of

VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8)),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=8), inner, max_size=4)),
    max_leaves=12,
)


@settings(max_examples=80)
@given(st.one_of(st.text(), VALUES.map(json.dumps)))
def test_any_text_is_parsed_or_refused(text):
    assert key_of(text) is None
    with pytest.raises(FaceWrinkleError):
        parse(text)


@settings(max_examples=120)
@given(st.sampled_from(sorted(COMMANDS)), st.data())
def test_any_arguments_are_checked_or_refused(command, data):
    names = [name for name in kinds_of(COMMANDS[command]) if name != "id"]
    try:
        found = parse(json.dumps({"do": command} | {name: data.draw(VALUES) for name in names}))
    except FaceWrinkleError:
        return
    assert type(found) is COMMANDS[command]
    assert found.id == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "must be a JSON object"),
        ("[]", "must be a JSON object"),
        ("[" * 100_000, "must be a JSON object"),
        ('{"do": "undo", "id": -1}', "undo.id must be at least 0, received -1"),
        ('{"do": "undo", "id": true}', "undo.id must be a whole number"),
        ('{"do": "undo", "more": 1}', "unknown entry of undo 'more'"),
        ('{"do": "field"}', "field must have an entry name"),
        ('{"do": "undone"}', "unknown command 'undone'. Did you mean 'undo'"),
        ('{"do": 3}', "unknown command '3'"),
        ('{"do": "pose", "time": "soon"}', "pose.time must be a number, received 'soon'"),
        ('{"do": "pose", "time": 1e999}', "pose.time must be at most 600, received inf"),
        ('{"do": "pose", "time": NaN}', "must be a JSON object"),
        ('{"do": "pose", "time": 1e99}', r"pose.time must be at most 600, received 1e\+99"),
        ('{"do": "field", "name": "\\ud800"}', "must be a JSON object"),
        ('{"do": "pose", "time": "nan"}', "pose.time must be a number"),
        (
            '{"do": "probe", "corners": [0, 1, 2], "shares": [2, 0, 0], "version": 1}',
            r"probe.shares\[0\] must be at most 1",
        ),
        ('{"do": "pose", "time": Infinity}', "must be a JSON object"),
        ('{"do": "probe", "corners": [0, 1, -1], "shares": [1, 0, 0], "version": 1}', r"probe.corners\[2\] must be"),
        ('{"do": "save", "what": "glb", "camera": [1e99, 0, 0, 0, 0, 0]}', r"save.camera\[0\] must be"),
        ('{"do": "change", "gesture": "", "patches": [[["a", "b", "c", "d", "e"], 1]]}', "must have at most 4 entries"),
    ],
)
def test_errors_say_what_is_wrong(text, message):
    with pytest.raises(FaceWrinkleError, match=message):
        parse(text)


def test_the_key_is_that_of_the_first_message():
    assert key_of('{"do": "hello", "key": "secret"}') == "secret"
    assert key_of('{"do": "hello"}') == ""  # of a widget
    for text in ("", "{}", '{"do": "hello", "key": 3}', '{"do": "undo", "key": "a"}'):
        assert key_of(text) is None


# --- what a page is sent -------------------------------------------------------------------------

ARRAYS = st.sampled_from(["uint8", "int8", "uint16", "uint32", "float32"]).flatmap(
    lambda name: arrays(
        np.dtype(name),
        st.tuples(st.integers(0, 7), st.integers(1, 4)),
        elements={"allow_nan": False} if "f" in name else None,
    )
)


@settings(max_examples=50)
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
    again = restored(box.quantized(points), [*box.low, box.size])
    assert np.abs(again - points).max() <= 0.5 * box.size / 65535 * (1 + 1e-6)


def test_what_is_outside_the_box_comes_to_its_border():
    box = Box(np.zeros(3), 1.0)
    outside = np.array([[-5.0, 0.5, 7.0]])
    assert not box.holds(outside)
    assert box.quantized(outside).tolist() == [[0, 32768, 65535]]


def test_normals_keep_their_direction():
    random = np.random.default_rng(0).normal(size=(500, 3))
    normals = random / np.linalg.norm(random, axis=1, keepdims=True)
    small = small_normals(normals, np.linspace(0, 1, 500))
    back = small[:, :3] / np.linalg.norm(small[:, :3], axis=1, keepdims=True)
    assert np.degrees(np.arccos(np.clip((back * normals).sum(axis=1), -1, 1))).max() < 0.5
    assert np.abs(small[:, 3] / 127 - np.linspace(0, 1, 500)).max() <= 0.5 / 127 + 1e-9
