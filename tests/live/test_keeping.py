"""The session in the folder: saved by itself, offered again, and never lost.

what was kept       | the document, by the text of its file
a later start       | is offered it; going on is a step of undo; leaving it keeps it under another name
what is no session  | an error when it is taken, and nothing before
"""

from __future__ import annotations

import pytest

from facewrinkle.anatomy.atlas import load_atlas
from facewrinkle.errors import ParameterError
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


def test_a_session_is_gone_on_with(folder):
    document, kept = Document(load_atlas()), Kept(folder)
    assert kept.when.startswith("2")
    kept.go_on(document, True)
    assert kept.when == ""
    assert document.data["mixture"] == {"AU12": 0.5}
    assert document.undo()
    assert document.data["mixture"] == {}


def test_a_session_that_is_left_gets_another_name(folder):
    document, kept = Document(load_atlas()), Kept(folder)
    kept.go_on(document, False)
    kept.keep(document)
    before = (folder.path / "session.json").read_text()
    document.change([(("intensity",), 0.2)])
    kept.keep(document)
    assert (folder.path / "session_1.json").read_text() == before
    assert (folder.path / "session.json").read_text() == document.text()


def test_what_is_no_session_is_an_error_when_it_is_taken(folder):
    (folder.path / "session.json").write_text("[]")
    document, kept = Document(load_atlas()), Kept(folder)
    with pytest.raises(ParameterError, match="not a session of the studio"):
        kept.go_on(document, True)
    assert document.version == 0
    (folder.path / "session.json").write_bytes(b"\xff\xfe")
    assert Kept(folder).when == ""
