"""Faces that perform takes.

what                        checked against
shapes of muscles           the simulation of the same action units
what is modeled            the rig's shapes
the head                    rotations about one point
"""

import dataclasses

import numpy as np
import pytest

import facewrinkle as fw
from facewrinkle.appearance.seen import companion_meshes
from facewrinkle.errors import FaceWrinkleWarning, ParameterError
from facewrinkle.rigging.modeled import Movements


def held(face, weights, **options):
    """The face after a second of shapes at constant weights: a motion, and its positions."""
    motion = fw.Performer(fw.Take(tuple(weights), [0.0], [list(weights.values())]), face, time_step=0.1, **options)
    for _ in range(9):
        motion.step()
    return motion, motion.step().copy()


def test_shapes_of_muscles_are_those_of_a_simulation(face):
    motion, points = held(face, {"mouthSmileLeft": 0.6, "mouthFrownRight": 0.9, "browInnerUp": 1.0, "AU9": 0.0})
    skin = fw.Skin(face, 0.1)
    skin.contract(face.atlas.contractions({"AU12L": 0.6, "AU15R": 0.9, "AU1": 1.0}))
    for _ in range(10):
        expected = skin.step()
    np.testing.assert_array_equal(points, expected)
    np.testing.assert_array_equal(motion.rates, skin.rates)
    motion.reset()
    assert not motion.rates.any()


def test_what_no_muscle_does_is_added(face):
    motion, points = held(face, {"jawLeft": 1.0})
    np.testing.assert_allclose(points - face.points_mm, face.unit * Movements(face).of("jaw_left"), atol=0.3)
    sim = fw.Simulation(face, fw.Refinement(max_level=0), layers=[], motion=motion)
    frame = sim.step()
    now, rest = (companion_meshes(face, f, always=True) for f in (frame, face.mesh))
    left = face.frame.axes[0]
    assert ((now["lower_teeth"].points - rest["lower_teeth"].points) @ left).max() * face.unit > 3.0
    np.testing.assert_array_equal(now["upper_teeth"].points, rest["upper_teeth"].points)


@pytest.mark.parametrize("weight", [0.3, 1.0])
def test_mouth_close_seals_an_open_jaw(face, weight):
    upper, lower = Movements(face).pairs

    def gap(points):
        return np.linalg.norm(points[upper] - points[lower], axis=1)

    _, opened = held(face, {"jawOpen": weight})
    _, closed = held(face, {"jawOpen": weight, "mouthClose": weight})
    _, alone = held(face, {"mouthClose": weight})
    rest = gap(face.points_mm)
    assert np.median(gap(opened) - rest) > 10.0 * weight
    assert np.abs(gap(closed) - rest).max() < 0.3
    assert np.abs(gap(alone) - rest).max() < 0.3  # the corrective alone does nothing


def test_the_head_turns_about_its_neck(face):
    take = fw.Take(("jawOpen",), [0.0], [[0.0]], np.array([[0.4, 0.1, 0.0]]))
    motion = fw.Performer(take, face)
    turn = motion.pose[:3, :3]
    np.testing.assert_allclose(motion.step() / face.unit, face.points @ turn.T + motion.pose[:3, 3], atol=1e-9)
    nose = turn @ face.frame.axes[2]
    np.testing.assert_allclose(nose @ face.frame.axes.T, take.turn(0.0)[:, 2], atol=1e-12)
    assert fw.Performer(take, face, head=False).pose is None


def test_what_a_face_cannot_perform_is_told(face):
    blinking = fw.Take(("eyeBlinkLeft", "jawOpen"), [0.0], [[0.5, 0.5]])
    blind = dataclasses.replace(face, eyes=[])
    with pytest.warns(FaceWrinkleWarning, match=r"1 shapes of the take are left out \(the lids of this"):
        motion = fw.Performer(blinking, blind)
    assert motion.left_out == {"eyeBlinkLeft": "the lids of this mesh do not open"}
    with pytest.raises(ParameterError, match="performs a take"):
        fw.Simulation(blind, motion=motion).contract({"jaw": 1.0})
    with pytest.raises(ParameterError, match="can make none of the shapes"):
        fw.Performer(blinking, fw.surface(face.mesh, "mm"))


def test_a_tongue_comes_out_where_a_take_says_so(face):
    take = fw.Take(("tongueOut", "jawOpen"), [0.0, 0.5], [[0.0, 0.0], [1.0, 0.3]])
    *_, frame = fw.Simulation(face, fw.Refinement(max_level=0), layers=[], motion=fw.Performer(take, face)).run(40)
    tongue, at_rest = (companion_meshes(face, each, always=True)["tongue"].points for each in (frame, face.mesh))
    tips = (np.asarray(tongue) @ face.frame.axes[2]).max(), (np.asarray(at_rest) @ face.frame.axes[2]).max()
    assert (tips[0] - tips[1]) / face.frame.scale > 20.0
    shape = face.atlas.contractions("AU19")
    assert frame.field_data["jaw_angle"][0] == pytest.approx(face.jaw_angle(shape))
