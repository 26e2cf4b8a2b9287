"""Dripping tears.

DrippingTear closed, of genus 0, oriented, of constant mass as it falls, born outside the skin, falling as things fall
"""

import dataclasses

import numpy as np
import pytest
import pyvista as pv
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from small_meshes import assert_ball, signed_distances

import facewrinkle as fw
from facewrinkle.errors import MeshError, ParameterError, UnknownNameError
from facewrinkle.tears import DropShape, Fall
from facewrinkle.tears.drop import SHARPEST, DropLattice, moments, profile


@settings(max_examples=40)
@given(st.floats(0.0, 1.0), st.floats(2.0, 12.0), st.floats(0.5, 8.0))
def test_closed_oriented_and_of_the_asked_mass(share, ratio, size):
    tear = fw.DrippingTear(size=size, shape=DropShape(ratio=ratio), begin=0.5)
    mesh = tear.surface(tear.begin + share * (tear.end - tear.begin))
    assert_ball(mesh)
    if share * (tear.end - tear.begin) > tear.hang:
        assert mesh.volume == pytest.approx(np.pi / 6.0 * size**3, rel=1e-5)


def test_mass_is_kept_to_a_tenth_of_a_percent_by_the_formula_too():
    """The mesh holds the volume; the smooth drop around it, by quadrature, differs by its facets."""
    tear = fw.DrippingTear(resolution=160)
    volumes = []
    for t in np.linspace(tear.begin + tear.hang, tear.end, 9):
        s, alpha, beta = tear.sizes(t)
        volumes.append(moments(s, alpha, beta)[0])
    assert np.ptp(volumes) < 1e-3 * np.mean(volumes)


def test_it_grows_hangs_by_its_tip_and_lets_go_without_a_jump():
    tear = fw.DrippingTear(start=(1.0, 2.0, 3.0), begin=1.0, hang=0.5)
    meshes = [tear.surface(t) for t in np.linspace(1.0, 1.5, 20)]
    assert (np.diff([m.volume for m in meshes]) > 0.0).all()
    for mesh in meshes:
        assert mesh.bounds.y_max == pytest.approx(2.0)
    before, after = tear.surface(1.5), tear.surface(1.5 + 1e-6)
    assert np.abs(before.points - after.points).max() < 1e-3
    slenderness = [np.ptp(m.points[:, 1]) / np.ptp(m.points[:, 0]) for m in meshes]
    assert slenderness[-1] == max(slenderness)  # it is drawn out before it lets go


def test_it_falls_as_things_fall():
    tear = fw.DrippingTear(fall=Fall(depth=500.0))
    free = np.linspace(tear.begin + tear.hang, tear.end, 7)
    drops = [tear.surface(t) for t in free]
    centre = [trimesh.Trimesh(drop.points, drop.regular_faces, process=False).center_mass[1] for drop in drops]
    assert centre == pytest.approx(centre[0] - 0.5 * 9810.0 * (free - free[0]) ** 2, abs=0.05)
    assert centre[0] - centre[-1] == pytest.approx(500.0, abs=0.05)
    steady = fw.DrippingTear(fall=Fall(speed=100.0, depth=50.0))
    assert steady.end - steady.begin - steady.hang == pytest.approx(0.5)


def test_down_can_be_given():
    tear = fw.DrippingTear(down=(0.0, 0.0, -2.0))
    assert tear.surface(tear.end).center[2] < -290.0


def test_it_hangs_at_the_moving_lid_and_falls_from_there(face):
    tear, mesh = fw.DrippingTear(face, "l"), face.mesh
    moved = mesh.copy()
    moved.points = mesh.points + np.array([0.0, 5.0, 0.0])
    for t in (tear.end, 0.4, tear.begin + tear.hang + 0.02):  # in any order
        still, there = tear.surface(t, mesh).points, tear.surface(t, moved).points
        assert there - still == pytest.approx(np.tile([0.0, 5.0, 0.0], (len(still), 1)), abs=1e-6)
        np.testing.assert_array_equal(fw.DrippingTear(face, "l").surface(t, moved).points, there)


