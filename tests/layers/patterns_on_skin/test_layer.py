"""Patterns as a layer: on a surface, time and strength, refinement.

what                 checked against
parameters           the paper's parameters; the number of furrows that come out; depth in mm
rest                 W exactly 0 at strength 0 and outside the region; the mesh goes back to M0
strength and time    functions of time; the compression of a surface that is squeezed, in closed form
refinement           triangles only where the pattern is; half a wavelength has its vertices; the level that it asks for
stacking             W is the sum of the layers; on skin, on recordings
"""

import warnings

import numpy as np
import pytest
import pyvista as pv
from small_meshes import pressed

import facewrinkle as fw
from facewrinkle.layers.patterns_on_skin.kinds import (
    Cheek,
    Frown,
)
from facewrinkle.layers.patterns_on_skin.region import outline_norm

unrefined = pytest.mark.filterwarnings("ignore:the mesh is too coarse to carry the pattern")


def played(face, layers, steps=8, **options):
    sim = fw.Simulation(face, layers=layers, motion=options.pop("motion", fw.Still(face)), **options)
    *_, frame = sim.run(steps)
    return sim, frame


# --- parameters ---------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [2, 3, 5])
@pytest.mark.parametrize("name", ["forehead", "cheek", "frown"])
def test_number_is_the_number_of_furrows(slab, name, number):
    words = {"forehead": {"style": 0.0, "bend": 0.0}, "cheek": {"radius": 50.0}, "frown": {"variant": "paper"}}[name]
    layer = fw.PatternLayer(
        name, (0, 0, 0), size=60.0, number=number, outline="box", border=0.01, sharpness=0.0, **words
    )
    layer.attach(slab)
    kind = layer.patterns[0]
    s = np.linspace(-0.9999, 0.9999, 4001)
    uv = np.stack([0 * s, s] if name == "forehead" else [s, 0 * s], axis=1)
    h = kind.relief(*kind.plane(uv, 1.0), 1.0, kind.time(0.0), 1.0)
    minima = (h[1:-1] < h[:-2]) & (h[1:-1] < h[2:])
    assert minima.sum() == number
    assert np.ptp(h) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("unit", [1.0, 10.0])
@pytest.mark.parametrize(
    ("name", "across"), [("forehead", 30.0), ("cheek", 60.0), ("frown", 60.0), ("eye_corner", 30.0)]
)
def test_spacing_is_the_number_in_mm(name, across, unit):
    face = fw.surface(pv.Plane(i_size=100 / unit, j_size=100 / unit, i_resolution=25, j_resolution=25), unit)
    place = {"center": (0, 0, 0), "size": (60.0 / unit, 30.0 / unit), "border": 0.3}
    layers = [fw.PatternLayer(name, **place, **words) for words in ({"spacing": 12.0}, {"number": across / 12.0})]
    by_spacing, by_number = (played(face, [layer])[1] for layer in layers)
    np.testing.assert_array_equal(by_spacing["W"], by_number["W"])
    assert np.ptp(by_spacing["W"]) > 0.5
    with pytest.raises(fw.errors.ParameterError, match=rf"spacing must lie in .* region is {across:.0f} mm long"):
        fw.Simulation(face, layers=[fw.PatternLayer(name, **place, spacing=700.0)])


# --- on a surface -------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", [1.0, 10.0])
def test_depth_is_in_mm_whatever_the_unit(unit):
    center = (2.0, 2.0, 0.0)  # a vertex
    face = fw.surface(pv.Plane(i_size=100 / unit, j_size=100 / unit, i_resolution=50, j_resolution=50), unit)
    layer = fw.PatternLayer("dimple", np.array(center) / unit, size=20.0 / unit, depth=3.0)
    frame = played(face, [layer])[1]
    assert frame["W"].min() == pytest.approx(-3.0, abs=1e-6)
    assert frame.points[:, 2].min() * unit == pytest.approx(-3.0, abs=1e-6)


def test_nothing_outside_the_region_and_nothing_at_rest(slab, kind):
    frame = played(slab, [fw.PatternLayer(kind, (10, 5, 0), size=(40.0, 30.0), depth=2.0)])[1]
    outside = outline_norm((frame["rest"][:, :2] - [10, 5]) / [20, 15], "ellipse") >= 1.0 + 1e-9
    assert (frame["W"][outside] == 0.0).all()
    assert (frame["W"][~outside] != 0.0).any()
    assert 0.01 < np.abs(frame["W"]).max() <= 2.0 * 1.05
    resting = played(slab, [fw.PatternLayer(kind, (10, 5, 0), size=(40.0, 30.0), strength=0.0)], 3)[1]
    assert not resting["W"].any()
    assert resting.n_cells == slab.mesh.n_cells
    np.testing.assert_array_equal(resting.points, slab.points)


