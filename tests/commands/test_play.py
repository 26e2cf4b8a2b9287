"""``facewrinkle play`` from outside: what it prints, what it writes, and with which code it ends."""

import json
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from command_files import read_series
from glb_files import GltfFile

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import write_landmarks

SMALL = ["--size", "64", "--max-level", "1"]


@pytest.fixture(scope="module")
def clip(face, played, tmp_path_factory):
    """The built-in face as a GLB that raises and lowers its brows in 0.4 s, in cm, and its landmarks."""
    folder = tmp_path_factory.mktemp("clip")
    file = GltfFile()
    file.node(
        mesh=file.mesh(
            face.points / 10.0, face.triangles, [played("paper_surprise").held.displacement / 10.0], ["browsUp"]
        )
    )
    file.animate((0, "weights", [0.0, 0.2, 0.4], [[0.0], [1.0], [0.0]]))
    file.glb(folder / "brows.glb")
    write_landmarks({name: point / 10.0 for name, point in face.landmarks.items()}, folder / "brows.json")
    return folder / "brows.glb", folder / "brows.json"


@pytest.mark.slow
def test_play_writes_pictures_a_movie_and_a_series(clip, tmp_path, run):
    file, landmarks = map(str, clip)
    options = ["--out", str(tmp_path), "--series", "--moments", "2", *SMALL]
    said, told = run("play", file, "--landmarks", landmarks, *options)
    assert "no wrinkles" not in told
    steps = read_series(tmp_path / "brows.vtkhdf")[1]
    assert len(steps) == 10
    depth = [
        np.average(mesh["W"] ** 2, weights=fw.geometry.vertex_areas(mesh.points, mesh.regular_faces)) for mesh in steps
    ]
    numbers = [step + int(np.argmax(depth[step : step + 5])) for step in (0, 5)]
    deepest = [f"{0.04 * (1 + k):.2f} s ({-steps[k]['W'].min():.2f} mm)" for k in numbers]
    names = {f"brows_{0.04 * (1 + k):.2f}s.png" for k in numbers}
    assert {path.name for path in tmp_path.iterdir() if path.name[0] != "."} == {
        "brows.mp4",
        "brows.vtkhdf",
        "brows.png",
        *names,
    }
    assert pv.read_texture(tmp_path / "brows.png").to_array().shape[:2] == (132, 2 * 64 + 4)
    for line in ("0.40 s, 10 steps", *deepest, "4517 to"):
        assert line in said
    # The last frame of the series is the face at rest, in the file's unit and place.
    rest, _ = fw.read_animation(file)
    for frame, expected in ((steps[9], 0.0), (steps[4], 1.0)):
        assert (np.ptp(frame["W"]) > 0.3) == (expected > 0.0)
        if not expected:
            np.testing.assert_allclose(frame.points[: rest.n_points], rest.points, atol=1e-6)


@pytest.mark.slow
def test_a_head_that_only_goes_along_is_told(face, tmp_path, run):
    frames = [face.mesh.translate((shift, 0.0, 0.0)) for shift in (0.0, 5.0, 10.0)]
    file = fw.export.write_series(frames, [0.0, 0.1, 0.2], tmp_path / "away.vtkhdf")
    write_landmarks(face.landmarks, tmp_path / "away.json")
    given = [str(file), "--landmarks", str(tmp_path / "away.json"), "--out", str(tmp_path / "out")]
    out, err = run("play", *given, *SMALL)
    assert "away.vtkhdf shows no wrinkles" in err
    assert "(0.00 mm)" in out


