"""Rigs of the built-in head.

what                      checked against
sides                     shapes of the other side, and the simulation of both
shapes at full weight     the simulation
captured shapes           ICT's, by the cosine of the displacements
age                       simulations whose lines have an age
"""

import numpy as np
import pytest
from small_meshes import area_vectors

import facewrinkle as fw
from facewrinkle.rigging.linear_rig import label


def test_all_meshes_have_all_shapes(rig):
    assert len(rig.names) == 52
    assert not rig.left_out
    assert {"face", "eye_l", "eye_r", "mouth", "upper_teeth", "lower_teeth", "tongue", "brows"} <= rig.parts.keys()
    for part, model in rig.parts.items():
        morphs = rig.morphs[part]
        assert tuple(morphs.names) == rig.names
        assert morphs.deltas.shape == morphs.normals.shape == (52, *model.points.shape)
    moving = {
        part: [name for name, moved in zip(rig.names, m.deltas, strict=True) if moved.any()]
        for part, m in rig.morphs.items()
    }
    assert set(moving["face"]) == set(rig.names)
    assert moving["eye_l"] == [name for name in rig.names if name.startswith("eyeLook") and name.endswith("Left")]
    assert moving["upper_teeth"] == []
    turned = {"jawForward", "jawLeft", "jawOpen", "jawRight", "tongueOut"}
    assert set(moving["tongue"]) == turned
    pressed = {"mouthLowerDownLeft", "mouthLowerDownRight"}  # the gum stays behind the skin
    assert turned <= set(moving["lower_teeth"]) <= turned | pressed
    most = {part: np.linalg.norm(m.deltas, axis=2).max(axis=1) for part, m in rig.morphs.items()}
    out = rig.names.index("tongueOut")
    assert most["tongue"][out] > 25.0
    most["tongue"][out] = 0.0
    for part in (
        "mouth",
        "upper_teeth",
        "lower_teeth",
        "tongue",
    ):  # nothing else behind the lips goes farther than they
        assert (most[part] <= 1.1 * most["face"]).all(), part


def test_the_vertices_of_the_face_come_first(face, rig, smooth_rig):
    np.testing.assert_allclose(rig.mesh.points[: len(face.points)], face.points, atol=1e-4)
    assert len(rig.mesh.points) > 1.5 * len(face.points)
    np.testing.assert_array_equal(smooth_rig.parts["face"].origin[: len(face.points)], np.arange(len(face.points)))


def test_shapes_of_a_side_stay_there(face, rig):
    place = face.frame.local(rig.parts["face"].points)[:, 0]
    for name, moved in zip(rig.names, rig.deltas, strict=True):
        if name.startswith(("jaw", "mouthLeft", "mouthRight")):
            continue
        beyond = place < -0.15 if name.endswith("Left") else place > 0.15
        if name.endswith(("Left", "Right")):
            assert not moved[beyond].any(), name


@pytest.mark.parametrize("stem", ["mouthSmile", "noseSneer", "browDown", "eyeBlink"])
def test_both_sides_together_are_the_simulation(rig, stem):
    found = rig.error({f"{stem}Left": 1.0, f"{stem}Right": 1.0})
    assert found.mean < 0.03 * found.motion
    assert found.largest < 0.8 if stem == "eyeBlink" else found.largest < 0.3


@pytest.mark.parametrize("name", ["browInnerUp", "jawOpen", "mouthFunnel", "mouthPucker", "jawForward", "cheekPuff"])
def test_a_shape_at_full_weight_is_the_simulation_and_nearly_so_at_half(rig, name):
    full, half = rig.error({name: 1.0}), rig.error({name: 0.5})
    assert full.largest < 0.3
    assert full.mean < 0.01 * full.motion
    assert half.mean < 0.1 * half.motion


