"""Shaders: corners of triangles are as good as pixels; behind a tear lies the skin, bent, and all else stays. The
micro-relief of the skin: where it is seen, what strain does to it, and what it leaves alone.
"""

import dataclasses

import numpy as np
import pytest
import pyvista as pv
from drawing import SMALL, difference, held

import facewrinkle as fw
from facewrinkle.appearance.skin_paint import DEPTH, OLD_DEPTH
from facewrinkle.plotting import Scene, Style, TearScene, View, picture
from facewrinkle.plotting.images import rendered
from facewrinkle.plotting.shaders import EYE_MATERIAL, RELIEF, SKIN_MATERIAL, TEETH_MATERIAL, Relief, hair, send
from facewrinkle.plotting.views import LIGHTS, VIEW_ANGLE, VIEWS

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


def added_change(first, second):
    return np.abs(first.astype(int) - second.astype(int)).sum(axis=2)


@pytest.fixture(scope="module")
def pictures(face, tear):
    with TearScene(face, CLOSE) as scene:
        dry, wet, again = scene.picture(face.mesh), scene.picture(face.mesh, [tear]), scene.picture(face.mesh)
    return dry, wet, again


def test_only_the_tear_changes_the_picture_and_it_goes_again(pictures):
    dry, wet, again = pictures
    changed = added_change(dry, wet) > 6
    assert 0.005 < changed.mean() < 0.15
    assert not changed[:, :20].any()
    assert np.array_equal(dry, again)


def test_a_tear_is_seen_through_and_has_highlights(pictures):
    dry, wet, _ = pictures
    changed = added_change(dry, wet) > 6
    assert wet[changed].max(axis=1).max() > 250  # the lamp in the bead
    assert dry[changed].max() < 240
    assert np.median(added_change(dry, wet)[changed]) < 120  # most of it is still the color of skin


def test_a_trail_has_glints_and_is_else_darker(pictures):
    """Evenly brighter, it would read as a scar."""
    dry, wet, _ = (picture.astype(float) for picture in pictures)
    trail = added_change(dry, wet) > 6
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
    assert 0.01 < (added_change(dry, wet) > 12).mean() < 0.2
    assert wet.max() > 250


# --- micro-relief ----------------------------------------------------------------------------------


NEAR = View((0.0, 0.0, 1.0), "malar_r", (0.0, -0.1, 0.0), height=0.5)


def patch(face, **options):
    """The middle of a close-up of the cheek, without and with the relief."""
    images = [picture(face.mesh, face, Style((160, 160), NEAR, microrelief=on, **options)) for on in (False, True)]
    return [image[40:120, 40:120].astype(float) for image in images]


def test_cheeks_have_pores_and_furrows_in_the_same_light(face):
    without, relief = patch(face)
    change = (relief - without).mean(axis=2)
    assert change.std() > 2.0
    assert abs(change.mean()) < 2.0
    assert np.abs(change).max() < 60.0


def test_quick_pictures_and_those_from_afar_have_none(face):
    np.testing.assert_array_equal(*patch(face, quick=True))
    np.testing.assert_array_equal(*(picture(face.mesh, face, Style(SMALL, microrelief=on)) for on in (False, True)))


def test_lips_have_none(face):
    def change(view):
        style = [Style((200, 200), view, microrelief=on) for on in (False, True)]
        return difference(*(picture(face.mesh, face, s) for s in style))[90:110, 90:110]

    lips = View((0.0, 0.0, 1.0), "lower_lip_mid", (0.0, 0.09, 0.0), height=0.4)
    assert change(lips).mean() < 0.1 * change(NEAR).mean()
    assert change(NEAR).mean() > 3.0


