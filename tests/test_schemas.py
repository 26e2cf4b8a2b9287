"""Values from outside: what is said of those that are refused, in everybody's words."""

from dataclasses import dataclass, field, is_dataclass
from typing import Annotated, Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from facewrinkle.dataset.spec import Drawn, Spec
from facewrinkle.errors import FaceWrinkleError, ParameterError
from facewrinkle.live.protocol import COMMANDS
from facewrinkle.schemas import Limits, conforming, kinds_of
from facewrinkle.session import Session

TEXT = st.text(st.characters(exclude_characters="`"), max_size=80)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | TEXT,
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=8,
)
KINDS = {**kinds_of(Session), **COMMANDS, "spec": Spec, "drawn": Drawn}


@dataclass
class Box:
    """A box for these tests."""

    size: Annotated[float, Limits(1.0, 9.0)]
    names: dict[Annotated[str, Limits(most=3)], str] = field(default_factory=dict)
    kind: Literal["open", "shut"] = "open"
    lid: bool | None = None


@pytest.mark.parametrize(
    ("value", "kind", "message"),
    [
        ({"size": 1, "lid": 3}, Box, "box.lid must be true or false or nothing, received 3."),
        ({}, Box, "box must have an entry size, received {}."),
        ({"size": 1, "kind": "shot"}, Box, "box.kind must be one of 'open', 'shut', received 'shot'."),
        ({"size": 0}, Box, "box.size must be at least 1, received 0."),
        ({"size": float("nan")}, Box, "box.size must be at least 1, received nan."),
        ({"size": True}, Box, "box.size must be a number, received True."),
        ({"size": 1, "names": {"a": 1}}, Box, "box.names.a must be a text, received 1."),
        ({"size": 1, "names": {"long": "a"}}, Box, "a name in box.names must have at most 3 characters, "),
        ([1.0], Annotated[list[float], Limits(2)] | None, "box must have at least 2 entries, received [1.0]."),
        (7, Annotated[float, Limits(most=6)] | None, "box must be at most 6, received 7."),
        ([1, 2, 3], tuple[float, float], "box must be a list of 2 entries, received [1, 2, 3]."),
        ([1, "2"], list[float], "box[1] must be a number, received '2'."),
        (7, Annotated[int, Limits(most=6)], "box must be at most 6, received 7."),
        (object(), Box, "box must be made of"),
    ],
)
def test_a_sentence_for_each_kind_of_refusal(value: Any, kind: Any, message: str):
    with pytest.raises(ParameterError) as told:
        conforming(value, kind, "box")
    assert str(told.value).startswith(message)


@given(st.sampled_from(sorted(KINDS)), PLAIN, st.data())
def test_nobody_reads_the_language_of_schemas(name, value, data):
    kind = KINDS[name]
    if is_dataclass(kind) and data.draw(st.booleans()):
        value = {name: data.draw(PLAIN) for name in kinds_of(kind) if data.draw(st.booleans())}
    try:
        conforming(value, kind, name)
    except FaceWrinkleError as problem:
        said = str(problem).partition(", received ")[0].partition("unknown entry")[0]
        assert not any(word in said for word in ("`", "regex", "xpected", "is not allowed"))