def test_triangles_only_where_they_are_needed(slab):
    layer = fw.PatternLayer("cheek", (0, 0, 0), size=30.0, number=4)
    sim, frame = played(slab, [layer])
    assert (frame["level"][(np.abs(frame["rest"][:, :2]) > 25.0).any(axis=1)] == 0).all()
    assert frame["level"].max() == layer.level_needed(slab) == sim.refinement.max_level
    # In the middle the furrows, 7.5 mm apart, have at least three vertices per half wave.
    near = np.linalg.norm(frame["rest"][:, :2], axis=1) < 5.0
    assert np.diff(np.unique(frame["rest"][near, 0].round(6))).max() < 7.5 / 2 / 3


@pytest.mark.parametrize("weights", [[1 / 3, 1 / 3, 1 / 3], [0.6, 0.3, 0.1]])
def test_a_region_between_the_vertices_is_found(slab, weights):
    center = weights @ slab.points[slab.triangles[100]]
    assert played(slab, [fw.PatternLayer("dimple", center, size=1.0, depth=0.3)], 12)[1]["W"].min() < -0.25


@pytest.mark.parametrize("cap", ["off", "one less"])
def test_a_mesh_that_is_too_coarse_is_reported_once_for_each_layer(slab, cap):
    layers = [fw.PatternLayer("cheek", (x, 0, 0), size=30.0, number=12, name=f"c{x}") for x in (-20, 20)]
    layers.append(fw.PatternLayer("dimple", (0, 30, 0), size=35.0, sharpest=1.0))
    needed = [layer.level_needed(slab) for layer in layers]
    assert needed[0] == needed[1] > needed[2] == 0
    level = 0 if cap == "off" else needed[0] - 1
    with warnings.catch_warnings(record=True, action="always") as heard:
        sim = fw.Simulation(slab, fw.Refinement(max_level=level), layers=layers)
        for _ in range(3):
            sim.step()
    assert [w.category for w in heard] == [fw.FaceWrinkleWarning] * 2
    for name, warning in zip(("c-20", "c20"), heard, strict=True):
        says = f"pattern {name} well: its triangles should be split {needed[0]} times, and max_level={level}"
        assert says in str(warning.message)
        assert warning.filename == __file__


@unrefined
def test_layers_stack(slab):
    one = fw.PatternLayer("cheek", (0, 0, 0), size=40.0, depth=1.0, name="one")
    frame = played(slab, [one, fw.PatternLayer("dimple", (5, 0, 0), size=20.0, depth=2.0, name="two")])[1]
    np.testing.assert_allclose(frame["W"], frame["pattern_one"] + frame["pattern_two"], atol=1e-15)
    both = fw.PatternLayer([Cheek(), Frown()], (0, 0, 0), size=40.0)
    kinds = [fw.PatternLayer(kind, (0, 0, 0), size=40.0) for kind in (Cheek(), Frown())]
    level = fw.Refinement(max_level=0)
    summed = played(slab, kinds, refinement=level)[1]["W"]
    np.testing.assert_allclose(played(slab, [both], refinement=level)[1]["W"], summed, atol=1e-14)


@unrefined
def test_depth_below_zero_turns_it_upside_down(slab):
    level = fw.Refinement(max_level=0)
    down, up = (
        played(slab, [fw.PatternLayer("dimple", (0, 0, 0), size=30.0, depth=d)], 1, refinement=level)[1]["W"]
        for d in (2.0, -2.0)
    )
    np.testing.assert_array_equal(down, -up)


# --- time and strength --------------------------------------------------------------------------


def test_strength_as_a_function_of_time(slab):
    heard = []

    def rising(seconds):
        heard.append(seconds)
        return min(seconds / 0.1, 1.0)

    layer = fw.PatternLayer("dimple", (0, 0, 0), size=30.0, depth=2.0, strength=rising, begin=0.02)
    sim = fw.Simulation(slab, layers=[layer], motion=fw.Still(slab, 0.02))
    deepest = [-sim.step()["W"].min() for _ in range(6)]
    np.testing.assert_allclose(deepest[-4:], np.minimum(2.0 * np.arange(4, 8) * 0.2, 2.0)[:4], atol=0.02)
    assert max(heard) == pytest.approx(0.14)
    bad = fw.PatternLayer("dimple", (0, 0, 0), size=30.0, strength=lambda s: 1.0 if s < 0.03 else np.nan)
    sim = fw.Simulation(slab, layers=[bad], motion=fw.Still(slab, 0.02))
    sim.step()
    with pytest.raises(fw.errors.ParameterError, match=r"strength of dimple at 0.04 s.*nan"):
        sim.step()


@unrefined
def test_a_pouch_trembles_at_its_frequency(slab):
    layer = fw.PatternLayer("eye_pouch", (0, 0, 0), size=30.0, frequency=5.0, trembling=0.5)
    sim = fw.Simulation(slab, fw.Refinement(max_level=0), layers=[layer], motion=fw.Still(slab, 0.01))
    frames = np.array([np.array(sim.step()["W"]) for _ in range(41)])
    np.testing.assert_allclose(frames[20:], frames[:21], atol=1e-12)  # 5 Hz: every 0.2 s
    assert np.abs(frames[10] - frames[0]).max() > 0.1


