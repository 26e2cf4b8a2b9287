"""The thread that simulates follows the document, as a whole or not at all.

a change that is refused     | nothing of it is left, neither in the document nor in the face
random changes, good and bad | face, layers and tears are those of the document
another person               | what was placed on the skin keeps the numbers of its triangle
"""

import contextlib

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.live.document import Document
from facewrinkle.live.library import Library
from facewrinkle.live.stage import Stage
from facewrinkle.session.parts import point_of
from facewrinkle.session.player import Player
from facewrinkle.session.session import START

FAR = {"start": [1e8, 1e8, 1e8]}


@contextlib.contextmanager
def staged(face):
    """A document, a stage that follows it, and the sentences that it said."""
    library, told = Library(face), []
    document = Document(face.atlas, library.accepted)
    stage = Stage(library, document)
    stage.complain = told.append
    stage.start()
    try:
        yield document, stage, told
    finally:
        stage.close()


def change(document, stage, gesture="", **parts):
    with stage.condition:
        document.change([((name,), value) for name, value in parts.items()], gesture)
    stage.wake()


def shown(document, stage):
    """What is shown, once it is what the document asks for."""
    with stage.condition:
        assert stage.condition.wait_for(lambda: stage.shown and stage.shown.session is document.session, 60.0)
        return stage.shown


def test_of_a_change_that_is_refused_nothing_is_left(face):
    with staged(face) as (document, stage, told):
        change(document, stage, identity={"age": 0.5})
        shown(document, stage)
        before = stage.face
        change(document, stage, identity={"jaw": 1.0, "width": 1.0}, tears={"a": FAR})
        with stage.condition:
            assert stage.condition.wait_for(lambda: document.session.identity == {"age": 0.5}, 60.0)
        shown(document, stage)
        assert (stage.face, len(told)) == (before, 1)
        assert told[0].startswith("start must lie on the surface")
        assert document.session.tears == {}
        assert document.history == (1, 0), "it cannot be done again"


def test_a_drag_that_ends_in_a_refusal_is_taken_back_whole(face):
    with staged(face) as (document, stage, _):
        change(document, stage, "drag", folds={"depth": 2.0})
        shown(document, stage)
        change(document, stage, "drag", tears={"a": FAR})
        with stage.condition:
            assert stage.condition.wait_for(lambda: document.session == START, 60.0)
        assert {layer.depth for layer in shown(document, stage).layers} == {1.0}


def test_what_lies_on_the_skin_goes_along_with_the_person(face):
    corners, shares = face.triangles[[100, 2000, 3000]], np.array([[0.2, 0.3, 0.5], [1.0, 0.0, 0.0], [0.6, 0.4, 0.0]])
    one, two, three = np.einsum("pc,pcx->px", shares, face.points[corners]).tolist()
    document = Document(face.atlas, Library(face).accepted)
    tear, pattern = {"start": one}, {"kind": "dimple", "center": two, "size": 9.0, "depth": 1.0}
    document.change([(("tears", "a"), tear), (("patterns", "b"), pattern), (("probes", "c"), three)])
    before = document.session
    for step in range(1, 11):
        document.change([(("identity",), {"sex": -step / 10.0, "width": step / 20.0})], "drag")
    child = fw.default_face({"sex": -1.0, "width": 0.5})

    def points():
        session = document.session
        places = session.tears["a"].start, session.patterns["b"].center, session.probes["c"]
        return [point_of(place, child) for place in places]

    places = points()
    expected = np.einsum("pc,pcx->px", shares, child.points[corners])
    assert np.linalg.norm(expected - [one, two, three], axis=1).min() > 0.5
    np.testing.assert_allclose(places, expected, atol=1e-9)
    document.undo()
    assert document.session == before
    document.redo()
    saved = document.session.to_json()
    document.reset()
    document.load(saved)
    assert points() == places


