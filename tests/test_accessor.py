"""The namespace on PolyData.

what           checked against
registration   PyVista's list of accessors; the entry point in pyproject.toml
input          its fingerprint, before and after
result         a simulation of the same; the mesh's other parts, point data and texture coordinates
tear           a SheddingTear of the same; closed, outside, and where it was led
errors         too coarse, presets without landmarks, compressed skin; paths that are none, off, crossing or torn
"""

import tomllib
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
import facewrinkle.accessor
from facewrinkle.errors import FaceWrinkleWarning, MeshError, ParameterError, UnknownNameError


@pytest.fixture
def ball():
    mesh = pv.Sphere(radius=40.0, theta_resolution=40, phi_resolution=40)
    mesh["height"] = mesh.points[:, 1].astype(np.float64)
    return mesh


def test_it_is_registered_on_all_data_of_pyvista():
    assert any(a.name == "facewrinkle" and a.target is pv.DataObject for a in pv.registered_accessors())
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())
    assert project["project"]["entry-points"]["pyvista.accessors"] == {"facewrinkle": "facewrinkle.accessor"}


def test_a_pattern_leaves_its_input_alone(ball, fingerprint):
    before = fingerprint(ball)
    out = ball.facewrinkle.pattern("cheek", (0, 0, 40), size=30.0, depth=1.5, number=3)
    assert fingerprint(ball) == before
    assert out is not ball
    assert out.n_cells > ball.n_cells
    assert 1.0 < np.ptp(out["W"]) < 1.6
    np.testing.assert_allclose(out["height"], out["rest"][:, 1], atol=0.15)


def test_it_is_what_a_simulation_gives(ball):
    scan = ball.texture_map_to_sphere(inplace=False)
    out = scan.facewrinkle.pattern("dimple", (0, 0, 40), size=15.0, depth=2.0)
    face = fw.surface(scan)
    layer = fw.PatternLayer("dimple", (0, 0, 40), size=15.0, depth=2.0)
    *_, frame = fw.Simulation(face, layers=[layer], motion=fw.Still(face)).run(8)
    np.testing.assert_array_equal(out.points, frame.points)
    assert out.point_data.keys() == frame.point_data.keys()
    for name in frame.point_data:
        np.testing.assert_array_equal(out[name], frame[name], name)
    assert out.active_texture_coordinates.shape == (out.n_points, 2)


def test_fine_meshes_are_not_refined():
    fine = pv.Plane(i_size=50, j_size=50, i_resolution=90, j_resolution=90).triangulate()
    out = fine.facewrinkle.pattern("cheek", (0, 0, 0), size=40.0, number=2, radius=20.0)
    assert out.n_cells == fine.n_cells


def test_other_parts_come_along(ball):
    ear = pv.Sphere(radius=8.0, center=(0, 0, 60), theta_resolution=30, phi_resolution=30)
    ear["height"] = ear.points[:, 1].astype(np.float64)
    both = pv.merge([ball, ear])
    out = both.facewrinkle.pattern("dimple", (0, 0, 68), size=6.0, depth=1.0)
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
    out = face.mesh.facewrinkle.pattern("frown", landmarks=given, depth=1.0)
    expected = facewrinkle.accessor.patterned(face, fw.PatternLayer.presets("frown", face, depth=1.0), 6)
    assert out.n_cells == expected.n_cells
    np.testing.assert_allclose(out["W"], expected["W"], atol=1e-9)


@pytest.mark.filterwarnings("ignore:Kept one of")
def test_eyes_and_teeth_stay_where_landmarks_are_given(face):
    balls = [pv.Sphere(radius=eye.radius, center=eye.centre) for eye in face.eyes]
    whole = face.mesh.copy()
    whole.clear_data()
    whole = pv.merge([whole, *balls], merge_points=False)
    out = whole.facewrinkle.pattern("frown", landmarks=face.landmarks, depth=1.0)
    alone = face.mesh.facewrinkle.pattern("frown", landmarks=face.landmarks, depth=1.0)
    assert out.n_cells == alone.n_cells + sum(ball.n_cells for ball in balls)
    np.testing.assert_allclose(out["W"][out["part"] == 0], alone["W"], atol=1e-9)
    assert out.field_data["parts"].tolist() == ["skin", "eye_l", "eye_r"]
    for number, ball in enumerate(balls, start=1):
        found = np.asarray(out.points)[out["part"] == number]
        np.testing.assert_allclose(np.sort(found, axis=0), np.sort(ball.points, axis=0), atol=1e-5)
    np.testing.assert_array_equal(out["W"][out["part"] > 0], 0.0)


# --- tears ------------------------------------------------------------------------------------------


def on_ball(*polar_azimuth):
    polar, azimuth = np.transpose(polar_azimuth)
    x, y = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth)
    return 40.0 * np.stack([x, np.cos(polar), y], axis=1)


@pytest.fixture
def round_ball():
    return pv.Icosphere(radius=40.0, nsub=4)


