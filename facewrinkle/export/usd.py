"""Meshes with blend shapes, and the animation of their weights, as USD (UsdSkel)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..array_types import Array, Single
from ..errors import optional_imports
from ..files import write_whole
from ..mesh.formats.merging import linear_light
from .gltf import SKIN_COLOR, roughness
from .model import Model, Morphs, WeightTrack

SUFFIXES = (".usd", ".usdc", ".usda")


def write_usd(
    path: Path,
    models: Mapping[str, Model],
    unit: float,
    rotation: Array | None,
    morphs: Mapping[str, Morphs] | None = None,
    tracks: Mapping[str, WeightTrack] | None = None,
    beside: Path | None = None,
) -> list[Path]:
    """Write meshes with their blend shapes as a USD file: one `SkelRoot`, with one joint that does not move.

    Shapes are sparse; a mesh has those that move it. Shapes that are driven by another's weight squared are part of
    that one, with an in-between at half its weight. Colors are `displayColor`, texture coordinates `primvars:st`, and
    materials preview surfaces, with the pictures in files beside.

    Parameters
    ----------
    path : Path
        Ends in .usd or .usdc (binary) or .usda (text).
    models : mapping of str to Model
    unit : float
        Millimeters per unit.
    rotation : ndarray, shape (3, 3), optional
        Turns the models upright.
    morphs : mapping of str to Morphs, optional
    tracks : mapping of str to WeightTrack, optional
        Animation of the weights of the shapes of models, by their names; all at the same times.
    beside : Path, optional
        The final place of the file, if that is another: pictures are written there, ``NAME_face.png`` and so on.

    Returns
    -------
    list of Path
        The pictures.

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
    with optional_imports(f"{(beside or path).name}: USD files need", ", or write .glb."):
        from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt
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
    pictures = []
    for name, model in models.items():
        mesh = UsdGeom.Mesh.Define(stage, f"/Face/{name}")
        _fill(mesh, model)
        pictures += _paint(stage, mesh, name, model, beside or path)
        binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
        binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
        binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
        binding.CreateJointIndicesPrimvar(True, 1).Set([0])
        binding.CreateJointWeightsPrimvar(True, 1).Set([1.0])
        if morphs is not None and name in morphs:
            _shapes(stage, mesh, binding, morphs[name])
    own = {part: [name for name, *_ in _merged(shapes)] for part, shapes in (morphs or {}).items()}
    names = list(dict.fromkeys(name for each in own.values() for name in each))
    animation = UsdSkel.Animation.Define(stage, "/Face/Skeleton/Animation")
    animation.CreateJointsAttr(["head"])
    animation.CreateTranslationsAttr([Gf.Vec3f(0.0)])
    animation.CreateRotationsAttr([Gf.Quatf(1.0)])
    animation.CreateScalesAttr([Gf.Vec3h(1.0)])
    animation.CreateBlendShapesAttr(names)
    weights = animation.CreateBlendShapeWeightsAttr(np.zeros(len(names), np.float32))
    if tracks:
        times, ticks = next(iter(tracks.values())).times, 1000.0  # a time code is a ms, whatever the steps are
        rows = np.zeros((len(times), len(names)), np.float32)
        for part, track in tracks.items():
            rows[:, [names.index(name) for name in own[part]]] = track.weights
        for time, row in zip(times.tolist(), rows, strict=True):
            weights.Set(Vt.FloatArray.FromNumpy(row), Usd.TimeCode(time * ticks))
        stage.SetStartTimeCode(float(times[0]) * ticks)
        stage.SetEndTimeCode(float(times[-1]) * ticks)
        stage.SetTimeCodesPerSecond(ticks)
        stage.SetFramesPerSecond(24.0)  # at which players are asked to show it
    source = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    source.CreateAnimationSourceRel().SetTargets([Sdf.Path(animation.GetPath())])
    stage.GetRootLayer().Save()
    return pictures


def _fill(mesh: Any, model: Model) -> None:
    """Write points, triangles, normals, colors and texture coordinates of a mesh."""
    from pxr import Sdf, UsdGeom

    points = model.points.astype(np.float32)
    mesh.CreatePointsAttr(points)
    mesh.CreateFaceVertexCountsAttr(np.full(len(model.triangles), 3, np.int32))
    mesh.CreateFaceVertexIndicesAttr(model.triangles.astype(np.int32).ravel())
    mesh.CreateNormalsAttr(model.normals.astype(np.float32))
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateExtentAttr(np.stack([points.min(axis=0), points.max(axis=0)]))
    if model.colors is not None:
        light = linear_light(model.colors)
        mesh.CreateDisplayColorPrimvar(UsdGeom.Tokens.vertex).Set(light.astype(np.float32))
    if model.uv is not None:
        places = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
        places.Set(model.uv.astype(np.float32))


