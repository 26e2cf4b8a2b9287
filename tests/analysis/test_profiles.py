"""Sections and their report, against closed forms."""

import numpy as np
import pytest

import facewrinkle as fw
from analysis.profiles import EPSILON, closed_form, closed_narrow, folded, sheet
from analysis.sections import cut, expected, measure
from analysis.surfaces import rates_of, settled, wrinkled_surface, wrinkling
from facewrinkle.geometry import equations


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
        w = np.mod(x, 6.0)
        found = measure(x, equations.shape(w, 3.0, 0.5, alpha))
        assert found.amplitude == pytest.approx(0.5 * 2.0**alpha, rel=1e-2)
        assert found.narrow == pytest.approx(closed_narrow(alpha), abs=5e-3)


@pytest.mark.slow
def test_cuts_are_made_across_folds_of_every_kind(face):
    """Between the vertices of a fine mesh the closed form of rings and of straight fibers is met."""
    for name in ("closing_eye", "paper_surprise"):
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
    for _, measured, at in numbers["attenuation"]:
        assert measured == pytest.approx(at, abs=0.01)


@pytest.mark.slow
def test_heights_on_the_head_converge_too(report):
    for row in report("profiles").numbers["head"].values():
        assert row["order"] > 1.0  # where folds begin and end, H has a step, as printed; elsewhere it would be 2
        assert row["share"] < 0.03  # of the amplitude; .007 to .028 were measured


def test_the_plate_is_compressed_as_it_should_be():
    surface = folded(sheet(), 1)
    np.testing.assert_allclose(surface.bare[:, 1], (1.0 - EPSILON) * surface.rest[:, 1])
