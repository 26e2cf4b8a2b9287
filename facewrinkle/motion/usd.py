"""USD stages with an animation: the mesh at rest, and how its points and its place move with the time samples.

The stage is usd-core's business (extra `export`); here its numbers become arrays.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..errors import FaceWrinkleWarning, MeshError, MissingPackageError, unknown_name
from ..mesh.arrays import MOVED, blended
from ..mesh.formats import Polygons, check_vertices, textured
from ..mesh.reading import from_polygons, from_primitives, joined
from ..mesh.usd_file import opened, read_usd_file
from .recorded import Recorded, Track

__all__ = ["read_usd"]

Array = npt.NDArray[np.float64]

TEXTURES = ("st", "UVMap", "st0", "uv")


def read_usd(path: Path, mesh: str | None = None) -> tuple[pv.PolyData, Recorded]:
    """The mesh of a USD stage at rest, and the recording that moves it; see :func:`facewrinkle.read_animation`."""
    try:
        from pxr import Usd, UsdGeom
    except ImportError:
        raise MissingPackageError(
            "animations of USD files need the package usd-core, which is not installed. pip install "
            "'facewrinkle[export]'"
        ) from None
    stage = opened(path)
    found = [_Mesh(prim, path.name, Usd, UsdGeom) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    chosen = _chosen(found, mesh, path.name)
    times = chosen.times
    if len(times) < 2:
        raise MeshError(
            f"{path.name}: {chosen.name} has no time samples of its points or its place, and no animation is read from "
            "bones and blend shapes (UsdSkel). Bake the motion to the points of the mesh."
        )
    rest, still = chosen.polygons(times[0])
    positions = np.array([chosen.points(time) for time in times]) @ still[:3, :3].T + still[:3, 3]
    seconds = np.asarray(times) / stage.GetTimeCodesPerSecond()
    recorded = Recorded(Track(seconds, positions), rest=rest.points, pose=chosen.pose(still, stage))
    surface = from_polygons(rest, path.name)
    if chosen.deforms:
        surface.point_data[MOVED] = blended(positions - rest.points)
    others = read_usd_file(path, without=chosen.path)
    return joined([surface, from_primitives(others, path)]) if others else surface, recorded


def _chosen(found: list[_Mesh], name: str | None, file: str) -> _Mesh:
    """The mesh that is meant."""
    if not found:
        raise MeshError(f"{file} holds no mesh. Export the face with its geometry.")
    if name is not None:
        named = [mesh for mesh in found if name in (mesh.name, mesh.path)]
        if not named:
            raise unknown_name("mesh", name, [mesh.name for mesh in found])
        return named[0]
    moving = [mesh for mesh in found if len(mesh.times) > 1] or found
    shaped = [mesh for mesh in moving if mesh.deforms] or moving
    candidates = sorted(shaped, key=lambda mesh: mesh.count, reverse=True)
    if len(candidates) > 1:
        warnings.warn(
            f"{file} holds {len(candidates)} meshes that may be meant: {', '.join(mesh.name for mesh in candidates)}; "
            "took the first, which has the most points. Name another with mesh=.",
            FaceWrinkleWarning,
            stacklevel=4,
        )
    return candidates[0]


class _Mesh:
    """A mesh of a stage."""

    def __init__(self, prim: Any, file: str, usd: Any, geometry: Any) -> None:
        self._prim, self._file, self._usd, self._geometry = prim, file, usd, geometry
        self._mesh = geometry.Mesh(prim)
        self.name, self.path = prim.GetName(), str(prim.GetPath())
        own = self._mesh.GetPointsAttr().GetTimeSamples()
        placed, parent = set(own), prim
        while parent and not parent.IsPseudoRoot():
            placed |= set(geometry.Xformable(parent).GetTimeSamples())
            parent = parent.GetParent()
        self.deforms = len(own) > 1
        self.times: list[float] = sorted(placed)
        self.count = len(self.points(usd.TimeCode.EarliestTime()))

    def points(self, time: Any) -> Array:
        """Positions (n, 3) at a time code, in the mesh's own coordinates."""
        points = np.array(self._mesh.GetPointsAttr().Get(time) or [], dtype=np.float64).reshape(-1, 3)
        if hasattr(self, "count") and len(points) != self.count:
            raise MeshError(
                f"{self._file}: {self.name} changes from {self.count} to {len(points)} points. A recording needs the "
                "same points at all times: export it without subdivision or remeshing."
            )
        return points

    def world(self, time: Any) -> Array:
        """The matrix (4, 4) from the mesh's coordinates to the stage's, for columns."""
        cache = self._geometry.XformCache(self._usd.TimeCode(time))
        return np.array(cache.GetLocalToWorldTransform(self._prim), dtype=np.float64).T

    def pose(self, still: Array, stage: Any) -> Callable[[float], Array] | None:
        """How the place has changed since rest, at a time in seconds."""
        back = np.linalg.inv(still)
        if all(np.allclose(self.world(time), still, rtol=0.0, atol=1e-12) for time in self.times):
            return None

        def pose(seconds: float) -> Array:
            return np.asarray(self.world(seconds * stage.GetTimeCodesPerSecond()) @ back)  # which keeps the stage open

        return pose

    def polygons(self, time: float) -> tuple[Polygons, Array]:
        """The faces at a time, placed as they are then, and the matrix that placed them."""
        mesh, tokens = self._mesh, self._geometry.Tokens
        counts, indices = mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()
        if indices.GetNumTimeSamples() > 1:
            raise MeshError(f"{self._file}: the faces of {self.name} change with time. A recording needs the same.")
        sizes, vertices = (np.array(a.Get(time) or [], dtype=np.int64) for a in (counts, indices))
        if sizes.sum() != len(vertices) or (len(sizes) and sizes.min() < 3):
            raise MeshError(f"{self._file}: the faces of {self.name} lead nowhere, it is damaged: export it again.")
        still = self.world(time)
        ends = np.cumsum(sizes)
        corner = [np.arange(end - size, end) for size, end in zip(sizes, ends, strict=True)]
        turned = (mesh.GetOrientationAttr().Get() == tokens.leftHanded) != (np.linalg.det(still[:3, :3]) < 0.0)
        corner = [numbers[::-1] for numbers in corner] if turned else corner
        faces = [vertices[numbers].tolist() for numbers in corner]
        check_vertices(Path(self._file), faces, self.count)
        order = np.concatenate(corner) if corner else np.zeros(0, np.int64)
        texture, at_corners = self._texture(faces, order, vertices, time)
        return Polygons(self.points(time) @ still[:3, :3].T + still[:3, 3], faces, texture, at_corners), still

    def _texture(
        self, faces: list[list[int]], order: npt.NDArray[np.int64], vertices: npt.NDArray[np.int64], time: float
    ) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Texture coordinates of points, and of corners where these differ."""
        variables = self._geometry.PrimvarsAPI(self._prim)
        for name in TEXTURES:
            variable = variables.GetPrimvar(name)
            values = variable.ComputeFlattened(time) if variable and variable.HasValue() else None
            if values is None:
                continue
            each = variable.GetInterpolation() == self._geometry.Tokens.faceVarying
            return textured(faces, order if each else vertices[order], np.array(values, np.float64), self.count)
        return None, None
