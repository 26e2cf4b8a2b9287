"""Furrows as they are measured.

what                              checked against
cuts across creases               known profiles; steps of flesh in the young, lines in the old, as captured
directions and spacings           heights of which they are known
mean curvature                    that of a sphere
smoothed change of a bump         a Gaussian convolved with a Gaussian, whose Laplacian is known
correlation and size              fields of known correlation
sections                          closed forms
"""

from functools import lru_cache

import numpy as np
import pytest
import pyvista as pv
from expressions import after
from real_faces import FACES

import facewrinkle as fw
from analysis.creases import CREASES, Cut, captured_creases, creases
from analysis.folds import measured, spacings
from analysis.motion import captured, read_shapes
from analysis.profiles import EPSILON, closed_form, closed_narrow, folded, sheet
from analysis.relief import SMOOTHED, change_of_curvature, correlation, mean_curvature
from analysis.sections import cut, expected, measure
from analysis.surfaces import rates_of, settled, wrinkled_surface, wrinkling
from facewrinkle.geometry import equations

young = lru_cache(maxsize=2)(creases)
"""The creases of a face at age 0, found once."""

PLACE = np.linspace(-8.0, 8.0, 161)


def test_a_known_valley_is_measured():
    """Walls of 20 degrees on the far side of the line, 30 on the other, in a plane that leans by 10."""
    far, near = np.tan(np.radians([20.0, 30.0]))
    height = np.where(PLACE < 0.0, -far, near) * PLACE
    cut = Cut(PLACE, height, np.stack([PLACE, height], axis=1))
    assert cut.turn == pytest.approx(20.0)
    assert cut.bend == pytest.approx(50.0)
    assert cut.slopes == pytest.approx((-20.0, 30.0))
    assert cut.sharpest == pytest.approx(50.0)


def test_a_step_does_not_turn_back():
    height = 1.0 / (1.0 + np.exp(-PLACE))
    cut = Cut(PLACE, height, np.stack([PLACE, height], axis=1))
    assert cut.turn == 0.0
    assert cut.slopes[0] >= 0.0


@pytest.mark.slow
@pytest.mark.parametrize("any_face", [None, "ict_face_narrow"], indirect=True)
def test_young_creases_are_steps_of_flesh(any_face):
    """Captured skin, which is smooth over a millimeter or two, bends by up to 33 degrees/mm."""
    found = {row.crease: row for row, _ in young(any_face)}
    assert set(found) == set(CREASES)
    for row in found.values():
        assert row.turn < 10.0, row
        assert row.bend < 25.0, row
    assert min(found[name].turn for name in ("beside the nose", "corner of the mouth")) > 3.0  # they are there


@pytest.mark.slow
def test_creases_sharpen_with_age(face):
    before, old = ({row.crease: row for row, _ in rows} for rows in (young(face), creases(face, 1.0)))
    for name in ("beside the nose", "corner of the mouth", "below the corner", "between the brows"):
        if name != "between the brows":  # there the old keep less, or they look cross
            assert old[name].turn > before[name].turn
        assert old[name].bend > 1.8 * before[name].bend


@pytest.mark.slow
def test_a_smile_slopes_as_captured_skin_does(real_face):
    """Across the fold of the mean captured face, in front of the plane of the face."""
    face = real_face("ict_face_narrow")
    shapes = read_shapes(FACES / "ict_face_expressions.npz", len(face.points), 10.0)
    truth, ours = ({row.crease: row for row, _ in rows} for rows in (captured_creases(face, shapes), young(face)))
    smile, captured = ours["beside the nose"], truth["beside the nose"]
    np.testing.assert_allclose(smile.slopes, captured.slopes, atol=10.0)
    assert 0.5 * captured.sharpest < smile.sharpest < 1.5 * captured.sharpest


# --- spacings and directions -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def raised(face):
    """A simulation that holds the brows up, without layers, and its frame."""
    sim = fw.Simulation(face, layers=[])
    return sim, after(sim, "surprise", 20)


