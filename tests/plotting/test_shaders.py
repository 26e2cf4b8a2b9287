"""Shaders: corners of triangles are as good as pixels; behind a tear lies the skin, bent, and all else stays."""

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.plotting import Style, TearScene, View
from facewrinkle.plotting.images import rendered
from facewrinkle.plotting.shaders import EYE_MATERIAL, SKIN_MATERIAL, TEETH_MATERIAL, hair
from facewrinkle.plotting.views import LIGHTS

FINE = pv.Sphere(radius=1.0, theta_resolution=240, phi_resolution=240)


def lamps():
    return [pv.Light(position=place, color=color, intensity=power) for place, color, power in LIGHTS]


def drawn(shade, lights, mesh=FINE, **options):
    """A ball under some lights, shaded by a function of its actor."""
    plotter = pv.Plotter(off_screen=True, window_size=(120, 120), lighting="none")
    plotter.disable_anti_aliasing()
    for light in lights:
        plotter.add_light(light)
    options = {"color": (0.8, 0.6, 0.5), "smooth_shading": False, **options}
    actor = plotter.add_mesh(mesh, **options)
    actor.prop.interpolation = "phong"
    shade(actor)
    plotter.camera_position = [(0.0, 0.0, 9.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    try:
        return rendered(plotter).astype(int)
    finally:
        plotter.close()


@pytest.mark.parametrize("material", [SKIN_MATERIAL, EYE_MATERIAL, TEETH_MATERIAL], ids=["skin", "eye", "teeth"])
def test_corners_of_small_triangles_are_as_good_as_pixels(material):
    def ball(edges):
        return drawn(lambda actor: material.apply(actor, len(LIGHTS), edges=edges), lamps(), ambient=1.0, diffuse=1.0)

    corners, pixels = ball(False), ball(True)
    assert np.ptp(pixels[40:80, 40:80]) > 50
    assert np.abs(corners - pixels).max() <= 2


def test_factors_of_a_texture_are_worked_out_at_corners():
    """Half of the light, given at the points, is half of it, given as the color of the whole ball."""
    ball = FINE.copy()
    ball.active_texture_coordinates = np.full((ball.n_points, 2), 0.5, np.float32)
    ball.point_data["shade"] = np.full((ball.n_points, 3), 128, np.uint8)
    gray = pv.Texture(np.full((4, 4, 3), 190, np.uint8))
    options = {"mesh": ball, "texture": gray, "ambient": 1.0, "diffuse": 1.0}

    def tinted(actor):
        mapper = actor.mapper
        mapper.scalar_visibility, mapper.color_mode, mapper.scalar_map_mode = True, "direct", "point_field"
        mapper.SelectColorArray("shade")
        EYE_MATERIAL.apply(actor, len(LIGHTS), textured=True, tinted=True)

    corners = drawn(tinted, lamps(), **options)
    whole = drawn(
        lambda actor: EYE_MATERIAL.apply(actor, len(LIGHTS), textured=True), lamps(),
        **{**options, "color": (128 / 255, 128 / 255, 128 / 255)},
    )  # fmt: skip
    untinted = drawn(lambda actor: EYE_MATERIAL.apply(actor, len(LIGHTS), textured=True), lamps(), **options)
    assert np.abs(corners - untinted).max() > 30
    assert np.abs(corners - whole).max() <= 2


@pytest.mark.parametrize("lights", [0, len(LIGHTS)], ids=["headlight", "studio"])
@pytest.mark.parametrize("culling", ["back", "front"])
def test_hair_has_the_shading_of_vtk(lights, culling):
    ball = FINE.copy()
    ball.point_data["paint"] = np.tile(np.uint8([90, 70, 60, 200]), (ball.n_points, 1))
    options = {"mesh": ball, "color": None, "scalars": "paint", "rgb": True, "show_scalar_bar": False}
    options |= {"ambient": 0.35, "diffuse": 0.65, "specular": 0.05, "specular_power": 100, "culling": culling}
    ours, theirs = (
        drawn(shade, lamps() if lights else [pv.Light(light_type="headlight")], **options)
        for shade in (lambda actor: hair(actor, lights), lambda actor: setattr(actor.prop, "specular_color", "white"))
    )
    assert np.ptp(theirs[40:80, 40:80]) > 10
    assert np.abs(ours - theirs).max() <= 2


# --- wet skin --------------------------------------------------------------------------------------


CLOSE = Style((160, 160), View((0.3, 0.05, 1.0), "malar_l", (-0.25, -0.2, 0.0), 0.5))


@pytest.fixture(scope="module")
def tear(face):
    return fw.SheddingTear(face, start="l").surface(1.3)


def difference(first, second):
    return np.abs(first.astype(int) - second.astype(int)).sum(axis=2)


@pytest.fixture(scope="module")
def pictures(face, tear):
    with TearScene(face, CLOSE) as scene:
        dry, wet, again = scene.picture(face.mesh), scene.picture(face.mesh, [tear]), scene.picture(face.mesh)
    return dry, wet, again


def test_only_the_tear_changes_the_picture_and_it_goes_again(pictures):
    dry, wet, again = pictures
    changed = difference(dry, wet) > 6
    assert 0.005 < changed.mean() < 0.15
    assert not changed[:, :20].any()
    assert np.array_equal(dry, again)


def test_a_tear_is_seen_through_and_has_highlights(pictures):
    dry, wet, _ = pictures
    changed = difference(dry, wet) > 6
    assert wet[changed].max(axis=1).max() > 250  # the lamp in the bead
    assert dry[changed].max() < 240
    assert np.median(difference(dry, wet)[changed]) < 120  # most of it is still the color of skin


def test_a_trail_has_glints_and_is_else_darker(pictures):
    """Evenly brighter, it would read as a scar."""
    dry, wet, _ = (picture.astype(float) for picture in pictures)
    trail = difference(dry, wet) > 6
    trail[100:] = False  # the head
    gain = (wet - dry).mean(axis=2)[trail]
    assert np.median(gain) < -3.0
    assert np.percentile(gain, 95) > 25.0


def test_a_drop_bends_what_is_behind_it(face):
    drop = fw.DrippingTear(face, "l", size=5.0)
    mesh = drop.surface(drop.begin + drop.hang)
    style = Style((160, 160), View((0.3, 0.05, 1.0), "eye_l_centre", (0.0, -0.2, 0.0), 0.5))
    with TearScene(face, style) as scene:
        dry, wet = scene.picture(face.mesh), scene.picture(face.mesh, [mesh])
    assert 0.01 < (difference(dry, wet) > 12).mean() < 0.2
    assert wet.max() > 250