def sheet(stretch, depth):
    plane = pv.Plane(i_resolution=1, j_resolution=1).triangulate()
    rest = np.asarray(plane.points, np.float32) * 40.0
    plane.point_data[RELIEF] = np.column_stack([rest, np.full(len(rest), 0.5)]).astype(np.float32)
    plane.points = np.asarray(plane.points) * [stretch, 1.0, 1.0]
    pixels = 400
    plotter = pv.Plotter(off_screen=True, window_size=(pixels, pixels), lighting="none")
    plotter.disable_anti_aliasing()
    plotter.add_light(pv.Light(position=(-1.0, 0.0, 1.0), focal_point=(0.0, 0.0, 0.0)))
    for _, color, _ in LIGHTS[1:]:
        plotter.add_light(pv.Light(position=(0.0, 0.0, 1.0), focal_point=(0.0, 0.0, 0.0), color=color, intensity=0.0))
    actor = plotter.add_mesh(plane, color=(0.8, 0.6, 0.5), smooth_shading=False, ambient=1.0, diffuse=1.0)
    actor.prop.interpolation = "phong"
    SKIN_MATERIAL.apply(actor, len(LIGHTS), relief=(depth, np.radians(VIEW_ANGLE) / pixels))
    send(actor, RELIEF)
    actor.GetMapper().SetInputData(plane)
    plotter.camera_position = [(0.0, 0.0, 1.6), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    plotter.camera.view_angle = VIEW_ANGLE
    try:
        return rendered(plotter)[..., 1].astype(float)
    finally:
        plotter.close()


def test_slopes_flatten_where_the_skin_is_stretched_and_rise_where_it_is_compressed():
    """A furrow of the material keeps its depth, and is as much wider as the skin is longer."""
    rest, long, short = ((sheet(s, 1e-3) - sheet(s, 0.0)).std() for s in (1.0, 1.25, 0.8))  # lit from the side
    assert rest > 1.0
    assert long / rest == pytest.approx(1.0 / 1.25, rel=0.1)
    assert short / rest == pytest.approx(1.0 / 0.8, rel=0.1)


def test_the_relief_belongs_to_the_skin_at_rest(face):
    """The same place has the same, whatever the mesh around it is split into."""
    fine = held("paper_surprise")
    relief = Relief(face, 0.05, 800)
    coarse = relief.on(face.mesh)
    refined = relief.on(fine)
    assert relief.on(fine) is refined
    assert len(refined) > len(coarse)
    assert Relief(face, 0.1, 400).on(fine) is refined  # scenes of a face share it
    np.testing.assert_array_equal(refined, Relief(dataclasses.replace(face), 0.05, 800).on(fine))
    np.testing.assert_array_equal(refined[: len(coarse), :3], coarse[:, :3])
    np.testing.assert_allclose(refined[: len(coarse), 3] % 1.0, coarse[:, 3] % 1.0, atol=1e-6)


def test_points_that_moved_in_place_are_noticed(face):
    mesh, relief = face.mesh.copy(), Relief(face, 0.05, 800)
    before = relief.on(mesh).copy()
    mesh.points[:] += 1.0
    after = relief.on(mesh)
    assert (after[:, :3] != before[:, :3]).all()
    np.testing.assert_array_equal(after, Relief(dataclasses.replace(face), 0.05, 800).on(mesh))


def test_old_skin_has_larger_fields_and_deeper_furrows(face):
    sent = [Relief(dataclasses.replace(face, age=age), 0.05, 800).on(face.mesh) for age in (0.0, 1.0)]
    assert (np.ptp(sent[1][:, :3], axis=0) < np.ptp(sent[0][:, :3], axis=0)).all()
    some = sent[0][:, 3] % 1.0 > 0.1
    np.testing.assert_allclose((sent[0][some, 3] % 1.0) / (sent[1][some, 3] % 1.0), DEPTH / OLD_DEPTH, rtol=1e-5)


def test_frames_tell_the_age_of_their_folds(face):
    aged = fw.Simulation(face, layers=[fw.WaveFolds(age=1.0)]).step()
    relief, old = (Relief(own, 0.05, 800) for own in (face, dataclasses.replace(face, age=1.0)))
    young = relief.on(face.mesh).copy()
    np.testing.assert_array_equal(relief.on(aged), old.on(aged))
    assert (relief.on(aged)[:, :3] != young[:, :3]).any()
    np.testing.assert_array_equal(relief.on(face.mesh), young)


def test_faces_without_landmarks_have_none(face):
    assert Relief.seen(face, 0.1)
    assert not Relief.seen(dataclasses.replace(face, landmarks={}, eyes=(), muscles={}), 0.1)


def test_a_scene_that_looks_nearer_shows_the_relief_and_from_afar_no_more(face):
    pictures = {}
    for on in (False, True):
        with Scene(face, Style((240, 240), microrelief=on)) as scene:
            pictures[on] = []
            for view in ("front", "left_eye", "front"):
                scene.look(VIEWS[view])
                pictures[on].append(scene.picture(face.mesh))
    changes = [difference(*pair).max() for pair in zip(*pictures.values(), strict=True)]
    assert changes[0] == changes[2] == 0
    assert changes[1] > 5
