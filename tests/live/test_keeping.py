"""The session in the folder: saved by itself, offered again, and never lost.

what was kept       | the document, by the text of its file
a later start       | is offered it; resuming is a step of undo; what is not resumed is kept under another name
what is no session  | an error when it is taken, and nothing before
"""

from __future__ import annotations

import pytest

from facewrinkle.anatomy.atlas import load_atlas
from facewrinkle.errors import OutputError, ParameterError
from facewrinkle.live.document import Document
from facewrinkle.live.keeping import Kept
from facewrinkle.live.saving import Folder


@pytest.fixture
def folder(tmp_path):
    """A folder in which a session with a smile was kept."""
    folder = Folder(tmp_path)
    document, kept = Document(load_atlas()), Kept(folder)
    assert kept.when == ""
    kept.keep(document)
    assert not list(tmp_path.iterdir())  # nothing was set
    document.change([(("mixture",), {"AU12": 0.5})])
    kept.keep(document)
    assert (tmp_path / "session.json").read_text() == document.text()
    return folder


def test_a_session_is_resumed(folder):
    document, kept = Document(load_atlas()), Kept(folder)
    assert kept.when.startswith("2")
    kept.keep(document)
    kept.resume(document)
    assert kept.when == ""
    assert document.data["mixture"] == {"AU12": 0.5}
    document.change([(("intensity",), 0.2)])
    kept.keep(document)
    assert [path.name for path in folder.path.iterdir()] == ["session.json"]
    assert (folder.path / "session.json").read_text() == document.text()
    kept.resume(document)  # another page may ask for it once more
    assert document.data["intensity"] == 0.2
    assert document.undo()
    assert document.undo()
    assert document.data["mixture"] == {}


def test_a_session_can_be_resumed_after_something_else_was_begun(folder):
    before = (folder.path / "session.json").read_text()
    document, kept = Document(load_atlas()), Kept(folder)
    kept.keep(document)
    document.change([(("mixture",), {"AU4": 1.0})])
    kept.keep(document)
    assert kept.when
    kept.resume(document)
    assert document.data["mixture"] == {"AU12": 0.5}
    kept.keep(document)
    assert {path.name: path.read_text() for path in folder.path.iterdir()} == {
        "session.json": document.text(),
        "session_1.json": before,
    }


def test_a_session_that_is_dismissed_gets_another_name(folder):
    document, kept = Document(load_atlas()), Kept(folder)
    kept.dismiss()
    kept.keep(document)
    before = (folder.path / "session.json").read_text()
    document.change([(("intensity",), 0.2)])
    kept.keep(document)
    assert (folder.path / "session_1.json").read_text() == before
    assert (folder.path / "session.json").read_text() == document.text()


def test_what_cannot_be_read_is_not_offered_and_gets_another_name(folder):
    (folder.path / "session.json").write_bytes(b"\xff not text")
    document, kept = Document(load_atlas()), Kept(folder)
    assert kept.when == ""
    document.change([(("intensity",), 0.2)])
    kept.keep(document)
    document.change([(("intensity",), 0.3)])
    kept.keep(document)
    assert (folder.path / "session_1.json").read_bytes() == b"\xff not text"
    assert (folder.path / "session.json").read_text() == document.text()
    assert len(list(folder.path.iterdir())) == 2


@pytest.mark.parametrize("content", ["a session", b"\xff not text"])
@pytest.mark.parametrize("whole", [False, True])
def test_a_session_that_was_moved_away_is_not_in_the_way(folder, content, whole):
    path = folder.path / "session.json"
    if isinstance(content, bytes):
        path.write_bytes(content)
    document, kept = Document(load_atlas()), Kept(folder)
    kept.keep(document)
    path.rename(folder.path.with_name(f"{folder.path.name}_elsewhere"))
    if whole:
        folder.path.rmdir()
    for intensity in (0.2, 0.3):
        document.change([(("intensity",), intensity)])
        kept.keep(document)
        assert path.read_text() == document.text()
    assert list(folder.path.iterdir()) == [path]


def test_a_session_that_could_not_be_saved_is_saved_later(folder, monkeypatch):
    def refuse(*_, **__):
        raise OutputError("no space left")

    document, kept = Document(load_atlas()), Kept(folder)
    kept.keep(document)
    document.change([(("intensity",), 0.2)])
    with monkeypatch.context() as disk:
        disk.setattr(folder, "write", refuse)
        kept.keep(document)
    kept.keep(document)
    assert (folder.path / "session.json").read_text() == document.text()
    assert len(list(folder.path.iterdir())) == 2


def test_what_is_no_session_is_an_error_when_it_is_taken(folder):
    (folder.path / "session.json").write_text("[]")
    document, kept = Document(load_atlas()), Kept(folder)
    with pytest.raises(ParameterError, match="not a session of the studio"):
        kept.resume(document)
    assert document.version == 0
    (folder.path / "session.json").write_bytes(b"\xff\xfe")
    assert Kept(folder).when == ""
