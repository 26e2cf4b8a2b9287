"""The recorder behind the commands that play something."""

from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import pyvista as pv
from command_files import movie_frames, read_series

import facewrinkle as fw
from facewrinkle.commands import recorder
from facewrinkle.commands.options import OutputOptions, Report
from facewrinkle.commands.recorder import Clip, Recorder, Scenes
from facewrinkle.plotting.views import height_of


@pytest.fixture
def clip():
    """A sphere that grows in four frames."""
    balls = [pv.Sphere(radius=radius) for radius in (1.0, 1.1, 1.2, 1.3)]
    return Clip(fw.surface(balls[0]), iter(balls), 0.1 * np.arange(4))


def test_a_clip_is_played_once_watched_and_drawn(clip, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    numbers, drawn = [], []

    def draw(frame):
        drawn.append(frame.length)
        image = np.full((32, 48, 3), 60 * len(drawn), np.uint8)
        return lambda: image

    made = Recorder(tmp_path / "new", "ball", OutputOptions(series=True), Report(quiet=False))
    made.record(clip, draw, lambda number, frame: numbers.append((number, frame.length)))
    assert [number for number, _ in numbers] == [0, 1, 2, 3]
    assert drawn == [length for _, length in numbers]
    assert sorted(drawn) == drawn
    assert (
        set(made.files)
        == set((tmp_path / "new").iterdir())
        == {tmp_path / "new" / name for name in ("ball.mp4", "ball.vtkhdf")}
    )
    assert [mesh.length for mesh in read_series(tmp_path / "new" / "ball.vtkhdf")[1]] == drawn
    gray = movie_frames(tmp_path / "new" / "ball.mp4", 32, 48).mean(axis=(1, 2, 3))
    np.testing.assert_allclose(gray, [60.0, 120.0, 180.0, 240.0], atol=3.0)


def test_without_movie_and_series_frames_are_watched_only(clip, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # a short name
    seen = []
    made = Recorder(Path("out"), "ball", OutputOptions(movie=False), Report(quiet=False))
    made.record(clip, lambda frame: pytest.fail("it was drawn"), lambda number, frame: seen.append(number))
    assert seen == [0, 1, 2, 3]
    made.save_mesh(clip.face.mesh, clip.face)
    assert made.files == []
    made.save_picture(np.zeros((4, 4, 3), np.uint8), "_b")
    made.save_picture(np.zeros((4, 4, 3), np.uint8), "_a")
    made.tabulate("a ball", {"frames": "4"})
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["a", "ball"],
        ["frames", "4"],
        ["files", "in", "out", "ball_a.png"],
        ["ball_b.png"],
    ]


@pytest.mark.slow
def test_a_scene_that_has_drawn_other_frames_draws_the_same(face, played):
    frames = [face.mesh, played("paper_surprise").top, face.mesh]
    styles = [fw.plotting.Style((48, 48), view) for view in ("front", "forehead")]
    with Scenes(face) as scenes:
        shown = [scenes.picture(frame, style) for frame in frames for style in styles]
    for image, (frame, style) in zip(shown, [(frame, style) for frame in frames for style in styles], strict=True):
        np.testing.assert_array_equal(image, fw.picture(frame, face, style))


def test_a_movie_draws_again_only_what_can_be_seen_to_have_moved(face):
    style = fw.plotting.Style((32, 32))
    pixel = height_of(face, style) / 32
    frame = fw.Simulation(face, fw.Refinement(max_level=0), layers=[]).step()

    def moved(pixels):
        other = frame.copy()
        other.points[7] += [pixels * pixel, 0.0, 0.0]
        return other

    turned = moved(0.0)
    gaze = next(name for name in frame.field_data if name.startswith(fw.mesh.GAZE))
    turned.field_data[gaze] = -np.asarray(frame.field_data[gaze])
    split = moved(0.0)
    split.regular_faces = np.roll(frame.regular_faces, 1, axis=0)
    with Scenes(face) as scenes:
        first = scenes.begun(frame, style)
        assert first() is first() is scenes.begun(moved(0.0), style)()
        assert scenes.begun(moved(0.003), style) is first
        for other in (moved(0.005), turned, split, face.mesh):
            assert scenes.begun(other, style) is not first
            first = scenes.begun(frame, style)
        near = scenes.begun(moved(0.003), style), scenes.begun(moved(0.006), style)
        assert [drawing is first for drawing in near] == [True, False], "steps too small to be seen add up"
        assert scenes.begun(moved(0.006), style, style) is not near[1], "other views"


def test_without_imageio_the_movie_is_skipped_with_a_notice(tmp_path, monkeypatch, run):
    missing = fw.errors.MissingPackageError("movies need the package imageio, which is not installed.")
    monkeypatch.setattr(recorder, "movie_writer", Mock(side_effect=missing))
    pv.Sphere(radius=40.0).save(tmp_path / "ball.ply")
    stale = tmp_path / "pattern_dimple.mp4"
    stale.write_bytes(b"of an earlier run")
    ball = ["--face", str(tmp_path / "ball.ply"), "--units", "mm", "--center", "0,0,40", "--out", str(tmp_path)]
    out, err = run("pattern", "dimple", *ball, "--frames", "2", "--size", "48", "--series")
    note, *_ = err.splitlines()  # a slow machine tells more
    assert note == "facewrinkle: note: no movie is written: movies need the package imageio, which is not installed."
    assert "pattern_dimple.mp4" not in out
    assert not stale.exists()
    assert len(read_series(tmp_path / "pattern_dimple.vtkhdf")[1]) == 5
    assert (tmp_path / "pattern_dimple_closeup.png").is_file()


@pytest.mark.parametrize("ending", ["glb", "gltf", "obj", "ply"])
@pytest.mark.parametrize("textured", [True, False])
@pytest.mark.parametrize("crying", [True, False])
def test_commands_tell_of_all_files_that_were_written(tmp_path, ending, textured, crying):
    sheet = fw.surface(pv.Plane(), texture=np.zeros((4, 4, 3), np.uint8) if textured else None)
    tears = [pv.Sphere(radius=0.1)] if crying else []
    recorder = Recorder(tmp_path, "a", OutputOptions(save_mesh=ending), Report(quiet=False))
    recorder.save_mesh(sheet.mesh, sheet, tears=tears)
    assert sorted(recorder.files) == sorted(tmp_path.iterdir())
