"""The command line from outside: what it prints, what it writes, and with which code it ends."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import logging
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.vtkIOHDF import vtkHDFReader

import facewrinkle as fw
from facewrinkle.anatomy.atlas import DEFAULT_ATLAS, load_atlas
from facewrinkle.anatomy.landmarks import write_landmarks
from facewrinkle.cli import main
from facewrinkle.commands import demo as demo_module
from facewrinkle.commands import recorder as recorder_module
from facewrinkle.commands.express import FIELDS, Performance
from facewrinkle.commands.options import FaceOptions
from facewrinkle.commands.parsing import parse_mixture
from facewrinkle.commands.report import Report
from facewrinkle.commands.table1 import PAPER, as_text, measure
from facewrinkle.errors import MissingPackageError, ParameterError, UnknownNameError

SIZE, FRAMES = 96, 6
STEPS = FRAMES + FRAMES // 2
FEW = ["--frames", str(FRAMES), "--size", str(SIZE)]
PROGRAM = [sys.executable, "-m", "facewrinkle"]


def shape(path: Path) -> tuple[int, ...]:
    return pv.read_texture(path).to_array().shape[:2]


def movie_frames(path: Path, height: int, width: int) -> np.ndarray:
    """The pictures of a movie of this size, decoded by ffmpeg itself."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    command = [ffmpeg, "-loglevel", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, height, width, 3)


