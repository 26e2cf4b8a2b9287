"""The command line from outside: wrong input, wrong usage, help, progress and logs."""

import os
import subprocess
import sys
import warnings
from pathlib import Path
from unittest.mock import Mock

import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle import progress
from facewrinkle.commands.options import FaceOptions, OutputOptions


@pytest.mark.parametrize(
    "arguments, message",
    [
        ("express suprise", "Did you mean 'surprise'"),
        ("express AU1=0.5,frontalis_iner", "unknown expression, action unit or muscle 'frontalis_iner'. Did you mean"),
        ("express AU1=strong", "names with numbers are needed, such as AU1=0.7+AU4; received 'AU1=strong'"),
        ("express AU1=1.5", "AU1 must lie in [0, 1], received 1.5"),
        ("express AU1 --intensity nan", "intensity must lie in [0, 1]"),
        ("express AU1 --frames 0", "the number of frames must lie in [1, 1e+09], received 0"),
        ("express AU1 --size big", "the size must be pixels such as 800 or 800x600, received 'big'"),
        ("express AU1 --size 8", "width and height in pixels must lie in [16, 8192]"),
        ("express AU1 --view forhead", "unknown view 'forhead'. Did you mean 'forehead'"),
        ("express AU1 --fps 0", "fps must lie in"),
        ("express AU1 --depth=-1", "depth must lie in"),
        ("express AU1 --max-level 99", "max_level must lie in [0, 8]"),
        ("express AU1 --landmarks a.json", "--landmarks belongs to a mesh"),
        ("express AU1 --units mm", "--units belongs to a mesh"),
        ("express AU1 --atlas no.toml", "cannot read the atlas 'no.toml'"),
        ("express AU1 --face no.obj --landmarks no.json", "no."),
        ("play no.glb", "there is no file 'no.glb'"),
        ("play folder.glb", "'folder.glb' cannot be opened: it is a folder, and a file is needed"),
        ("play empty.glb", "empty.glb is empty (0 bytes)"),
        ("play broken.glb", "broken.glb cannot be read"),
        ("play broken.vtkhdf", "broken.vtkhdf cannot be read"),
        (
            "play nan.obj",
            "animations are read from .glb, .gltf, .vtkhdf, .usd, .usda, .usdc and .usdz files, received '.obj'",
        ),
        ("pattern forhead", "Did you mean 'forehead'?"),
        ("pattern forehead --view forhead", "Did you mean 'forehead'?"),
        ("pattern forehead --extent=-60,30", "size must be a length, or width and height, greater than 0"),
        ("pattern forehead --extent nan", "size must be finite"),
        ("pattern forehead --depth nan", "depth must lie in"),
        ("pattern forehead --size=-5", "must lie in [16, 8192], received -5"),
        ("pattern forehead --expression nope", "unknown expression, action unit or muscle 'nope'"),
        ("pattern forehead --out empty.glb/folder", "a file stands there"),
        ("pattern forehead --center 0,0,0", "--center belongs to a mesh"),
        ("pattern forehead --center 0,0,0 --face nan.obj", "1 of 3 points are NaN"),
        ("pattern forehead --center 0,0,0 --face folder.glb", "'folder.glb' cannot be opened: it is a folder"),
        ("tear joy --expression nope", "unknown expression, action unit or muscle 'nope'"),
        ("tear joy --fps nan", "fps must lie in [1, 100], received nan"),
        ("tear joy --seconds=-1", "seconds must lie in"),
        ("tear joy --speed nan", "speed must lie in"),
        ("tear joy --roughness 3", "roughness must lie in [0, 1]"),
        ("tear joy --size=-5", "must lie in [16, 8192], received -5"),
        ("tear joy --view forhead", "Did you mean 'forehead'?"),
        ("tear joy --out empty.glb/folder", "a file stands there"),
        ("express AU1 --identity jaw", "such as jaw=0.5,age=1; received 'jaw'"),
        ("express AU1 --identity=", "such as jaw=0.5,age=1; received ''"),
        ("express AU1 --identity jawz=1", "unknown parameter of an identity 'jawz'. Did you mean 'jaw'"),
        ("express AU1 --identity jaw=nan", "jaw must lie in [-1, 1], received nan"),
        ("express AU1 --identity jaw=1 --face nan.obj", "becomes other people; this face has no 'jaw', only an age"),
        ("express AU1 --identity age=2 --face nan.obj", "points of the mesh are NaN"),
        ("fit nan.obj --units furlong", "unknown unit 'furlong'"),
        ("fit nan.obj --texture none.png", "there is no file 'none.png'"),
        ("fit nan.obj --out empty.glb/folder", "a file stands there"),
        ("express xyzzy", "All of them: facewrinkle info."),
        ("express AU1 --face nan.obj --landmarks nan.json", "must be three finite numbers"),
        ("tear dripping --roughness 0.5", "--roughness belongs to tears that run down"),
        ("tear dripping --head extruded", "--head belongs to tears that run down"),
        ("tear shedding --start 1,2,3", "name it with --face"),
        ("tear shedding --landmarks x.json", "--landmarks belongs to a mesh"),
        ("tear shedding --seed -1", "seed must lie in"),
        ("pattern dimple --center 0,0", "--center must be 3 numbers"),
        ("pattern dimple --cycle 2", "t of dimple_l follows from its strength"),
        ("pattern frown --cycle 2 --t 3", "exclude each other"),
        ("pattern frown --valid-share 2", "valid_share must lie"),
        ("pattern dimple --strength 2", "strength must lie"),
        ("pattern dimple --frames 0", "number of frames"),
        ("pattern dimple --number 3", "number"),
        ("pattern forehead --extent 9,9", "larger than the mesh"),
        ("pattern forehead --number 40 --max-level 1", "too coarse to carry the pattern forehead"),
        ("rig --map-size 1000 --wrinkles maps", "power of two"),
        ("rig --map-size 4096 --wrinkles maps", "size of a map must lie in [64, 2048]"),
        ("rig --map-size 512", "add --wrinkles maps, or leave it out"),
        ("rig --level 4 --wrinkles maps", "leave out --level"),
        ("rig --correctives 1000", "correctives must lie in"),
        ("rig --shapes arkitt", "Did you mean 'arkit'"),
        ("rig --level 9", "level must lie in [0, 5]"),
        ("rig --same-mesh", "name that, and give --landmarks"),
        ("rig --same-mesh nobody.face", "name that, and give --landmarks"),
        ("rig --same-mesh nobody.obj --level 1", "leave out one of them"),
        ("rig nobody.obj --face somebody.obj", "named twice"),
        (
            "express AU4 --folds=printed --depth=2",
            "printed wrinkles have no --depth and no limit",
        ),
        (
            "express AU4 --folds=printed --age=1",
            "--age belongs to folds that are waves: add --folds wave",
        ),
        (
            "express AU4 --folds=paper --seed=3",
            "--seed belongs to folds that are waves: add --folds wave",
        ),
        ("express AU4 --age=2", "age must lie in [0, 1], received 2. 0 has no lines at rest."),
        ("express AU4 --density=9", "density must lie in [0.25, 4], received 9. 1 is as on people."),
        ("play take.csv --mesh head", "--mesh is not for take.csv"),
        ("play clip.glb --take-fps 30", "--take-fps is for takes"),
        ("play clip.glb --identity age=1", "--identity is for takes"),
        ("play take.csv", "no file"),
        ("studio --no-browser a.obj --face b.obj", "the face is named twice: leave out --face"),
        ("studio --no-browser --port 70000", "port must lie in [0, 65535], received 70000"),
        ("studio --no-browser nowhere.obj", "nowhere.obj"),
        ("express AU1 --view=", "view"),
        ("express AU1 --face=", "file"),
        ("express AU1 --face \0", "file"),
        ("express AU1 --face a.txt", ".txt"),
        ("express AU1 --face text.obj", "text.obj"),
        ("express AU1 --face bad.face", "bad.face"),
        ("express AU1 --gamma-c nan", "gamma_c"),
        ("express AU1 --samples=-1", "samples"),
        ("pattern forehead --sharpness nan", "sharpness"),
        ("pattern forehead --variation=-1", "variation"),
    ],
)
def test_every_command_refuses_bad_input_in_one_line(arguments, message, tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.glb").mkdir()
    for name, content in {
        "empty.glb": b"",
        "broken.glb": b"glTF\x02\0\0\0broken",
        "broken.vtkhdf": b"\x89HDF\r\n\x1a\nbroken",
        "nan.obj": b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n",
        "nan.json": b'{"nose_tip": [NaN, 0, 0]}',
        "text.obj": b"hello",
        "a.txt": b"x",
        "bad.face": b"PK",
    }.items():
        (tmp_path / name).write_bytes(content)
    before = set(tmp_path.rglob("*"))
    out, err = run(*arguments.split(), code=1)
    assert out == ""
    assert err.startswith("facewrinkle: ")
    assert message in err
    assert err.count("\n") == 1
    assert set(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["expres"], "express"),
        (["play"], "FILE"),
        (["express", "surprise", "--framez", "3"], "--framez"),
        (["express", "surprise", "--frames", "many"], "many"),
        (["tear", "weepin"], "weeping"),
        (["tear", "shedding", "--reveal", "depth"], "reveal"),
        (["express", "AU1", "--frames", "2.5"], "2.5"),
        (["express", "AU1", "--seed", "1.5"], "1.5"),
        (["express", "surprise", "--folds", "none"], '"wave", "paper", "printed"'),
        (["express", "--", "surprise", "--frames", "3"], "Arguments after -- are not options: put options before it."),
    ],
)
def test_wrong_usage_is_one_line_with_a_hint(arguments, message, run):
    out, err = run(*arguments, code=2)
    assert out == ""
    assert message in err
    assert err.rstrip().endswith("--help")
    assert err.count("\n") == 1


