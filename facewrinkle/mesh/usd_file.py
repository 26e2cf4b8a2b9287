"""USD files as plain arrays: all meshes of the stage, in its coordinates, at its first time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MeshError, MissingPackageError
from .formats import Primitive, polygon_triangles

__all__ = ["read_usd_file"]


def read_usd_file(path: Path, without: str | None = None) -> list[Primitive]:
    """The triangles of all meshes that are drawn on the stage of a USD file, but those at the path `without`.

    Raises
    ------
    MissingPackageError
        Without usd-core (extra `export`).
    MeshError
        For a file that USD cannot open, or whose faces lead nowhere.
    """
    try:
        from pxr import Usd, UsdGeom
    except ImportError:
        raise MissingPackageError(
            f"{path.name}: USD files need the package usd-core, which is not installed. "
            "pip install 'facewrinkle[export]', or export the mesh as OBJ, PLY or glTF."
        ) from None
    stage = opened(path)
    first = Usd.TimeCode.EarliestTime()
    places = UsdGeom.XformCache(first)
    found = []
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        mesh = UsdGeom.Mesh(prim)
        if not mesh or str(prim.GetPath()) == without or mesh.ComputeVisibility(first) == UsdGeom.Tokens.invisible:
            continue
        if mesh.ComputePurpose() in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy):
            continue
        matrix = np.array(places.GetLocalToWorldTransform(prim), dtype=np.float64)
        primitive = _primitive(path, mesh, matrix, first, UsdGeom)
        if primitive is not None:
            found.append(primitive)
    return found


def opened(path: Path) -> Any:
    """The stage of a USD file; needs usd-core."""
    from pxr import Tf, Usd

    try:
        return Usd.Stage.Open(str(path))
    except Tf.ErrorException as problem:
        reason = str(problem).strip().splitlines()[-1].strip()
        raise MeshError(f"{path.name} cannot be read: {reason[:200]}. Export it again.") from None


def _primitive(path: Path, mesh: Any, matrix: np.ndarray, time: Any, usd: Any) -> Primitive | None:
    """One mesh; None if it is empty."""
    name = mesh.GetPrim().GetName()
    points, counts, vertices = (
        np.array(attribute.Get(time) if attribute.HasValue() else [])
        for attribute in (mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    )
    if not len(points) or not len(counts):
        return None
    if counts.sum() != len(vertices) or counts.min() < 0 or vertices.min() < 0 or vertices.max() >= len(points):
        raise MeshError(f"{path.name}: the faces of {name} lead nowhere. The file is damaged: export it again.")
    corners = np.arange(len(vertices))
    if counts.min() < 3:  # lines and points
        keep = counts >= 3
        corners, counts = corners[np.repeat(keep, counts)], counts[keep]
    placed = points.astype(np.float64) @ matrix[:3, :3] + matrix[3, :3]
    split = corners[polygon_triangles(placed[vertices[corners]], counts)]
    turned = mesh.GetOrientationAttr().Get() == usd.Tokens.leftHanded
    if turned != (np.linalg.det(matrix[:3, :3]) < 0.0):
        split = split[:, [0, 2, 1]]
    return Primitive(name, placed, vertices[split].astype(np.int64), _texture(mesh, split, vertices, time, usd))


def _texture(mesh: Any, split: np.ndarray, vertices: np.ndarray, time: Any, usd: Any) -> np.ndarray | None:
    """Texture coordinates (m, 3, 2) of the corners of the triangles."""
    primvars = usd.PrimvarsAPI(mesh.GetPrim())
    for name in ("st", "UVMap", "st0", "uv"):
        primvar = primvars.GetPrimvar(name)
        values = primvar.ComputeFlattened(time) if primvar and primvar.HasValue() else None
        if values is None:
            continue
        flat, kind = np.array(values, dtype=np.float64), primvar.GetInterpolation()
        where = split if kind == usd.Tokens.faceVarying else vertices[split]
        if flat.ndim == 2 and flat.shape[1] == 2 and where.max() < len(flat):
            return np.asarray(flat[where])
    return None