@pytest.mark.parametrize(("axis", "low", "high"), [(1, 0.0, 25.0), (0, 60.0, 90.0)])
@pytest.mark.slow
def test_the_angle_is_that_between_lines_and_compression(face, raised, axis, low, high):
    """The forehead is compressed upwards: level lines lie across that, upright ones along."""
    sim, frame = raised
    place = np.asarray(frame["rest"])
    above = place[:, 1] > face.landmarks["glabella"][1] + 12.0
    front = place[:, 2] > face.landmarks["forehead_mid"][2] - 25.0
    frame = {"W": np.where(above & front, 0.3 * np.cos(place[:, axis] * 2.0 * np.pi / 30.0), 0.0)}
    assert low <= measured(sim, frame).angle <= high


@pytest.mark.slow
def test_spacings_are_those_of_the_furrows(face):
    """On a forehead whose triangles are fine enough."""
    sim = fw.Simulation(face)
    after(sim, "surprise", 20)
    up = face.frame.local(sim.vertices.points)[:, 1] * face.frame.pupil_distance
    gaps = np.concatenate(spacings(sim, {"W": np.cos(up * 2.0 * np.pi / 16.0)}))
    assert len(gaps) > 5
    assert np.median(gaps) == pytest.approx(16.0, abs=1.0)


# --- change of curvature ---------------------------------------------------------------------------


def test_a_sphere_has_the_curvature_of_its_radius():
    ball = pv.Icosphere(radius=40.0, nsub=4)
    curvature = mean_curvature(np.asarray(ball.points, float), ball.regular_faces.astype(np.int32))
    assert curvature.mean() == pytest.approx(1.0 / 40.0, rel=1e-3)
    np.testing.assert_allclose(curvature[12:], 1.0 / 40.0, rtol=0.02)  # the first twelve have five neighbors


def test_a_flat_bump_has_the_smoothed_laplacian_of_a_gaussian():
    """h exp(-r^2 / 2 s^2), smoothed: h s^2 / v exp(-r^2 / 2 v), v the sum of variances; curvature: -1/2 its Laplacian.

    The Gaussian that smooths ends at 2.5 of its width: its variance is less by the closed form for a disc.
    """
    sheet = pv.Plane(i_size=60.0, j_size=60.0, i_resolution=80, j_resolution=80).triangulate()
    points, triangles = np.asarray(sheet.points, float), sheet.regular_faces.astype(np.int32)
    square = (points[:, :2] ** 2).sum(axis=1)
    end = 0.5 * 2.5**2
    height, s, v = 0.05, 6.0, 6.0**2 + SMOOTHED**2 * (1.0 - end / (np.exp(end) - 1.0))
    bump = np.zeros_like(points)
    bump[:, 2] = height * np.exp(-0.5 * square / s**2)
    exact = height * s**2 / v**2 * (1.0 - 0.5 * square / v) * np.exp(-0.5 * square / v)
    inner = square < 20.0**2
    found = change_of_curvature(points, triangles)(bump)
    np.testing.assert_allclose(found[inner], exact[inner], atol=0.02 * exact.max())


def test_fields_of_known_correlation():
    rng = np.random.default_rng(0)
    a, b = np.linalg.qr(rng.normal(size=(200, 3)) * [0, 1, 1] + [1, 0, 0])[0][:, 1:].T  # square to each other and to 1
    assert correlation(3.0 * (0.6 * a + 0.8 * b) + 5.0, a, np.ones(200)) == pytest.approx((0.6, 3.0))
    doubled = np.concatenate([a, a[:50]]), np.concatenate([b, b[:50]])
    weight = np.ones(200) + (np.arange(200) < 50)
    assert correlation(a, b, weight) == pytest.approx(correlation(*doubled, np.ones(250)))


def test_without_captured_faces_nothing_is_done(tmp_path, capsys):
    assert captured(tmp_path / "no.obj", shapes=tmp_path / "no.npz") is None
    assert "no.obj" in capsys.readouterr().out


# --- sections and their report --------------------------------------------------------------------