@pytest.mark.slow
def test_play_options(clip, tmp_path, run):
    file, landmarks = map(str, clip)
    options = ["--speed", "0.5", "--fps", "10", "--no-movie", "--depth", "0", "--view", "forehead", "--moments", "1"]
    play = ["play", file, "--landmarks", landmarks, *SMALL, *options]
    said = run(*play, "--out", str(tmp_path / "a"), "--save-mesh", "glb").out
    assert "0.80 s, 8 steps" in said
    assert "(0.00 mm)" in said
    assert {path.suffix for path in (tmp_path / "a").iterdir() if path.name[0] != "."} == {".png", ".glb"}
    (written,) = (tmp_path / "a").glob("*.glb")
    rest, _ = fw.read_animation(file)
    scene = pytest.importorskip("trimesh").load_scene(written)
    assert {"face", "eye_l", "eye_r"} <= set(scene.geometry)
    assert f"{written.stem}.png" in said
    assert len(scene.geometry["face"].faces) == rest.n_cells  # without wrinkles nothing is refined
    assert 0.15 < scene.scale < 0.6  # in meters, as glTF asks
    assert run(*play, "--out", str(tmp_path / "b"), "--quiet").out == ""


@pytest.mark.parametrize(
    "options, message",
    [
        (["--landmarks", "none.json"], "none.json"),
        (["--moments", "0"], "moments must lie"),
        (["--fps", "0"], "fps must lie"),
        (["--speed", "-1"], "speed must lie"),
        (["--speed", "0"], "speed must lie"),
        (["--speed", "1e-6"], "Raise --speed"),
        (["--view", "behind"], "unknown view"),
        (["--units", "ell"], "unknown unit"),
        (["--animation", "song"], "unknown animation"),
        (["--mesh", "hat"], "unknown mesh"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(clip, options, message, tmp_path, run):
    file, landmarks = map(str, clip)
    given = ["play", file, "--landmarks", landmarks, "--out", str(tmp_path / "out"), *options]
    if "--landmarks" in options:
        del given[2:4]
    error = run(*given, code=1).err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_shapes_in_place_of_an_animation(clip, tmp_path, run):
    file, landmarks = map(str, clip)
    play = ["play", file, "--landmarks", landmarks, "--out", str(tmp_path), *SMALL, "--fps", "4"]
    assert "1.50 s" in run(*play, "--shapes", "browsUp=0.5").out
    assert "Did you mean 'browsUp'" in run(*play, "--shapes", "brosUp=0.5", code=1).err
    told = " ".join(run("info", file).out.split())
    assert "(1) browsUp" in told
    assert "animations 0" in told


@pytest.mark.slow
def test_a_take_of_a_phone_on_a_face(tmp_path, run):
    take = tmp_path / "take.csv"
    take.write_text("time,browInnerUp,tongueOut,HeadYaw,HeadPitch,HeadRoll\n0,0,0,0,0,0\n0.2,0.6,0,0.2,0,0\n")
    options = ["--gain", "browInnerUp=1.5", "--identity", "age=0.5", *SMALL]
    animation = tmp_path / "take.glb"
    out = ["--out", str(tmp_path / "out"), "--save-animation", str(animation)]
    said, told = run("play", str(take), *options, *out)
    assert "0.20 s, 5 steps" in said
    assert "no wrinkles" not in told
    assert animation.exists()


def test_a_take_of_any_tracker_is_printed_as_a_table(tmp_path, run):
    take, table = tmp_path / "take.json", tmp_path / "take.csv"
    scores = [{"categoryName": name, "score": score} for name, score in (("jawOpen", 0.25), ("mouthSmileLeft", 1.0))]
    take.write_text(json.dumps([{"timestamp": 40.0 * k, "faceBlendshapes": [{"categories": scores}]} for k in (0, 1)]))
    expected = "time,jawOpen,mouthSmileLeft\n0,0.25,1\n0.04,0.25,1\n"
    assert run("take", str(take)).out == expected
    run("take", str(take), "--out", str(table))
    assert table.read_text() == expected
    assert "no file" in run("take", str(tmp_path / "lost.csv"), code=1).err


@pytest.mark.slow
def test_each_face_that_performs_a_take_has_its_folder(tmp_path, run, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("take.csv").write_text("time,browInnerUp\n0,0\n0.04,1\n")
    play = ["play", "take.csv", "--no-movie", "--moments", "1", *SMALL]
    run(*play)
    assert "removed" not in run(*play, "--identity", "jaw=1").out
    assert {path.parent for path in Path("output").rglob("*.png")} == {Path("output/take"), Path("output/jaw=1/take")}
