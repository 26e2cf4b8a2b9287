"""The messages of pages: whatever comes is a command with checked arguments, or an error of the package."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facewrinkle.errors import FaceWrinkleError
from facewrinkle.live.protocol import COMMANDS, MessageError, Rate, greeting, parse

VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8)),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=8), inner, max_size=4)),
    max_leaves=12,
)


@settings(max_examples=200)
@given(st.one_of(st.text(), VALUES.map(json.dumps)))
def test_any_text_is_parsed_or_refused(text):
    greeting(text)
    with pytest.raises(FaceWrinkleError):
        parse(text)


@settings(max_examples=300)
@given(st.sampled_from(sorted(COMMANDS)), st.data())
def test_any_arguments_are_checked_or_refused(command, data):
    content = {"do": command} | {name: data.draw(VALUES) for name in COMMANDS[command]}
    try:
        found, arguments, number = parse(json.dumps(content))
    except FaceWrinkleError:
        return
    assert (found, number) == (command, 0)
    assert set(arguments) == set(COMMANDS[command])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "must be JSON"),
        ('{"do": "undo", "id": -1}', "number of a message"),
        ('{"do": "undo", "id": true}', "number of a message"),
        ('{"do": "undo", "more": 1}', "undo takes nothing"),
        ('{"do": "field"}', "field takes name"),
        ('{"do": "undone"}', "unknown command 'undone'. Did you mean 'undo'"),
        ('{"do": "pose", "time": "soon"}', "was given what it does not take"),
        ('{"do": "live", "weights": {"AU1": 2}}', r"weight of AU1 must lie in \[0, 1\]"),
        ('{"do": "live", "weights": {"AU1": Infinity}}', "must be JSON"),
        ('{"do": "change", "gesture": "", "patches": [[[[[[[[[[[1]]]]]]]]]]]}', "nested little"),
    ],
)
def test_errors_say_what_is_wrong(text, message):
    with pytest.raises(FaceWrinkleError, match=message):
        parse(text)


def test_only_messages_that_are_none_of_the_protocol_count_as_mistakes():
    with pytest.raises(MessageError):
        parse("nonsense")
    with pytest.raises(FaceWrinkleError) as error:
        parse('{"do": "probe", "corners": [0, 1, -1], "shares": [1, 0, 0], "version": 1}')
    assert not isinstance(error.value, MessageError)


@pytest.mark.parametrize(
    "text", ["", "{}", '{"do": "hello"}', '{"do": "hello", "key": 3}', '{"do": "undo", "key": "a"}']
)
def test_what_is_no_greeting_has_no_key(text):
    assert greeting(text) == ""


@settings(max_examples=50)
@given(st.lists(st.floats(0.0, 0.5), max_size=200))
def test_a_rate_never_allows_more_than_its_burst_and_its_share_of_the_time(pauses):
    rate, now, allowed = Rate(20.0, 5.0), 100.0, 0
    for pause in pauses:
        now += pause
        allowed += rate.allows(now)
    assert allowed <= 5.0 + 20.0 * (now - 100.0) + 1e-6
