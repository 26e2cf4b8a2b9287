"""``facewrinkle tear`` from outside: what it writes, and what it refuses."""

import numpy as np
import pytest
import pyvista as pv
from command_files import read_series
from glb_files import read_glb
from small_meshes import signed_distances

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import write_landmarks
from facewrinkle.cli import main

SIZE = 96
FEW = ["--size", str(SIZE), "--seconds", "0.8", "--fps", "5"]


@pytest.fixture(scope="module")
def weeping(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tear") / "new"
    assert main(["tear", "weeping", *FEW, "--series", "--out", str(folder)]) == 0
    return folder


def test_it_writes_pictures_movie_and_series(weeping):
    names = {"tear_weeping.png", "tear_weeping_closeup.png", "tear_weeping.mp4"}
    assert {p.name for p in weeping.iterdir() if p.name[0] != "."} == names | {
        "tear_weeping.vtkhdf",
        "tear_weeping_tears.vtkhdf",
    }
    assert pv.read_texture(weeping / "tear_weeping.png").to_array().shape[:2] == (SIZE, 4 * SIZE + 3 * 4)


def test_series_hold_the_face_and_closed_tears_that_grow(face, weeping):
    faces, tears = (read_series(weeping / f"tear_{what}.vtkhdf")[1] for what in ("weeping", "weeping_tears"))
    assert len(faces) == len(tears) == 4
    assert all(frame.n_points >= face.mesh.n_points for frame in faces)
    assert all(tear.n_open_edges == 0 for tear in tears)
    volume = np.array([tear.volume for tear in tears])
    assert volume[-1] > volume[0] > 0.0


@pytest.mark.slow
def test_dripping_without_movie_and_series_on_a_mesh_of_ones_own(tmp_path, run, monkeypatch):
    monkeypatch.chdir(tmp_path)
    face = fw.default_face()
    face.mesh.save(tmp_path / "face.ply")
    write_landmarks(face.landmarks, tmp_path / "face.json")
    source = ["--face", str(tmp_path / "face.ply"), "--landmarks", str(tmp_path / "face.json")]
    folder = tmp_path / "out"
    options = ["--expression", "AU4", "--no-movie", "--view", "left_eye", "--out", str(folder)]
    options += ["--save-mesh", "obj", "--save-animation", "drops.glb"]
    out, err = run("tear", "dripping", *FEW, *source, *options)
    assert err == ""
    assert "obj holds" in out
    pictures = {"tear_dripping.png", "tear_dripping_closeup.png"}
    assert {path.name for path in folder.iterdir() if path.name[0] != "."} == pictures | {
        "tear_dripping.obj",
        "tear_dripping.mtl",
    }
    assert "\ng tears\n" in (folder / "tear_dripping.obj").read_text()
    assert fw.read_surface(folder / "tear_dripping.obj").n_cells > face.mesh.n_cells
    assert "tears" in out
    assert "drops.glb" in out
    content, _ = read_glb(tmp_path / "drops.glb")
    moving = {content["nodes"][channel["target"]["node"]]["name"] for channel in content["animations"][0]["channels"]}
    assert {"face", "tears_1", "tears_2"} <= moving


@pytest.mark.slow
def test_the_paper_s_tears_have_other_shapes(tmp_path):
    def tears(*options):
        folder = tmp_path / "_".join(["out", *options])
        quick = [
            "--seconds",
            "0.6",
            "--fps",
            "10",
            "--size",
            "32",
            "--no-movie",
            "--series",
            "--out",
            str(folder),
        ]
        assert main(["tear", "one_tear", *quick, *options]) == 0
        return read_series(folder / "tear_one_tear_tears.vtkhdf")[1]

    ours, extruded, by_height = tears(), tears("--head", "extruded"), tears("--reveal", "height")
    assert all(tear.n_open_edges == 0 for series in (ours, extruded, by_height) for tear in series)
    np.testing.assert_allclose(extruded[-1].bounds, ours[-1].bounds, atol=0.5)  # the same path
    assert np.abs(signed_distances(ours[-1].points, extruded[-1])).max() > 0.05  # mm, and another head
    length = [np.ptp(series[-1].points[series[-1]["thickness"] > 0.0][:, 1]) for series in (ours, by_height)]
    assert length[1] > length[0]  # c is then the speed of the descent


def test_it_weeps_on_a_mesh_that_is_no_face(tmp_path):
    mesh, out = tmp_path / "ball.ply", tmp_path / "out"
    pv.Icosphere(radius=0.9, nsub=4).save(mesh)
    starts = ["--face", str(mesh), "--start", "0.3,0.4,0.75", "--start", "-0.3,0.4,0.75"]
    quick = ["--seconds", "1.6", "--fps", "5", "--size", "48", "--no-movie", "--series", "--out", str(out)]
    assert main(["tear", "weeping", *starts, *quick, "--quiet"]) == 0
    water = read_series(out / "tear_weeping_tears.vtkhdf")[1][-1]
    assert water.n_open_edges == 0
    assert {bool(body.center[0] > 0.0) for body in water.split_bodies(label=True)} == {True, False}
    assert -0.9 < water.bounds[2] < 0.3  # they have run down
    assert np.linalg.norm(water.points, axis=1).min() > 0.88