@pytest.mark.parametrize("along", [None, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
def test_the_skin_below_drives_the_strength(slab, along):
    shares = [0.0, 0.02, 0.1, 0.15, 0.3, 0.1, 0.0]
    driver = fw.Compression(low=0.05, full=0.25, along=along)
    layer = fw.PatternLayer("dimple", (2, 2, 0), size=30.0, depth=2.0, strength=driver)
    sim = fw.Simulation(slab, layers=[layer], motion=pressed(slab, [(share, 0.0) for share in shares]), time_step=0.02)
    for share in shares:
        frame = sim.step()
        s = np.clip((share - 0.05) / 0.2, 0.0, 1.0) if along != (0.0, 1.0, 0.0) else 0.0
        assert -frame["pattern_dimple"].min() == pytest.approx(2.0 * (s * s * (3 - 2 * s)), abs=1e-6)
    *_, frame = sim.run(4)
    assert not frame["W"].any()
    assert frame.n_cells == slab.mesh.n_cells  # the triangles have gone again


# --- faces --------------------------------------------------------------------------------------


def test_patterns_and_muscles_together(face):
    """On the moving skin a pattern adds to what the muscles fold, and rides on it."""
    sim = fw.Simulation(face, layers=[fw.Creases(), *fw.PatternLayer.presets("dimple", face)])
    sim.express("AU12")
    for _ in range(6):
        frame = sim.step()
    dimples = frame["pattern_dimple_l"] + frame["pattern_dimple_r"]
    muscles = frame["W"] - dimples
    assert dimples.min() == pytest.approx(-fw.PatternLayer.preset("dimple_l", face).depth, abs=0.3)
    assert np.abs(muscles).max() > 0.1
    assert {"lambda", "muscle", "epsilon"} <= set(frame.point_data)


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (lambda x, y, t: np.full_like(x, np.nan), "not finite"),
        (lambda x, y, t: np.zeros(3), "one finite height per place"),
    ],
)
def test_functions_that_misbehave(slab, function, says):
    sim = fw.Simulation(slab, layers=[fw.PatternLayer(function, (0, 0, 0), size=20.0)])
    with pytest.raises(fw.FaceWrinkleError, match=says):
        sim.step()


@unrefined
def test_a_function_of_ones_own(slab):
    layer = fw.PatternLayer(lambda x, y, t: fw.layers.patterns.cheek(x, y, t, 0.5, 9.0), (0, 0, 0), size=40.0, t=0.7)
    frame = played(slab, [layer], refinement=fw.Refinement(max_level=0))[1]
    x, y = frame["rest"][:, 0] / 20, frame["rest"][:, 1] / 20
    inside = np.hypot(x, y) < 0.4
    np.testing.assert_allclose(frame["W"][inside], fw.layers.patterns.cheek(x, y, 0.7, 0.5, 9.0)[inside], atol=1e-9)


def test_simulations_have_layers_of_their_own(slab):
    """Two surfaces in turns with one layer: each is as if it were alone."""
    layer = fw.PatternLayer("dimple", (0, 0, 0), size=30.0)
    before, other = dict(vars(layer)), fw.surface(slab.mesh.subdivide(1))
    with warnings.catch_warnings(action="error"):
        first, second, alone = (fw.Simulation(where, layers=[layer]) for where in (slab, other, slab))
        for _ in range(4):
            a, b = first.step(), second.step()
        c = [alone.step() for _ in range(4)][-1]
    assert b.n_points > a.n_points
    assert a["W"].min() < -0.1
    np.testing.assert_array_equal(a["W"], c["W"])
    assert vars(layer) == before


@pytest.mark.parametrize("kind", ["dimple", "cheek", lambda x, y, t: np.cos(9.0 * x)])
def test_what_is_not_given_scales_with_the_surface(kind):
    ball = pv.Icosphere(radius=64.0, nsub=5)
    tiny = ball.copy()
    tiny.points /= 128.0  # a power of two: no rounding
    heights = [
        played(face, [fw.PatternLayer(kind, face.points[0])], 1)[1]["W"]
        for face in (fw.surface(tiny), fw.surface(ball))
    ]
    np.testing.assert_allclose(128.0 * heights[0], heights[1], rtol=1e-9, atol=1e-12)
    assert 0.001 < np.abs(heights[0]).max() < 0.03  # of a ball with a radius of 0.5


def test_a_pattern_is_placed_by_the_name_of_a_landmark(face):
    frames = [
        fw.Simulation(
            face, fw.Refinement(max_level=2), layers=[fw.PatternLayer("forehead", at, size=60.0)], motion=fw.Still(face)
        ).step()
        for at in ("forehead_mid", face.landmarks["forehead_mid"])
    ]
    np.testing.assert_array_equal(frames[0]["W"], frames[1]["W"])
    assert np.abs(frames[0]["W"]).max() > 0.1
    with pytest.raises(fw.errors.UnknownNameError, match="unknown landmark 'forhead'.*forehead_mid"):
        fw.PatternLayer("forehead", "forhead", size=60.0).laid(face)
