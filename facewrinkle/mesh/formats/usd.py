"""USD files as plain arrays: all meshes of the stage, in its coordinates, at its first time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...errors import MeshError, optional_imports, warn
from ...files import check_inside
from ..arrays import COLORS
from ..surface import Piece, Surface
from .merging import srgb
from .polygons import polygon_triangles
from .probing import probe


def read_usd_file(path: Path) -> list[Surface]:
    """Read the triangles of all meshes that are drawn on the stage of a USD file.

    Raises
    ------
    MissingPackageError
        Without usd-core (extra `export`).
    MeshError
        For a file that USD cannot open, or whose faces use points that do not exist.
    """
    stage = opened(path)
    from pxr import Usd, UsdGeom

    first = Usd.TimeCode.EarliestTime()
    places = UsdGeom.XformCache(first)
    found = [
        primitive_of(path, UsdGeom.Mesh(prim), np.array(places.GetLocalToWorldTransform(prim)).T, first, number)
        for number, prim in enumerate(shown(stage))
    ]
    return [part for part in found if part is not None]


def shown(stage: Any) -> list[Any]:
    """Prims of the meshes that are drawn; some may be empty."""
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
    """Open the stage of a USD file."""
    with optional_imports(f"{path.name}: USD files need", ", or export the mesh as OBJ, PLY or glTF."):
        from pxr import Tf, Usd
    probe(path)
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as problem:  # in the words of its C++
        raise MeshError(f"{path.name} cannot be read: USD does not understand it. Export it again.") from problem
    for layer in stage.GetUsedLayers():
        if name := layer.realPath:
            check_inside(path.parent, name, path.name, name)
    return stage


def primitive_of(path: Path, mesh: Any, matrix: np.ndarray, time: Any, number: int = 0) -> Surface | None:
    """Return a mesh at a time code, transformed by a matrix (4, 4); None if it is empty."""
    from pxr import UsdGeom

    points, counts, vertices = (
        np.array(attribute.Get(time) if attribute.HasValue() else [])
        for attribute in (mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    )
    if not len(points) or not len(counts):
        return None
    if counts.sum() != len(vertices) or counts.min() < 0 or vertices.min() < 0 or vertices.max() >= len(points):
        raise MeshError(
            f"{path.name}: the faces of {mesh.GetPrim().GetName()} use points that do not exist. The file is damaged: "
            "export it again."
        )
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
    of_face = np.full(len(sizes), "") if texture is None else _inside(path, _images(mesh, len(sizes)))
    colors = _colors(mesh, len(points), time)
    name = "/".join(reversed(str(mesh.GetPath()).split("/")))
    images, piece = np.unique(of_face, return_inverse=True)
    pieces = tuple(Piece(number, name, image) for image in images.tolist())
    triangles = vertices[split].astype(np.int64)
    return Surface(placed, triangles, texture, colors, pieces=pieces, piece=piece.ravel()[face])


def _colors(mesh: Any, count: int, time: Any) -> dict[str, np.ndarray]:
    """Colors of the `count` points."""
    primvar = mesh.GetDisplayColorPrimvar()
    values = primvar.ComputeFlattened(time) if primvar and primvar.HasValue() else None
    if values is None or primvar.GetInterpolation() not in ("vertex", "varying") or len(values) != count:
        return {}
    return {COLORS: srgb(np.array(values))}


def _inside(path: Path, images: np.ndarray) -> np.ndarray:
    """The images without those outside the folder of the file, with a warning for each."""
    for name in {str(name) for name in images} - {""}:
        try:
            check_inside(path.parent, name.partition("[")[0], path.name, name)
        except MeshError as problem:
            warn(f"the texture is left out: {problem}")
            images = np.where(images == name, "", images)
    return images


def _images(mesh: Any, count: int) -> np.ndarray:
    """The image on each of the `count` faces, from the material of the mesh or those of its subsets; "" for none."""
    from pxr import UsdShade

    binding = UsdShade.MaterialBindingAPI(mesh.GetPrim())
    found = [_image_of_material(binding.ComputeBoundMaterial()[0])] * count
    for subset in binding.GetMaterialBindSubsets():
        own = _image_of_material(UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()[0])
        for face in subset.GetIndicesAttr().Get() or []:
            if 0 <= face < count:
                found[face] = own
    return np.array(found)


def _image_of_material(material: Any) -> str:
    """The image file that gives a material its color, "" for none."""
    # Of the preview surface, MaterialX and MDL.
    inputs = ("diffusecolor", "basecolor", "diffusetexture", "basecolortexture")
    for context in ("", "mdl") if material else ():
        shader = material.ComputeSurfaceSource(context)[0]
        for source in shader.GetInputs() if shader else ():
            if source.GetBaseName().lower().replace("_", "") in inputs and (file := _file(source)):
                return file
    return ""


def _file(source: Any, depth: int = 8) -> str:
    """The first file named by an input of a shader, or by what it is connected to; "" for none."""
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
    """Texture coordinates (m, 3, 2) of the corners of the triangles: those of the first usual name, else any."""
    primvars = usd.PrimvarsAPI(mesh.GetPrim())
    others = [primvar for primvar in primvars.GetPrimvars() if primvar.GetTypeName().role == "TextureCoordinate"]
    for primvar in (*(primvars.GetPrimvar(name) for name in ("st", "UVMap", "st0", "uv")), *others):
        values = primvar.ComputeFlattened(time) if primvar and primvar.HasValue() else None
        if values is None:
            continue
        flat, kind = np.array(values, dtype=np.float64), primvar.GetInterpolation()
        where = split if kind == usd.Tokens.faceVarying else vertices[split]
        if flat.ndim == 2 and flat.shape[1] == 2 and where.max() < len(flat):
            return np.asarray(flat[where])
    return None
