"""Files that a studio writes: the session, saved by itself, offered again, and never lost; and what takes long.

what was saved       | the document, by the text of its file
a later start        | is offered it; resuming is a step of undo; what is not resumed is kept under another name
what is no session   | an error when it is taken, and nothing before
a disk that is full  | is told once, and tried again with the next change
what libraries print | much of it, in C, and no text: no harm
written by another   | gets another name
a link to elsewhere  | gets another name, and what it leads to stays
stopped              | an error, and nothing in the terminal
"""

import io
import json
import threading
import zipfile
from unittest.mock import Mock

import numpy as np
import pytest
import pyvista as pv
from studio_pages import until

import facewrinkle as fw
from facewrinkle.files import inputs_kept
from facewrinkle.live import saving
from facewrinkle.live.document import Document
from facewrinkle.live.library import Library, Loaded
from facewrinkle.live.saving import Folder, Kept, Order, SavingProcess, save_slowly
from facewrinkle.session.session import START


def begun(folder, complain=lambda text: None):
    """What a studio begins with: a document in which nothing is set, and the session of the folder."""
    document = Document(fw.anatomy.load_atlas())
    library = Library(fw.Face.without_anatomy(pv.Plane().triangulate(), 1.0))
    return document, Kept(folder, document, library, complain)


def changed(document, kept, intensity):
    document.change([(("intensity",), intensity)])
    kept.save()


def session(folder):
    """What is saved; "" while there is nothing, as in the moment in which an earlier session gets another name."""
    path = folder.path / "session.json"
    return path.read_text() if path.exists() else ""


@pytest.fixture
def folder(tmp_path):
    """A folder in which a session with a smile was kept."""
    folder = Folder(tmp_path)
    document, kept = begun(folder)
    assert kept.when == ""
    kept.save()
    assert not list(tmp_path.iterdir())  # nothing was set
    document.change([(("mixture",), {"AU12": 0.5})])
    kept.save()
    assert (tmp_path / "session.json").read_text() == document.session.to_json()
    return folder


def test_a_session_is_resumed(folder):
    document, kept = begun(folder)
    assert kept.when.startswith("2")
    kept.save()
    kept.resume()
    assert kept.when == ""
    assert document.session.mixture == {"AU12": 0.5}
    changed(document, kept, 0.2)
    assert [path.name for path in folder.path.iterdir()] == ["session.json"]
    assert (folder.path / "session.json").read_text() == document.session.to_json()
    kept.resume()  # another page may ask for it once more
    assert document.session.intensity == 0.2
    assert document.undo()
    assert document.undo()
    assert document.session.mixture == {}


def test_a_session_holds_the_face_that_was_opened(folder, face):
    """Resumed by another studio, and read without one."""
    own = fw.default_face({"jaw": 1.0})
    for studio in range(2):
        library = Library(face)
        document = Document(face.atlas, library.accepted)
        kept = Kept(folder, document, library, pytest.fail)
        if studio == 0:
            library.add("own.ply", Loaded(fw.session.Subject(own)))
            kept.keep("own.ply")
            document.change([(("face",), "own.ply"), (("mixture",), {"AU12": 0.5})])
            kept.save()
            kept.load((folder.path / "session.json").read_bytes())  # it is open: not once more
            assert document.session.face == "own.ply"
        else:
            kept.resume()
            document.change([(("mixture",), {"AU12": 0.75})])
            kept.save()
        np.testing.assert_array_equal(library.subject_of(document.session).face.points, own.points)
        session = fw.Session.read(folder.path / "session.json")
        assert session.mixture == document.session.mixture
        np.testing.assert_array_equal(session.subject().face.points, own.points)
    assert len(list(folder.path.glob("*.face"))) == 1


def test_a_session_that_is_dismissed_gets_another_name(folder):
    document, kept = begun(folder)
    kept.dismiss()
    kept.save()
    before = (folder.path / "session.json").read_text()
    changed(document, kept, 0.2)
    assert (folder.path / "session_1.json").read_text() == before
    assert (folder.path / "session.json").read_text() == document.session.to_json()


def test_a_session_that_was_moved_away_is_not_in_the_way(folder):
    path = folder.path / "session.json"
    document, kept = begun(folder)
    path.rename(folder.path.with_name(f"{folder.path.name}_elsewhere"))
    folder.path.rmdir()
    for intensity in (0.2, 0.3):
        changed(document, kept, intensity)
        assert path.read_text() == document.session.to_json()
    assert list(folder.path.iterdir()) == [path]


def test_a_session_that_cannot_be_saved_is_told_once_and_saved_with_the_next_change(folder, monkeypatch):
    told = []
    document, kept = begun(folder, told.append)
    with monkeypatch.context() as disk:
        disk.setattr(saving, "write_whole", Mock(side_effect=fw.errors.OutputError("no space left.")))
        for intensity in (0.2, 0.3):
            changed(document, kept, intensity)
    assert told == ["The session could not be saved: no space left."]
    changed(document, kept, 0.4)
    assert session(folder) == document.session.to_json()
    assert len(list(folder.path.iterdir())) == 2
    assert len(told) == 1