@pytest.mark.parametrize("arguments", [[], ["--help"], ["express", "--help"], ["--version"]])
def test_help_and_version(arguments, run):
    out, err = run(*arguments)
    assert err == ""
    assert (fw.__version__ if arguments == ["--version"] else "Usage: facewrinkle") in out


@pytest.mark.parametrize("columns", ["0", "1", "2"])
def test_help_on_the_narrowest_terminals(columns, monkeypatch, run):
    """They had it end in an error, or never."""
    monkeypatch.setenv("COLUMNS", columns)
    shown = "".join(run("express", "--help").out.split())
    assert shown.startswith("Usage:facewrinkleexpress")
    assert "--folds" in shown


def test_help_loads_no_heavy_package():
    probe = (
        "import sys; from facewrinkle.cli import main; main(['--help']); "
        "sys.exit(' '.join({'numba', 'scipy', 'pyvista', 'matplotlib'} & set(sys.modules)) or 0)"
    )
    result = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        pytest.param(
            ["express", "AU4", "--frames", "2"], ("Preparing the skin", "Frames", "Drawing"), marks=pytest.mark.slow
        ),
        (
            ["pattern", "dimple", "--face", "ball.ply", "--units", "mm", "--center", "0,0,40", "--frames", "2"],
            ("Frames", "Pictures"),
        ),
    ],
)
def test_progress_is_shown_on_a_terminal_only(tmp_path, monkeypatch, run, command, shown):
    monkeypatch.chdir(tmp_path)
    pv.Sphere(radius=40.0).save("ball.ply")
    command = [*command, "--no-movie", "--size", "60", "--out", str(tmp_path)]
    assert run(*command).err == ""
    monkeypatch.setattr("rich.console.Console.is_terminal", True)
    err = run(*command).err
    assert [what for what in shown if what not in err] == []
    assert run(*command, "--quiet") == ("", "")


