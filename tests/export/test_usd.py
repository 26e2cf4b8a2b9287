"""Rigs and animations as USD.

what                   checked against
files                  UsdValidation, which finds an error in a broken one
shapes and animation   the skin as UsdSkel bakes it
"""

from __future__ import annotations

import numpy as np
import pytest

import facewrinkle as fw

pxr = pytest.importorskip("pxr")
from pxr import Usd, UsdGeom, UsdSkel, UsdValidation  # noqa: E402


def errors(path):
    """What the validators of USD find."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    return UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(path)))


def baked(path, time):
    """Points of the skin at a time, s, in the coordinates of its mesh."""
    stage = Usd.Stage.Open(str(path))
    assert UsdSkel.BakeSkinning(UsdSkel.Root.Get(stage, "/Face"))
    code = time * stage.GetTimeCodesPerSecond()
    return np.asarray(UsdGeom.Mesh.Get(stage, "/Face/face").GetPointsAttr().Get(code))


@pytest.fixture(scope="module")
def rig(face):
    return fw.rig(face, "jawOpen+browInnerUp", level=1)


def test_a_rig_is_valid_and_has_its_shapes(rig, tmp_path):
    path = fw.write_rig(rig, tmp_path / "head.usda")
    assert not errors(path)
    stage = Usd.Stage.Open(str(path))
    binding = UsdSkel.BindingAPI(stage.GetPrimAtPath("/Face/face"))
    assert tuple(binding.GetBlendShapesAttr().Get()) == rig.names
    assert UsdGeom.GetStageMetersPerUnit(stage) == pytest.approx(1e-3 * rig.face.unit)
    animation = UsdSkel.Animation.Get(stage, "/Face/Skeleton/Animation")
    animation.GetBlendShapeWeightsAttr().Set([0.5, 1.0])
    stage.GetRootLayer().Save()
    expected = rig.at({"jawOpen": 0.5, "browInnerUp": 1.0}).points
    np.testing.assert_allclose(baked(path, 0.0), expected, atol=1e-6 * np.ptp(expected))


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
    sim.express("surprise")
    writer = fw.export.animation.AnimationWriter(face, tmp_path / "surprise.usdc", error=0.1)
    frames = []
    for frame in sim.run(8):
        writer.add(frame)
        frames.append(frame.points[: len(face.points)].copy())
    (path,) = writer.write(0.02 * np.arange(8), sim.forest)
    assert not errors(path)
    for k in (0, 3, 7):
        off = np.linalg.norm(baked(path, 0.02 * k)[: len(face.points)] - frames[k], axis=1)
        assert off.max() * face.unit < 0.1 + 1e-3