def test_no_half_way_shape_turns_triangles_over(rig):
    model = rig.parts["face"]
    rest = area_vectors(model.points, model.triangles)
    sizable = np.linalg.norm(rest, axis=1) > 1e-3
    for name, moved in zip(rig.names, rig.deltas, strict=True):
        if name == "mouthClose":  # is never used without an open jaw
            continue
        turned = {}
        for weight in (0.5, 1.0):
            now = area_vectors(model.points + weight * moved, model.triangles)
            turned[weight] = ((now * rest).sum(axis=1) < 0.0)[sizable].mean()
        assert turned[0.5] <= turned[1.0] + 2e-3, name


def test_wrinkles_can_be_targets_of_their_own(face):
    name = "browDownLeft"
    baked, bare = (fw.rig(face, name, wrinkles=kind, level=1) for kind in ("baked", "none"))
    separate = fw.rig(face, name, wrinkles="separate", level=1)
    assert separate.names == (name, f"{name}_wrinkle")
    together = separate.at({name: 1.0, f"{name}_wrinkle": 1.0}).points
    np.testing.assert_allclose(together, baked.at({name: 1.0}).points, atol=0.2)
    smooth = separate.at({name: 1.0}).points[: len(face.points)]
    np.testing.assert_allclose(smooth, bare.at({name: 1.0}).points[: len(face.points)], atol=0.02)
    assert np.linalg.norm(separate.deltas[1], axis=1).max() > 0.1


@pytest.mark.slow
def test_age_is_the_lines_that_old_skin_has_at_rest(face):
    made = fw.rig(face, "age+happiness", level=0)
    old, own = (
        fw.Simulation(face, fw.Refinement(max_level=0), layers=fw.fold_layers(face, "wave", age=age)).step()
        for age in (1.0, 0.0)
    )
    lines = np.asarray(old.points) - own.points
    moved = np.linalg.norm(lines, axis=1) * face.unit > 0.2  # what moves less fades
    assert moved.sum() > 10
    assert np.abs(made.deltas[0, : len(face.points)] - lines)[moved].max() * face.unit < 1e-4
    assert np.array_equal(made.deltas[1], fw.rig(face, "happiness", level=0).deltas[0])


def test_weights_are_checked(rig):
    with pytest.raises(fw.errors.UnknownNameError, match=r"shape 'jawOpn'. Did you mean 'jawOpen'"):
        rig.at({"jawOpn": 1.0})
    with pytest.raises(fw.errors.UnknownNameError, match="part 'nose'"):
        rig.at({}, "nose")
    with pytest.warns(fw.FaceWrinkleWarning, match=r"outside \[0, 1\] are clamped"):
        clamped = rig.at({"jawOpen": 1.5})
    np.testing.assert_array_equal(clamped.points, rig.at({"jawOpen": 1.0}).points)
    assert rig.error({}) == type(rig.error({}))(0.0, 0.0, 0.0)


def test_mixtures_have_labels():
    assert label({"a": 1.0, "b": 0.25}) == "a, b=0.25"


@pytest.mark.slow
def test_the_shapes_of_ict(real_face):
    from analysis.motion import FACES, read_shapes

    path = FACES / "ict_face_expressions.npz"
    if not path.exists():
        pytest.skip(f"{path.name} is not beside the repository")
    face = real_face("ict_face_narrow")
    rig = fw.rig(face, wrinkles="none", level=0)
    captured = {
        name.replace("_L", "Left").replace("_R", "Right"): moved
        for name, moved in read_shapes(path, face.mesh.n_points, face.unit).items()
    }
    for name in ("browInnerUp", "cheekPuff"):  # other tools divide them
        captured[name] = captured[f"{name}Left"] + captured[f"{name}Right"]
    assert set(rig.names) - set(captured) == {"tongueOut"}  # which was not captured
    cosines = {}
    for name, theirs in captured.items():
        if name not in rig.names:
            continue
        ours = rig.deltas[rig.names.index(name)]
        ours = ours[: len(theirs)] * face.unit
        cosines[name] = float((ours * theirs).sum() / np.sqrt((ours**2).sum() * (theirs**2).sum()))
    assert np.mean(list(cosines.values())) > 0.85
    assert min(cosines.values()) > 0.6, cosines
