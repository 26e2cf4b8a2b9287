"""Skin as it is drawn: small holes are closed, large ones are dim inside, and a mouth's lining has no back."""

import gc
import pickle
import weakref

import numpy as np
import pytest
import pyvista as pv
from drawing import held
from expressions import after
from outlines import turns
from small_meshes import area_vectors
from synthetic_faces import head_with, ring

import facewrinkle as fw
from facewrinkle.anatomy.cavities import INSIDE_DEPTH
from facewrinkle.appearance.seen import Appearance, companion_meshes
from facewrinkle.appearance.smooth_skin import SAGITTA, SmoothSkin
from facewrinkle.appearance.visible_skin import SMALL_HOLE, VisibleSkin
from facewrinkle.geometry import topology
from facewrinkle.mesh import corner_texture, split_at_seams, with_normals

AHEAD = np.array([0.0, 0.0, 1e4])


def cut(face: fw.Face, landmark: str, radius: float) -> tuple[fw.Face, int]:
    """A face without the triangles about a landmark, and their number; `radius` in distances between the pupils."""
    centres = face.points[face.triangles].mean(axis=1)
    gone = np.linalg.norm(centres - face.landmarks[landmark], axis=1) < radius * face.frame.pupil_distance
    holed = pv.PolyData.from_regular_faces(face.points, face.triangles[~gone]).clean()
    return fw.Face.from_landmarks(holed, face.landmarks, 1.0), int(gone.sum())


def test_skin_without_holes_is_drawn_as_it_is(face):
    assert VisibleSkin(face, bag=False).of(face.mesh, AHEAD) is face.mesh


def test_small_holes_are_closed_also_when_their_rims_are_split(face):
    holed, gone = cut(face, "pogonion", 0.08)
    assert gone > 1
    for skin in (holed.mesh, after(fw.Simulation(holed), "sadness", 8)):
        drawn = VisibleSkin(holed, bag=False).of(skin, AHEAD)
        triangles = drawn.regular_faces
        assert len(triangles) > skin.n_cells
        assert len(topology.boundary_loops(triangles)) == len(topology.boundary_loops(skin.regular_faces)) - 1
        assert topology.is_oriented(triangles)
        assert not len(topology.non_manifold_edges(triangles))
        np.testing.assert_array_equal(drawn.points, skin.points)


def test_eyes_mouth_and_large_holes_stay_open(face):
    holed, _ = cut(face, "forehead_mid", SMALL_HOLE)
    assert VisibleSkin(holed, bag=False).of(holed.mesh, AHEAD) is holed.mesh


def test_closed_holes_keep_the_texture(face):
    """With texture coordinates that are linear in place, those across a hole are, too."""
    holed, _ = cut(face, "pogonion", 0.08)
    skin = with_normals(holed.mesh)
    coordinates = 0.01 * np.asarray(skin.points)[:, :2]
    skin.point_data["place"] = coordinates
    skin.point_data.active_texture_coordinates_name = "place"
    skin.cell_data["Texture Corners"] = coordinates[skin.regular_faces].reshape(-1, 6)
    drawn = VisibleSkin(holed, bag=False).of(skin, AHEAD)
    assert drawn.n_cells > skin.n_cells
    np.testing.assert_allclose(corner_texture(drawn), 0.01 * drawn.points[drawn.regular_faces][:, :, :2], atol=1e-6)
    assert split_at_seams(drawn).n_cells == drawn.n_cells


