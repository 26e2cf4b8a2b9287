"""What is read is an ordinary file, and no command replaces it."""

import json
import os
import shutil

import pytest

import facewrinkle as fw
from facewrinkle.anatomy.atlas import load_atlas, read_atlas
from facewrinkle.anatomy.landmarks import read_landmarks
from facewrinkle.cli import main
from facewrinkle.files import LARGEST_SETTINGS, inputs_kept, written

SMALL = ("--size", "60", "--quiet")
SHORT = ("--frames", "2", "--max-level", "0", "--no-movie", *SMALL)

READERS = {"atlas": read_atlas, "landmarks": read_landmarks, "specification": fw.dataset.Spec.read}


@pytest.fixture(scope="module")
def files(face, tmp_path_factory):
    """A scan with a photo and landmarks, a recording, and their bytes."""
    folder = tmp_path_factory.mktemp("files")
    fw.write_mesh(face.mesh, folder / "scan.obj", face)
    shutil.move(folder / "scan_texture.png", folder / "scan.png")
    places = {name: place.tolist() for name, place in face.landmarks.items()}
    (folder / "marks.json").write_text(json.dumps(places))
    meters = {name: [0.001 * value for value in place] for name, place in places.items()}
    (folder / "meters.json").write_text(json.dumps(meters))
    shutil.copy(folder / "scan.obj", folder / "surprise.obj")
    fw.write_mesh(face.mesh, folder / "head.glb", face)
    sim = fw.Simulation(face, refinement=None)
    sim.express("paper_surprise")
    fw.export.write_series(sim.run(2), [0.1, 0.2], folder / "recording.vtkhdf")
    return folder


COMMANDS = {
    "photo": ("fit scan.obj --texture scan.png --landmarks marks.json --out . --quiet", "scan.png"),
    "scan, by its rig": ("rig head.glb --landmarks meters.json --shapes jawOpen --level 0 --out . --quiet", "head.glb"),
    "scan, by a mesh": (
        "express surprise --face surprise.obj --landmarks marks.json --save-mesh obj --out . " + " ".join(SHORT),
        "surprise.obj",
    ),
    "scan, by an animation": (
        f"express AU12 --face head.glb --landmarks meters.json --save-animation head.glb --out new {' '.join(SHORT)}",
        "head.glb",
    ),
    "recording": (
        f"play recording.vtkhdf --landmarks marks.json --max-level 0 --no-movie --series --out . {' '.join(SMALL)}",
        "recording.vtkhdf",
    ),
}


@pytest.mark.parametrize(("words", "name"), COMMANDS.values(), ids=COMMANDS)
def test_a_command_does_not_replace_what_it_read(files, tmp_path, monkeypatch, capsys, words, name):
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert main(words.split()) == 1
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert f"{name}' was read, and would be replaced" in line
    assert line.endswith("Write to another folder: --out.")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.slow
def test_landmarks_that_were_edited_are_written_again(files, tmp_path, monkeypatch):
    """They are kept in it; `fit` says so."""
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "marks.json").rename("scan.landmarks.json")
    (tmp_path / "scan.png").unlink()
    assert main(["fit", "scan.obj", "--landmarks", "scan.landmarks.json", "--out", ".", "--quiet"]) == 0
    assert "landmarks" in json.loads((tmp_path / "scan.landmarks.json").read_text())


def test_programs_name_their_files_themselves(files, tmp_path):
    path = tmp_path / "head.glb"
    shutil.copy(files / "head.glb", path)
    mesh = fw.read_surface(path)
    assert fw.write_mesh(mesh, path) == path
    with inputs_kept():
        fw.read_surface(path)
        with pytest.raises(fw.errors.OutputError, match="was read, and would be replaced"):
            fw.write_mesh(mesh, path)


@pytest.mark.parametrize("what", READERS)
def test_settings_are_ordinary_files(tmp_path, what):
    pipe, large = tmp_path / "pipe", tmp_path / "large"
    os.mkfifo(pipe)
    with large.open("wb") as file:
        file.truncate(LARGEST_SETTINGS + 1)
    link = tmp_path / "link"
    link.symlink_to("/dev/zero")
    for path, problem in ((pipe, "not a regular file"), (link, "not a regular file"), (large, "larger than 256 MB")):
        with pytest.raises(fw.FaceWrinkleError, match=problem):
            READERS[what](path)
    with pytest.raises(fw.FaceWrinkleError, match="it is a folder"):
        READERS[what](tmp_path)


def test_devices_and_pipes_are_not_replaced(face, tmp_path):
    pipe = tmp_path / "pipe.glb"
    os.mkfifo(pipe)
    for write in (lambda: fw.write_mesh(face.mesh, pipe), lambda: fw.write_atlas(face.atlas, pipe)):
        with pytest.raises(fw.errors.OutputError, match="is not a regular file, so nothing is written"):
            write()
    assert pipe.is_fifo()


def test_what_a_link_leads_to_is_replaced(tmp_path):
    real = tmp_path / "files" / "atlas.toml"
    for link in (tmp_path / "link.toml", tmp_path / "other.toml"):
        link.symlink_to(real)
        fw.write_atlas(load_atlas(), link)
        assert link.is_symlink()
        assert read_atlas(real).action_units == load_atlas().action_units
    assert [path.name for path in real.parent.iterdir()] == ["atlas.toml"]


def test_two_files_of_one_name_at_once(tmp_path):
    path = tmp_path / "file.txt"
    with written(path) as one:
        with written(path) as other:
            other.write_text("other")
        one.write_text("one")
    assert path.read_text() == "one"
    assert list(tmp_path.iterdir()) == [path]
