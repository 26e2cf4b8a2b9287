"""Folders and files that can be written, and those that cannot; a pipe is not waited for. What is read is an ordinary
file, and no command replaces it.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import read_landmarks
from facewrinkle.cli import main
from facewrinkle.errors import OutputError
from facewrinkle.export import output_folder, write_mesh, write_movie, write_series
from facewrinkle.files import (
    LARGEST_SETTINGS,
    bytes_of,
    check_file,
    drop_unfinished,
    inputs_kept,
    remove_stale,
    replaced,
    text_of,
    write_whole,
    written,
)


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
        *((Path, "mkdir", refuse) if operation == "mkdir" else ("facewrinkle.files.TemporaryFile", refuse))
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


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664])
def test_what_is_replaced_keeps_who_may_read_it(tmp_path, mode):
    (tmp_path / "link").symlink_to(tmp_path / "file")
    path = write_whole(tmp_path / "file", "old")
    path.chmod(mode)
    before = path.stat().st_ino
    write_whole(tmp_path / "link", "new")
    assert path.stat().st_ino != before
    assert path.stat().st_mode & 0o777 == mode


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


def test_a_full_disk_keeps_what_was_there(small_disk, face):
    (small_disk / "head.glb").write_bytes(b"an older head")
    (small_disk / "rest").write_bytes(bytes(8_300_000))
    calls = [
        lambda: write_mesh(face.mesh, small_disk / "head.glb", face, parts=True),
        lambda: fw.write_face(face, small_disk / "head.face"),
        lambda: fw.plotting.save_picture(
            np.random.default_rng(0).integers(0, 256, (300, 300, 3), np.uint8), small_disk / "a.png"
        ),
    ]
    for call in calls:
        with pytest.raises(OutputError, match="no space left on its disk"):
            call()
    assert (small_disk / "head.glb").read_bytes() == b"an older head"
    assert sorted(file.name for file in small_disk.iterdir()) == ["head.glb", "rest"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("read", [bytes_of, text_of, check_file, fw.read_texture, fw.read_atlas, fw.read_surface])
def test_what_became_a_pipe_is_not_waited_for(tmp_path, monkeypatch, read):
    """However it looked before it is opened."""
    os.mkfifo(tmp_path / "pipe.ply")
    ordinary = Path(__file__).stat()
    monkeypatch.setattr(Path, "stat", lambda path, **how: ordinary)
    monkeypatch.setattr(Path, "is_file", lambda path: True)
    signal.signal(signal.SIGALRM, lambda *_: pytest.fail("it waits for ever"))
    signal.alarm(5)
    try:
        with pytest.raises((OSError, fw.FaceWrinkleError, fw.FaceWrinkleWarning), match="not a regular file"):
            read(tmp_path / "pipe.ply")
    finally:
        signal.alarm(0)


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="no limit of file sizes here")
def test_the_limit_of_file_sizes_is_told(tmp_path):
    """In a process of its own, as the limit cannot be raised again."""
    program = (
        "import resource, sys\n"
        "from pathlib import Path\n"
        "from facewrinkle.files import written\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "with written(sys.argv[1]) as whole:\n    whole.write_bytes(bytes(5000))\n"
    )
    (tmp_path / "file").write_text("old")
    run = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "file")], capture_output=True, text=True, check=False
    )
    assert "it would be larger than files may be here" in run.stderr
    assert "ulimit -f" in run.stderr
    assert "no space left" not in run.stderr
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]


def test_a_later_failure_keeps_a_folder_that_an_earlier_success_made(tmp_path):
    with written(tmp_path / "new" / "file") as whole:
        whole.touch()
    (tmp_path / "new" / "file").unlink()
    with pytest.raises(KeyboardInterrupt), written(tmp_path / "new" / "file"):
        raise KeyboardInterrupt
    assert (tmp_path / "new").is_dir()


def test_unfinished_files_can_be_dropped(tmp_path):
    with replaced(tmp_path / "new" / "deep" / "file.txt") as whole:
        whole.write_text("half of")
        drop_unfinished()
        assert not list(tmp_path.iterdir())
        whole.parent.mkdir(parents=True)
        whole.write_text("all")
    assert (tmp_path / "new" / "deep" / "file.txt").read_text() == "all"


def test_what_the_last_run_wrote_alone_is_removed(tmp_path):
    old, new, changed, theirs = (tmp_path / name for name in ("old.png", "new.png", "changed.png", "theirs.png"))
    below, record, outside = tmp_path / "masks" / "a.tif", tmp_path / ".a.files", tmp_path.parent / "outside.png"
    for path in (old, new, changed, theirs, below, outside):
        write_whole(path, "old")
    assert remove_stale(record, [old, new, changed, below, outside]) == []
    changed.write_text("by a person")
    os.utime(changed, ns=(2 * record.stat().st_mtime_ns,) * 2)
    assert sorted(remove_stale(record, [new])) == sorted([old, below])
    assert sorted(tmp_path.iterdir()) == sorted([new, changed, theirs, record])
    assert outside.exists()
    record.write_text("../outside.png\nnone\n\0\n" + str(outside))
    assert remove_stale(record, [new]) == []
    assert outside.exists()


def test_what_a_command_reads_is_never_stale(tmp_path):
    read, record = tmp_path / "a.vtkhdf", tmp_path / ".a.files"
    write_whole(read, "old")
    remove_stale(record, [read])
    with inputs_kept():
        bytes_of(read)
        assert remove_stale(record, []) == []
    assert read.exists()


def test_the_number_of_a_file_that_is_gone_is_free(tmp_path):
    gone, new = tmp_path / "gone", tmp_path / "new"
    gone.write_text("read")
    with inputs_kept():
        bytes_of(gone)
        gone.rename(new)  # as good as a new file that gets the number
        write_whole(new, "written")
    assert new.read_text() == "written"


SMALL = ("--size", "60", "--quiet")
SHORT = ("--frames", "2", "--max-level", "0", "--no-movie", *SMALL)

READERS = {"atlas": fw.read_atlas, "landmarks": read_landmarks, "specification": fw.dataset.Spec.read}


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
        fw.write_atlas(fw.anatomy.load_atlas(), link)
        assert link.is_symlink()
        assert fw.read_atlas(real).action_units == fw.anatomy.load_atlas().action_units
    assert [path.name for path in real.parent.iterdir()] == ["atlas.toml"]


def test_two_files_of_one_name_at_once(tmp_path):
    path = tmp_path / "file.txt"
    with written(path) as one:
        with written(path) as other:
            other.write_text("other")
        one.write_text("one")
    assert path.read_text() == "one"
    assert list(tmp_path.iterdir()) == [path]
