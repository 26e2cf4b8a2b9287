"""Wrong values that would do harm without a word are refused in our own; Python's errors tell the rest.

what                                | checked against
numbers, vectors, pictures          | what they allow, one by one
wrong values of public functions    | an error of the package, whose message names the remedy
values from outside                 | what is said of those that are refused, in everybody's words
"""

from dataclasses import dataclass, field, is_dataclass
from typing import Annotated, Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import facewrinkle as fw
from facewrinkle.checks import finite, picture, vector, vectors
from facewrinkle.dataset.spec import Drawn, Spec
from facewrinkle.errors import FaceWrinkleError, ParameterError, check_flag, check_positive, check_range, check_whole
from facewrinkle.live.protocol import COMMANDS
from facewrinkle.schemas import Limits, conforming, kinds_of

NO_NUMBERS = ["3", b"3", None, [1.0], True, float("nan"), 10**400, object(), np.zeros(3), 1 + 0j]
NOT_WHOLE = [float("inf"), -float("inf"), float("nan"), 2.5, np.ones(2)]
NO_VECTORS = ["abc", ["1", "2", "3"], (0, 1), (0, 0, np.nan), (0, np.inf, 0), (0, -(10**400), 0), (0, 1e60, 0), None]
NO_PICTURES = [np.zeros((4, 4, 3)), np.zeros((4, 4), np.uint8), np.zeros((0, 4, 3), np.uint8), 3]
REFUSED = [
    (lambda value: check_range("depth", value, 0.0, 10.0), NO_NUMBERS, "^depth must"),
    (lambda value: check_positive("width", value), NO_NUMBERS, "^width must"),
    (lambda value: check_whole("count", value, 0, float("inf")), NOT_WHOLE, "^count must"),
    (lambda value: check_flag("loop", value), ["no", 1, None, np.zeros(3)], "loop must be True or False, received"),
    (lambda value: vector("up", value), NO_VECTORS, "^up must be three finite numbers, received"),
    (lambda value: vectors("path", value), NO_VECTORS, "^path must be rows of three finite numbers, received"),
    (lambda value: finite("times", value), [[[0.0], [np.nan]]], r"times must be finite; entry \[1, 0\] is nan"),
    (
        lambda value: finite("times", value),
        [[[0.0], [1.0, 2.0]]],
        "times must be numbers in rows of one length",
    ),
    (lambda value: finite("times", value), [[1j]], "times must be numbers"),
    (picture, NO_PICTURES, "pictures must be uint8 arrays"),
]


@pytest.mark.parametrize(
    ("check", "value", "message"), [(check, value, said) for check, values, said in REFUSED for value in values]
)
def test_what_is_refused_is_named(check, value, message):
    with pytest.raises(ParameterError, match=message):
        check(value)


@pytest.mark.parametrize("value", [3, 3.0, np.float32(3), np.int64(3), np.array(3.0)])
def test_numbers_of_all_kinds(value):
    assert check_range("depth", value, 0.0, 10.0) == check_whole("depth", value, 0, 10) == 3.0


def test_flags():
    assert check_flag("loop", True) is True
    assert check_flag("loop", np.bool_(False)) is False


def test_vectors_are_copies():
    rows = np.arange(6.0).reshape(2, 3)
    found, first = vectors("path", rows), vector("up", rows[0])
    found[0] = 7.0
    np.testing.assert_array_equal(first, [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(rows, [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    assert not first.flags.writeable
    np.testing.assert_array_equal(vectors("path", (1, 2, 3)), [[1.0, 2.0, 3.0]])


WRONG = {
    "a number beyond all floats": (
        lambda face: fw.SheetMuscle([(-(10**400), 0, 0), (1, 0, 0)], [(0, 1, 0)] * 2),
        "three",
    ),
    "text as a flag": (
        lambda face: fw.MuscleWrinkles(waves="no"),
        "waves must be True or False, received 'no'",
    ),
    "the class of a layer": (lambda face: fw.Simulation(face, layers=[fw.MuscleWrinkles]), r"such as \[MuscleWrinkles"),
    "a mesh as a recording": (lambda face: fw.Recorded(face.mesh, np.zeros(3)), r"Recorded\.of_positions"),
    "a list as a face": (lambda face: fw.Simulation([1]), "mesh"),
    "text as a time step": (lambda face: fw.Simulation(face, time_step="0.02"), "time_step must be a number"),
    "a number as a mesh": (lambda face: fw.fit_face(3), "mesh"),
    "text as a depth": (lambda face: fw.MuscleWrinkles(depth="deep"), "depth must be a number"),
    "True as a depth": (lambda face: fw.MuscleWrinkles(depth=True), "depth must be a number, received True"),
    "a number as a preset": (lambda face: fw.tears.preset(3, face), "unknown"),
}


@pytest.mark.parametrize(("call", "message"), WRONG.values(), ids=WRONG)
def test_wrong_values_that_python_would_let_pass(face, call, message):
    with pytest.raises(fw.FaceWrinkleError, match=message):
        call(face)


# --- values from outside --------------------------------------------------------------------------


TEXT = st.text(st.characters(exclude_characters="`"), max_size=80)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | TEXT,
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=8,
)
KINDS = {**kinds_of(fw.Session), **COMMANDS, "spec": Spec, "drawn": Drawn}


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