def test_landmarks_that_were_moved_go_along_with_the_person(face):
    library = Library(face)
    document = Document(face.atlas, library.accepted)
    place = face.points[np.linalg.norm(face.points - face.landmarks["mouth_l"], axis=1).argsort()[3]]
    document.change([(("landmarks", "mouth_l"), place.tolist())])
    document.change([(("identity",), {"width": 1.0, "jaw": 1.0})])
    wide = library.subject_of(document.session).face
    vertex = np.flatnonzero((face.points == place).all(axis=1))
    np.testing.assert_allclose(wide.landmarks["mouth_l"], wide.points[vertex[0]], atol=1e-9)


@pytest.mark.slow
def test_what_is_wished_during_the_last_step_is_not_lost(face, monkeypatch):
    """As when a phone falls silent at the very moment at which the face comes to rest."""
    step, last = Player.step, []

    def slow(player, weights, *rest):
        frame = step(player, weights, *rest)
        if last and not weights:
            stage.live(last.pop())
        return frame

    with staged(face) as (document, stage, _):
        shown(document, stage)
        with stage.condition:
            assert stage.condition.wait_for(lambda: stage.settled, 60.0)
        monkeypatch.setattr(Player, "step", slow)
        for _ in range(8):  # one of its last steps, whichever that is
            last.append({"jaw": 1.0})
            stage.wake()
            with stage.condition:
                assert stage.condition.wait_for(lambda: stage.shown.rates["jaw"] > 0.9, 20.0)
            stage.live({})
            with stage.condition:
                assert stage.condition.wait_for(lambda: stage.settled and not stage.shown.rates["jaw"], 20.0)


def random_parts(generator, stage):
    """Parts of a document, good or bad."""
    face = stage.face  # what is on it may be old: places are then refused, or not, as they lie
    place = face.points[generator.integers(len(face.points))].tolist()
    good = [
        {"identity": {"jaw": generator.uniform(-1, 1), "sex": generator.uniform(-1, 1)}},
        {"identity": {}},
        {"tears": {"a": {"start": place, "begin": 0.0}}},
        {"patterns": {"b": {"kind": "dimple", "center": place, "size": 12.0, "depth": 1.0}}},
        {"probes": {"c": place}},
        {"folds": {"depth": generator.uniform(0, 2)}},
        {"mixture": {"AU12": generator.uniform()}},
    ]
    bad = [
        {"tears": {"a": FAR}},
        {"patterns": {"b": {"kind": "dimple", "center": [1e8, 0.0, 0.0], "size": 12.0, "depth": 1.0}}},
        {"landmarks": {"nasion": [500.0, 0.0, 0.0]}},
        {"mixture": {"AU99": 1.0}},
    ]
    one = good[generator.integers(len(good))]
    return one | bad[generator.integers(len(bad))] if generator.random() < 0.4 else one


@pytest.mark.slow
def test_after_random_changes_the_face_is_that_of_the_document(face):
    library, generator = Library(face), np.random.default_rng(0)
    with staged(face) as (document, stage, told):
        shown(document, stage)
        for _ in range(100):
            for _ in range(generator.integers(1, 6)):
                gesture = "drag" if generator.random() < 0.3 else ""
                with contextlib.suppress(fw.FaceWrinkleError):
                    change(document, stage, gesture, **random_parts(generator, stage))
                if generator.random() < 0.2:
                    with stage.condition:
                        generator.choice([document.undo, document.redo])()
                    stage.wake()
                if generator.random() < 0.3:
                    shown(document, stage)
            now, session = shown(document, stage), document.session
            np.testing.assert_array_equal(stage.face.points, library.subject_of(session).face.points)
            assert stage.face.landmarks.keys() == face.landmarks.keys()
            patterns = [layer for layer in now.layers if isinstance(layer, fw.PatternLayer)]
            assert [layer.name for layer in patterns] == list(session.patterns)
            assert {layer.depth for layer in now.layers if layer not in patterns} == {session.folds.depth}
            assert len(now.tears) <= len(session.tears)
            for entry in session.tears.values():
                place = np.array(point_of(entry.start, stage.face))
                assert fw.geometry.closest(stage.face.points, stage.face.triangles, place)[2] < 10.0
    assert told
    assert not any("internal" in sentence for sentence in told)
