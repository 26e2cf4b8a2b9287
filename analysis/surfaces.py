"""Surfaces to measure: one frame of a simulation on any refinement of its mesh, and plates with one muscle."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import Delaunay

import facewrinkle as fw
from facewrinkle.anatomy.muscles import Muscle
from facewrinkle.geometry.interpolation import displaced
from facewrinkle.geometry.normals import detail_normals, vertex_normals
from facewrinkle.geometry.refinement import Change, RedGreenForest
from facewrinkle.geometry.untangling import unfolded_shares
from facewrinkle.layers.base import Displacement, Layer, SurfacePoints, SurfaceState
from facewrinkle.layers.compression import StrainField
from facewrinkle.mesh import to_polydata
from facewrinkle.motion.base import NONE_BY_NAME

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

EXPRESSIONS = ("paper_surprise", "frowning", "closing_eye", "stretching_mouth", "paper_fear")
"""Those of Zhang, Sim, Tan, Table 1."""

KINDS = ("printed", "paper", "wave")
"""Kinds of folds: as printed, mended, and waves."""


@dataclass(frozen=True, eq=False)
class WrinkledSurface:
    """A wrinkled surface at one time; lengths in mm.

    Attributes
    ----------
    rest, bare, wrinkled, normals : ndarray, shape (n, 3)
        At rest, moved, moved and displaced, and the unit directions of displacement.
    rest_normals : ndarray, shape (n, 3)
    height : ndarray, shape (n,)
        W.
    triangles : ndarray of int32, shape (m, 3)
    layers, displacements : lists of Layer and Displacement
        As evaluated on this mesh.
    """

    rest: Array
    bare: Array
    wrinkled: Array
    normals: Array
    rest_normals: Array
    height: Array
    triangles: IntArray
    layers: list[Layer]
    displacements: list[Displacement]

    @property
    def folded(self) -> Array:
        """Vertex normals (n, 3) of the wrinkled surface, which Eq. 19 compares."""
        return detail_normals(self.bare, self.wrinkled, self.triangles, self.normals)

    @property
    def shading(self) -> Array:
        """Shading normals (n, 3) as a frame has them, of heights averaged over the distance of the vertices."""
        offset = sum(d.shading_offset for d in self.displacements if d.shading_offset is not None)
        shown = displaced(self.bare, self.height + offset, self.normals)
        return detail_normals(self.bare, shown, self.triangles, self.normals)


def settled(face: fw.Face, expression: str, frames: int = 50, **options: object) -> fw.Simulation:
    """Return a simulation that has played an expression to full strength, by default with the papers' folds."""
    sim = fw.Simulation(face, **{"folds": "paper", **options})  # type: ignore[arg-type]
    sim.express(expression)
    for _ in sim.run(frames):
        pass
    return sim


def wrinkled_surface(
    sim: fw.Simulation, forest: RedGreenForest | None = None, layers: list[Layer] | None = None
) -> WrinkledSurface:
    """Return the present frame of a simulation on its own mesh, on another refinement, or with other layers."""
    face, forest = sim.face, forest or sim.forest
    base = sim.motion.points + sim.motion.displacement  # type: ignore[attr-defined]
    vertices = SurfacePoints.of_forest(forest, face.points, vertex_normals(face.points, face.triangles))
    moved = SurfacePoints.of_forest(forest, base, vertex_normals(base, face.triangles))
    bare, normals = moved.points, moved.normals
    field = StrainField(face.points_mm, face.triangles)
    state = SurfaceState(sim.motion.rates, vertices, forest.triangles, base, bare, sim.time, lambda: field)
    own = [copy(layer) for layer in (sim.layers if layers is None else layers)]
    for layer in own:
        layer.attach(face)
        layer.follow(Change(slice(None), len(bare)), vertices)
    displacements = [layer.displacement(state) for layer in own]
    height = np.sum([np.zeros(len(bare)), *(d.height for d in displacements)], axis=0)
    if (shares := unfolded_shares(bare, height, normals, forest.triangles)) is not None:
        height *= shares
    return WrinkledSurface(
        vertices.points * face.unit, bare, displaced(bare, height, normals), normals, vertices.normals, height,
        forest.triangles, own, displacements,
    )  # fmt: skip


