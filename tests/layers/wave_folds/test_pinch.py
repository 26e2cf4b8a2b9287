"""Folds that pinch: skin slides into the furrows.

what                  checked against
simulation            a layer that makes the surface of Gerstner's wave: a trochoid, with its arc length; beyond the
                      cusp nothing turns over and nothing crosses
waves                 stretch of the skin on crests and in furrows, 1 +- kappa of the trochoid of this depth and length
bounds                arc length of the formula, with what the kernel reckons; the length that the compression frees;
                      net volume; steepness
contact               no triangle turned over, no crossing, on flat, hollow and round sheets, whatever presses them
rest, histories       no slide, and the mesh at the start; the same slide after other times
"""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import LinearNDInterpolator
from scipy.special import ellipe

import facewrinkle as fw
from facewrinkle.errors import ParameterError
from facewrinkle.geometry.interpolation import interpolated
from facewrinkle.geometry.profile import bulge_height, first_harmonic, shape
from facewrinkle.geometry.smoothstep import smoothstep
from facewrinkle.geometry.volume import swept_volumes
from facewrinkle.layers.base import Displacement
from facewrinkle.layers.wave_folds import WaveFolds
from facewrinkle.layers.wave_folds import _kernels as kernels
from facewrinkle.motion.base import Undriven
from tools.self_intersections import self_intersections


class Moved(Undriven):
    """A surface whose vertices are at these places (n, 3), at one time after the other."""

    time_step = 0.02

    def __init__(self, face, *places):
        self.points, self.places, self.steps = face.points * face.unit, places, 0

    def reset(self):
        self.steps = 0

    def step(self):
        self.steps += 1
        return self.places[min(self.steps, len(self.places)) - 1].copy()


def sheet_of(width=40.0, height=50.0):
    return pv.Plane(
        i_size=width, j_size=height, i_resolution=round(width / 2), j_resolution=round(height / 2)
    ).triangulate()


def moulded(points, relief, across=0.0, along=0.0):
    """A flat sheet with ridges and hollows so high, pressed together by shares of its width and height."""
    x, y = points[:, :2].T
    return np.column_stack([(1.0 - across) * x, (1.0 - along) * y, -relief * np.cos(y / 4.0)])


def areas(points, triangles):
    corners = points[triangles]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def bare_surface(sim):
    sim.motion.steps -= 1
    return interpolated(sim.motion.step(), sim.vertices.corners, sim.vertices.barycentric)


# --- the surface of a wave, as a layer ---------------------------------------------------------------


class Gerstner:
    """Heights ``a cos(k y)`` whose points slide by ``a sin(k y)`` towards the troughs."""

    length = 8.0

    def __init__(self, steepness):
        self.wave = 2.0 * np.pi / self.length
        self.amplitude = steepness / self.wave

    def attach(self, face):
        self.y = np.empty(0)

    def follow(self, change, created):
        self.y = np.concatenate([self.y[change.kept], created.points[:, 1]])

    def displacement(self, state):
        n, (up, forward) = len(self.y), np.eye(3)[[2, 1]]
        assert (state.directions == up).all()
        height, slide = self.amplitude * np.cos(self.wave * self.y), self.amplitude * np.sin(self.wave * self.y)
        across, active = np.tile(forward, (n, 1)), np.ones(n, bool)
        return Displacement(height, np.full(n, 0.8), across, active, None, False, slide[:, None] * forward)

    def fields(self):
        return {}


@pytest.fixture(scope="module")
def still():
    """Plays a layer on a flat sheet that nothing moves."""
    face = fw.surface(sheet_of())

    def play(layer):
        sim = fw.Simulation(face, fw.Refinement(max_level=2), [layer], motion=fw.Still(face))
        return sim, sim.step()

    return play


@pytest.mark.parametrize("steepness", [0.3, 0.9])
def test_gerstners_wave_is_a_trochoid(still, steepness):
    layer = Gerstner(steepness)
    sim, frame = still(layer)
    start, now = np.asarray(frame["rest"])[:, 1], np.asarray(frame.points)
    np.testing.assert_allclose(now[:, 1], start + layer.amplitude * np.sin(layer.wave * start), atol=1e-12)
    np.testing.assert_allclose(now[:, 2], layer.amplitude * np.cos(layer.wave * start), atol=1e-12)
    np.testing.assert_allclose(frame["slide"][:, 1], now[:, 1] - start, atol=1e-12)
    edge = np.flatnonzero(np.abs(frame["rest"][:, 0] - 20.0) < 1e-9)
    edge = edge[np.argsort(start[edge])]
    exact = 4.0 * (1.0 + steepness) * ellipe(4.0 * steepness / (1.0 + steepness) ** 2) / layer.wave
    inner = edge[np.abs(start[edge]) <= 24.0 + 1e-9]
    arc = np.hypot(*np.diff(now[inner][:, 1:], axis=0).T).sum()
    assert arc == pytest.approx(6.0 * exact, rel=0.01)
    assert len(self_intersections(now, sim.forest.triangles)) == 0