def test_the_command_replaces_the_session_that_it_saved_or_resumed(folder):
    told = []
    with inputs_kept():  # as commands run
        document, kept = begun(folder, told.append)
        kept.resume()
        for intensity in (0.2, 0.3, 0.4):
            changed(document, kept, intensity)
    assert not told
    assert session(folder) == document.session.to_json()
    assert len(list(folder.path.iterdir())) == 1


def test_each_change_is_saved_soon(folder, monkeypatch):
    monkeypatch.setattr(saving, "SOON", 0.02)
    document, kept = begun(folder)
    for intensity in (0.2, 0.3):
        document.change([(("intensity",), intensity)])
        kept.changed()
        kept.changed()
        until(lambda: session(folder) == document.session.to_json())


@pytest.mark.parametrize("content", [b"[]", b"\xff not text"])
def test_what_is_no_session_is_an_error_when_it_is_taken_and_gets_another_name(folder, content):
    (folder.path / "session.json").write_bytes(content)
    document, kept = begun(folder)
    with pytest.raises(fw.errors.ParameterError, match="not a session of the studio"):
        kept.resume()
    assert document.version == 0
    for intensity in (0.2, 0.3):
        changed(document, kept, intensity)
    assert {path.name: path.read_bytes() for path in folder.path.iterdir()} == {
        "session.json": document.session.to_json().encode(),
        "session_1.json": content,
    }


def test_a_link_is_not_followed_out_of_the_folder(folder, tmp_path_factory):
    outside = tmp_path_factory.mktemp("outside") / "precious.json"
    outside.write_text("precious")
    document, kept = begun(folder)
    kept.resume()
    path = folder.path / "session.json"
    for intensity in (0.2, 0.3):
        path.unlink()
        path.symlink_to(outside)
        changed(document, kept, intensity)
        assert outside.read_text() == "precious"
        assert path.read_text() == document.session.to_json()
        assert not path.is_symlink()


def test_what_another_has_written_meanwhile_is_kept(folder):
    """As two studios in one folder do."""
    (one, ours), (other, theirs) = begun(folder), begun(folder)
    ours.resume()
    for document, kept, intensity in ((one, ours, 0.2), (one, ours, 0.3), (other, theirs, 0.4), (one, ours, 0.5)):
        changed(document, kept, intensity)
        assert (folder.path / "session.json").read_text() == document.session.to_json()
    found = {path.name: json.loads(path.read_text())["intensity"] for path in folder.path.iterdir()}
    assert found == {"session_1.json": 0.3, "session_2.json": 0.4, "session.json": 0.5}


@pytest.mark.slow
def test_maps_come_with_all_that_plays_them(face):
    told = []
    name, content = save_slowly(Order("maps", START, fw.session.Subject(face)), lambda *what: told.append(what))
    assert name == "maps.zip"
    assert told
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        names = {*archive.namelist()}
        facts = json.loads(archive.read("rig_wrinkles.json"))
        with zipfile.ZipFile(io.BytesIO(archive.read("facewrinkle-blender.zip"))) as extension:
            assert "blender_manifest.toml" in extension.namelist()
    used = [facts["masks"]["picture"], *(file for layer in facts["layers"] for file in layer.values())]
    assert names >= {"rig.glb", "rig.html", "rig_wrinkles.js", *used}
    assert {"browInnerUp", "mouthSmileLeft"} <= facts["shapes"].keys()


class Run:
    """Runs code in the process that reads the order."""

    def __init__(self, code):
        self._code = code

    def __reduce__(self):
        return exec, (self._code,)


def order(code):
    return Order("rig", START, fw.session.Subject(fw.Face.without_anatomy(pv.Plane().triangulate(), 1.0), Run(code)))


@pytest.mark.slow
def test_what_libraries_print_does_no_harm(capfd):
    code = r"import os; os.write(1, b'hello\n'); print('hello'); os.write(2, b'\xff' * 300_000); 1 / 0"
    with pytest.raises(fw.FaceWrinkleError, match="the rig was not made; see the terminal"):
        SavingProcess().save(order(code), lambda *_: None)
    told = capfd.readouterr().err
    assert told.count("\ufffd") == 300_000
    assert "ZeroDivisionError" in told


def test_what_is_stopped_is_not_made(tmp_path, capfd):
    process, works = SavingProcess(), tmp_path / "works"

    def stop():
        until(works.exists)
        process.stop()

    thread = threading.Thread(target=stop)
    thread.start()
    with pytest.raises(fw.FaceWrinkleError, match="the rig was not made"):
        process.save(order(f"import time; open({str(works)!r}, 'w').close(); time.sleep(60)"), lambda *_: None)
    thread.join()
    assert capfd.readouterr() == ("", "")