def test_a_surface_on_its_own_mesh_is_the_frame(face):
    sim = settled(face, "frowning", 12)
    frame = sim.step()
    surface = wrinkled_surface(sim)
    np.testing.assert_array_equal(surface.wrinkled, frame.points)
    np.testing.assert_array_equal(surface.height, frame["W"])
    np.testing.assert_array_equal(surface.shading, frame["Normals"])


def test_vertices_lie_on_the_closed_form():
    """All error is between the vertices of the mesh."""
    muscle = sheet()
    surface = folded(muscle, 2)
    core = np.abs(surface.rest[:, 0]) < 0.5 * muscle.wrinkles.core * muscle.width
    along = 22.0 - surface.rest[:, 1]
    inside = core & (along > 4.4) & (along < 44.0)
    np.testing.assert_allclose(surface.height[inside], closed_form(muscle, along[inside]), atol=1e-12)


def test_a_known_wave_is_measured():
    x = np.linspace(0.0, 30.0, 3001)
    found = measure(x, 0.4 * np.cos(2.0 * np.pi * x / 6.0))
    assert (found.count, found.amplitude, found.wavelength) == (5, pytest.approx(0.8, abs=1e-4), pytest.approx(6.0))
    assert found.narrow == pytest.approx(0.5, abs=1e-3)
    for alpha in (0.5, 2.0, 4.0):
        found = measure(x, equations.shape(np.mod(x, 6.0), 3.0, 0.5, alpha))
        assert found.amplitude == pytest.approx(0.5 * 2.0**alpha, rel=1e-2)
        assert found.narrow == pytest.approx(closed_narrow(alpha), abs=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["closing_eye", "paper_surprise"])
def test_cuts_are_made_across_folds_of_every_kind(face, name):
    """Between the vertices of a fine mesh the closed form of rings and of straight fibers is met."""
    sim = settled(face, name, 30)
    fine = wrinkled_surface(sim, wrinkling(face, rates_of(sim), 4))
    which = max(rates_of(sim), key=lambda n: rates_of(sim)[n])
    section = cut(fine, face.muscles[which].fold_pattern, face.unit)
    error = np.abs(section.height - expected(section, sim, fine))
    assert np.ptp(section.height) > 0.3
    assert error.mean() < 0.01 * np.ptp(section.height)


def test_a_cut_outside_the_region_is_refused():
    muscle = sheet()
    with pytest.raises(fw.FaceWrinkleError, match="does not meet the wrinkling region"):
        cut(folded(muscle, 1), muscle, across=1.3)


@pytest.mark.slow
def test_heights_converge_to_the_closed_form(report):
    numbers = report("profiles").numbers
    assert 1.7 < numbers["orders"]["mean"] < 2.2
    assert 1.2 < numbers["orders"]["rms"] < 1.7  # H has creases
    assert 0.7 < numbers["orders"]["largest"] < 1.2
    assert numbers["plate"]["mean"][-1] < 0.002
    for row in numbers["shapes"]:
        assert row["amplitude"] == pytest.approx(row["closed amplitude"], rel=0.09)
        assert row["amplitude"] < row["closed amplitude"] * (1.0 + 1e-9)  # the mesh can only cut off
        assert row["wavelength"] == pytest.approx(row["closed wavelength"], rel=0.01)
        assert row["narrow"] == pytest.approx(row["closed narrow"], abs=0.03)
    half = {row["k0"]: row["amplitude"] for row in numbers["shapes"] if row["alpha"] == 2.0}
    assert half[1.0] == pytest.approx(10.0 * half[0.1], rel=1e-9)  # proportional to k0
    for _, amplitude, at in numbers["attenuation"]:
        assert amplitude == pytest.approx(at, abs=0.01)


@pytest.mark.slow
def test_heights_on_the_head_converge_too(report):
    for row in report("profiles").numbers["head"].values():
        assert row["order"] > 1.0  # where folds begin and end, H has a step, as printed; elsewhere it would be 2
        assert row["share"] < 0.03  # of the amplitude; .007 to .028 were measured


def test_the_plate_is_compressed_as_it_should_be():
    surface = folded(sheet(), 1)
    np.testing.assert_allclose(surface.bare[:, 1], (1.0 - EPSILON) * surface.rest[:, 1])
