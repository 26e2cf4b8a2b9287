"""What a frame says of its face.

pose there and back          | the identity, to rounding
points of a turned head      | scipy's rotation
frames of a simulation       | what was asked of it
"""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from expressions import after
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.anatomy.eyeball import gaze_of
from facewrinkle.errors import MeshError
from facewrinkle.mesh.arrays import GAZE, OF_PART, POSE, UNIT, FrameState

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 0]])


def frame() -> pv.PolyData:
    return pv.PolyData.from_regular_faces(POINTS, [[0, 1, 2]])


def test_a_frame_that_says_nothing_is_a_head_at_rest():
    state = FrameState.of(frame(), 3)
    np.testing.assert_array_equal(state.points, POINTS[:3])
    assert (state.pose, state.gazes, state.parts) == (None, {}, {})
    np.testing.assert_array_equal(state.head, np.eye(4))
    np.testing.assert_array_equal(state.to_rest(POINTS), POINTS)


def test_pose_gazes_and_parts_are_read():
    turn, shift = Rotation.from_rotvec([0.1, -0.4, 0.2]), np.array([3.0, -1.0, 2.0])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn.as_matrix(), shift
    mesh = frame()
    mesh.field_data[POSE] = pose
    mesh.field_data[f"{GAZE}r"] = ["a word of the user's"]
    assert FrameState.of(mesh, 3).pose is None  # of a mesh that is no frame, it means something else
    mesh.point_data["rest"], mesh.point_data["level"], mesh.field_data[UNIT] = POINTS, np.zeros(4), [1.0]
    del mesh.field_data[f"{GAZE}r"]
    mesh.field_data[f"{GAZE}l"] = [[0.6, 0.0, 0.8]]
    mesh.field_data[f"{OF_PART}hat"] = POINTS + 1.0
    state = FrameState.of(mesh, 3)
    np.testing.assert_allclose(state.from_rest(POINTS), turn.apply(POINTS) + shift, atol=1e-15)
    np.testing.assert_allclose(state.to_rest(state.from_rest(POINTS)), POINTS, atol=1e-15)
    assert list(state.gazes) == ["l"]
    np.testing.assert_array_equal(state.gazes["l"], [0.6, 0.0, 0.8])
    assert list(state.parts) == ["hat"]
    np.testing.assert_array_equal(state.parts["hat"], POINTS + 1.0)


def test_frames_of_a_simulation_say_where_the_eyes_look(face):
    sim = fw.Simulation(face)
    sim.look(yaw=25.0)
    last = after(sim, "paper_surprise", 4)
    state = face.state_of(last)
    np.testing.assert_array_equal(state.points, last.points[: len(face.points)])
    for eye in face.eyes:
        np.testing.assert_allclose(state.gazes[eye.side], eye.turned(*gaze_of(eye, yaw=25.0)), atol=1e-12)


def test_a_mesh_with_fewer_points_is_no_frame():
    with pytest.raises(MeshError, match="4 points or more, received 3"):
        FrameState.of(pv.PolyData(POINTS[:3]), 4)
