"""USD files as plain arrays: all meshes of the stage, in its coordinates, at its first time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...errors import MeshError, MissingPackageError
from .gltf import seen
from .obj_off import Primitive, polygon_triangles

__all__ = ["read_usd_file"]


TEXTURES = ("st", "UVMap", "st0", "uv")
"""What texture coordinates are called, the first of which is taken; else the first of another name."""


def read_usd_file(path: Path) -> list[Primitive]:
    """The triangles of all meshes that are drawn on the stage of a USD file.

    Raises
    ------
    MissingPackageError
        Without usd-core (extra `export`).
    MeshError
        For a file that USD cannot open, or whose faces lead nowhere.
    """
    stage = opened(path)
    from pxr import Usd, UsdGeom

    first = Usd.TimeCode.EarliestTime()
    places = UsdGeom.XformCache(first)
    found = [
        primitive_of(path, UsdGeom.Mesh(prim), np.array(places.GetLocalToWorldTransform(prim)).T, first)
        for prim in shown(stage)
    ]
    return [primitive for primitive in found if primitive is not None]


def shown(stage: Any) -> list[Any]:
    """The prims of the meshes that are drawn, of which some may be empty."""
    from pxr import Usd, UsdGeom

    first = Usd.TimeCode.EarliestTime()
    found = []
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        mesh = UsdGeom.Mesh(prim)
        if not mesh or mesh.ComputeVisibility(first) == UsdGeom.Tokens.invisible:
            continue
        if mesh.ComputePurpose() not in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy):
            found.append(prim)
    return found


def opened(path: Path) -> Any:
    """The stage of a USD file."""
    try:
        from pxr import Tf, Usd
    except ImportError:
        raise MissingPackageError(
            f"{path.name}: USD files need the package usd-core, which is not installed. "
            "pip install 'facewrinkle[export]', or export the mesh as OBJ, PLY or glTF."
        ) from None
    try:
        return Usd.Stage.Open(str(path))
    except Tf.ErrorException as problem:
        reason = str(problem).strip().splitlines()[-1].strip()
        raise MeshError(f"{path.name} cannot be read: {reason[:200]}. Export it again.") from None


def primitive_of(path: Path, mesh: Any, matrix: np.ndarray, time: Any) -> Primitive | None:
    """A mesh at a time, placed by a matrix (4, 4); None if it is empty."""
    from pxr import UsdGeom

    name = mesh.GetPrim().GetName()
    points, counts, vertices = (
        np.array(attribute.Get(time) if attribute.HasValue() else [])
        for attribute in (mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    )
    if not len(points) or not len(counts):
        return None
    if counts.sum() != len(vertices) or counts.min() < 0 or vertices.min() < 0 or vertices.max() >= len(points):
        raise MeshError(f"{path.name}: the faces of {name} lead nowhere. The file is damaged: export it again.")
    corners, sizes = np.arange(len(vertices)), counts
    if counts.min() < 3:  # lines and points
        keep = counts >= 3
        corners, counts = corners[np.repeat(keep, counts)], counts[keep]
    placed = points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    split = corners[polygon_triangles(placed[vertices[corners]], counts)]
    turned = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    if turned != (np.linalg.det(matrix[:3, :3]) < 0.0):
        split = split[:, [0, 2, 1]]
    texture = _texture(mesh, split, vertices, time, UsdGeom)
    face = np.repeat(np.arange(len(sizes)), sizes)[split[:, 0]]
    images = "" if texture is None else _images(mesh, len(sizes))[face]
    colors = _colors(mesh, len(points), time)
    return Primitive(name, placed, vertices[split].astype(np.int64), texture, colors, image=images)


def _colors(mesh: Any, count: int, time: Any) -> np.ndarray | None:
    """The colours of so many points."""
    primvar = mesh.GetDisplayColorPrimvar()
    values = primvar.ComputeFlattened(time) if primvar and primvar.HasValue() else None
    if values is None or primvar.GetInterpolation() not in ("vertex", "varying") or len(values) != count:
        return None
    return seen(np.array(values))


def _images(mesh: Any, count: int) -> np.ndarray:
    """The image on each of so many faces, by the material of the mesh or those of its subsets; "" for none."""
    from pxr import UsdShade

    binding = UsdShade.MaterialBindingAPI(mesh.GetPrim())
    found = [_image(binding.ComputeBoundMaterial()[0])] * count
    for subset in binding.GetMaterialBindSubsets():
        own = _image(UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()[0])
        for face in subset.GetIndicesAttr().Get() or []:
            if 0 <= face < count:
                found[face] = own
    return np.array(found)


COLOUR = ("diffusecolor", "basecolor", "diffusetexture", "basecolortexture")
"""What shaders call the input of the colour, without underscores: the preview surface, MaterialX, MDL."""


def _image(material: Any) -> str:
    """The file of the image that gives a material its colour, "" for none."""
    for context in ("", "mdl") if material else ():
        shader = material.ComputeSurfaceSource(context)[0]
        for source in shader.GetInputs() if shader else ():
            if source.GetBaseName().lower().replace("_", "") in COLOUR and (file := _file(source)):
                return file
    return ""


def _file(source: Any, depth: int = 8) -> str:
    """The file that an input of a shader, or what it is connected to, names first, "" for none."""
    from pxr import Sdf, UsdShade

    value = source.Get()
    if isinstance(value, Sdf.AssetPath):
        return str(value.resolvedPath or value.path)
    for connection in source.GetConnectedSources()[0] if depth else ():
        for further in UsdShade.ConnectableAPI(connection.source.GetPrim()).GetInputs():
            if file := _file(further, depth - 1):
                return file
    return ""


def _texture(mesh: Any, split: np.ndarray, vertices: np.ndarray, time: Any, usd: Any) -> np.ndarray | None:
    """Texture coordinates (m, 3, 2) of the corners of the triangles."""
    primvars = usd.PrimvarsAPI(mesh.GetPrim())
    others = [primvar for primvar in primvars.GetPrimvars() if primvar.GetTypeName().role == "TextureCoordinate"]
    for primvar in (*(primvars.GetPrimvar(name) for name in TEXTURES), *others):
        values = primvar.ComputeFlattened(time) if primvar and primvar.HasValue() else None
        if values is None:
            continue
        flat, kind = np.array(values, dtype=np.float64), primvar.GetInterpolation()
        where = split if kind == usd.Tokens.faceVarying else vertices[split]
        if flat.ndim == 2 and flat.shape[1] == 2 and where.max() < len(flat):
            return np.asarray(flat[where])
    return None
