"""Motion of parts that come with a face: with eyes, jaw, lids and head."""

from __future__ import annotations

import numpy as np
import pytest
from dressed_head import NAMES
from scipy.spatial.transform import Rotation

import facewrinkle as fw
from facewrinkle.anatomy.attachments import combined_mesh


def test_at_rest_all_parts_are_where_they_were(dressed):
    for name, part in dressed.parts_at(dressed.mesh).items():
        np.testing.assert_allclose(part.points, dressed.parts[name].mesh.points, atol=1e-9 * 60.0)


def test_eyes_turn_with_the_gaze_and_nothing_else_does(dressed):
    sim = fw.Simulation(dressed, layers=[])
    sim.look(yaw=20.0)
    *_, frame = sim.run(3)
    parts = dressed.parts_at(frame)
    turn = Rotation.from_rotvec(np.radians(20.0) * dressed.frame.axes[1]).as_matrix()
    for eye in dressed.eyes:
        rest = dressed.parts[f"eye_{eye.side}"].mesh.points - eye.centre
        np.testing.assert_allclose(parts[f"eye_{eye.side}"].points - eye.centre, rest @ turn.T, atol=0.05)
    for name in ("hair", "upper_teeth", "glasses"):
        np.testing.assert_allclose(parts[name].points, dressed.parts[name].mesh.points, atol=0.05)


def test_lower_teeth_go_with_the_mandible(dressed):
    jaw = next(m for m in dressed.muscles.values() if isinstance(m, fw.anatomy.muscles.JawMuscle))
    sim = fw.Simulation(dressed, layers=[])
    sim.express("AU26")
    rate = dressed.atlas.contractions("AU26")[next(n for n, m in dressed.muscles.items() if m is jaw)]
    *_, frame = sim.run(60)
    parts = dressed.parts_at(frame)
    rest, now = (
        np.asarray(mesh.points) - jaw.hinge for mesh in (dressed.parts["lower_teeth"].mesh, parts["lower_teeth"])
    )
    turn = Rotation.align_vectors(now, rest)[0].as_rotvec()
    np.testing.assert_allclose(now, rest @ Rotation.from_rotvec(turn).as_matrix().T, atol=0.1)  # about the hinge
    np.testing.assert_allclose(turn / np.linalg.norm(turn), jaw.axis, atol=0.01)
    assert np.linalg.norm(turn) == pytest.approx(rate * jaw.angle, abs=1e-3)  # the muscle tells, not the skin over it
    assert np.abs(parts["upper_teeth"].points - dressed.parts["upper_teeth"].mesh.points).max() < 0.1


def test_lashes_go_down_with_the_lid(dressed):
    sim = fw.Simulation(dressed, layers=[])
    sim.contract({"orbicularis_oculi_l": 1.0})
    *_, frame = sim.run(60)
    parts = dressed.parts_at(frame)
    fall = (parts["lashes_l"].points - dressed.parts["lashes_l"].mesh.points) @ dressed.frame.axes[1]
    assert fall.max() < -3.0
    kept = parts["lashes_r"].points - dressed.parts["lashes_r"].mesh.points
    assert np.abs(kept).max() < 0.3
    # They keep their shape.
    edges = [np.linalg.norm(np.diff(mesh.points[:16], axis=0), axis=1) for mesh in
             (dressed.parts["lashes_l"].mesh, parts["lashes_l"])]  # fmt: skip
    np.testing.assert_allclose(edges[1], edges[0], rtol=0.35)


def test_everything_goes_with_a_head_that_moves(dressed):
    turn, shift = Rotation.from_rotvec([0.4, -1.0, 0.3]).as_matrix(), np.array([30.0, -500.0, 7.0])
    frame = dressed.mesh.copy()
    frame.points = np.asarray(frame.points) @ turn.T + shift
    for name, part in dressed.parts_at(frame).items():
        rest = np.asarray(dressed.parts[name].mesh.points)
        np.testing.assert_allclose(part.points, rest @ turn.T + shift, atol=1e-6)


def test_the_expression_does_not_shift_the_hair(dressed):
    for expression in ("surprise", "happiness", "fear"):
        sim = fw.Simulation(dressed, layers=[])
        sim.express(expression)
        *_, frame = sim.run(40)
        hair = dressed.parts_at(frame)["hair"]
        assert np.linalg.norm(hair.points - dressed.parts["hair"].mesh.points, axis=1).max() < 0.15, expression


def test_one_mesh_for_files(dressed):
    frame = fw.Simulation(dressed, layers=[]).step()
    whole = dressed.with_parts(frame)
    assert list(whole.field_data["parts"]) == ["skin", *NAMES]
    parts = dressed.parts_at(frame)
    assert whole.n_cells == frame.n_cells + sum(part.n_cells for part in parts.values())
    np.testing.assert_array_equal(whole.points[: frame.n_points], frame.points)
    for number, part in enumerate(parts.values(), start=1):
        np.testing.assert_array_equal(whole.points[whole["part"] == number], part.points)
    assert set(frame.point_data) | {"part"} == set(whole.point_data)
    assert combined_mesh(frame, {}).n_points == frame.n_points


def test_a_face_without_parts_is_its_own_frame(face):
    assert face.with_parts(face.mesh) is face.mesh