def uniform(face: fw.Face, level: int) -> RedGreenForest:
    """Return the whole base mesh split `level` times."""
    return refined(face, np.ones(len(face.triangles), bool), level)


def wrinkling(face: fw.Face, rates: Mapping[str, float], level: int) -> RedGreenForest:
    """Return the base mesh with all triangles that these muscles may wrinkle split `level` times."""
    inside = np.zeros(len(face.triangles), bool)
    for name, zone in zip(face.muscles, face.zones, strict=True):
        if rates.get(name, 0.0) > 0.0:
            inside |= zone
    return refined(face, inside, level)


def refined(face: fw.Face, roots: npt.NDArray[np.bool_], level: int) -> RedGreenForest:
    """Return the base mesh with some of its triangles split `level` times."""
    forest = RedGreenForest(face.triangles, level, len(face.points))
    for _ in range(level):
        forest.split(roots[forest.root])
    return forest


def rates_of(sim: fw.Simulation) -> dict[str, float]:
    """Return the contraction rates that are not 0, by muscle."""
    return {name: float(rate) for name, rate in zip(sim.muscles, sim.motion.rates, strict=True) if rate > 0.0}


class Given:
    """A motion in closed form: a displacement that grows in proportion to the largest contraction rate.

    Parameters
    ----------
    face : Face
    displacement : ndarray, shape (n, 3)
        Of the base mesh at full contraction, mm.
    """

    pose, gazes, parts, mandible = None, NONE_BY_NAME, NONE_BY_NAME, None

    def __init__(self, face: fw.Face, displacement: Array) -> None:
        self.names, self.points, self.time_step = tuple(face.muscles), face.points_mm, 0.02
        self._full = displacement
        self.reset()

    def reset(self) -> None:
        """See :class:`facewrinkle.motion.base.Motion`."""
        self.rates = np.zeros(len(self.names))

    def step(self) -> Array:
        """See :class:`facewrinkle.motion.base.Motion`."""
        return np.asarray(self.points + self.displacement)

    @property
    def displacement(self) -> Array:
        """Displacement (n, 3) of the base mesh now, mm."""
        return np.asarray(self._full * self.rates.max(initial=0.0))

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """See :class:`facewrinkle.motion.base.Motion`."""
        return np.array([rates.get(name, 0.0) for name in self.names])

    def set_rates(self, rates: Array) -> None:
        """See :class:`facewrinkle.motion.base.Motion`."""
        self.rates = rates


def plate(muscle: Muscle, spacing: float = 4.0, size: tuple[float, float] = (60.0, 60.0), seed: int = 0) -> fw.Face:
    """Return an unstructured flat mesh in the plane z = 0 about the origin, with one muscle named "muscle".

    Its vertices are `spacing` mm apart, without regard to the folds.
    """
    rng = np.random.default_rng(seed)
    counts = [round(length / spacing) for length in size]
    grid = np.stack(np.meshgrid(*(np.linspace(-0.5, 0.5, n + 1) for n in counts), indexing="ij"), axis=-1).reshape(
        -1, 2
    )
    inner = (np.abs(grid) < 0.499).all(axis=1)
    grid += inner[:, None] * rng.uniform(-0.22, 0.22, grid.shape) / counts
    triangles = Delaunay(grid).simplices
    a, b, c = (grid[triangles[:, k]] for k in range(3))
    turned = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    triangles[turned] = triangles[turned, ::-1]
    points = np.column_stack([grid * size, np.zeros(len(grid))])
    return fw.surface(to_polydata(points, triangles)).with_muscles({"muscle": muscle})


def squeezed(face: fw.Face, epsilon: float, **options: object) -> fw.Simulation:
    """Return a simulation of a plate after one step: muscle fully contracted, skin compressed by epsilon along y."""
    motion = Given(face, face.points * [0.0, -epsilon, 0.0])
    sim = fw.Simulation(face, motion=motion, **options)  # type: ignore[arg-type]
    sim.contract({"muscle": 1.0})
    sim.step()
    return sim
