"""Wrong values that would do harm without a word are refused in our own; Python's errors tell the rest.

what                                | checked against
numbers, vectors, pictures          | what they allow, one by one
wrong values of public functions    | an error of the package, whose message names the remedy
"""

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.checks import finite, picture, vector, vectors
from facewrinkle.errors import ParameterError, check_flag, check_positive, check_range, check_whole

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
