"""The namespace on PolyData.

what           checked against
registration   PyVista's list of accessors; the entry point in pyproject.toml
input          its fingerprint, before and after
result         a simulation of the same; the mesh's other parts, point data and texture coordinates
errors         too coarse, presets without landmarks, compressed skin
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
import facewrinkle.accessor
from facewrinkle.errors import FaceWrinkleWarning, ParameterError, UnknownNameError
from facewrinkle.layers.presets import presets

FACES = Path(__file__).parents[1].parent / "shared" / "faces"


@pytest.fixture
def ball():
    mesh = pv.Sphere(radius=40.0, theta_resolution=40, phi_resolution=40)
    mesh["height"] = mesh.points[:, 1].astype(np.float64)
    return mesh


def test_it_is_registered_on_polydata():
    assert any(a.name == "facewrinkle" and a.target is pv.PolyData for a in pv.registered_accessors())
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())
    assert project["project"]["entry-points"]["pyvista.accessors"] == {"facewrinkle": "facewrinkle.accessor"}


def test_a_pattern_leaves_its_input_alone(ball, fingerprint):
    before = fingerprint(ball)
    with pytest.warns(FaceWrinkleWarning, match=r"too coarse.*refined from \d+ to \d+ triangles"):
        out = ball.facewrinkle.pattern("cheek", (0, 0, 40), size=30.0, depth=1.5, number=3)
    assert fingerprint(ball) == before
    assert out is not ball
    assert out.n_cells > ball.n_cells
    assert 1.0 < np.ptp(out["W"]) < 1.6
    np.testing.assert_allclose(out["height"], out["rest"][:, 1], atol=0.15)


def test_it_is_what_a_simulation_gives(ball):
    with pytest.warns(FaceWrinkleWarning, match="refined"):
        out = ball.facewrinkle.pattern("dimple", (0, 0, 40), size=15.0, depth=2.0)
    face = fw.surface(ball)
    layer = fw.PatternLayer("dimple", (0, 0, 40), size=15.0, depth=2.0)
    sim = fw.Simulation(face, layers=[layer], motion=fw.Still(face))
    for _ in range(8):
        frame = sim.step()
    np.testing.assert_array_equal(out.points, frame.points)
    np.testing.assert_array_equal(out["W"], frame["W"])


def test_fine_meshes_are_not_refined():
    fine = pv.Plane(i_size=50, j_size=50, i_resolution=90, j_resolution=90).triangulate()
    out = fine.facewrinkle.pattern("cheek", (0, 0, 0), size=40.0, number=2, radius=20.0)
    assert out.n_cells == fine.n_cells


def test_other_parts_come_along(ball):
    ear = pv.Sphere(radius=8.0, center=(0, 0, 60), theta_resolution=30, phi_resolution=30)
    ear["height"] = ear.points[:, 1].astype(np.float64)
    both = pv.merge([ball, ear])
    with pytest.warns(FaceWrinkleWarning, match="refined"):
        out = both.facewrinkle.pattern("dimple", (0, 0, 68), size=6.0)
    assert out.split_bodies().n_blocks == 2
    moved = out["W"] != 0.0
    assert out["W"].min() == pytest.approx(-1.0, abs=0.02)
    assert out.points[moved, 2].min() > 60.0
    np.testing.assert_allclose(out.bounds[:5], both.bounds[:5], atol=1e-6)
    assert set(both.point_data) <= set(out.point_data)
    np.testing.assert_allclose(np.sort(out["height"])[[0, -1]], [ball["height"].min(), ball["height"].max()], atol=1e-4)


def test_time_moves_functions_of_time(ball):
    def at(time):
        return ball.facewrinkle.pattern(
            "dimple", (0, 0, 40), size=40.0, strength=lambda s: 0.5 + 0.1 * s, time=time, sharpest=1.0
        )

    early, late = at(0.0), at(4.0)
    assert late["W"].min() / early["W"].min() == pytest.approx(0.9 / 0.5, rel=0.03)


def test_presets_by_landmarks(face):
    given = {name: face.landmarks[name].tolist() for name in face.landmarks}
    with pytest.warns(FaceWrinkleWarning, match="refined"):
        out = face.mesh.facewrinkle.pattern("frown", landmarks=given, depth=1.0)
    with pytest.warns(FaceWrinkleWarning, match="refined"):
        expected = facewrinkle.accessor.laid(face, presets("frown", face, depth=1.0), 6)
    assert out.n_cells == expected.n_cells
    np.testing.assert_allclose(out["W"], expected["W"], atol=1e-9)


def test_texture_coordinates_stay(ball):
    scan = ball.texture_map_to_sphere(inplace=False)
    with pytest.warns(FaceWrinkleWarning, match="refined"):
        out = scan.facewrinkle.pattern("dimple", (0, 0, 40), size=15.0)
    assert out.active_texture_coordinates.shape == (out.n_points, 2)
    base = out["level"] == 0
    np.testing.assert_allclose(out.active_texture_coordinates[base], scan.active_texture_coordinates, atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        ({"pattern": "dimple", "centre": (40, 0, 0), "size": 2.0, "max_level": 2}, ParameterError, "too coarse.*split"),
        ({"pattern": "dimple_l"}, ParameterError, "placed by landmarks"),
        ({"pattern": "dimpel", "centre": (0, 0, 40), "size": 9.0}, UnknownNameError, "'dimple'"),
        ({"pattern": "dimple", "centre": (0, 0, np.nan), "size": 9.0}, ParameterError, "finite"),
        ({"pattern": "dimple", "centre": (0, 0, 40), "size": 9.0, "time": np.nan}, ParameterError, "time"),
        ({"pattern": "dimple", "centre": (0, 0, 90), "size": 9.0}, ParameterError, "off the mesh"),
        ({"pattern": "dimple", "centre": (0, 0, 40), "size": 900.0}, ParameterError, "larger than the mesh"),
        (
            {"pattern": "dimple", "centre": (0, 0, 40), "size": 9.0, "strength": fw.Compression()},
            ParameterError,
            "keeps still",
        ),
    ],
)
def test_errors(ball, arguments, error, says):
    with pytest.raises(error, match=says):
        ball.facewrinkle.pattern(**arguments)
