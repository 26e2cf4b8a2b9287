"""The document of a session.

changes, undo, redo        | a list of snapshots, by random sequences
gestures                   | one step however many patches
what is refused            | nothing has changed; the message names what is allowed
files                      | written and read again
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facewrinkle.anatomy.atlas import load_atlas
from facewrinkle.errors import FaceWrinkleError
from facewrinkle.live.document import Document
from facewrinkle.live.library import Library
from facewrinkle.session import Folds, Session
from facewrinkle.session.session import START

DIMPLE = {"kind": "dimple", "center": [40.0, -20.0, 60.0], "size": 9, "depth": 1.6}
KEY = {"unit": "AU12", "weight": 1.0, "onset": 0.0, "apex": 0.5, "offset": 1.0, "end": 2.0}
WORDS = st.one_of(
    st.tuples(
        st.sampled_from([("mixture", "AU12L"), ("mixture", "jaw")]), st.one_of(st.none(), st.floats(0, 1, width=16))
    ),
    st.tuples(st.sampled_from([("folds", "depth"), ("folds", "left")]), st.floats(0, 4, width=16)),
    st.tuples(st.just(("patterns", "a")), st.one_of(st.none(), st.just({**DIMPLE, "strength": 1.0}))),
    st.tuples(st.just(("mixtures", "My smile")), st.just({"AU12": 0.5})),
    st.tuples(st.just(("timeline", "keys", "k")), st.one_of(st.none(), st.just(KEY))),
    st.tuples(st.just(("gaze",)), st.lists(st.floats(-40, 40, width=16), min_size=2, max_size=2)),
)


@settings(max_examples=60)
@given(st.lists(st.one_of(WORDS, st.sampled_from(["undo", "redo", "reset"])), max_size=24))
def test_undo_and_redo_are_those_of_a_list_of_snapshots(steps):
    document = Document(load_atlas())
    snapshots, at = [document.session], 0
    for step in steps:
        if step == "undo":
            assert document.undo() == (at > 0)
            at = max(at - 1, 0)
        elif step == "redo":
            assert document.redo() == (at < len(snapshots) - 1)
            at = min(at + 1, len(snapshots) - 1)
        elif step != "reset" or document.session != replace(START, mixtures=document.session.mixtures):
            document.reset() if step == "reset" else document.change([step])
            if step == "reset":
                assert document.session == replace(START, mixtures=snapshots[at].mixtures)
            snapshots[at + 1 :] = [document.session]
            at += 1
        assert document.session == snapshots[at]
        assert document.history == (at, len(snapshots) - 1 - at)


def test_a_drag_is_one_step_and_an_undone_one_is_not_continued():
    document = Document(load_atlas())
    for k in range(50):
        document.change([(("intensity",), k / 50)], gesture="drag 1")
    assert document.history == (1, 0)
    document.undo()
    document.redo()
    document.change([(("intensity",), 0.1)], gesture="drag 1")
    assert document.history == (2, 0)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("mixtur",), {}, "unknown part of the session 'mixtur'. Did you mean 'mixture'"),
        ((), 1, "unknown part of the session"),
        (("mixture", "AU99"), 0.5, "unknown expression, action unit or muscle 'AU99'"),
        (("mixture", "AU12"), 1.5, "mixture.AU12 must be at most 1, received 1.5"),
        (("mixture", "AU12"), "1", "mixture.AU12 must be a number, received '1'"),
        (("mixture",), [], "mixture must be a table"),
        (("mixture", "AU12", "L"), 1.0, "unknown table of the session 'AU12'"),
        (("mixtures", 41 * "a"), {"AU12": 1.0}, "a name in mixtures must have at most 40 characters"),
        (("mixtures", ""), {"AU12": 1.0}, "a name in mixtures must not be empty"),
        (("mixtures", "mine"), {}, "mixtures.mine must not be empty"),
        (("mixtures", "mine"), {"AU12": 2.0}, "mixtures.mine.AU12 must be at most 1"),
        (("regions", "ears"), 1.0, "unknown region of folds 'ears'"),
        (("regions", "nose"), 9.0, "regions.nose must be at most 4, received 9.0"),
        (("folds", "deep"), 1.0, "unknown entry of folds 'deep'. Did you mean 'depth'"),
        (("folds", "depth"), float("nan"), "folds.depth must be at least 0, received nan"),
        (("folds", "depth"), object(), "folds must be made of numbers, texts, lists and tables"),
        (("folds", "seed"), 1.5, "folds.seed must be a whole number, received 1.5"),
        (("identity", "jaws"), 0.1, "unknown parameter of an identity 'jaws'"),
        (("gaze",), [0.0], "gaze must be a list of 2 entries"),
        (("patterns", "a"), {**DIMPLE, "kind": "beard"}, "unknown pattern 'beard'"),
        (("patterns", "a"), {**DIMPLE, "center": [0, 0]}, "patterns.a.center must be a list of 3 entries"),
        (("patterns", "a"), {**DIMPLE, "center": [0, 0, float("inf")]}, r"patterns.a.center\[2\] must be at most"),
        (("patterns", "a"), {"kind": "dimple"}, "patterns.a must have an entry center"),
        (("patterns", "a"), {**DIMPLE, "color": 1}, "unknown entry of patterns.a 'color'"),
        (("tears", "a"), {"start": [0, 0, 0], "width": 99}, "tears.a.width must be at most 6, received 99"),
        (("timeline", "keys", "k"), {**KEY, "apex": 5.0}, "must follow each other"),
        (("timeline", "speed"), 1, "unknown entry of timeline 'speed'"),
        (("timeline", "length"), float("inf"), "timeline.length must be at most 600"),
        (("look", "view"), "behind", "unknown view 'behind'"),
        (("time",), -1.0, "time must be at least 0, received -1"),
        (("identity", "jaw"), 99.0, "identity.jaw must be at most 1, received 99"),
        (("landmarks", "ear"), [0.0, 0.0, 0.0], "'ear'"),
        (("probes", "p"), [float("nan"), 0.0, 0.0], "probes.p"),
        (("intensity",), "much", "intensity must be a number, received 'much'"),
        (("face",), 3, "face must be a text, received 3"),
        (("face",), "nobody.obj", "nobody.obj"),
        (("nothing",), 1.0, "unknown part of the session 'nothing'"),
    ],
)
def test_what_is_not_allowed_changes_nothing(face, path, value, message):
    document = Document(load_atlas(), Library(face).accepted)
    with pytest.raises(FaceWrinkleError, match=message):
        document.change([(("intensity",), 0.5), (path, value)])
    assert document.session == START
    assert document.version == 0
    assert document.history == (0, 0)


@pytest.mark.parametrize("name", ["Big smile!", "Smile (1)", "100 %", "<b>", "müde", 40 * "a"])
def test_an_expression_is_kept_under_any_name(name):
    document = Document(load_atlas())
    document.change([(("mixtures", name), {"AU12": 1.0})])
    assert document.session.mixtures == {name: {"AU12": 1.0}}


def test_there_is_a_limit_to_patterns():
    document = Document(load_atlas())
    document.change([(("patterns", str(k)), DIMPLE) for k in range(32)])
    with pytest.raises(FaceWrinkleError, match="patterns must have at most 32 entries"):
        document.change([(("patterns", "one more"), DIMPLE)])
    document.change([(("patterns", "3"), {**DIMPLE, "depth": 2.0})])  # changing one is allowed


def test_numbers_of_numpy_are_taken_and_what_is_taken_away_is_as_at_the_start():
    document = Document(load_atlas())
    document.change([(("folds",), {"depth": np.float64(2.0), "seed": np.int64(3)}), (("gaze",), np.array([1.0, 2.0]))])
    assert document.session == Session(folds=Folds(depth=2.0, seed=3), gaze=(1.0, 2.0))
    document.change([(("folds", "depth"), None), (("folds", "seed"), None), (("gaze",), None)])
    assert document.session == START


def test_a_session_is_read_as_it_was_written():
    first, second = Document(load_atlas()), Document(load_atlas())
    first.change([(("mixture", "AU1"), 0.3), (("tears", "t"), {"start": [1, 2, 3]}), (("timeline", "keys", "k"), KEY)])
    second.load(first.session.to_json())
    assert second.session == first.session
    assert second.undo()
    assert second.session == START


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a session of the studio"),
        ("[1]", "not a session"),
        ("[" * 100_000, "not a session"),
        ('{"a": 1}', "not a session"),
        (json.dumps({"facewrinkle session": 99}), "the session has the version 99"),
        (
            json.dumps({"facewrinkle session": 1, "mixture": {"AU12": 7}}),
            "mixture.AU12 must be at most 1",
        ),
        (json.dumps({"facewrinkle session": 1, "files": "/etc"}), "unknown part of the session 'files'"),
    ],
)
def test_other_files_are_refused(text, message):
    document = Document(load_atlas())
    with pytest.raises(FaceWrinkleError, match=message):
        document.load(text)
    assert document.session == START
