"""Eyeballs that turn, and lids that follow them."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.anatomy.eye_placement import place_eyeballs
from facewrinkle.anatomy.eyeball import gaze_of
from facewrinkle.anatomy.eyelid_opening import eyelid_opening
from facewrinkle.anatomy.eyelids import OVERLAP, lid_weights
from facewrinkle.anatomy.muscles import EyeMuscle, LidMuscle
from facewrinkle.appearance.hair import Lashes
from facewrinkle.errors import ParameterError, UnknownNameError
from facewrinkle.geometry.topology import boundary_loops
from facewrinkle.plotting import Scene, Style


def margins_of(face, side):
    """The vertices of the upper and the lower margin."""
    opening = face.eyelid_openings[side]
    return opening.upper, opening.lower


def test_turns_and_directions_are_inverse(face):
    rng = np.random.default_rng(4)
    for eye in face.eyes:
        for turns in rng.uniform(-0.7, 0.7, (20, 2)):
            direction = eye.turned(*turns)
            assert np.linalg.norm(direction) == pytest.approx(1.0)
            np.testing.assert_allclose(eye.turn_to(3.0 * direction), turns, atol=1e-12)
            turned = eye.looking(direction)
            assert abs(turned.up @ direction) < 1e-12
            pole = turned.surface().points[0] - eye.centre
            np.testing.assert_allclose(pole / np.linalg.norm(pole), direction, atol=1e-6)


def test_both_eyes_converge_on_a_point(face):
    target = np.array([40.0, 10.0, 350.0])
    for eye in face.eyes:
        way = np.cross(eye.turned(*gaze_of(eye, at=target)), target - eye.centre)
        assert np.linalg.norm(way) < 1e-9 * np.linalg.norm(target)


def test_yaw_is_to_the_left_of_the_subject(face):
    left, up, _ = face.frame.axes
    for eye in face.eyes:
        assert eye.turned(*gaze_of(eye, yaw=20.0)) @ left == pytest.approx(np.sin(np.radians(20.0)), abs=1e-3)
        assert eye.turned(*gaze_of(eye, pitch=-15.0)) @ up == pytest.approx(-np.sin(np.radians(15.0)), abs=1e-3)


def test_bad_places_to_look_at(face):
    eye = face.eyes[0]
    for what in (
        {"at": (0, 1)},
        {"at": "there"},
        {"at": eye.centre},
        {"yaw": 10.0, "at": (0, 0, 300)},
        {"yaw": "left"},
    ):
        with pytest.raises(ParameterError):
            gaze_of(eye, **what)


def test_muscles_of_the_eye():
    muscle = EyeMuscle("l", "outwards", 0.7)
    assert muscle.rate(0.35, -0.2) == pytest.approx(0.5)
    assert muscle.rate(-0.5, 0.0) == 0.0
    with pytest.raises(ParameterError, match="40.1 degrees at most"):
        muscle.rate(0.8, 0.0)
    assert muscle.transformed(np.diag([-1.0, 1.0, 1.0])).side == "r"
    with pytest.raises(UnknownNameError):
        EyeMuscle("l", "sideways", 0.7)
    with pytest.raises(ParameterError):
        EyeMuscle("left", "up", 0.7)


def test_lids_follow_the_gaze_and_closing_takes_its_place(face):
    guides = face.joint_weights
    close, up, down = (guides[f"{m}_l"] for m in ("orbicularis_oculi", "rectus_superior", "rectus_inferior"))
    upper = close.angles > np.radians(20.0)
    lower = close.angles < np.radians(-3.0)
    angle = face.muscles["rectus_inferior_l"].angle
    assert 0.6 * angle < down.angles[upper].max() <= 0.9 * angle + 1e-12
    assert 0.1 * angle < down.angles[lower].max() < 0.5 * down.angles[upper].max()
    assert -0.5 * angle < up.angles[upper].min() < -0.25 * angle
    skin = fw.Skin(face, time_step=0.1)
    states = []
    for rates in ({"orbicularis_oculi_l": 1.0}, {"orbicularis_oculi_l": 1.0, "rectus_inferior_l": 1.0}):
        skin.reset()
        skin.contract(rates)
        for _ in range(20):
            skin.step()
        states.append(skin.displacement.copy())
    np.testing.assert_allclose(*states, atol=1e-5)


# --- where the eyes are -------------------------------------------------------------------------


def rims(face):
    """The rims of the openings of both eyes."""
    centres = [eye.centre for eye in face.eyes]
    return [
        loop
        for loop in boundary_loops(face.triangles)
        if min(np.linalg.norm(face.points[loop] - centre, axis=1).max() for centre in centres) < 24.0
    ]


def filled(face, *rings):
    """Points and triangles of the face with its eyes closed by rings (share of the rim, mm back) and a last point."""
    points, triangles = [face.points], [face.triangles]
    back = -face.frame.axes[2]
    for rim in rims(face):
        before, middle = rim, face.points[rim].mean(axis=0)
        for share, depth in rings:
            start = sum(map(len, points))
            ring = np.arange(start, start + len(rim))
            points.append(middle + share * (face.points[rim] - middle) + depth * back)
            after = np.roll(before, -1), np.roll(ring, -1)
            triangles += [np.stack([before, ring, after[0]], axis=1), np.stack([after[0], ring, after[1]], axis=1)]
            before = ring
        last = sum(map(len, points))
        points.append(points[-1].mean(axis=0)[None] if rings else middle[None])
        triangles.append(np.stack([before, np.full(len(rim), last), np.roll(before, -1)], axis=1))
    return np.vstack(points), np.vstack(triangles).astype(np.int32)


@pytest.mark.parametrize("shift", [(0.0, 0.0, 3.0), (0.0, 0.0, -3.0), (1.0, 0.5, 2.0)])
def test_the_lids_tell_how_deep_an_eye_lies(face, shift):
    marks = dict(face.landmarks)
    for eye, sign in zip(face.eyes, (1.0, -1.0), strict=True):
        marks[f"eye_{eye.side}_centre"] = eye.centre + np.array(shift) * [sign, 1.0, 1.0]
    names = ("eye_l_centre", "eye_r_centre")
    found = place_eyeballs(marks, face.frame, face.points, face.triangles, names)
    given = place_eyeballs(marks, face.frame, face.points, face.triangles)
    for eye, there, kept in zip(face.eyes, found, given, strict=True):
        assert np.linalg.norm(there.centre - eye.centre) < 0.5 * np.linalg.norm(shift)
        assert there.radius == pytest.approx(eye.radius, rel=0.1)
        margin = face.points[np.concatenate(margins_of(face, eye.side))]
        assert np.linalg.norm(margin - there.centre, axis=1).min() > 0.95 * there.radius
        if shift[2] > 0.0:  # what is given is kept, unless the ball would be far from the lids
            np.testing.assert_array_equal(kept.centre, marks[f"eye_{eye.side}_centre"])
        else:
            np.testing.assert_array_equal(kept.centre, there.centre)


def test_lids_before_a_socket_are_those_before_a_hole(face):
    points, triangles = filled(face, (1.6, 2.0), (1.8, 8.0), (0.9, 16.0))
    eyes = place_eyeballs(face.landmarks, face.frame, points, triangles)
    for eye, other in zip(face.eyes, eyes, strict=True):
        assert other.radius == pytest.approx(eye.radius, rel=0.03)
        first = lid_weights(face.eyelid_openings[eye.side], face.points, face.triangles)
        second = lid_weights(eyelid_opening(other, points, triangles, face.landmarks), points, triangles)
        turns = np.zeros((2, len(points)))
        for angles, lids in zip(turns, (first, second), strict=True):
            angles[lids.close.vertices] = lids.close.angles
        margins = margins_of(face, eye.side)
        upper, lower = (chain[3:-3] for chain in margins)  # it is not seen where margins before a socket end
        turns[0, upper] -= OVERLAP  # which only skin that ends at the margin needs
        np.testing.assert_allclose(*turns[:, np.append(upper, lower)], atol=np.radians(2.0))


def test_an_eye_that_is_not_open_lies_behind_its_skin(face):
    points, triangles = filled(face)
    closed = fw.fit_face(pv.PolyData.from_regular_faces(points, triangles), face.landmarks, units="mm")
    assert not any(isinstance(closed.muscles[name], LidMuscle | EyeMuscle) for name in closed.joint_weights)
    assert not any(name.startswith("orbicularis_oculi") for name in closed.joint_weights)
    for eye in closed.eyes:
        assert eye.side not in closed.eyelid_openings
        hits = closed.mesh.ray_trace(eye.centre, eye.centre + 100.0 * eye.gaze)[0]
        assert np.linalg.norm(hits - eye.centre, axis=1).min() >= eye.radius
        lashes = Lashes(eye, closed, 0.1)
        ((chain, weights),) = lashes.roots
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-9)
        roots = weights @ closed.points[chain]
        assert np.abs(roots - closed.mesh.find_closest_cell(roots, return_closest_point=True)[1]).max() < 0.5
    with Scene(closed, Style(size=(64, 64))) as scene:
        scene.show(closed.mesh)
        drawn = set(scene.plotter.actors)
    assert {"lashes_l", "lashes_r"} <= drawn
    assert not {"eye_l", "eye_r"} & drawn


def test_eyes_of_a_face_with_closed_lids_do_not_show(real_face):
    face = real_face("mediapipe_canonical_face_model")
    for eye in face.eyes:
        assert eye.side not in face.eyelid_openings
        offset = face.points - eye.centre
        before = offset @ eye.gaze > 0.0
        assert np.linalg.norm(offset[before], axis=1).min() > eye.radius


def test_deep_sockets_have_lids(real_face):
    """The eyes lie where the lids are, and closing lids meet."""
    face = real_face("makehuman_head_male")
    moved = fw.Skin(face, time_step=0.1)
    moved.contract({"orbicularis_oculi_l": 1.0, "orbicularis_oculi_r": 1.0})
    for _ in range(15):
        moved.step()
    now = (moved.points + moved.displacement) / face.unit
    for eye in face.eyes:
        upper, lower = margins_of(face, eye.side)
        along = face.points[np.concatenate([upper, lower])] @ face.frame.axes[0]
        middle = np.quantile(along, [0.35, 0.65])
        heights = []
        for points in (face.points, now):
            chains = [points[chain][:, :3] @ face.frame.axes.T * face.unit for chain in (upper, lower)]
            place = np.linspace(*(middle * face.unit), 9)
            high, low = (np.interp(place, *chain[np.argsort(chain[:, 0])][:, :2].T) for chain in chains)
            heights.append(high - low)
        assert heights[0].min() > 4.0
        assert heights[1].max() < 1.0


@pytest.mark.parametrize("name", ["makehuman_head_male", "ict_face_narrow"])
def test_the_margins_of_thick_lids_keep_to_one_edge(real_face, name):
    """Between their ends they go from neighbour to neighbour, and turn little."""
    face = real_face(name)
    sides = {tuple(sorted(edge)) for t in face.triangles.tolist() for edge in zip(t, t[1:] + t[:1], strict=True)}
    for eye in face.eyes:
        inner, outer = (face.landmarks[f"eye_{eye.side}_{end}"] for end in ("inner", "outer"))
        for chain in margins_of(face, eye.side):
            place = (face.points[chain] - inner) @ (outer - inner) / ((outer - inner) @ (outer - inner))
            middle = chain[(place > 0.22) & (place < 0.95)]
            steps = zip(middle[:-1].tolist(), middle[1:].tolist(), strict=True)
            assert len(middle) > 5
            assert {tuple(sorted(step)) for step in steps} <= sides
            along = np.diff(face.points[middle], axis=0)
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            assert (along[1:] * along[:-1]).sum(axis=1).min() > np.cos(np.radians(40.0))
