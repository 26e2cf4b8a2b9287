"""Eyes: flesh between lids and balls, what is seen of a painted eye, and eyes that came with a face.

Painted ones take the place of those without colors only where they can be seen.
"""

from dataclasses import replace

import numpy as np
import pytest
from drawing import held
from expressions import after
from eyelids_of_faces import ball_of
from synthetic_faces import head_with, head_with_balls

from facewrinkle.anatomy.parts import follower
from facewrinkle.appearance.eye import LidMargin, PaintedEye
from facewrinkle.appearance.seen import Appearance, companion_meshes
from facewrinkle.mesh import to_polydata
from facewrinkle.plotting import Scene, Style
from facewrinkle.simulation import Simulation


def rays_past(face, eye, points, ball):
    """Ends of rays through the hole before an eye, along its gaze, that meet neither a ball nor the skin."""
    loop = LidMargin(eye, face).loop
    size = face.frame.pupil_distance
    side = np.cross(eye.up, eye.gaze)
    local = (points[loop] - eye.centre) @ np.stack([side, eye.up], axis=1)
    skin = face.mesh.copy()
    skin.points = points
    across = np.linspace(local.min(axis=0), local.max(axis=0), 40)
    starts = [eye.centre + x * side + y * eye.up + size * eye.gaze for x in across[:, 0] for y in across[:, 1]]
    rays = [(start, start - 1.2 * size * eye.gaze) for start in starts]
    return [ray for ray in rays if not any(len(mesh.ray_trace(*ray)[0]) for mesh in (ball, skin))]


@pytest.mark.parametrize(
    ("any_face", "radius"),
    [
        (None, 0.85),
        ("thick", 1.0),
        *(pytest.param(*each, marks=pytest.mark.slow) for each in ((None, 0.95), ("ict_face_narrow", 1.0))),
    ],
    indirect=["any_face"],
)
def test_no_one_looks_past_a_ball_that_the_lids_do_not_touch(any_face, radius):
    """Too small a ball, and those of faces with thick lids, behind which there is no skin."""
    face = any_face
    for eye in (replace(eye, radius=radius * eye.radius) for eye in face.eyes):
        past, strip = rays_past(face, eye, face.points, ball_of(eye)), LidMargin(eye, face).at(face.points)
        assert past
        assert all(len(strip.ray_trace(*ray)[0]) for ray in past)


def test_the_strip_goes_from_the_rim_into_the_ball_and_faces_out(face):
    frame = after(Simulation(face), "wink", 10)
    for eye in (replace(eye, radius=0.9 * eye.radius) for eye in face.eyes):
        rim = LidMargin(eye, face)
        for points in (face.points, np.asarray(frame.points, np.float64)[: len(face.points)]):
            strip = rim.at(points)
            n = len(rim.loop)
            np.testing.assert_allclose(strip.points[:n], points[rim.loop], rtol=1e-6)
            assert np.linalg.norm(strip.points[-n:] - eye.centre, axis=1).max() < eye.radius
            # It goes on where the skin ends, facing the same way: along the rim, the other way round.
            turned = {(b, a) for t in strip.regular_faces for a, b in zip(t, np.roll(t, -1), strict=True)}
            ends = {(int(a), int(b)) for a, b in turned if max(a, b) < n}
            sides = {(a, b) for t in face.triangles for a, b in zip(t, np.roll(t, -1), strict=True)}
            assert len(ends) == n
            assert {(rim.loop[a], rim.loop[b]) for a, b in ends} <= sides


@pytest.mark.parametrize(
    "any_face, there",
    [
        ("thick", True),
        ("sockets", False),
        ("shut", False),
        ("ict_face_narrow", True),
        pytest.param("makehuman_head_male", False, marks=pytest.mark.slow),
        (None, False),
    ],
    indirect=["any_face"],
)
def test_it_is_drawn_and_written_where_a_ball_leaves_a_hole_open_alone(any_face, there):
    names = {"rim_l", "rim_r"}
    assert (names <= set(companion_meshes(any_face, any_face.mesh))) is there
    with Scene(any_face, Style(size=(32, 32))) as scene:
        scene.show(any_face.mesh)
        assert (names == scene.drawn_parts["rims"]) is there


# --- painted eyes ---------------------------------------------------------------------------------


def blink(face):
    """Base points with both eyes closed."""
    return np.asarray(held("AU43").points)[: face.mesh.n_points]


def test_pupil_is_where_the_eye_looks(face):
    for eye in face.eyes:
        painted = PaintedEye(eye, face)
        for gaze in (eye.gaze, np.array([0.48, 0.0, np.sqrt(1.0 - 0.48**2)])):
            ball = painted.at(face.points, gaze)
            dark = np.asarray(ball["paint"]).max(axis=1) < 12
            dark &= (ball.points - eye.centre) @ gaze > 0.96 * eye.radius
            assert dark.sum() > 100
            middle = ball.points[dark].mean(axis=0) - eye.centre
            assert middle @ gaze / np.linalg.norm(middle) > np.cos(np.radians(1.0))
            np.testing.assert_allclose(np.linalg.norm(ball.points - eye.centre, axis=1), eye.radius, rtol=1e-5)