def test_a_tear_leaves_its_input_alone_and_is_a_mesh_of_its_own(round_ball, fingerprint):
    before, way = fingerprint(round_ball), on_ball((0.6, 1.0), (1.5, 1.0))
    given = way.copy()
    first, second = (round_ball.facewrinkle.tear(path=way, width=4.0) for _ in range(2))
    assert fingerprint(round_ball) == before
    np.testing.assert_array_equal(way, given)
    assert fingerprint(first) == fingerprint(second)
    first.points[:] = 0.0
    assert fingerprint(round_ball) == before
    assert np.ptp(second.points) > 10.0


def test_a_tear_is_that_of_the_class(round_ball, fingerprint):
    way = on_ball((0.6, 1.0), (1.5, 1.0))
    stream = fw.SheddingTear(round_ball, way, width=4.0)
    assert fingerprint(round_ball.facewrinkle.tear(way, width=4.0)) == fingerprint(stream.surface(stream.end))
    assert fingerprint(round_ball.facewrinkle.tear(way, t=0.3, width=4.0)) == fingerprint(stream.surface(0.3))


def test_units_scale_a_tear(round_ball):
    water, other = (
        mesh.facewrinkle.tear(on_ball((0.6, 1.0), (1.5, 1.0)) * scale, units=units, width=4.0)
        for mesh, scale, units in ((round_ball, 1.0, "mm"), (round_ball.scale(0.001), 0.001, 1000.0))
    )
    assert other.volume * 1e9 == pytest.approx(water.volume, rel=0.01)


def test_without_units_the_size_of_the_mesh_says_them(ball, round_ball):
    """A ball of 40 is one in mm, one of 0.04 in meters: patterns and tears are the same."""
    small = ball.scale(0.001)
    usual = ball.facewrinkle.pattern("dimple", (0, 0, 40), size=15.0, depth=2.0)
    with pytest.warns(FaceWrinkleWarning, match="taken to be m"):
        other = small.facewrinkle.pattern("dimple", (0, 0, 0.04), size=0.015, depth=2.0)
    np.testing.assert_allclose(other["W"], usual["W"], atol=1e-4)
    np.testing.assert_allclose(other.points * 1000.0, usual.points, atol=1e-3)
    with pytest.warns(FaceWrinkleWarning, match="unit is taken to be m"):
        water = round_ball.scale(0.001).facewrinkle.tear(start=RING[0] / 1000.0, width=4.0)
    expected = round_ball.facewrinkle.tear(start=RING[0], width=4.0)
    assert water.volume * 1e9 == pytest.approx(expected.volume, rel=0.01)


RING = on_ball((0.5, 0.0), (1.2, 0.0), (1.0, 0.5), (0.8, -0.5), (1.3, -0.5))


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        ({}, ParameterError, "give either path or start"),
        ({"path": RING[:2], "start": RING[0]}, ParameterError, "give either path or start"),
        ({"path": [(0, 80, 0), (0, 0, 40)]}, ParameterError, "point 0.*40 away"),
        ({"path": []}, ParameterError, "finite numbers"),
        ({"start": (0, 80, 0)}, ParameterError, "start must lie on the surface"),
        ({"start": (0, np.nan, 0)}, ParameterError, "start must be three finite numbers"),
        ({"start": "l"}, ParameterError, "only be named on a Face"),
        ({"start": RING[0], "t": -1.0}, ParameterError, "t must lie in"),
        ({"start": RING[0], "units": 0.0}, ParameterError, "units must be a finite number greater than 0"),
        ({"start": RING[0], "down": (0, 0, 0)}, ParameterError, "down must not be zero"),
    ],
)
def test_errors_of_tears(round_ball, arguments, error, says, fingerprint):
    before = fingerprint(round_ball)
    with pytest.raises(error, match=says):
        round_ball.facewrinkle.tear(**arguments)
    assert fingerprint(round_ball) == before


@pytest.mark.parametrize(
    ("mesh", "says"),
    [
        (pv.PolyData(), "no points"),
        (pv.PolyData(np.eye(3)), "no faces"),
        (pv.Line(), "no faces"),
        (pv.PolyData(np.array([[0, 0, 0], [9, 0, 0], [0, np.nan, 0.0]]), [3, 0, 1, 2]), "finite"),
    ],
)
def test_meshes_on_which_nothing_runs(mesh, says):
    with pytest.raises(MeshError, match=says):
        mesh.facewrinkle.tear(start=(0.0, 0.0, 0.0))


def test_a_face_is_fitted_and_makes_an_expression(face):
    frame = face.mesh.facewrinkle.express("AU4", 0.5, landmarks=face.landmarks)
    sim = fw.Simulation(fw.fit_face(face.mesh, face.landmarks))
    sim.express("AU4", 0.5)
    np.testing.assert_array_equal(frame.points, sim.settle().points)
    with pytest.raises(UnknownNameError, match="Did you mean 'happiness'"):
        face.mesh.facewrinkle.express("hapiness", landmarks=face.landmarks)