def test_what_is_no_plain_mesh_says_what_to_do_with_it(tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "head.face").write_bytes(b"PK\x03\x04")
    assert "has been fitted" in run("fit", "head.face", code=1).err
    pv.Sphere(radius=40.0).save(tmp_path / "ball.ply")
    assert (
        "the region lies off the mesh"
        in run("pattern", "dimple", "--face", "ball.ply", "--center", "0,0,90", "--out", ".", code=1).err
    )
    assert not (tmp_path / "output").exists()


def test_errors_of_our_own_are_one_line(monkeypatch, run):
    def work(*_: object, **__: object) -> None:
        warnings.warn("a library mumbles", RuntimeWarning, stacklevel=1)
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("facewrinkle.cli.app", work)
    err = run("info", code=1).err
    assert err.count("\n") == 1
    assert "ZeroDivisionError: division by zero. Please report it with the output of --verbose." in err
    err = run("info", "--verbose", code=1).err
    assert "Traceback" in err
    for error, said in ((MemoryError(), "not enough memory"), (OSError(5, "Input/output error"), "the system refused")):
        monkeypatch.setattr("facewrinkle.cli.app", Mock(side_effect=error))
        assert said in run("info", code=1).err


def test_faces_have_folders_of_their_own():
    mine, hers = FaceOptions(face=Path("scans/anna.obj")), FaceOptions(identity="jaw=0.5, age=1")
    assert [OutputOptions().folder("happiness", source.label) for source in (FaceOptions(), mine, hers)] == [
        Path("output/happiness"),
        Path("output/anna/happiness"),
        Path("output/jaw=0.5_age=1/happiness"),
    ]
    assert OutputOptions(out=Path("x")).folder("happiness", "anna") == Path("x")


