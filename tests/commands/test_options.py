"""Faces by the options that choose one."""

import time
import warnings

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.anatomy.atlas import DEFAULT_ATLAS, load_atlas
from facewrinkle.commands import options
from facewrinkle.commands.options import FaceOptions, Report, parse_mixture, whole_number


def test_a_face_with_another_atlas(tmp_path):
    other = tmp_path / "other.toml"
    text = DEFAULT_ATLAS.read_text(encoding="utf-8")
    other.write_text(text.replace("[expressions]", "[expressions]\nscowl = { corrugator = 0.5 }"), encoding="utf-8")
    face = FaceOptions(atlas=other).load()
    assert face.atlas.contractions("scowl") == {"corrugator_l": 0.5, "corrugator_r": 0.5}
    assert face.texture is not None
    assert "brows" in face.bound_hair


def test_a_face_of_somebody(face):
    somebody = FaceOptions(identity="jaw=0.5, age=1").load()
    assert np.array_equal(somebody.points, fw.default_face(fw.Identity(jaw=0.5, age=1.0)).points)
    assert not np.array_equal(somebody.points, face.points)


def test_a_face_of_a_file_has_an_age_alone(face, tmp_path):
    path = tmp_path / "mine.face"
    fw.write_face(face, path)
    older = FaceOptions(identity="age=0.6", face=path).load()
    assert older.age == 0.6
    np.testing.assert_allclose(older.points, face.aged(0.6).points, atol=1e-9)


def test_a_session_stands_for_its_face(face, tmp_path):
    """What it has itself is not given beside it."""
    session = fw.Session(identity={"jaw": 0.5})
    path = tmp_path / "mine.json"
    session.write(path)
    assert FaceOptions(face=path).session() == session
    own = FaceOptions(face=path).load()
    assert np.array_equal(own.points, session.subject().face.points)
    assert not np.array_equal(own.points, face.points)
    with pytest.raises(fw.errors.ParameterError, match="--atlas is not for mine.json"):
        FaceOptions(face=path, atlas=DEFAULT_ATLAS).load()
    with pytest.raises(fw.errors.ParameterError, match="--identity is not for mine.json"):
        FaceOptions(face=path, identity="age=1").load()


# --- words of the command line as values ----------------------------------------------------------


def test_mixtures():
    atlas = load_atlas()
    assert parse_mixture("AU1=0.7,AU4", atlas) == {"AU1": 0.7, "AU4": 1.0}
    for name in ["corrugator", *atlas.expressions, *atlas.action_units, *atlas.muscles]:
        assert parse_mixture(name, atlas) == {name: 1.0}
    for name, meant in (("au1", "AU1"), ("SURPRISE", "surprise"), ("Jaw", "jaw")):
        assert atlas.contractions(parse_mixture(name, atlas)) == atlas.contractions(meant)


@pytest.mark.parametrize("text", ["2.5", "nan", "inf", "x", "1e400", ""])
def test_fractions_are_no_whole_numbers(text):
    with pytest.raises(ValueError, match="a whole number is needed, received"):
        whole_number(int, [text])


# --- progress of a command on a terminal ----------------------------------------------------------


@pytest.mark.parametrize("terminal, quiet, shown", [(True, False, True), (True, True, False), (False, False, False)])
def test_what_takes_a_while_is_told_where_there_is_a_terminal(capsys, monkeypatch, terminal, quiet, shown):
    monkeypatch.setattr("rich.console.Console.is_terminal", terminal)
    with warnings.catch_warnings(), Report(quiet).waiting("Preparing the skin"):
        pass
    out, err = capsys.readouterr()
    assert ("Preparing the skin" in err) is shown
    assert not out


@pytest.mark.parametrize("shortest, said", [(0.01, "Preparing the skin ...\n"), (60.0, "")])
def test_a_log_tells_what_takes_some_seconds(capsys, monkeypatch, shortest, said):
    monkeypatch.setattr("rich.console.Console.is_terminal", False)
    monkeypatch.setattr(options, "SHORTEST", shortest)
    with Report(quiet=False).waiting("Preparing the skin"):
        time.sleep(0.2)
    assert capsys.readouterr() == ("", said)
