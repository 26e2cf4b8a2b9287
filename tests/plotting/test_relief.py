"""The micro-relief of the skin in pictures: where it is seen, what strain does to it, and what it leaves alone."""

import dataclasses

import numpy as np
import pytest
import pyvista as pv
from drawing import SMALL, difference, held

import facewrinkle as fw
from facewrinkle.appearance.skin_paint import DEPTH, OLD_DEPTH
from facewrinkle.plotting import Scene, Style, View, picture
from facewrinkle.plotting.images import rendered
from facewrinkle.plotting.shaders import RELIEF, SKIN_MATERIAL, Relief, send
from facewrinkle.plotting.views import LIGHTS, VIEW_ANGLE, VIEWS

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
