"""Rigs and animations as USD.

what                   checked against
files                  UsdValidation, which finds an error in a broken one
shapes and animation   the skin as UsdSkel bakes it
"""

from dataclasses import replace

import numpy as np
import pytest
from command_files import in_usd

import facewrinkle as fw
from facewrinkle.rigging.write import write_rig_files

pxr = pytest.importorskip("pxr")
from pxr import Usd, UsdGeom, UsdSkel, UsdValidation  # noqa: E402


def errors(path):
    """What the validators of USD find."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    return UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(path)))


@pytest.fixture(scope="module")
def rig(face):
    return fw.rig(face, "jawOpen+browInnerUp", level=1)


def test_a_rig_is_valid_and_has_its_shapes(rig, tmp_path):
    path = fw.write_rig(rig, tmp_path / "head.usda")
    assert not errors(path)
    stage = Usd.Stage.Open(str(path))
    assert tuple(UsdSkel.BindingAPI(stage.GetPrimAtPath("/Face/face")).GetBlendShapesAttr().Get()) == rig.names
    assert UsdGeom.GetStageMetersPerUnit(stage) == pytest.approx(1e-3 * rig.face.unit)
    UsdSkel.Animation.Get(stage, "/Face/Skeleton/Animation").GetBlendShapeWeightsAttr().Set([0.5, 1.0])
    stage.GetRootLayer().Save()
    expected = rig.at({"jawOpen": 0.5, "browInnerUp": 1.0}).points
    np.testing.assert_allclose(in_usd(path, "face", 0.0).points, expected, atol=1e-6 * np.ptp(expected))


def test_wrinkles_of_their_own_are_in_betweens(face, tmp_path):
    """At half the weight a quarter of the wrinkles shows."""
    rig = fw.rig(face, "browInnerUp", wrinkles="separate", level=1)
    path = fw.write_rig(rig, tmp_path / "head.usda")
    assert not errors(path)
    stage = Usd.Stage.Open(str(path))
    assert tuple(UsdSkel.BindingAPI(stage.GetPrimAtPath("/Face/face")).GetBlendShapesAttr().Get()) == ("browInnerUp",)
    for weight in (0.5, 1.0):
        stage.Reload()
        UsdSkel.Animation.Get(stage, "/Face/Skeleton/Animation").GetBlendShapeWeightsAttr().Set([weight])
        stage.GetRootLayer().Save()
        expected = rig.at(rig.driven({"browInnerUp": weight})).points
        np.testing.assert_allclose(in_usd(path, "face", 0.0).points, expected, atol=1e-6 * np.ptp(expected))


@pytest.mark.slow
def test_colors_are_those_of_the_mesh(face, tmp_path):
    rig = fw.rig(replace(face, texture=None), "jawOpen", wrinkles="none", level=0)
    for ending in ("usda", "glb"):
        found = fw.read_surface(fw.write_rig(rig, tmp_path / f"head.{ending}"))
        np.testing.assert_array_equal(found["Colors"][: face.mesh.n_points], face.mesh["Colors"])


@pytest.mark.slow
def test_pictures_lie_beside(face, tmp_path):
    pytest.importorskip("PIL")
    ramp = np.linspace(40, 200, 64).astype(np.uint8)
    image = np.stack([*np.meshgrid(ramp, ramp), np.full((64, 64), 90, np.uint8)], axis=-1)
    rig = fw.rig(replace(face, texture=image), "jawOpen", wrinkles="none", level=0)
    path = fw.write_rig(rig, tmp_path / "head.usdc")
    assert not errors(path)
    with pytest.warns(fw.FaceWrinkleWarning, match="separate parts"):
        again = fw.fit_face(path, face.landmarks)
    assert (tmp_path / "head_face.jpg").exists()
    assert np.abs(again.texture.astype(float) - image).mean() < 3.0  # a JPEG
    assert set(write_rig_files(rig, path)) == set(tmp_path.iterdir())


def test_the_validators_find_a_broken_file(rig, tmp_path):
    path = fw.write_rig(rig, tmp_path / "head.usda")
    stage = Usd.Stage.Open(str(path))
    stage.GetPrimAtPath("/Face").SetTypeName("Scope")
    UsdGeom.Mesh.Get(stage, "/Face/face").GetFaceVertexCountsAttr().Set([3, 3])
    stage.ClearDefaultPrim()
    stage.GetRootLayer().Save()
    assert errors(path)


def test_an_animation_is_within_its_error(face, tmp_path):
    sim = fw.Simulation(face, fw.Refinement(max_level=1, coarsen=False))
    sim.express("paper_surprise")
    writer = fw.export.animation.AnimationWriter(face, tmp_path / "surprise.usdc", error=0.1)
    frames = []
    for frame in sim.run(8):
        writer.add(frame)
        frames.append(frame.points[: len(face.points)].copy())
    path, *pictures = writer.write(0.02 * np.arange(8), sim.forest)
    assert {path, *pictures} == set(tmp_path.iterdir())
    assert pictures  # of lashes
    assert not errors(path)
    for k in (0, 3, 7):
        off = np.linalg.norm(in_usd(path, "face", 0.02 * k).points[: len(face.points)] - frames[k], axis=1)
        assert off.max() * face.unit < 0.1 + 1e-3