def test_units(face):
    meters = dataclasses.replace(face, mesh=face.mesh, unit=1000.0)
    assert fw.DrippingTear(meters, "l", size=3000.0).volume == pytest.approx(fw.DrippingTear(face, "l").volume)


@pytest.mark.parametrize(
    ("any_face", "side"),
    [
        (None, "l"),
        (None, "r"),
        ("thick", "l"),
        ("sockets", "r"),
        ("shut", "l"),
        ("ict_face_narrow", "r"),
        pytest.param("makehuman_head_male", "l", marks=pytest.mark.slow),
    ],
    indirect=["any_face"],
)
def test_never_in_the_skin_on_lids_of_all_kinds(any_face, side):
    face, tear = any_face, fw.DrippingTear(any_face, side)
    for t in np.linspace(tear.begin, tear.end, 15):
        drop = tear.surface(t)
        assert_ball(drop)
        assert signed_distances(drop.points, face.mesh).min() > 0.0
    assert drop.bounds.y_max < face.landmarks["menton"][1]
    assert tear.volume * face.unit**3 == pytest.approx(np.pi / 6.0 * 27.0)


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda face: fw.DrippingTear(size=0.0), ParameterError, "size"),
        (lambda face: fw.DrippingTear(size=np.nan), ParameterError, "size"),
        (lambda face: fw.DrippingTear(hang=0.0), ParameterError, "hang"),
        (lambda face: fw.DrippingTear(start=(0.0, np.nan, 0.0)), ParameterError, "start"),
        (lambda face: fw.DrippingTear(start="l"), ParameterError, "start must be three finite numbers"),
        (lambda face: fw.DrippingTear(down=(0.0, 0.0, 0.0)), ParameterError, "down"),
        (lambda face: fw.DrippingTear(resolution=3), ParameterError, "resolution"),
        (lambda face: fw.DrippingTear(face, (0.0, 0.0, 500.0)), ParameterError, "must lie on the surface"),
        (lambda face: fw.DrippingTear(face, "m"), UnknownNameError, "unknown side 'm'"),
        (lambda face: fw.DrippingTear(pv.Sphere(radius=50.0), "l"), ParameterError, "only be named on a Face"),
        (lambda face: fw.DrippingTear(face, "l", size=200.0), ParameterError, "smaller than"),
        (lambda face: fw.DrippingTear(face, "l").surface(0.4, pv.Sphere()), MeshError, "another surface"),
        (lambda face: fw.DrippingTear(face, "l").surface(0.4, "frame"), MeshError, "must be a PolyData"),
        *((lambda _, t=t: fw.DrippingTear().surface(t), ParameterError, "t must lie in") for t in (-0.1, 99.0, np.nan)),
        (lambda face: DropShape(ratio=0.1), ParameterError, "ratio"),
        (lambda face: DropShape(t=(0.1, 0.6)), ParameterError, "t"),
        (lambda face: DropShape(t=0.1), ParameterError, "t"),
        (lambda face: DropShape(stretch=-0.1), ParameterError, "stretch"),
        (lambda face: Fall(speed=-1.0), ParameterError, "speed"),
        (lambda face: Fall(depth=0.0), ParameterError, "depth"),
        (lambda face: profile(1.0, 0.5, 1.0, 1.0), ParameterError, "t must lie in"),
    ],
)
def test_refuses(face, call, error, says):
    with pytest.raises(error, match=says):
        call(face)


# --- its shape, formulas alone --------------------------------------------------------------------


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


def test_volume_of_the_lattice_is_that_of_its_mesh():
    lattice = DropLattice(30)
    mesh = pv.PolyData.from_regular_faces(lattice.points(0.3, 1.0, 6.0) * [1.0, 1.0, -1.0], lattice.triangles)
    assert abs(mesh.volume) == pytest.approx(lattice.volume(0.3, 6.0), rel=1e-6)
