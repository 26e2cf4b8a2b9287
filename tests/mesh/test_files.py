"""Folders and files that can be written, and those that cannot."""

from __future__ import annotations

from pathlib import Path

import pytest

from facewrinkle.errors import OutputError
from facewrinkle.export import output_folder, write_movie, write_series
from facewrinkle.mesh.files import replaced


def test_output_folder(tmp_path, monkeypatch):
    folder = output_folder(tmp_path / "a" / "b")
    assert folder.is_dir()
    assert output_folder(str(folder)) == folder
    assert not list(folder.iterdir())
    monkeypatch.setenv("HOME", str(tmp_path))
    assert output_folder("~/c") == tmp_path / "c"


def test_a_file_in_the_place_of_the_folder(tmp_path):
    (tmp_path / "file").write_text("something")
    for path in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(OutputError, match="a file stands there or on the way to it. Name another"):
            output_folder(path)
    assert (tmp_path / "file").read_text() == "something"


@pytest.mark.parametrize("operation", ["mkdir", "write"])
def test_a_folder_that_refuses(tmp_path, monkeypatch, operation):
    """Simulated, since root passes permission bits."""

    def refuse(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(
        *((Path, "mkdir", refuse) if operation == "mkdir" else ("facewrinkle.mesh.files.TemporaryFile", refuse))
    )
    with pytest.raises(OutputError, match="cannot be written: Permission denied. Name a folder"):
        output_folder(tmp_path / "new")


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder that nobody can write to")
def test_a_folder_that_nobody_can_write_to():
    with pytest.raises(OutputError, match="cannot be written"):
        output_folder("/proc/facewrinkle")


@pytest.mark.parametrize("name", ["x" * 300, "null\0"])
def test_names_that_no_file_can_have(tmp_path, name):
    for call in (
        lambda: output_folder(tmp_path / name),
        lambda: write_movie([], tmp_path / f"{name}.gif"),
        lambda: write_series([], [0.0], tmp_path / f"{name}.vtkhdf"),
    ):
        with pytest.raises(OutputError, match="cannot be written"):
            call()
    assert not list(tmp_path.iterdir())


def test_a_file_is_whole_or_not_there(tmp_path):
    path = tmp_path / "a" / "b" / "c.txt"

    def half(problem):
        with replaced(path) as beside:
            beside.write_text("half")
            raise problem

    for problem in (ValueError, KeyboardInterrupt):
        with pytest.raises(problem):
            half(problem)
        assert not list(tmp_path.iterdir())
    with replaced(path) as beside:
        beside.write_text("old")
        assert beside.suffix == path.suffix
        assert not path.exists()
    with pytest.raises(ValueError, match="late"):
        half(ValueError("late"))
    assert path.read_text() == "old"
    assert list(path.parent.iterdir()) == [path]


def test_folders_that_others_use_stay(tmp_path):
    def disturbed():
        with replaced(tmp_path / "new" / "mine") as beside:
            beside.with_name("theirs").touch()
            raise ValueError("mine")

    with pytest.raises(ValueError, match="mine"):
        disturbed()
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["theirs"]


def test_the_last_of_several_removes_the_folder(tmp_path):
    def both():
        with replaced(tmp_path / "a" / "b" / "movie") as one, replaced(tmp_path / "a" / "b" / "series") as other:
            other.touch()
            one.touch()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        both()
    assert not list(tmp_path.iterdir())
