"""The shape of a drop, formulas alone.

profile      against a point of the printed formula worked out by other means, and its sharpest t
moments      against adaptive quadrature and the numbers of the design
DropLattice  against the volume of its mesh
"""

import numpy as np
import pytest
import pyvista as pv
from scipy.integrate import quad

from facewrinkle.errors import ParameterError
from facewrinkle.tears.drop import SHARPEST, DropLattice, moments, profile


def test_profile_is_the_printed_surface_of_revolution():
    radius, axis = profile(np.pi / 2, 1.0 / 3.0, 2.0, 5.0)
    assert radius == pytest.approx(2.0 / (np.sqrt(3.0) / 2.0))  # u = pi/2, t u = pi/6
    assert axis == pytest.approx(5.0 * np.sqrt(3.0) / 2.0)
    u = np.linspace(0.0, np.pi, 500)
    for t in (0.1, 0.3, 0.45):
        radius, axis = profile(u, t, 1.0, 8.0)
        assert (np.diff(axis) < 0.0).all()  # the round end is the lowest
        assert radius[[0, -1]] == pytest.approx(0.0, abs=1e-12)
        assert (radius[1:-1] > 0.0).all()


def test_it_is_sharpest_where_the_design_says():
    t = np.linspace(0.1, 0.45, 35_001)
    at_tip = np.array([profile(np.pi - 1e-4, x, 1.0, 1.0)[0] for x in t[::100]])
    height = np.array([profile(np.pi - 1e-4, x, 1.0, 1.0)[1] - profile(np.pi, x, 1.0, 1.0)[1] for x in t[::100]])
    assert t[::100][np.argmin(at_tip / height)] == pytest.approx(SHARPEST, abs=1e-3)


@pytest.mark.parametrize("t", [0.1, 0.25, 0.4, 0.45])
def test_moments_are_those_of_adaptive_quadrature(t):
    def slab(u):
        return np.pi * profile(u, t, 1.0, 1.0)[0] ** 2 * 6.0 * t * np.sin(t * u)

    volume = quad(slab, 0.0, np.pi, epsabs=1e-12)[0]
    centre = quad(lambda u: slab(u) * profile(u, t, 1.0, 6.0)[1], 0.0, np.pi, epsabs=1e-12)[0] / volume
    assert moments(t, 1.0, 6.0) == pytest.approx((volume, centre), rel=1e-9)


def test_volume_is_the_closed_integral_of_the_design():
    for t, volume in ((0.2, 1.7496), (0.4, 11.3555)):
        assert moments(t, 1.0, 5.0)[0] == pytest.approx(volume, abs=5e-5)


def test_profile_refuses_the_singular_t():
    with pytest.raises(ParameterError):
        profile(1.0, 0.5, 1.0, 1.0)


def test_volume_of_the_lattice_is_that_of_its_mesh():
    lattice = DropLattice(30)
    mesh = pv.PolyData.from_regular_faces(lattice.points(0.3, 1.0, 6.0) * [1.0, 1.0, -1.0], lattice.triangles)
    assert abs(mesh.volume) == pytest.approx(lattice.volume(0.3, 6.0), rel=1e-6)
