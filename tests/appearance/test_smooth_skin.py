"""What is drawn is smooth: outlines without corners, wrinkles where they were, hairs on the same surface."""

import numpy as np
import pytest
from expressions import after
from outlines import turns

import facewrinkle as fw
from facewrinkle.appearance.seen import Appearance
from facewrinkle.appearance.smooth_skin import SAGITTA, SmoothSkin
from facewrinkle.mesh import with_normals
from facewrinkle.simulation.fold_layers import fold_layers


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
    drawn = smooth(face).mesh
    _, places = drawn.find_closest_cell(surface.points, return_closest_point=True)
    assert moved.max() > 2.5 * SAGITTA
    assert np.linalg.norm(places - surface.points, axis=1).max() < 2.0 * SAGITTA  # what either may be flat


def test_wrinkles_are_as_deep_as_in_the_frame(face):
    frame = after(fw.Simulation(face, layers=fold_layers(face, "wave", depth=2.0)), "paper_surprise", 15)
    surface = smooth(face, frame)
    shift = surface.points[: frame.n_points] - np.asarray(frame.points)
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