@pytest.mark.parametrize("steepness", [1.0, 1.6])
def test_beyond_the_cusp_walls_touch_and_do_not_cross(still, steepness):
    """A trochoid steeper than a cycloid runs through itself: there the slide is shortened."""
    layer = Gerstner(steepness)
    sim, frame = still(layer)
    now, triangles = np.asarray(frame.points), sim.forest.triangles
    bare = np.asarray(frame["rest"])
    assert ((areas(now, triangles) * areas(bare, triangles)).sum(axis=1) > 0.0).all()
    assert len(self_intersections(now, triangles)) == 0
    asked = layer.amplitude * np.abs(np.sin(layer.wave * np.asarray(frame["rest"])[:, 1]))
    assert (np.abs(frame["slide"][:, 1]) <= asked + 1e-12).all()
    np.testing.assert_allclose(frame["W"], layer.amplitude * np.cos(layer.wave * np.asarray(frame["rest"])[:, 1]))


# --- waves on pressed sheets -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pressed():
    """Presses a flat sheet by shares of its height, one after the other: the simulation and its last frame."""
    face = fw.surface(sheet_of())
    shapes = [moulded(face.points, 0.0, 0.0, 0.3)]

    def press(*shares, level=3, **options):
        motion = Moved(face, *(moulded(face.points, 0.0, 0.0, share) for share in shares))
        layer = WaveFolds(families={"pressed": shapes}, **{"irregularity": 0.0, "symmetry": 0.0, **options})
        sim = fw.Simulation(face, fw.Refinement(max_level=level), [layer], motion=motion)
        for _ in range(len(shares) + 6):
            frame = sim.step()
        return sim, frame

    return press


