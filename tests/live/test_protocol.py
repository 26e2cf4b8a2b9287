"""The messages of pages: whatever comes is a command with checked arguments, or an error of the package."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facewrinkle.errors import FaceWrinkleError
from facewrinkle.live.protocol import COMMANDS, key_of, parse

VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8)),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=8), inner, max_size=4)),
    max_leaves=12,
)


@settings(max_examples=200)
@given(st.one_of(st.text(), VALUES.map(json.dumps)))
def test_any_text_is_parsed_or_refused(text):
    assert key_of(text) is None
    with pytest.raises(FaceWrinkleError):
        parse(text)


@settings(max_examples=300)
@given(st.sampled_from(sorted(COMMANDS)), st.data())
def test_any_arguments_are_checked_or_refused(command, data):
    names = [field for field in COMMANDS[command].__struct_fields__ if field != "id"]
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
        ('{"do": "undo", "id": -1}', "undo.id: expected `int` >= 0, received -1"),
        ('{"do": "undo", "id": true}', "undo.id: expected `int`, got `bool`"),
        ('{"do": "undo", "more": 1}', "unknown entry of undo 'more'"),
        ('{"do": "field"}', "field: object missing required field `name`"),
        ('{"do": "undone"}', "unknown command 'undone'. Did you mean 'undo'"),
        ('{"do": 3}', "unknown command '3'"),
        ('{"do": "pose", "time": "soon"}', "pose.time: expected `float`, got `str`, received 'soon'"),
        ('{"do": "pose", "time": 1e999}', "must be a JSON object: Number out of range"),
        ('{"do": "pose", "time": NaN}', "must be a JSON object"),
        ('{"do": "pose", "time": 1e99}', r"pose.time: expected `float` <= 600.0, received 1e\+99"),
        ('{"do": "field", "name": "\\ud800"}', "must be a JSON object"),
        ('{"do": "pose", "time": "nan"}', "pose.time: expected `float`, got `str`"),
        ('{"do": "live", "weights": {"AU1": 2}}', "live.weights.AU1: expected `float` <= 1.0, received 2"),
        ('{"do": "live", "weights": {"AU1": Infinity}}', "must be a JSON object"),
        ('{"do": "probe", "corners": [0, 1, -1], "shares": [1, 0, 0], "version": 1}', r"probe.corners\[2\]: expected"),
        ('{"do": "save", "what": "glb", "camera": [1e99, 0, 0, 0, 0, 0]}', r"save.camera\[0\]: expected"),
        ('{"do": "change", "gesture": "", "patches": [[["a", "b", "c", "d", "e"], 1]]}', "length <= 4"),
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