def _shapes(stage: Any, mesh: Any, binding: Any, morphs: Morphs) -> None:
    """Write the shapes that move a mesh as blend shapes below it."""
    from pxr import Tf, UsdSkel

    names, targets = [], []
    for name, whole, half in _merged(morphs):
        some = np.flatnonzero(whole.any(axis=1) | (False if half is None else half.any(axis=1)))
        if not len(some):
            continue
        shape = UsdSkel.BlendShape.Define(stage, mesh.GetPath().AppendChild(Tf.MakeValidIdentifier(name)))
        shape.CreateOffsetsAttr(np.ascontiguousarray(whole[some, :3]))
        shape.CreateNormalOffsetsAttr(np.ascontiguousarray(whole[some, 3:]))
        shape.CreatePointIndicesAttr(some.astype(np.int32))
        if half is not None:
            between = shape.CreateInbetween("half")
            between.SetWeight(0.5)
            between.SetOffsets(np.ascontiguousarray(half[some, :3]))
            between.CreateNormalOffsetsAttr(np.ascontiguousarray(half[some, 3:]))
        names.append(name)
        targets.append(shape.GetPath())
    if names:
        binding.CreateBlendShapesAttr(names)
        binding.CreateBlendShapeTargetsRel().SetTargets(targets)


def _merged(morphs: Morphs) -> Iterator[tuple[str, Single, Single | None]]:
    """Yield the names of shapes, what they add to points and normals (n, 6), side by side, at weight 1, and at a half
    if that is not the half of it.
    """
    drivers = ((k, morphs.drivers.get(name, ())) for k, name in enumerate(morphs.names))
    squared = {names[0]: k for k, names in drivers if len(names) == 2 and names[0] == names[1]}
    for k, name in enumerate(morphs.names):
        if k in squared.values():
            continue
        whole = np.hstack([morphs.deltas[k], morphs.normals[k]])
        half = None
        if name in squared:
            more = np.hstack([morphs.deltas[squared[name]], morphs.normals[squared[name]]])
            whole, half = whole + more, (0.5 * whole + 0.25 * more).astype(np.float32)
        yield name, whole, half


def _paint(stage: Any, mesh: Any, name: str, model: Model, place: Path) -> list[Path]:
    """Bind a preview surface to a mesh, with its colors, or with its picture in a file beside `place`; return that."""
    from pxr import Sdf, UsdShade

    types, folder = Sdf.ValueTypeNames, f"/Face/Materials/{name}"

    def node(title: str, kind: str, **inputs: tuple[Any, Any]) -> Any:
        """Return a shader whose inputs have types and values."""
        shader = UsdShade.Shader.Define(stage, f"{folder}/{title}")
        shader.CreateIdAttr(kind)
        for title, (of, value) in inputs.items():
            shader.CreateInput(title, of).Set(value)
        return shader

    material = UsdShade.Material.Define(stage, folder)
    surface = node("Surface", "UsdPreviewSurface", roughness=(types.Float, roughness(name)))
    color = surface.CreateInput("diffuseColor", types.Color3f)
    material.CreateSurfaceOutput().ConnectToSource(surface.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    if model.png is None or model.uv is None:
        fallback = types.Float3, tuple(SKIN_COLOR[:3])
        colors = node("Colors", "UsdPrimvarReader_float3", varname=(types.String, "displayColor"), fallback=fallback)
        color.ConnectToSource(colors.CreateOutput("result", types.Float3))
        return []
    ending = "png" if model.png.startswith(b"\x89PNG") else "jpg"
    picture = place.with_name(f"{place.stem}_{name}.{ending}")
    write_whole(picture, model.png)
    places = node("Places", "UsdPrimvarReader_float2", varname=(types.String, "st"))
    texture = node(
        "Picture",
        "UsdUVTexture",
        file=(types.Asset, Sdf.AssetPath(f"./{picture.name}")),
        sourceColorSpace=(types.Token, "sRGB"),
        wrapS=(types.Token, "repeat"),
        wrapT=(types.Token, "repeat"),
    )
    texture.CreateInput("st", types.Float2).ConnectToSource(places.CreateOutput("result", types.Float2))
    color.ConnectToSource(texture.CreateOutput("rgb", types.Float3))
    if model.cutout:
        opacity = surface.CreateInput("opacity", types.Float)
        opacity.ConnectToSource(texture.CreateOutput("a", types.Float))
        surface.CreateInput("opacityThreshold", types.Float).Set(0.5)
    return [picture]