@pytest.mark.parametrize("stem", [None, "makehuman_head_male"])
def test_the_lining_of_a_bag_has_no_back(real_face, stem):
    face = head_with("sockets", "bag") if stem is None else real_face(stem)
    inner = face.lining.vertices[face.triangles]
    assert inner.any()
    drawn = VisibleSkin(face, bag=True).of(
        face.mesh, face.frame.origin + 100.0 * face.frame.pupil_distance * face.frame.axes[2]
    )
    toward = area_vectors(face.points, face.triangles)
    away = toward @ face.frame.axes[2] < 0.0
    kept = {tuple(triangle) for triangle in drawn.regular_faces}
    shown = np.array([tuple(triangle) in kept for triangle in face.triangles])
    centres = face.points[face.triangles].mean(axis=1)
    lids = np.zeros(len(centres), bool)  # and what lies behind them has no back, either
    for eye in face.eyes:
        offset = centres - eye.centre
        lids |= (np.linalg.norm(offset, axis=1) < 1.5 * eye.radius) & ((offset * toward).sum(axis=1) < 0.0)
    assert shown[~inner.any(axis=1) & ~lids].all()
    assert shown[~away].mean() > 0.99
    assert shown[inner.any(axis=1) & away].mean() < 0.05


@pytest.mark.parametrize("name", ["malar_l", "glabella", "zygion_r", "ala_l", "pogonion", "menton"])
def test_all_of_a_bag_is_lining_and_nothing_of_the_face(real_face, name):
    face = real_face("makehuman_head_male")
    inside = face.lining.vertices
    assert not inside[face.mesh.find_closest_point(face.landmarks[name])]
    loose = topology.components(face.triangles[inside[face.triangles].all(axis=1)])
    assert len(np.unique(loose)) <= 4  # a mouth, two nostrils, and what is seen in these beside them


def test_the_bag_of_a_mouth_is_its_lining(face):
    """All of it, also beside the mouth, where it is not seen to be inside; and of the face what was lining before."""
    bag = head_with("wide bag")
    inside, added = bag.lining.vertices, np.arange(bag.mesh.n_points) >= face.mesh.n_points
    assert (bag.cavities.depth(bag.points[added]) < INSIDE_DEPTH).sum() >= 4
    assert inside[added].all()
    np.testing.assert_array_equal(inside[~added], face.lining.vertices)
    assert bag.lining.holds(bag.points[ring("wide bag", 3)] + 0.1).all()


def test_the_lining_of_a_socket_has_no_back(face):
    """Of the skin that was added, only what turns its front to the viewer is drawn; of the rest, all."""
    head = head_with("sockets")
    ahead = 100.0 * face.frame.pupil_distance * face.frame.axes[2]
    seen = {}
    for name, place in (("front", face.frame.origin + ahead), ("back", face.frame.origin - ahead)):
        drawn = VisibleSkin(head, bag=False).of(head.mesh, place)
        kept = {tuple(triangle) for triangle in drawn.regular_faces}
        seen[name] = np.array([tuple(triangle) in kept for triangle in head.triangles])
        np.testing.assert_array_equal(drawn.points, head.points)
    toward = area_vectors(head.points, head.triangles) @ face.frame.axes[2]
    added = (head.triangles >= face.mesh.n_points).any(axis=1)
    lids = np.isin(head.triangles, ring("sockets", 0)).any(axis=1) & ~added  # they may curl in behind the margins
    for shown, hidden in ((seen["front"], toward < 0.0), (seen["back"], toward > 0.0)):
        assert shown[~added & ~lids].mean() > 0.99
        assert added[hidden].sum() > 100
        assert shown[added & hidden].mean() < 0.02
        assert shown[added & ~hidden].mean() > 0.98


# --- what is seen of a face is made once, and worked out once for each frame ----------------------


def test_the_same_frame_is_worked_out_once(face):
    frame, appearance = held("paper_surprise").copy(), Appearance.of(face)
    seen = appearance.at(frame)
    assert Appearance.of(face) is appearance
    assert appearance.at(frame) is seen
    assert seen.bound_hair is appearance.at(frame).bound_hair
    before, points = seen.eyes["l"]["paint"].astype(int), np.array(seen.eyes["l"].points)
    companion_meshes(face, frame)["eye_l"].points += 1.0
    np.testing.assert_array_equal(seen.eyes["l"].points, points)  # files get copies
    frame.points[: face.mesh.n_points] = np.asarray(held("AU43").points)[: face.mesh.n_points]
    after = appearance.at(frame).eyes["l"]["paint"]
    assert np.abs(after - before).max() > 20  # modified: the shadow of the lid has come down


