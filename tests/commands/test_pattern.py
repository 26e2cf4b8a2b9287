"""``facewrinkle pattern`` from outside: what it writes, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from command_files import series_meshes

from facewrinkle.cli import main

FEW = ["--frames", "4", "--size", "96", "--no-movie"]


def heights(path):
    """Lowest and highest W of every step of a series."""
    return np.array([(mesh["W"].min(), mesh["W"].max()) for mesh in series_meshes(path)])


def test_a_preset_comes_and_goes(tmp_path, capsys):
    assert main(["pattern", "frown", *FEW, "--series", "--depth", "2.0", "--number", "3", "--out", str(tmp_path)]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "pattern_frown.png",
        "pattern_frown.vtkhdf",
        "pattern_frown_closeup.png",
    ]
    w = heights(tmp_path / "pattern_frown.vtkhdf")
    assert len(w) == 9
    assert (w[0] == 0.0).all()
    assert (w[-1] == 0.0).all()
    assert 1.5 < np.ptp(w[4]) <= 2.0 + 1e-6
    tall = np.ptp(w, axis=1)
    assert (np.diff(tall[:5]) > 0.0).all()
    assert (np.diff(tall[4:]) < 0.0).all()
    np.testing.assert_allclose(tall[5:7], tall[3:1:-1], rtol=0.01)  # before, the mesh was still coarse
    assert pv.read_texture(tmp_path / "pattern_frown.png").to_array().shape[:2] == (96, 3 * 96 + 8)
    assert "triangles" in capsys.readouterr().out


def test_on_any_surface_about_a_centre(tmp_path):
    mesh = tmp_path / "ball.ply"
    pv.Sphere(radius=4.0, theta_resolution=40, phi_resolution=40).save(mesh)
    place = ["--face", str(mesh), "--units", "cm", "--centre", "0,0,4", "--extent", "2,1.5", "--up", "0,1,0.2"]
    out = ["--save-mesh", "ply", "--out", str(tmp_path / "out")]
    assert main(["pattern", "dimple", *place, *FEW, "--series", "--depth", "3", "--quiet", *out]) == 0
    w = heights(tmp_path / "out" / "pattern_dimple.vtkhdf")
    assert w[4, 0] == pytest.approx(-3.0, abs=0.1)
    assert (w[:, 1] == 0.0).all()
    dimpled = pv.read(tmp_path / "out" / "pattern_dimple.ply")
    deepest = dimpled.points[np.argmin(np.linalg.norm(dimpled.points[:, :2], axis=1))]
    assert deepest[2] == pytest.approx(4.0 + w[4, 0] / 10.0, abs=0.01)  # the mesh at its height, in its own unit


def test_an_expression_brings_it_out(tmp_path):
    arguments = [
        "pattern",
        "dimple_l",
        "--expression",
        "AU12",
        "--frames",
        "14",
        "--size",
        "64",
        "--no-movie",
        "--series",
    ]
    assert main([*arguments, "--out", str(tmp_path), "--quiet"]) == 0
    deepest = -heights(tmp_path / "pattern_dimple_l.vtkhdf")[:, 0]
    assert deepest[0] == 0.0
    assert deepest.max() > 1.0
    assert deepest[-1] < 0.5 * deepest.max()


def test_a_movie(tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    arguments = ["pattern", "eye_pouch", "--frames", "2", "--size", "64", "--out", str(tmp_path)]
    assert main([*arguments, "--quiet"]) == 0
    assert (tmp_path / "pattern_eye_pouch.mp4").stat().st_size > 0
    assert not (tmp_path / "pattern_eye_pouch.vtkhdf").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["dimpel"], "'dimple'"),
        (["dimple", "--centre", "0,0"], "--centre must be 3 numbers"),
        (["dimple", "--centre", "0,0,0"], "name it with --face"),
        (["dimple", "--strength", "2"], "strength must lie"),
        (["dimple", "--frames", "0"], "number of frames"),
        (["dimple", "--number", "3"], "number"),
        (["forehead", "--extent", "9,9"], "larger than the mesh"),
        (["forehead", "--number", "40", "--max-level", "1"], "too coarse to carry the pattern forehead"),
    ],
)
def test_errors_are_one_line(tmp_path, capsys, arguments, says):
    assert main(["pattern", *arguments, "--out", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert says in error
    assert not (tmp_path / "out").exists()
