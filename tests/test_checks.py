"""Wrong values that would do harm without a word are refused in our own; Python's errors tell the rest.

what                                | checked against
numbers, vectors, pictures          | what they allow, one by one
wrong values of public functions    | an error of the package, whose message names the remedy
"""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.checks import finite, picture, vector, vectors
from facewrinkle.errors import ParameterError, check_flag, check_positive, check_range, check_whole


@pytest.mark.parametrize("value", ["3", b"3", None, [1.0], True, float("nan"), 10**400, object(), np.zeros(3), 1 + 0j])
def test_what_is_no_number(value):
    with pytest.raises(ParameterError, match=r"^depth must"):
        check_range("depth", value, 0.0, 10.0)
    with pytest.raises(ParameterError, match=r"^width must"):
        check_positive("width", value)


@pytest.mark.parametrize("value", [float("inf"), -float("inf"), float("nan"), 2.5, np.ones(2)])
def test_what_is_no_whole_number(value):
    with pytest.raises(ParameterError, match=r"^count must"):
        check_whole("count", value, 0, float("inf"))


@pytest.mark.parametrize("value", [3, 3.0, np.float32(3), np.int64(3), np.array(3.0)])
def test_numbers_of_all_kinds(value):
    assert check_range("depth", value, 0.0, 10.0) == check_whole("depth", value, 0, 10) == 3.0


def test_flags():
    assert check_flag("loop", True) is True
    assert check_flag("loop", np.bool_(False)) is False
    for wrong in ("no", 1, None, np.zeros(3)):
        with pytest.raises(ParameterError, match="loop must be True or False, received"):
            check_flag("loop", wrong)


@pytest.mark.parametrize(
    "value", ["abc", ["1", "2", "3"], (0, 1), (0, 0, np.nan), (0, np.inf, 0), (0, -(10**400), 0), (0, 1e60, 0), None]
)
def test_what_is_no_vector(value):
    with pytest.raises(ParameterError, match="^up must be three finite numbers, received"):
        vector("up", value)
    with pytest.raises(ParameterError, match="^path must be rows of three finite numbers, received"):
        vectors("path", value)


def test_vectors_are_copies():
    rows = np.arange(6.0).reshape(2, 3)
    found, first = vectors("path", rows), vector("up", rows[0])
    found[0] = 7.0
    np.testing.assert_array_equal(first, [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(rows, [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    assert not first.flags.writeable
    np.testing.assert_array_equal(vectors("path", (1, 2, 3)), [[1.0, 2.0, 3.0]])


def test_the_place_of_a_broken_number_is_named():
    with pytest.raises(ParameterError, match=r"times must be finite; entry \[1, 0\] is nan"):
        finite("times", [[0.0], [np.nan]])
    with pytest.raises(ParameterError, match="times must be numbers in rows of one length, received a list"):
        finite("times", [[0.0], [1.0, 2.0]])
    with pytest.raises(ParameterError, match="times must be numbers"):
        finite("times", [1j])


@pytest.mark.parametrize("image", [np.zeros((4, 4, 3)), np.zeros((4, 4), np.uint8), np.zeros((0, 4, 3), np.uint8), 3])
def test_what_is_no_picture(image):
    with pytest.raises(ParameterError, match="pictures must be uint8 arrays"):
        picture(image)


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