def test_it_is_one_with_its_face():
    """It goes with the face, and does not keep it; other faces have their own."""
    face = fw.default_face()
    Appearance.of(face).at(face.mesh)
    other = face.with_muscles({})
    assert Appearance.of(other).face is other
    assert pickle.loads(pickle.dumps(face)).mesh.n_cells == face.mesh.n_cells
    gone = weakref.ref(face)
    del face
    gc.collect()
    assert gone() is None


# --- smooth outlines, wrinkles where they were, hairs on the same surface -------------------------


def smooth(face, frame=None):
    return SmoothSkin(face, with_normals(face.mesh if frame is None else frame))


@pytest.mark.parametrize("view", ["front", "left_three_quarter", "left_profile"])
def test_edges_of_the_outline_meet_at_less_than_six_degrees(face, view):
    assert turns(face, face.points, view).max() > 12.0
    assert turns(face, smooth(face).points, view).max() < 6.0


def test_vertices_of_the_face_stay_and_all_others_keep_near_its_triangles(face):
    surface = smooth(face)
    np.testing.assert_array_equal(surface.points[: len(face.points)], face.points)
    corners = face.points[face.triangles[surface.split.parent]]
    flat = np.einsum("mck,mkd->mcd", surface.split.shares, corners)
    away = np.linalg.norm(surface.points[surface.split.triangles] - flat, axis=2)
    assert 0.5 < away.max() < 2.0  # mm: what skull and neck bulge over edges of 20 mm


def test_new_vertices_of_a_frame_lie_on_the_surface_of_the_face_at_rest(face):
    """A frame whose skin has not moved, refined, is drawn where the face itself is."""
    frame = after(fw.Simulation(face, layers=[fw.WaveFolds(depth=2.0)]), "paper_surprise", 8)
    still = frame.copy()
    still.points = np.asarray(frame["rest"])
    still["W"] = np.zeros(frame.n_points)
    surface = smooth(face, still)
    moved = np.linalg.norm(surface.points[: frame.n_points] - np.asarray(still.points), axis=1)
    assert moved[: len(face.points)].max() == 0.0
    _, places = smooth(face).mesh.find_closest_cell(surface.points, return_closest_point=True)
    assert moved.max() > 2.5 * SAGITTA
    assert np.linalg.norm(places - surface.points, axis=1).max() < 2.0 * SAGITTA  # what either may be flat


def test_wrinkles_are_as_deep_as_in_the_frame(face):
    frame = after(fw.Simulation(face, layers=fw.fold_layers(face, "wave", depth=2.0)), "paper_surprise", 15)
    shift = smooth(face, frame).points[: frame.n_points] - np.asarray(frame.points)
    deep = np.abs(np.asarray(frame["W"])) > 0.3
    assert deep.sum() > 100
    assert np.linalg.norm(shift[deep], axis=1).max() < 0.25


def test_brows_stand_on_the_surface_that_is_drawn(face):
    seen = Appearance.of(face).at(face.mesh)
    lines = seen.bound_hair["brows"].points.reshape(-1, 3)
    cells, places = seen.smooth.mesh.find_closest_cell(lines, return_closest_point=True)
    normals = seen.smooth.normals[seen.smooth.split.triangles[cells]].mean(axis=1)
    assert ((lines - places) * normals).sum(axis=1).min() > -0.02


def test_hollows_are_less_open_than_the_tip_of_the_nose(face):
    surface = smooth(face)
    marks = face.landmarks
    names = ("nose_tip", "forehead_mid", "ala_l")
    tip, forehead, wing = (np.linalg.norm(surface.points - marks[name], axis=1) for name in names)
    assert surface.openness[tip.argmin()] > 0.9
    assert surface.openness[forehead.argmin()] > 0.85
    assert surface.openness[wing < 8.0].min() < 0.5
