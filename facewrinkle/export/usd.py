"""Meshes with blend shapes, and the animation of their weights, as USD (UsdSkel)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import MissingPackageError
from .model import Model
from .morphs import Morphs, WeightTrack

Array = npt.NDArray[np.float64]

SUFFIXES = (".usd", ".usdc", ".usda")

TICKS = 1000.0
"""Time codes per second: a time code is a millisecond, whatever the steps of an animation are."""

SHOWN_PER_SECOND = 24.0
"""Frames per second at which players are asked to show it."""


def write_usd(
    path: Path,
    models: Mapping[str, Model],
    unit: float,
    rotation: Array | None,
    morphs: Mapping[str, Morphs] | None = None,
    track: WeightTrack | None = None,
) -> None:
    """Write meshes with their blend shapes as a USD file: one `SkelRoot`, with one joint that does not move.

    Shapes are sparse; a mesh has those that move it. Colours are `displayColor`, texture coordinates `primvars:st`;
    pictures are not bound.

    Parameters
    ----------
    path : Path
        Ends in .usd or .usdc (binary) or .usda (text).
    models : mapping of str to Model
    unit : float
        Millimetres per unit.
    rotation : ndarray, shape (3, 3), optional
        Turns the models upright.
    morphs : mapping of str to Morphs, optional
    track : WeightTrack, optional

    Raises
    ------
    MissingPackageError
        Without usd-core (extra `export`).

    Examples
    --------
    >>> import facewrinkle as fw
    >>> import tempfile
    >>> made = fw.rig(fw.default_face(), shapes="jawOpen", level=0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = fw.write_rig(made, f"{folder}/head.usdc")
    ...     path.stat().st_size > 10000
    True
    """
    try:
        from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt
    except ImportError:
        raise MissingPackageError(
            f"{path.name}: USD files need the package usd-core, which is not installed. "
            "pip install 'facewrinkle[export]', or write .glb."
        ) from None
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, unit / 1000.0)
    root = UsdSkel.Root.Define(stage, "/Face")
    stage.SetDefaultPrim(root.GetPrim())
    if rotation is not None:
        turn = np.eye(4)
        turn[:3, :3] = rotation.T  # USD multiplies rows
        root.AddTransformOp().Set(Gf.Matrix4d(turn.tolist()))
    skeleton = UsdSkel.Skeleton.Define(stage, "/Face/Skeleton")
    skeleton.CreateJointsAttr(["head"])
    still = Vt.Matrix4dArray([Gf.Matrix4d(1.0)])
    skeleton.CreateBindTransformsAttr(still)
    skeleton.CreateRestTransformsAttr(still)
    for name, model in models.items():
        mesh = UsdGeom.Mesh.Define(stage, f"/Face/{name}")
        _fill(mesh, model)
        binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
        binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
        binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
        binding.CreateJointIndicesPrimvar(True, 1).Set([0])
        binding.CreateJointWeightsPrimvar(True, 1).Set([1.0])
        if morphs is not None:
            _shapes(stage, mesh, binding, morphs[name])
    names = list(next(iter(morphs.values())).names) if morphs else []
    animation = UsdSkel.Animation.Define(stage, "/Face/Skeleton/Animation")
    animation.CreateJointsAttr(["head"])
    animation.CreateTranslationsAttr([Gf.Vec3f(0.0)])
    animation.CreateRotationsAttr([Gf.Quatf(1.0)])
    animation.CreateScalesAttr([Gf.Vec3h(1.0)])
    animation.CreateBlendShapesAttr(names)
    weights = animation.CreateBlendShapeWeightsAttr(np.zeros(len(names), np.float32))
    if track is not None:
        for time, row in zip(track.times.tolist(), track.weights.astype(np.float32), strict=True):
            weights.Set(Vt.FloatArray.FromNumpy(np.ascontiguousarray(row)), Usd.TimeCode(time * TICKS))
        stage.SetStartTimeCode(float(track.times[0]) * TICKS)
        stage.SetEndTimeCode(float(track.times[-1]) * TICKS)
        stage.SetTimeCodesPerSecond(TICKS)
        stage.SetFramesPerSecond(SHOWN_PER_SECOND)
    source = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    source.CreateAnimationSourceRel().SetTargets([Sdf.Path(animation.GetPath())])
    stage.GetRootLayer().Save()


def _fill(mesh: Any, model: Model) -> None:
    """Write points, triangles, normals, colours and texture coordinates of a mesh."""
    from pxr import Sdf, UsdGeom

    points = model.points.astype(np.float32)
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr(np.full(len(model.triangles), 3, np.int32))
    mesh.CreateFaceVertexIndicesAttr(model.triangles.astype(np.int32).ravel())
    mesh.CreateNormalsAttr(model.normals.astype(np.float32))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateExtentAttr(np.stack([points.min(axis=0), points.max(axis=0)]))
    if model.colours is not None:
        linear = (model.colours / 255.0) ** 2.2
        mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex).Set(linear.astype(np.float32))
    if model.uv is not None:
        places = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
        places.Set(model.uv.astype(np.float32))


def _shapes(stage: Any, mesh: Any, binding: Any, morphs: Morphs) -> None:
    """Write the shapes that move a mesh as blend shapes below it."""
    from pxr import Tf, UsdSkel

    names, targets = [], []
    for name, moved, turned in zip(morphs.names, morphs.deltas, morphs.normals, strict=True):
        some = np.flatnonzero(moved.any(axis=1) | turned.any(axis=1))
        if not len(some):
            continue
        shape = UsdSkel.BlendShape.Define(stage, mesh.GetPath().AppendChild(Tf.MakeValidIdentifier(name)))
        shape.CreateOffsetsAttr(np.ascontiguousarray(moved[some]))
        shape.CreateNormalOffsetsAttr(np.ascontiguousarray(turned[some]))
        shape.CreatePointIndicesAttr(some.astype(np.int32))
        names.append(name)
        targets.append(shape.GetPath())
    if names:
        binding.CreateBlendShapesAttr(names)
        binding.CreateBlendShapeTargetsRel().SetTargets(targets)
