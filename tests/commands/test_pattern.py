"""``facewrinkle pattern`` from outside: what it writes, and what it refuses."""

import numpy as np
import pytest
import pyvista as pv
from command_files import read_series

import facewrinkle as fw
from facewrinkle.cli import main

FEW = ["--frames", "4", "--size", "96", "--no-movie"]


def heights(path):
    """Lowest and highest W of every step of a series."""
    return np.array([(mesh["W"].min(), mesh["W"].max()) for mesh in read_series(path)[1]])


def test_a_preset_comes_and_goes(tmp_path, capsys):
    assert main(["pattern", "frown", *FEW, "--series", "--depth", "2.0", "--number", "3", "--out", str(tmp_path)]) == 0
    assert sorted(p.name for p in tmp_path.iterdir() if p.name[0] != ".") == [
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
    place = ["--face", str(mesh), "--units", "cm", "--center", "0,0,4", "--extent", "2,1.5", "--up", "0,1,0.2"]
    out = ["--save-mesh", "ply", "--out", str(tmp_path / "out")]
    assert main(["pattern", "dimple", *place, *FEW, "--series", "--depth", "3", "--quiet", *out]) == 0
    w = heights(tmp_path / "out" / "pattern_dimple.vtkhdf")
    assert w[4, 0] == pytest.approx(-3.0, abs=0.1)
    assert (w[:, 1] == 0.0).all()
    dimpled = pv.read(tmp_path / "out" / "pattern_dimple.ply")
    deepest = dimpled.points[np.argmin(np.linalg.norm(dimpled.points[:, :2], axis=1))]
    assert deepest[2] == pytest.approx(4.0 + w[4, 0] / 10.0, abs=0.01)  # the mesh at its height, in its own unit


def test_a_small_mesh_is_in_meters(tmp_path, capsys):
    mesh, out = tmp_path / "ball.ply", tmp_path / "out"
    pv.Sphere(radius=0.9, theta_resolution=40, phi_resolution=40).save(mesh)
    place = ["--face", str(mesh), "--center", "0,0.2,0.88", "--extent", "0.4,0.3", "--depth", "30"]
    assert main(["pattern", "dimple", *place, *FEW, "--series", "--out", str(out)]) == 0
    w = heights(out / "pattern_dimple.vtkhdf")
    assert w[4, 0] == pytest.approx(-30.0, abs=1.0)
    told = capsys.readouterr().out
    assert "1000 mm" in told
    assert f"{-w[4, 0] / 1000.0:.3g} units" in told


def test_a_cycle_runs_through_t(tmp_path):
    """Cheek lines of one period later are the same; half a period later, where bulges were, furrows are."""
    mesh = tmp_path / "sheet.ply"
    pv.Plane(i_size=100, j_size=100, i_resolution=60, j_resolution=60).triangulate().save(mesh)
    options = ["--face", str(mesh), "--units", "mm", "--center", "0,0,0", "--extent", "60", "--sharpness", "0"]
    options += [
        "--max-level",
        "0",
        "--fps",
        "10",
        "--frames",
        "10",
        "--size",
        "64",
        "--no-movie",
        "--series",
        "--quiet",
    ]
    assert main(["pattern", "cheek", *options, "--cycle", "0.8", "--out", str(tmp_path)]) == 0
    w = np.array([mesh["W"] for mesh in read_series(tmp_path / "pattern_cheek.vtkhdf")[1]])
    strength = np.ptp(w[[6, 10, 14]], axis=1)
    np.testing.assert_allclose(w[14] / strength[2], w[6] / strength[0], atol=1e-6)
    np.testing.assert_allclose(w[10] / strength[1], -w[6] / strength[0], atol=1e-6)


@pytest.mark.slow
def test_t_and_the_share_of_valid_vertices(tmp_path):
    options = ["--t", "2", "--valid-share", "0.5", "--series", "--quiet", "--out", str(tmp_path)]
    assert main(["pattern", "forehead", *FEW, *options]) == 0
    face = fw.default_face()
    layers = fw.PatternLayer.presets("forehead", face, t=2.0, valid_share=0.5)
    expected = fw.Simulation(face, layers=layers, motion=fw.Still(face)).step()
    found, n = read_series(tmp_path / "pattern_forehead.vtkhdf")[1][4], face.mesh.n_points
    np.testing.assert_allclose(found["W"][:n], expected["W"][:n], atol=1e-6)


@pytest.mark.slow
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