def test_crests_widen_and_furrows_narrow_as_those_of_a_trochoid(pressed):
    share = 0.25
    sim, frame = pressed(share, level=4, pinch=1.0)
    rest, now = np.asarray(frame["rest"]), np.asarray(frame.points)
    inner = np.flatnonzero((np.abs(rest[:, :2]) < 12.0).all(axis=1) & (np.abs(frame["slide"][:, 1]) > 0.05))
    shares = {1.0: [], -1.0: []}
    for vertex in inner[:: len(inner) // 60]:
        found = sim.layers[0].explained(vertex)[0]
        if abs(found["W"]) > 1e-3:
            shares[np.sign(found["W"])].append(frame["W"][vertex] / found["W"])
        assert 0.3 < np.pi * found["D"] / found["L"] < 0.7
        size = (1.0 - share) * 0.5 * found["D"] * abs(np.sin(found["theta"]))
        assert np.linalg.norm(frame["slide"][vertex]) == pytest.approx(size, rel=0.05)
    for level in shares.values():  # crests and furrows hold as much
        assert 0.8 < level[0] <= 1.0 + 1e-9
        np.testing.assert_allclose(level, level[0], rtol=1e-9)
    y = np.linspace(-12.0, 12.0, 2401)
    moved, height = LinearNDInterpolator(rest[:, :2], now[:, 1:])(np.full(len(y), 3.0), y).T
    stretch = np.gradient(moved, y) / (1.0 - share)
    assert stretch.min() > 0.2
    deep = 0.7 * np.ptp(height) / 2.0
    middle = 0.5 * (height.max() + height.min())
    assert stretch[height < middle - deep].mean() < 0.6
    assert stretch[height > middle + deep].mean() > 1.3
    assert "slide" not in pressed(share, level=1)[1].point_data


def test_the_formula_is_no_longer_than_is_reckoned():
    """Arcs of the profile that slides, by quadrature, for all depths up to the deepest."""
    s = np.linspace(0.0, 1.0, 20001)
    for depth in np.linspace(0.01, kernels.STEEPEST, 12):
        sharp = min(depth / kernels.SHARP_DEPTH, 1.0)
        alpha = kernels.BLUNT_ALPHA + (kernels.SHARP_ALPHA - kernels.BLUNT_ALPHA) * sharp
        height = depth * shape(1.0 + s, 1.0, 2.0**-alpha, alpha)
        assert first_harmonic(alpha) == pytest.approx(
            2.0 * np.trapezoid(height / depth * np.cos(np.pi * s), s), abs=1e-6
        )
        assert kernels.first_harmonic(alpha) == pytest.approx(first_harmonic(alpha), abs=2e-4)
        for pinch in (0.0, 0.5, 1.0):
            kappa = pinch * np.pi * depth
            place = 0.5 * (s + kappa * np.sin(np.pi * s) / np.pi)
            assert (np.diff(place) > 0.0).all()
            excess = 2.0 * np.hypot(np.diff(place), np.diff(height)).sum() - 1.0
            reckoned = kernels.LONGER * (1.0 + kernels.LONGER_PINCHED * kappa) * (0.5 * np.pi * depth) ** 2
            assert excess <= reckoned
            # Wider crests hold more, by what the kernel lowers all by.
            held = 2.0 * np.trapezoid(height, place)
            assert held == pytest.approx(0.5 * kappa * depth * first_harmonic(alpha), abs=1e-6)
    assert bulge_height(1.0, 2.0) > first_harmonic(2.0)


def test_skin_slides_along_itself_however_the_head_is_turned(pressed):
    """A turn by a right angle about an oblique axis, and a shift."""
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    sim, frame = pressed(0.2, pinch=1.0)
    motion = Moved(sim.face, moulded(sim.face.points, 0.0, 0.0, 0.2) @ turn.T + [7.0, -3.0, 1.0])
    other = fw.Simulation(sim.face, sim.refinement, sim.layers, motion=motion)
    for _ in range(7):
        turned = other.step()
    assert np.abs(frame["slide"]).max() > 0.5
    np.testing.assert_allclose(turned["slide"], frame["slide"] @ turn.T, atol=1e-9)
    np.testing.assert_allclose(turned.points, np.asarray(frame.points) @ turn.T + [7.0, -3.0, 1.0], atol=1e-9)


@pytest.mark.parametrize("depth", [1.0, 50.0])
@pytest.mark.parametrize("share", [0.08, 0.25])
def test_pinched_folds_are_no_longer_than_the_compression_frees(pressed, depth, share):
    _, frame = pressed(share, depth=depth, pinch=1.0, irregularity=1.0)
    of = LinearNDInterpolator(np.asarray(frame["rest"])[:, :2], np.asarray(frame.points))
    y = np.linspace(-23.0, 23.0, 2001)
    for x in (-14.0, 0.0, 11.0):
        line = of(np.full(len(y), x), y)
        assert np.ptp(line[:, 2]) > 0.1
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() <= np.ptp(y) * (1.0 + 1e-9)


def test_pinched_folds_take_no_volume():
    face = fw.surface(sheet_of(120.0, 100.0))
    x, y = np.abs(face.points[:, :2]).T
    amount = smoothstep((56.0 - x) / 18.0) * smoothstep((46.0 - y) / 18.0)
    motion = Moved(face, moulded(face.points, 0.0, 0.0, 0.25))
    layer = WaveFolds(families={"pressed": [moulded(face.points, 0.0, 0.0, 0.3)]}, amount=amount, pinch=1.0)
    sim = fw.Simulation(face, layers=[layer], motion=motion)
    for _ in range(6):
        frame = sim.step()
    bare = bare_surface(sim)
    volumes = swept_volumes(bare, np.asarray(frame.points) - bare, sim.forest.triangles)
    assert np.abs(volumes).sum() > 500.0
    assert abs(volumes.sum()) < 0.01 * np.abs(volumes).sum()


def test_released_skin_does_not_slide(pressed):
    sim, frame = pressed(0.3, *[0.0] * 10, pinch=1.0)
    assert not frame["slide"].any()
    assert not frame["W"].any()
    assert (np.asarray(frame.points) == sim.face.points).all()
    assert (sim.forest.triangles == sim.face.triangles).all()


def test_the_same_slide_after_other_times(pressed):
    frames = [pressed(*shares, pinch=0.7)[1] for shares in ([0.2], [0.05, 0.3, 0.0, 0.2])]
    n = sheet_of().n_points
    assert frames[0]["slide"][:n].any()
    for name in ("slide", "W"):
        assert (frames[0][name][:n] == frames[1][name][:n]).all()


class Reliefs(dict):
    """Of a few words, where an example fails."""

    __repr__ = object.__repr__


@pytest.fixture(scope="module")
def reliefs():
    """Sheets, flat or with hollows of 8 mm radius, and what two families of them are found from."""
    flat, found = sheet_of(), Reliefs()
    points = np.asarray(flat.points, np.float64)
    for relief in (0.0, 2.0):
        mesh = flat.copy()
        mesh.points = moulded(points, relief)
        families = {"up": [moulded(points, relief, 0.0, 0.3)], "aside": [moulded(points, relief, 0.3, 0.0)]}
        found[relief] = fw.surface(mesh), points, families
    return found


@settings(max_examples=20)
@given(
    relief=st.sampled_from([0.0, 2.0]),
    across=st.floats(-0.2, 0.5),
    along=st.floats(-0.2, 0.5),
    pinch=st.floats(0.2, 1.0),
    depth=st.sampled_from([1.0, 4.0]),
    inextensible=st.booleans(),
    age=st.sampled_from([0.0, 1.0]),
)
def test_nothing_crosses_however_skin_is_pressed(reliefs, relief, across, along, pinch, depth, inextensible, age):
    """Also where it is hollow, so that the walls of neighbouring folds approach each other. Only what no skin could
    fold, 15 mm deep in a hollow of 8 mm, crosses, pinched or not.
    """
    face, points, families = reliefs[relief]
    possible = inextensible or relief > 0.0
    layer = WaveFolds(depth, families=families, pinch=pinch, inextensible=possible, age=age)
    motion = Moved(face, moulded(points, relief, across, along))
    sim = fw.Simulation(face, fw.Refinement(max_level=2), [layer], motion=motion)
    frame = sim.step()
    now, bare, triangles = np.asarray(frame.points), bare_surface(sim), sim.forest.triangles
    assert ((areas(now, triangles) * areas(bare, triangles)).sum(axis=1) > 0.0).all()
    assert len(self_intersections(now, triangles)) == 0


# --- on the built-in head ----------------------------------------------------------------------------


def test_exaggerated_folds_that_slide_take_no_volume(face):
    """Of the volume under the whole surface, by the theorem of Gauss: its borders stay where they are."""
    sim = fw.Simulation(face, layers=[WaveFolds(3.0, inextensible=False, pinch=1.0)])
    sim.express("surprise")
    *_, frame = sim.run(12, ramp=0.5)
    corners, shares = sim.vertices.corners, sim.vertices.barycentric
    bare = np.einsum("nc,nck->nk", shares, (sim.motion.points + sim.motion.displacement)[corners])
    now, triangles = np.asarray(frame.points), sim.forest.triangles
    before, after = (np.linalg.det(points[triangles]).sum() / 6.0 for points in (bare, now))
    volumes = swept_volumes(bare, now - bare, triangles)
    assert np.abs(volumes).sum() > 1500.0
    assert abs(after - before) < 0.005 * np.abs(volumes).sum()


def test_crests_lean_over_the_furrows_between_the_brows(face):
    sim = fw.Simulation(face, layers=[fw.MuscleWrinkles(anatomical=True, pinch=1.0)])
    sim.express("frowning")
    *_, frame = sim.run(8)
    slide, height = np.asarray(frame["slide"]), np.asarray(frame["W"])
    assert np.linalg.norm(slide, axis=1).max() > 0.2
    crests = (height > 0.5 * height.max()) & (np.abs(np.asarray(frame["rest"])[:, 0]) < 25.0)
    towards_the_middle = -np.sign(np.asarray(frame["rest"])[:, 0]) * slide[:, 0]
    assert (towards_the_middle[crests] > 0.0).all()
    upright = np.abs((slide * frame["Normals"]).sum(axis=1))
    assert upright[crests].mean() < 0.3 * np.linalg.norm(slide[crests], axis=1).mean()


@pytest.mark.parametrize(
    ("layer", "options", "message"),
    [
        (WaveFolds, {"pinch": 1.5}, r"pinch must lie in \[0, 1\], received 1.5. At 0 folds are heights alone."),
        (WaveFolds, {"pinch": "much"}, r"pinch must be a number, received 'much'"),
        (fw.MuscleWrinkles, {"pinch": -1, "anatomical": True}, r"pinch must lie in \[0, 1\]"),
        (fw.MuscleWrinkles, {"pinch": 1}, r"pinch belongs to anatomical folds.* add anatomical=True"),
    ],
)
def test_bad_pinches(layer, options, message):
    with pytest.raises(ParameterError, match=message):
        layer(**options)