def test_a_camera_sees_the_cornea_stand_out_between_the_lids_and_not_below_them(face):
    """Its border is 11.7 mm wide, and its top about a millimeter in front of the ball of the sclera."""
    for eye in face.eyes:
        painted = PaintedEye(eye, face)
        for points, out in ((face.points, 1.1), (blink(face), 0.0)):
            away = np.asarray(painted.at(points, camera=eye.centre + 500.0 * eye.gaze).points, float) - eye.centre
            rise = np.linalg.norm(away, axis=1) - eye.radius
            assert rise.max() == pytest.approx(out, abs=0.1)
            assert rise.min() > -1e-3
            aside = np.linalg.norm(away - np.outer(away @ eye.gaze, eye.gaze), axis=1)
            assert rise[aside > 6.0].max() < 0.01
            lateral, up, ahead = painted.lid_axes @ (away / eye.radius).T
            upper, lower = painted.lid_heights(points, lateral)
            height = np.degrees(np.arctan2(up, ahead))
            assert np.abs(rise[(height > upper + 0.5) | (height < lower - 0.5)]).max() < 0.01


@pytest.mark.parametrize("turn", np.radians([20.0, 30.0, 40.0]))
def test_a_pupil_is_seen_where_the_cornea_shows_it(face, turn):
    """The entrance pupil of Emsley's schematic eye lies 3.05 mm behind the top of the cornea."""
    eye = face.eyes[0]
    towards = np.cos(turn) * eye.gaze + np.sin(turn) * np.cross(eye.up, eye.gaze)
    camera = eye.centre + 600.0 * towards
    ball = PaintedEye(eye, face).at(face.points, camera=camera)
    middle = np.asarray(ball.points, float)[np.argmin(ball["angle"])]
    top = np.max((ball.points - eye.centre) @ eye.gaze)
    sight = (middle - camera) / np.linalg.norm(middle - camera)
    across = eye.gaze - (eye.gaze @ sight) * sight  # the place on the axis that is the nearest to the line of sight
    place = (camera - eye.centre) @ across / (eye.gaze @ across)
    assert top - place == pytest.approx(3.05, abs=0.4)


def test_eye_is_darker_under_the_upper_lid_wherever_it_is(face):
    eye = face.eyes[0]
    painted = PaintedEye(eye, face)
    first, second = (painted.at(points)["paint"].astype(int) for points in (face.points, blink(face)))
    assert second.mean() < 0.85 * first.mean()
    upper = face.eyelid_openings[eye.side].upper
    ball = painted.at(face.points)
    top = face.points[upper][:, 1].max()
    white = (ball.points[:, 0] - eye.centre[0] > 6.5) & (ball.points[:, 0] - eye.centre[0] < 8.5)
    height = ball.points[:, 1]
    near, far = white & (np.abs(height - top + 3.0) < 1.0), white & (np.abs(height - eye.centre[1]) < 1.0)
    assert near.any()
    assert first[near].mean() < 0.9 * first[far].mean()


# --- eyes that came with a face --------------------------------------------------------------------


def flat_eye():
    """A left eye as drawn figures have them: not a ball, but half as deep as wide."""
    round_one = head_with_balls("shallow")
    eye, ball = round_one.eyes[0], round_one.parts["eye_l"].mesh
    offset = np.asarray(ball.points) - eye.centre
    front = eye.centre + 0.4 * eye.radius * eye.gaze
    return to_polydata(front + offset - 0.5 * np.outer(offset @ eye.gaze, eye.gaze), ball.regular_faces)


@pytest.mark.parametrize("lids", ["shallow", "sockets"])
def test_an_eye_is_hidden_only_where_one_is_painted_in_its_place(lids):
    """Where the lids seem shut, as it is no ball, it keeps its shape, with pupil and white."""
    bare = head_with(lids)
    mesh = flat_eye()
    face = replace(bare, parts={"eye_l": follower("eye_l", mesh)})
    shut = lids == "shallow"
    assert ("l" not in face.eyelid_openings) == shut
    drawn = companion_meshes(face, face.mesh)["eye_l"]
    assert (drawn.n_points == mesh.n_points) == shut
    with Scene(face, Style(size=(64, 64))) as scene:
        scene.show(face.mesh)
        assert ("eye_l" in scene.drawn_parts["eyes"]) != shut
    eye, paint = face.eyes[0], np.asarray(drawn.point_data["paint"]).max(axis=1)
    offset = np.asarray(drawn.points) - np.asarray(drawn.center)
    aside = np.linalg.norm(offset - np.outer(offset @ eye.gaze, eye.gaze), axis=1) / eye.radius
    front = offset @ eye.gaze > 0.0
    assert paint[front & (aside < 0.1)].max() < 40
    assert paint[front & (aside > 0.6) & (aside < 0.8)].max() > 150


def test_colors_of_its_own_are_kept():
    """Several on one eye; a single one is none."""
    face = head_with_balls("shallow")
    part = face.parts["eye_l"]
    colors = np.full((part.mesh.n_points, 3), 90, np.uint8)
    for k, kept in ((0, False), (1, True)):
        mesh = part.mesh.copy()
        mesh.point_data["Colors"] = colors + np.where(np.arange(len(colors)) < 9, 100 * k, 0).astype(np.uint8)[:, None]
        eyed = replace(face, parts={**face.parts, "eye_l": replace(part, mesh=mesh)})
        assert ("eye_l" in Appearance.of(eyed).own) == kept
