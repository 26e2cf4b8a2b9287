"""Eyes that came with a face: painted ones take the place of those without colors only where they can be seen."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from synthetic_faces import head_with, head_with_balls

from facewrinkle.anatomy.parts import follower
from facewrinkle.appearance.seen import Appearance, companion_meshes
from facewrinkle.mesh import to_polydata
from facewrinkle.plotting import Scene, Style


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
    face = dataclasses.replace(bare, parts={"eye_l": follower("eye_l", mesh)})
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
        eyed = dataclasses.replace(face, parts={**face.parts, "eye_l": dataclasses.replace(part, mesh=mesh)})
        assert ("eye_l" in Appearance.of(eyed).own) == kept
