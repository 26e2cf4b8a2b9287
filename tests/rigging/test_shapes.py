"""Names of shapes and what each face can make of them."""

import dataclasses

import numpy as np
import pytest
import pyvista as pv

import facewrinkle as fw
from facewrinkle.animation.action_units import named_shapes, units_of
from facewrinkle.rigging.shapes import ARKIT, EXTRAS, VISEMES, shapes_of


def test_there_are_52_shapes_15_visemes_and_all_have_a_twin():
    assert len(ARKIT) == 52
    assert len(VISEMES) == 15
    assert {*EXTRAS} >= {"mouthOpen", "mouthSmile", "eyesClosed", "eyesLookUp", "eyesLookDown"}
    for name, shape in (ARKIT | EXTRAS).items():
        if shape.side is not None:
            other = name.replace("Left", "Right") if shape.side == "l" else name.replace("Right", "Left")
            assert (ARKIT | EXTRAS)[other].movement == shape.movement
            assert (ARKIT | EXTRAS)[other].side != shape.side


def test_the_units_of_a_shape_are_those_that_recordings_of_it_read(face):
    for name, shape in ARKIT.items():
        if not shape.units or shape.modeled or name.startswith("eyeLook"):
            continue
        (unit,) = units_of({name: 1.0})
        assert shape.units == {unit: 1.0}, name
        assert unit in face.atlas.action_units
        assert named_shapes(name, list(ARKIT)) == [name]


def test_sets_and_single_shapes_are_joined(face):
    shapes, left_out = shapes_of("visemes+jawOpen+extras", face)
    assert list(shapes) == [*VISEMES, "jawOpen", *EXTRAS]
    assert not left_out
    assert {*shapes_of("aus", face)[0]} == {unit for unit in face.atlas.action_units if unit[-1].isdigit()}
    assert [*shapes_of("expressions+age", face)[0]] == [*face.atlas.expressions, "age"]


def test_what_a_face_cannot_do_is_left_out_with_the_reason(face):
    assert not shapes_of("arkit", face)[1]
    licking = dataclasses.replace(face, parts={"tongue": fw.anatomy.Part(pv.Sphere(), "mandible")})
    assert shapes_of("arkit", licking)[1] == {"tongueOut": "the tongue that came with the mesh does not move"}
    shapes, left_out = shapes_of("arkit", dataclasses.replace(face, eyes=[]))
    assert {"eyeBlinkLeft", "eyeWideRight"} <= left_out.keys()
    assert left_out["eyeBlinkLeft"] == "the lids of this mesh do not open"
    assert not left_out.keys() & shapes.keys()
    assert len(shapes) + len(left_out) == 52


def test_lips_that_do_not_meet_at_rest_cannot_be_closed(face):
    """A lower lip that hangs by a third of the distance between the pupils, with a gap all along."""
    local = face.frame.local(face.points) - face.frame.local(fw.anatomy.lips_middle(face.landmarks))
    name, jaw = next(
        (name, muscle) for name, muscle in face.muscles.items() if isinstance(muscle, fw.anatomy.JawMuscle)
    )
    weights = face.joint_weights[name]
    hanging = np.zeros(len(face.points))
    hanging[weights.vertices] = weights.angles / jaw.angle
    hanging *= np.exp(-((np.linalg.norm(local, axis=1) / 0.8) ** 4))
    mesh = face.mesh.copy()
    mesh.points = face.points - 0.35 * face.frame.pupil_distance * hanging[:, None] * face.frame.axes[1]
    agape = fw.fit_face(mesh, dict(face.landmarks), units=face.unit)
    shapes, left_out = shapes_of("mouthClose+jawOpen+mouthFunnel", agape)
    assert left_out == {"mouthClose": "the lips of this mesh do not meet at rest"}
    assert set(shapes) == {"jawOpen", "mouthFunnel"}
    with pytest.warns(fw.FaceWrinkleWarning, match="1 shapes are left out .the lips of this mesh do not meet"):
        made = fw.rig(agape, "mouthClose+jawOpen", wrinkles="none", level=0)
    assert made.names == ("jawOpen",)
    assert made.left_out == left_out


def test_shapes_are_joined_as_mixtures_are(face):
    joined = [list(shapes_of(text, face)[0]) for text in ("jawOpen+AU4", "jawOpen, AU4")]
    assert joined == [["jawOpen", "AU4"]] * 2
    with pytest.raises(fw.errors.UnknownNameError, match=r"'jawOpen\+'"):
        shapes_of("jawOpen+", face)
