"""USD stages with an animation: the meshes at rest, and the points, places, bones and blend shapes that move them.

Stages are read by usd-core (extra `export`); here their numbers become arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from ..array_types import Array
from ..errors import MeshError, unknown_name, warn
from ..mesh import Surface
from ..mesh.formats.merging import merged_primitives
from ..mesh.formats.usd import opened, primitive_of, shown
from .recorded import Recorded, Track, with_companions


def read_usd(path: Path, mesh: str | None = None) -> tuple[pv.PolyData, Recorded]:
    """Read the meshes of a USD stage at rest, and their recording; see :func:`facewrinkle.read_animation`."""
    stage = _baked(opened(path))
    found = [_Mesh(prim, path) for prim in shown(stage)]
    chosen = _chosen([model for model in found if model.count], mesh, path.name)
    surface, recorded = _animated(chosen, path)
    if recorded is None:
        raise MeshError(
            f"{path.name}: {chosen.name} keeps still: it has no time samples of its points or its place, and no bones "
            "or blend shapes that move. Name another mesh, or export the animation too."
        )
    others = [_animated(model, path) for model in found if model is not chosen and model.primitive is not None]
    return with_companions(surface, recorded, others)


def _baked(stage: Any) -> Any:
    """Return the stage with time samples of points in place of bones and blend shapes; its file is not changed."""
    from pxr import Usd, UsdSkel

    if any(prim.IsA(UsdSkel.Root) for prim in stage.Traverse()):
        stage.SetEditTarget(stage.GetSessionLayer())
        UsdSkel.BakeSkinning(Usd.PrimRange(stage.GetPseudoRoot()))
    return stage


def _animated(model: _Mesh, path: Path) -> tuple[Surface, Recorded | None]:
    """Return a mesh at its first time, and the recording that moves it, if anything does."""
    primitive = model.primitive
    if primitive is None:
        raise MeshError(f"{path.name}: {model.name} has no faces. Export the face with its geometry.")
    if len(model.times) < 2:
        return merged_primitives([primitive], path)[0], None
    still = model.world(model.times[0])
    samples = [model.points(time) @ still[:3, :3].T + still[:3, 3] for time in model.times]
    if model.deforms:
        some = samples[:: max(len(samples) // 16, 1)]  # enough to see which borders stay together
        primitive = replace(primitive, shapes=np.array(some) - primitive.points)
    surface, kept, _ = merged_primitives([primitive], path)
    positions = np.array([sample[kept] for sample in samples])
    track = Track(np.asarray(model.times) / model.per_second, positions)
    return surface, Recorded(track, rest=np.array(surface.points), pose=model.pose(still))


def _chosen(found: list[_Mesh], name: str | None, file: str) -> _Mesh:
    """Return the mesh of that name or path; by default the largest that moves, those that deform before others."""
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
        warn(
            f"{file} holds {len(candidates)} meshes that may be meant: {', '.join(mesh.name for mesh in candidates)}; "
            "took the first, which has the most points. Name another mesh."
        )
    return candidates[0]


class _Mesh:
    """A mesh of a stage."""

    def __init__(self, prim: Any, path: Path) -> None:
        from pxr import Usd, UsdGeom

        self._prim, self._file, self._usd, self._geometry = prim, path, Usd, UsdGeom
        self._mesh = UsdGeom.Mesh(prim)
        self.name, self.path = prim.GetName(), str(prim.GetPath())
        own = self._mesh.GetPointsAttr().GetTimeSamples()
        placed, parent = set(own), prim
        while parent and not parent.IsPseudoRoot():
            placed |= set(UsdGeom.Xformable(parent).GetTimeSamples())
            parent = parent.GetParent()
        self.deforms = len(own) > 1
        self.times: list[float] = sorted(placed)
        self._stage = prim.GetStage()  # keeps it open
        self.per_second = float(self._stage.GetTimeCodesPerSecond())
        self.count = len(self.points(self.first))

    @property
    def first(self) -> Any:
        """The time code at which the mesh is at rest."""
        return self._usd.TimeCode(self.times[0]) if self.times else self._usd.TimeCode.EarliestTime()

    @property
    def primitive(self) -> Surface | None:
        """The mesh at rest, in the coordinates of the stage; None if it has no triangles."""
        if self._mesh.GetFaceVertexIndicesAttr().GetNumTimeSamples() > 1:
            raise MeshError(
                f"{self._file.name}: the faces of {self.name} change with time. A recording needs the same."
            )
        return primitive_of(self._file, self._mesh, self.world(self.first), self.first)

    def points(self, time: Any) -> Array:
        """Return positions (n, 3) at a time code, in the mesh's own coordinates."""
        points = np.array(self._mesh.GetPointsAttr().Get(time) or [], dtype=np.float64).reshape(-1, 3)
        if hasattr(self, "count") and len(points) != self.count:
            raise MeshError(
                f"{self._file.name}: {self.name} changes from {self.count} to {len(points)} points. A recording needs "
                "the same points at all times: export it without subdivision or remeshing."
            )
        return points

    def world(self, time: Any) -> Array:
        """Return the matrix (4, 4) from the mesh's coordinates to the stage's, for columns."""
        cache = self._geometry.XformCache(self._usd.TimeCode(time))
        return np.array(cache.GetLocalToWorldTransform(self._prim), dtype=np.float64).T

    def pose(self, still: Array) -> Callable[[float], Array] | None:
        """Return a function of the seconds that gives the matrix of the motion since rest; None if the mesh stays."""
        back = np.linalg.inv(still)
        if all(np.allclose(self.world(time), still, rtol=0.0, atol=1e-12) for time in self.times):
            return None
        return lambda seconds: np.asarray(self.world(seconds * self.per_second) @ back)