@pytest.mark.parametrize("shell", ["bash", *(pytest.param(name, marks=pytest.mark.slow) for name in ("zsh", "fish"))])
def test_commands_and_options_are_completed(shell, run):
    script = run("completion", shell).out
    for word in ("express", "pattern", "intensity", "landmarks"):
        assert word in script


@pytest.mark.slow
def test_what_a_terminal_cannot_show_ends_no_command(tmp_path):
    """Such as the name of a file, where Windows writes into a file; the module runs."""
    (tmp_path / "λ → 頭.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    environment = os.environ | {"PYTHONIOENCODING": "cp1252"}
    command = [sys.executable, "-m", "facewrinkle", "info", "λ → 頭.obj"]
    run = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert (run.returncode, run.stderr) == (0, b"")
    assert b"1 triangles" in run.stdout
    assert b"? ? ?.obj" in run.stdout


# --- what a log says -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("seconds", "total", "said"),
    [
        (1.0, 100, [f"Making {k}/100" for k in range(10, 100, 10)]),
        (0.01, 100, []),
        (0.01, 10000, [f"Making {k}/10000" for k in range(1000, 10000, 1000)]),
        (30.0, 5, [f"Making {k}/5" for k in range(1, 5)]),
        (1.0, 1000, [f"Making {k}/1000" for k in range(60, 1000, 60)]),
    ],
)
def test_a_log_has_a_line_each_tenth_or_minute(seconds, total, said, monkeypatch, capsys):
    monkeypatch.delenv("FACEWRINKLE_PROGRESS", raising=False)
    clock = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    for _ in progress.bar_or_lines(range(total), "Making", total):
        clock[0] += seconds
    assert capsys.readouterr().err.splitlines() == said


def test_from_python_nothing_is_said_without_a_terminal(monkeypatch, capsys):
    monkeypatch.delenv("FACEWRINKLE_PROGRESS", raising=False)
    assert list(progress.bar(range(3), "Making", 3)) == [0, 1, 2]
    assert capsys.readouterr().err == ""
