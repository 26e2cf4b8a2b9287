"""``facewrinkle express`` from outside: its files, its lines, and its options."""

import contextlib
import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from command_files import movie_frames, picture_shape, read_series
from PIL import Image

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import write_landmarks
from facewrinkle.cli import main
from facewrinkle.commands import express as command
from facewrinkle.commands.express import FIELDS, Performance
from facewrinkle.commands.options import FoldOptions, OutputOptions, Report
from facewrinkle.commands.recorder import Scenes

IMAGES = Path(__file__).parents[2] / "docs" / "images"
SIZE, FRAMES = 96, 4
STEPS = FRAMES + FRAMES // 2
NAME = "AU1_AU2=0.5"
FEW = ["--frames", str(FRAMES), "--size", str(SIZE)]


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """The folder and the output of a command that does not name its folder."""
    told, home = io.StringIO(), tmp_path_factory.mktemp("cli")
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(told):
        patch.chdir(home)
        assert main(["express", "AU1, AU2=0.5", *FEW, "--max-level", "1", "--series"]) == 0
    return home / "output" / NAME, told.getvalue()


def test_express_writes_all_files_into_a_folder_of_a_safe_name_and_reports_them(played):
    folder, said = played
    pictures = {f"{NAME}.png", f"{NAME}_closeup.png"} | {f"{NAME}_{name}.png" for name in FIELDS}
    files = {path.name for path in folder.iterdir()} - {f".{NAME}.files"}
    assert files == pictures | {f"{NAME}.mp4", f"{NAME}.vtkhdf"}
    for text in ("4517 to ", "mm", *files):
        assert text in said
    for name in (f"{NAME}.png", f"{NAME}_closeup.png"):
        assert picture_shape(folder / name) == (SIZE, 4 * SIZE + 3 * 4)
    for name in FIELDS:
        assert picture_shape(folder / f"{NAME}_{name}.png") == (SIZE, SIZE)


def test_express_movie_shows_face_and_closeup_there_and_back(played):
    images = movie_frames(played[0] / f"{NAME}.mp4", SIZE, 2 * SIZE + 4)
    assert len(images) == STEPS
    away = [np.abs(image.astype(int) - images[0]).mean() for image in images]
    assert np.argmax(away) in range(FRAMES - 2, FRAMES + 2)
    assert away[-1] < 0.8 * max(away)


def test_express_series_holds_every_step(face, played):
    meshes = read_series(played[0] / f"{NAME}.vtkhdf")[1]
    assert len(meshes) == STEPS
    assert meshes[-1].n_points >= face.mesh.n_points


def test_express_options_reach_the_simulation(tmp_path, monkeypatch):
    seen: list[tuple[Performance, OutputOptions]] = []
    monkeypatch.setattr("facewrinkle.commands.express.record", lambda *given, bake: seen.append((given[0], given[-1])))
    options = ["--intensity=0.5", "--frames=7", "--max-level=3", "--gamma-c=0.1", "--samples=3", "--depth=2"]
    options += ["--folds=paper", "--size=64x48", "--view=nose"]
    assert main(["express", "AU4", *options, "--fps=10", "--out", str(tmp_path)]) == 0
    ((performance, output),) = seen
    frown = {"corrugator_l": 0.5, "corrugator_r": 0.5, "procerus_l": 0.21, "procerus_r": 0.21}
    assert performance.rates == frown
    assert (performance.frames, performance.size, performance.view, output.fps) == (7, (64, 48), "nose", 10.0)
    refinement = performance.refinement
    assert (refinement.max_level, refinement.gamma_c, refinement.samples) == (3, 0.1, 3.0)
    assert [layer.depth for layer in performance.layers] == [2.0, 2.0]


def test_express_draws_waves_of_a_seed(tmp_path, monkeypatch):
    seen: list[Performance] = []
    monkeypatch.setattr("facewrinkle.commands.express.record", lambda *given, bake: seen.append(given[0]))
    assert main(["express", "AU4", "--seed=5", "--age=0.5", "--depth=2", "--out", str(tmp_path)]) == 0
    formula, creases, waves = seen[0].layers
    assert (formula.waves, formula.depth, creases.depth) == (False, 2.0, 2.0)
    assert (waves.style.seed, waves.age, waves.depth) == (5, 0.5, 2.0)


@pytest.mark.slow
def test_express_on_another_mesh(tmp_path, run):
    head = fw.default_face()
    head.mesh.scale(0.001).save(tmp_path / "head.vtp")
    write_landmarks({name: point * 0.001 for name, point in head.landmarks.items()}, tmp_path / "head.json")
    source = ["--face", str(tmp_path / "head.vtp"), "--landmarks", str(tmp_path / "head.json"), "--units", "m"]
    few = [*FEW, "--no-movie", "--max-level", "1", "--depth", "0.1", "--view", "front"]
    assert "4517 to " in run("express", "AU46", *source, *few, "--out", str(tmp_path / "out")).out
    assert (tmp_path / "out" / "AU46.png").is_file()


@pytest.mark.slow
def test_long_mixtures_have_short_file_names(tmp_path):
    name = ",".join(fw.anatomy.load_atlas().muscles)
    assert len(name) > 255
    few = ["--frames", "1", "--size", "40", "--max-level", "1", "--depth", "0.1", "--no-movie"]
    assert main(["express", name, *few, "--out", str(tmp_path)]) == 0
    assert list(tmp_path.glob("*_closeup.png"))


@pytest.mark.slow
@pytest.mark.parametrize("folds", ["wave", "paper"])
def test_a_depth_that_skin_does_not_allow_can_be_had(tmp_path, run, folds):
    command = ["express", "happiness", *FEW, "--no-movie", "--folds", folds, "--out", str(tmp_path)]
    usual = deepest_furrow(run(*command, "--depth", "5").out)
    assert deepest_furrow(run(*command, "--depth", "5", "--no-limit").out) > 1.5 * usual