def series(path: Path) -> tuple[int, int]:
    """Number of steps, and of points of the last one."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    reader.SetStep(reader.GetNumberOfSteps() - 1)
    reader.Update()
    return reader.GetNumberOfSteps(), reader.GetOutput().GetNumberOfPoints()


# --- express ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def surprise(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cli") / "new" / "folder"
    assert main(["express", "surprise", *FEW, "--out", str(folder)]) == 0
    return folder


def test_express_writes_all_files(surprise):
    pictures = {"surprise.png", "surprise_closeup.png"} | {f"surprise_{name}.png" for name in FIELDS}
    assert {path.name for path in surprise.iterdir()} == pictures | {"surprise.mp4", "surprise.vtkhdf"}
    for name in ("surprise.png", "surprise_closeup.png"):
        assert shape(surprise / name) == (SIZE, 4 * SIZE + 3 * 4)
    for name in FIELDS:
        assert shape(surprise / f"surprise_{name}.png") == (SIZE, SIZE)


def test_express_movie_shows_face_and_closeup_there_and_back(surprise):
    images = movie_frames(surprise / "surprise.mp4", SIZE, 2 * SIZE + 4)
    assert len(images) == STEPS
    away = [np.abs(image.astype(int) - images[0]).mean() for image in images]
    assert np.argmax(away) in range(FRAMES - 2, FRAMES + 2)
    assert away[-1] < 0.8 * max(away)


def test_express_series_holds_every_step(surprise):
    steps, points = series(surprise / "surprise.vtkhdf")
    assert steps == STEPS
    assert points >= fw.default_face().mesh.n_points


def test_express_reports_what_it_did(tmp_path, capsys):
    assert main(["express", "AU4", *FEW, "--no-movie", "--no-series", "--out", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "4517 → " in out
    assert "mm" in out
    for path in tmp_path.iterdir():
        assert path.name in out
    assert not list(tmp_path.glob("*.mp4")) + list(tmp_path.glob("*.vtkhdf"))


def test_express_quiet_prints_nothing(tmp_path, capfd):
    name = "AU1=0.5,corrugator_l"
    assert main(["express", name, *FEW, "--quiet", "--out", str(tmp_path)]) == 0
    assert capfd.readouterr() == ("", "")
    assert {path.suffix for path in tmp_path.iterdir()} == {".png", ".mp4", ".vtkhdf"}


def test_express_default_folder_and_safe_names(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["express", "AU1=0.5, AU4", *FEW, "--no-movie", "--no-series"]) == 0
    assert (tmp_path / "output" / "AU1=0.5_AU4" / "AU1=0.5_AU4.png").is_file()


def test_express_options_reach_the_simulation(tmp_path, monkeypatch):
    seen: list[Performance] = []
    monkeypatch.setattr("facewrinkle.commands.express.record", lambda performance, *rest: seen.append(performance))
    options = ["--intensity=0.5", "--frames=7", "--max-level=3", "--gamma-c=0.1", "--samples=3", "--depth=2"]
    options += ["--alpha=1.5", "--count=3", "--ends=paper", "--compression=edges", "--size=64x48", "--view=nose"]
    assert main(["express", "AU4", *options, "--fps=10", "--out", str(tmp_path)]) == 0
    (performance,) = seen
    assert performance.rates == {"corrugator_l": 0.5, "corrugator_r": 0.5}
    assert (performance.frames, performance.size, performance.view, performance.fps) == (7, (64, 48), "nose", 10.0)
    refinement = performance.refinement
    assert (refinement.max_level, refinement.gamma_c, refinement.samples) == (3, 0.1, 3.0)
    assert (performance.layer.depth, performance.layer.compression) == (2.0, "edges")
    for name, muscle in performance.face.muscles.items():
        original = fw.default_face().muscles[name].fold_pattern.wrinkles
        wrinkles = muscle.fold_pattern.wrinkles
        if name in performance.rates:
            assert (wrinkles.alpha, wrinkles.count, wrinkles.ends) == (1.5, 3, "paper")
            assert wrinkles.depth == original.depth
        else:
            assert dataclasses.astuple(wrinkles) == dataclasses.astuple(original)


def test_express_on_another_mesh(tmp_path, capsys):
    head = fw.default_face()
    head.mesh.scale(0.001).save(tmp_path / "head.vtp")
    write_landmarks({name: point * 0.001 for name, point in head.landmarks.items()}, tmp_path / "head.json")
    source = ["--face", str(tmp_path / "head.vtp"), "--landmarks", str(tmp_path / "head.json"), "--units", "m"]
    few = [*FEW, "--no-movie", "--no-series", "--max-level", "1", "--depth", "0.1", "--view", "front"]
    assert main(["express", "AU46", *source, *few, "--out", str(tmp_path / "out")]) == 0
    assert "4517 → " in capsys.readouterr().out
    assert (tmp_path / "out" / "AU46.png").is_file()


def test_fit_finds_a_face_and_express_takes_it(tmp_path, capsys):
    head = fw.default_face()
    head.mesh.scale(0.001).rotate_y(40).flip_faces().save(tmp_path / "head.vtp")
    (tmp_path / "some.json").write_text(json.dumps({"nose_tip": _turned(head.landmarks["nose_tip"])}))
    arguments = ["fit", str(tmp_path / "head.vtp"), "--landmarks", str(tmp_path / "some.json"), "--units", "m"]
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    assert "4517" in told
    assert "mended and set apart" in told
    assert "oriented inward" in told
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "head.face",
        "head.landmarks.json",
        "head.png",
    ]
    found = json.loads((tmp_path / "out" / "head.landmarks.json").read_text())["landmarks"]
    assert found["zygion_l"]["estimated"]
    assert not found["nose_tip"]["estimated"]
    for name in ("nose_tip", "mouth_l", "eye_r_outer"):
        np.testing.assert_allclose(found[name]["xyz"], _turned(head.landmarks[name]), atol=0.002)
    few = [*FEW, "--no-movie", "--no-series", "--max-level", "1", "--view", "front"]
    source = ["--face", str(tmp_path / "out" / "head.face")]
    assert main(["express", "AU4", *source, *few, "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "AU4.png").is_file()
    assert main(["express", "AU4", *source, "--units", "mm"]) == 1
    assert "head.face has its own units: leave out --units." in capsys.readouterr().err


def _turned(point):
    """A place on the head after it was made a thousand times smaller and turned by 40 degrees about y."""
    cos, sin = np.cos(np.radians(40.0)), np.sin(np.radians(40.0))
    return [0.001 * (cos * point[0] + sin * point[2]), 0.001 * point[1], 0.001 * (cos * point[2] - sin * point[0])]


def test_express_with_another_atlas(tmp_path):
    other = tmp_path / "other.toml"
    text = DEFAULT_ATLAS.read_text(encoding="utf-8")
    other.write_text(text.replace("[expressions]", "[expressions]\nscowl = { corrugator = 0.5 }"), encoding="utf-8")
    face = FaceOptions(atlas=other).load()
    assert face.atlas.contractions("scowl") == {"corrugator_l": 0.5, "corrugator_r": 0.5}
    assert face.texture is not None
    assert face.brows is not None


def test_express_on_somebody(tmp_path):
    face = FaceOptions(identity="jaw=0.5, age=1").load()
    expected = fw.default_face(fw.Identity(jaw=0.5, age=1.0))
    assert np.array_equal(face.points, expected.points)
    assert not np.array_equal(face.points, fw.default_face().points)
    for text, message in (("jaw", "like jaw=0.5"), ("jaw=2", "jaw must lie"), ("yaw=1", "unknown parameter")):
        with pytest.raises(fw.FaceWrinkleError, match=message):
            FaceOptions(identity=text).load()
    with pytest.raises(fw.FaceWrinkleError, match="built-in head"):
        FaceOptions(identity="jaw=1", face=tmp_path / "mesh.obj").load()


def test_without_imageio_the_movie_is_skipped_with_a_notice(tmp_path, monkeypatch, capsys):
    def missing(*_: object) -> None:
        raise MissingPackageError("movies need the package imageio, which is not installed.")

    monkeypatch.setattr(recorder_module, "movie_writer", missing)
    stale = tmp_path / "AU4.mp4"
    stale.write_bytes(b"of an earlier run")
    assert main(["express", "AU4", *FEW, "--out", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert err == "facewrinkle: note: no movie is written: movies need the package imageio, which is not installed.\n"
    assert "AU4.mp4" not in out
    assert not stale.exists()
    assert series(tmp_path / "AU4.vtkhdf")[0] == STEPS
    assert (tmp_path / "AU4_closeup.png").is_file()


# --- wrong input ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["suprise"], "Did you mean 'surprise'"),
        (["AU1=0.5,frontalis_iner"], "unknown expression, action unit or muscle 'frontalis_iner'. Did you mean"),
        (["AU1=strong"], "the weight of AU1 must be a number, received 'strong'"),
        (["AU1=1.5"], "AU1 must lie in [0, 1], received 1.5"),
        (["AU1", "--intensity", "nan"], "intensity must lie in [0, 1]"),
        (["AU1", "--frames", "0"], "the number of frames must lie in [1, 1e+09], received 0"),
        (["AU1", "--size", "big"], "the size must be pixels such as 800 or 800x600, received 'big'"),
        (["AU1", "--size", "8"], "width and height in pixels must lie in [16, 8192]"),
        (["AU1", "--view", "forhead"], "unknown view 'forhead'. Did you mean 'forehead'"),
        (["AU1", "--fps", "0"], "fps must lie in"),
        (["AU1", "--depth=-1"], "depth must lie in"),
        (["AU1", "--max-level", "99"], "max_level must lie in [0, 8]"),
        (["AU1", "--landmarks", "a.json"], "--landmarks belongs to a mesh"),
        (["AU1", "--units", "mm"], "--units belongs to a mesh"),
        (["AU1", "--atlas", "no.toml"], "cannot read the atlas 'no.toml'"),
        (["AU1", "--face", "no.obj", "--landmarks", "no.json"], "no."),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["express", *arguments, "--out", "folder"]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("facewrinkle: ")
    assert message in err
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "arguments, message",
    [
        ("play no.glb", "there is no file 'no.glb'"),
        ("play folder.glb", "'folder.glb' is a folder, and a mesh file is needed"),
        ("play empty.glb", "empty.glb is empty (0 bytes)"),
        ("play broken.glb", "broken.glb cannot be read"),
        ("play broken.vtkhdf", "broken.vtkhdf cannot be read"),
        (
            "play nan.obj",
            "animations are read from .glb, .gltf, .vtkhdf, .usd, .usda, .usdc and .usdz files, received '.obj'",
        ),
        ("play broken.glb --size=-5", "width and height in pixels must lie in [16, 8192], received -5"),
        ("play broken.glb --fps nan", "fps must lie in [1, 100], received nan"),
        ("play broken.glb --moments 0", "moments must lie in [1, 100]"),
        ("play broken.glb --view forhead", "Did you mean 'forehead'?"),
        ("pattern forhead", "Did you mean 'forehead'?"),
        ("pattern forehead --view forhead", "Did you mean 'forehead'?"),
        ("pattern forehead --extent=-60,30", "size must be a finite number greater than 0"),
        ("pattern forehead --extent nan", "size must be a finite number greater than 0"),
        ("pattern forehead --depth nan", "depth must lie in"),
        ("pattern forehead --size=-5", "must lie in [16, 8192], received -5"),
        ("pattern forehead --expression nope", "unknown expression, action unit or muscle 'nope'"),
        ("pattern forehead --out empty.glb/folder", "a file stands there"),
        ("pattern forehead --centre 0,0,0", "--centre belongs to a mesh"),
        ("pattern forehead --centre 0,0,0 --face nan.obj", "1 of 3 points are NaN"),
        ("pattern forehead --centre 0,0,0 --face folder.glb", "'folder.glb' is a folder"),
        ("tear joy --expression nope", "unknown expression, action unit or muscle 'nope'"),
        ("tear joy --fps nan", "fps must lie in [1, 100], received nan"),
        ("tear joy --seconds=-1", "seconds must lie in"),
        ("tear joy --speed nan", "speed must lie in"),
        ("tear joy --roughness 3", "roughness must lie in [0, 1]"),
        ("tear joy --size=-5", "must lie in [16, 8192], received -5"),
        ("tear joy --view forhead", "Did you mean 'forehead'?"),
        ("tear joy --out empty.glb/folder", "a file stands there"),
        ("express AU1 --identity jaw", "the identity must be like jaw=0.5,age=1; received 'jaw'"),
        ("express AU1 --identity=", "the identity must be like jaw=0.5,age=1; received ''"),
        ("express AU1 --identity jawz=1", "unknown parameter of an identity 'jawz'. Did you mean 'jaw'"),
        ("express AU1 --identity jaw=nan", "jaw must lie in [-1, 1], received nan"),
        ("express AU1 --identity jaw=1 --face nan.obj", "leave out --face, or --identity"),
        ("express AU1 --identity jaw=1 --face none.face", "leave out --face, or --identity"),
        ("pattern forehead --number 5 --spacing 3", "--number and --spacing exclude each other"),
        ("fit nan.obj --units furlong", "unknown unit 'furlong'"),
        ("fit nan.obj --texture none.png", "there is no file 'none.png'"),
        ("fit nan.obj --out empty.glb/folder", "a file stands there"),
        ("express xyzzy", "All of them: facewrinkle info."),
        ("express AU1 --face nan.obj --landmarks nan.json", "must have three finite coordinates"),
        ("express AU1 --atlas folder.glb", "cannot read the atlas"),
    ],
)
def test_every_command_refuses_bad_input_in_one_line(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.glb").mkdir()
    for name, content in {
        "empty.glb": b"",
        "broken.glb": b"glTF\x02\0\0\0broken",
        "broken.vtkhdf": b"\x89HDF\r\n\x1a\nbroken",
        "nan.obj": b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n",
        "nan.json": b'{"nose_tip": [NaN, 0, 0]}',
    }.items():
        (tmp_path / name).write_bytes(content)
    before = set(tmp_path.rglob("*"))
    assert main(arguments.split()) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("facewrinkle: ")
    assert message in err
    assert err.count("\n") == 1
    assert set(tmp_path.rglob("*")) == before


def test_a_folder_that_cannot_be_written_is_found_before_the_work(tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    begin = time.perf_counter()
    assert main(["express", "surprise", "--frames", "100000", "--out", str(tmp_path / "file" / "folder")]) == 1
    assert time.perf_counter() - begin < 30.0
    assert "a file stands there" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["expres"], "express"),
        (["express"], "NAME"),
        (["express", "surprise", "--framez", "3"], "--framez"),
        (["express", "surprise", "--frames", "many"], "many"),
        (["express", "surprise", "--compression", "none"], '"gradient", "edges"'),
    ],
)
def test_wrong_usage_is_one_line_with_a_hint(arguments, message, capsys):
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert err.rstrip().endswith("--help")
    assert err.count("\n") == 1


@pytest.mark.skipif(os.name == "nt", reason="signals are another thing there")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("there", [False, True])
def test_an_interrupted_run_leaves_nothing_half_done(tmp_path, number, there):
    folder = tmp_path / "deep" / "out"
    command = [*PROGRAM, "express", "surprise", "--frames", "100000", "--size", "100", "--out", str(folder)]
    if there:
        folder.mkdir(parents=True)
        (folder / "surprise.mp4").write_bytes(b"of an earlier run")
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 120.0
        while len(list(folder.glob(".*"))) < 2 and time.monotonic() < deadline:  # movie and series have begun
            time.sleep(0.1)
        assert len(list(folder.glob(".*"))) == 2
        time.sleep(0.5)
        try:
            process.send_signal(number)
            out, err = process.communicate(timeout=60.0)
        finally:
            process.kill()
    assert (process.returncode, out) == (128 + number, "")
    assert "Traceback" not in err
    assert err.splitlines()[-1] == "facewrinkle: interrupted."
    if there:
        assert [(path.name, path.read_bytes()) for path in folder.iterdir()] == [("surprise.mp4", b"of an earlier run")]
    else:
        assert not list(tmp_path.iterdir())


def test_interrupt_inside_a_finalizer_is_not_lost(monkeypatch, capsys):
    class Finalized:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    def work(*_: object, **__: object) -> None:
        Finalized()
        for _ in range(200):  # the interrupt was dropped in there; it comes again
            time.sleep(0.05)

    monkeypatch.setattr("facewrinkle.cli.app", work)
    hooks = signal.getsignal(signal.SIGINT), sys.unraisablehook
    assert main(["info"]) == 130
    assert capsys.readouterr().err == "facewrinkle: interrupted.\n"
    assert (signal.getsignal(signal.SIGINT), sys.unraisablehook) == hooks


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_that_a_library_drops_ends_a_long_work(number, monkeypatch, capsys):
    begun = []

    def work(*_: object, **__: object) -> None:
        for item in Report(quiet=True).progress(iter(range(10)), "Frames", 10):
            begun.append(item)
            with contextlib.suppress(KeyboardInterrupt):
                if item == 3:
                    signal.raise_signal(number)

    monkeypatch.setattr("facewrinkle.cli.app", work)
    assert main(["info"]) == 128 + number
    assert capsys.readouterr().err == "facewrinkle: interrupted.\n"
    assert begun == [0, 1, 2, 3]


# --- the other commands --------------------------------------------------------------------------


def test_info_lists_every_name(capsys):
    atlas = load_atlas()
    names = {
        "muscles": {muscle.removesuffix("_l").removesuffix("_r") for muscle in atlas.muscles},
        "action-units": set(atlas.action_unit_names),
        "expressions": set(atlas.expressions),
    }
    first_words = {}
    for topic, known in names.items():
        assert main(["info", topic]) == 0
        first_words[topic] = {line.split()[0] for line in capsys.readouterr().out.splitlines() if line.strip()}
        assert known <= first_words[topic]
    assert main(["info"]) == 0
    everything = {line.split()[0] for line in capsys.readouterr().out.splitlines() if line.strip()}
    assert set().union(*names.values()) <= everything


def test_mixtures():
    atlas = load_atlas()
    assert parse_mixture("AU1=0.7,AU4", atlas) == {"AU1": 0.7, "AU4": 1.0}
    assert parse_mixture("corrugator", atlas) == {"corrugator": 1.0}
    for name in [*atlas.expressions, *atlas.action_units, *atlas.muscles]:
        assert parse_mixture(name, atlas) == {name: 1.0}
    with pytest.raises(UnknownNameError, match="'' *"):
        parse_mixture("AU1,", atlas)


def test_names_of_files_are_printed_as_they_are(tmp_path, capsys):
    path = tmp_path / "scan [v2] [red] [] :eyes:.ply"
    pv.Sphere(theta_resolution=8, phi_resolution=8).save(path)
    assert main(["info", str(path)]) == 0
    assert capsys.readouterr().out.startswith(path.name)


def test_info_tells_what_a_file_holds(tmp_path, capsys):
    face = fw.default_face()
    ball = pv.Sphere(center=face.landmarks["nose_tip"], radius=8.0)
    crossing = face.mesh.copy(deep=False)
    crossing.points = face.points * np.where(np.arange(len(face.points)) % 97, 1.0, 0.8)[:, None]
    crossing.append_polydata(ball).save(tmp_path / "head.vtp")
    assert main(["info", str(tmp_path / "head.vtp")]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    told = " ".join(out.split())
    assert f"triangles {face.mesh.n_cells} size" in told
    assert "Kept one of 2 separate parts" in told
    number = re.search(r"runs through itself at .*, with (\d+) of 4517 triangles", told)
    assert number is not None
    assert int(number[1]) > 118  # those of its lips
    fw.write_face(dataclasses.replace(face, likeness=0.93), tmp_path / "head.face")
    assert main(["info", str(tmp_path / "head.face")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "likeness to a face 0.93 landmarks 33, estimated: none" in told
    for name, message in (
        ("bones", "muscles, action-units, expressions"),
        ("no.obj", "no file"),
        ("no.face", "No such"),
    ):
        assert main(["info", name]) == 1
        assert message in capsys.readouterr().err


def test_table1_measures_and_writes(tmp_path, capsys):
    options = ["--iterations", "8", "--drawings", "2", "--out", str(tmp_path)]
    assert main(["table1", *options]) == 0
    out = capsys.readouterr().out
    text = (tmp_path / "table1.txt").read_text(encoding="utf-8")
    assert out.strip() == text.strip()
    content = json.loads((tmp_path / "table1.json").read_text(encoding="utf-8"))
    assert content["iterations"] == 8
    assert [row["expression"] for row in content["here"]] == [row.expression for row in PAPER]
    for row in content["here"]:
        parts = [row[name] for name in ("Te", "Ta", "Tw", "Tr")]
        assert all(part > 0.0 for part in (row["Tp"], *parts))
        assert row["fps"] == pytest.approx(8 / sum(parts))
        assert (row["before"], row["expression"] in text) == (4517, True)


def test_table1_prints_the_paper_beside_it():
    lines = as_text(list(PAPER), 250, "a machine").splitlines()
    for row, line in zip(PAPER, lines[2:7], strict=True):
        twice = [f"{value:.2f}" for value in (row.Tp, row.Te, row.Ta, row.Tw, row.Tr) for _ in range(2)]
        triangles = [str(row.before), "->", str(row.after)] * 2
        assert line.split() == [row.expression, *triangles, *twice, *[f"{row.fps:.1f}"] * 2]
    assert len({len(line) for line in lines[:7]}) == 1


def test_table1_refuses_nonsense():
    for iterations, drawings in ((0, 1), (1, 0)):
        with pytest.raises(ParameterError):
            next(measure(fw.default_face(), iterations, drawings))


def test_demo(tmp_path, monkeypatch, capsys):
    for name, value in (("SIZE", 48), ("FRAMES", 3), ("TILE", 32), ("ITERATIONS", 3), ("DRAWINGS", 1), ("SHEET", 32)):
        monkeypatch.setattr(demo_module, name, value)
    assert main(["demo", "--out", str(tmp_path), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    names = {row.expression for row in PAPER}
    others = {"contact.png", "contact_sheet.png", "table1.txt", "table1.json"}
    assert {path.name for path in tmp_path.iterdir()} == names | others
    for name in names:
        files = {path.name for path in (tmp_path / name).iterdir()}
        assert files == {f"{name}.png", f"{name}_closeup.png", f"{name}.mp4"}
    assert shape(tmp_path / "contact.png") == (3 * 32 + 2 * 4, 5 * 32 + 4 * 4)
    assert shape(tmp_path / "contact_sheet.png") == (6 * 32 + 5 * 4, 3 * 32 + 2 * 4)


@pytest.mark.parametrize("arguments", [[], ["--help"], ["express", "--help"], ["--version"]])
def test_help_and_version(arguments, capsys):
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert (fw.__version__ if arguments == ["--version"] else "Usage: facewrinkle") in out


def test_help_loads_no_heavy_package():
    probe = (
        "import sys; from facewrinkle.cli import main; main(['--help']); "
        "sys.exit(' '.join({'numba', 'scipy', 'pyvista', 'matplotlib'} & set(sys.modules)) or 0)"
    )
    result = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")


def test_the_module_runs():
    result = subprocess.run([*PROGRAM, "info", "expressions"], capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")
    assert "stretching_mouth" in result.stdout


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        (["express", "AU4", "--frames", "2"], ("Preparing the skin", "Frames", "Drawing")),
        (["pattern", "dimple_l", "--frames", "2"], ("Preparing the skin", "Frames", "Pictures")),
        (["table1", "--iterations", "2", "--drawings", "1"], ("Table 1",)),
    ],
)
def test_progress_is_shown_on_a_terminal_only(tmp_path, monkeypatch, capsys, command, shown):
    if command[0] != "table1":
        command = [*command, "--no-movie", "--no-series", "--size", "60"]
    command = [*command, "--out", str(tmp_path)]
    assert main(command) == 0
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("rich.console.Console.is_terminal", True)
    assert main(command) == 0
    err = capsys.readouterr().err
    assert [what for what in shown if what not in err] == []
    assert main([*command, "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_long_mixtures_have_short_file_names(tmp_path, capsys):
    name = ",".join(load_atlas().muscles)
    assert len(name) > 255
    assert main(["express", name, *FEW, "--no-movie", "--no-series", "--out", str(tmp_path)]) == 0
    assert list(tmp_path.glob("*_closeup.png"))


def test_a_view_without_a_name_is_refused_before_anything_is_written(tmp_path, capsys):
    assert main(["express", "AU1", *FEW, "--view=", "--out", str(tmp_path / "new")]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "new").exists()


def test_nothing_complains_after_an_interrupt(tmp_path, monkeypatch, capfd):
    def interrupted(*_, **__):
        try:
            os.kill(os.getpid(), signal.SIGINT)
        finally:
            logging.error("Failure when calling method: ProcessRequest")  # as pyvista passes on what VTK says

    monkeypatch.setattr("facewrinkle.commands.express.record", interrupted)
    assert main(["express", "AU1", "--out", str(tmp_path)]) == 130
    assert capfd.readouterr().err == "facewrinkle: interrupted.\n"
    assert logging.getLogger().isEnabledFor(logging.ERROR)


def test_what_is_no_plain_mesh_says_what_to_do_with_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "head.face").write_bytes(b"PK\x03\x04")
    assert main(["fit", "head.face"]) == 1
    assert "has been fitted" in capsys.readouterr().err
    pv.Sphere(radius=40.0).save(tmp_path / "ball.ply")
    assert main(["pattern", "dimple", "--face", "ball.ply", "--centre", "0,0,40"]) == 1
    assert "--centre needs --extent" in capsys.readouterr().err
    assert not (tmp_path / "output").exists()


@pytest.mark.parametrize("terminal, quiet, shown", [(True, False, True), (True, True, False), (False, False, False)])
def test_what_takes_a_while_is_told_where_there_is_a_terminal(capsys, monkeypatch, terminal, quiet, shown):
    monkeypatch.setattr("rich.console.Console.is_terminal", terminal)
    with warnings.catch_warnings(), Report(quiet).waiting("Preparing the skin"):
        pass
    out, err = capsys.readouterr()
    assert ("Preparing the skin" in err) is shown
    assert not out


def test_the_expression_without_wrinkles_is_the_same_with_a_skin_that_was_used(face):
    performance = Performance(face, face.atlas.contractions("AU4"), frames=3, size=(40, 40))
    used = performance.simulation()
    for _ in used.run(4):
        pass
    np.testing.assert_array_equal(performance.bare(used.motion).points, performance.bare().points)


FACES_THAT_ARE_NONE = (
    "no.obj",
    "empty.obj",
    "text.obj",
    "a.txt",
    "nan.obj",
    "bad.face",
    "folder.obj",
    "no.face",
    "\0",
    "",
)
NUMBERS = {
    "express": ("intensity", "depth", "gamma-c", "samples", "alpha", "count", "max-level", "frames", "size", "fps"),
    "pattern": ("number", "spacing", "sharpness", "variation", "seed", "strength", "frames", "max-level", "fps"),
    "tear": ("intensity", "speed", "roughness", "seed", "seconds", "fps", "size"),
    "table1": ("iterations", "drawings"),
}
WHAT = {"express": ["AU4"], "pattern": ["dimple_l"], "tear": ["shedding"], "table1": []}


@pytest.mark.parametrize("command", WHAT)
def test_bad_input_is_one_line_that_helps(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    for name, text in {"empty.obj": "", "text.obj": "hello", "a.txt": "x", "bad.face": "PK", "file": "x"}.items():
        Path(name).write_text(text)
    Path("nan.obj").write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    Path("folder.obj").mkdir()
    wrong = [["--face", name] for name in FACES_THAT_ARE_NONE]
    wrong += [[f"--{name}", value] for name in NUMBERS[command] for value in ("nan", "-1", "1e999", "x")]
    wrong += [["--out", "file"], ["--identity", "jaw=nan"], ["--atlas", "no.toml"], ["--units", "cm"]]
    there = sorted(tmp_path.iterdir())
    for options in wrong:
        assert main([command, *WHAT[command], *options]) in (1, 2), options
        out, err = capsys.readouterr()
        assert out == "", options
        assert err.startswith("facewrinkle: "), options
        assert (err.count("\n"), "Traceback" in err, len(err) > 40) == (1, False, True), (options, err)
        assert sorted(tmp_path.iterdir()) == there, options