def deepest_furrow(printed):
    """Millimeters in the table that a command prints."""
    return float(re.search(r"deepest furrow\D+([\d.]+) mm", printed)[1])


@pytest.mark.slow
def test_maps_of_an_expression(tmp_path, run):
    quick = ["--frames", "4", "--max-level", "1", "--size", "60", "--no-movie"]
    said = run("express", "AU1", "--maps", "64", *quick, "--out", str(tmp_path)).out
    assert "AU1_normal.png" in said
    assert "AU1_height.png" in said
    assert {f"AU1_{name}" for name in ("normal.png", "height.png", "maps.obj", "maps.json")} <= {
        path.name for path in tmp_path.iterdir()
    }
    said = run("express", "AU1", *quick, "--out", str(tmp_path)).out
    assert "removed, of an earlier run" in said
    assert not {"AU1_normal.png", "AU1_maps.obj"} & {path.name for path in tmp_path.iterdir()}
    assert (
        "power of two from 64 to 8192, received 100"
        in run("express", "AU1", "--maps", "100", *quick, "--out", str(tmp_path / "no"), code=1).err
    )
    assert not (tmp_path / "no").exists()


# --- the expressions of the paper, which the README shows ------------------------------------------


@pytest.mark.slow
def test_demo(tmp_path, monkeypatch, run):
    for name, value in (("SIZE", 48), ("FRAMES", 3), ("TILE", 32)):
        monkeypatch.setattr(command, name, value)
    assert run("demo", "--out", str(tmp_path), "--quiet") == ("", "")
    sheets = {"printed.jpg", "wave.jpg", "contact_sheet.jpg"}
    assert {path.name for path in tmp_path.iterdir() if path.name[0] != "."} == {"printed", "wave"} | sheets
    for folds in ("printed", "wave"):
        for name in command.EXPRESSIONS:
            files = {path.name for path in (tmp_path / folds / name).iterdir() if path.name[0] != "."}
            assert files == {f"{name}.png", f"{name}_closeup.png", f"{name}.mp4"}
        assert picture_shape(tmp_path / f"{folds}.jpg") == (3 * 32 + 2 * 4, 5 * 32 + 4 * 4)
    assert picture_shape(tmp_path / "contact_sheet.jpg") == (6 * 48 + 5 * 4, 3 * 48 + 2 * 4)


@pytest.mark.pictures
@pytest.mark.slow
@pytest.mark.parametrize("folds", ["printed", "wave"])
def test_the_readme_shows_what_is_drawn_today(folds, tmp_path):
    """One column of its picture, compressed alike; wrinkles change more."""
    renderer = pv.GPUInfo().renderer
    if "llvmpipe" not in renderer:
        pytest.skip(f"the picture is one of Mesa's llvmpipe; {renderer} draws other pixels")
    options = FoldOptions(folds, command.DEPTHS[folds])
    with Scenes(options.face(fw.default_face())) as scenes:
        peak = command.perform("closing_eye", options, scenes, tmp_path, Report(quiet=True), movie=False)
    plain = replace(peak, closeup=[peak.closeup[1]] * 4)
    files = [
        fw.plotting.save_picture(command.column(each), tmp_path / f"{k}.jpg") for k, each in enumerate((peak, plain))
    ]
    drawn, bare, sheet = (np.asarray(Image.open(file), float) for file in (*files, IMAGES / f"expressions_{folds}.jpg"))
    side = command.TILE
    start = command.EXPRESSIONS.index("closing_eye") * (side + 4)
    shown = sheet[:, start : start + side]
    for tile in (slice(0, side), slice(side + 4, 2 * side + 4), slice(2 * side + 8, None)):
        assert abs(shown[tile] - drawn[tile]).mean() < 0.5
    assert abs(shown - bare)[side + 4 : 2 * side + 4].mean() > 0.5


@pytest.mark.slow
def test_an_expression_becomes_a_session_which_is_shown(tmp_path):
    """The picture is that of the session, in the view that the command asks for."""
    path, few = tmp_path / "mine.json", ["--size", "64", "--no-movie", "--quiet"]
    own = ["--identity", "jaw=0.5", "--depth", "2", "--intensity", "0.5", "--write-session", str(path)]
    assert main(["express", "AU12=0.8", *own, *few, "--frames", "2", "--out", str(tmp_path / "one")]) == 0
    session = fw.Session.read(path)
    assert session == fw.Session(
        identity={"jaw": 0.5},
        mixture={"AU12": 0.8},
        intensity=0.5,
        folds=fw.session.Folds(depth=2.0),
        look=fw.session.Look(size=(64, 64)),
    )
    assert main(["express", "--session", str(path), *few, "--view", "mouth", "--out", str(tmp_path / "two")]) == 0
    picture = np.asarray(Image.open(tmp_path / "two" / "mine.png"))
    np.testing.assert_array_equal(picture, session.changed(look=fw.session.Look(view="mouth", size=(64, 64))).picture())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "what shall the face do"),
        (["AU12", "--session", "a.json"], "--session has a face, folds and an expression"),
        (["--session", "a.json", "--depth", "2"], "--session has a face, folds and an expression"),
        (["--session", "a.json"], "'a.json' cannot be read"),
        (["AU12", "--units", "mm", "--face", "a.obj", "--write-session", "b.json"], "--units is not kept in a session"),
        (["AU12", "--folds", "paper", "--write-session", "b.json"], "a session has folds that are waves"),
    ],
)
def test_what_does_not_go_with_a_session(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["express", *arguments]) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
