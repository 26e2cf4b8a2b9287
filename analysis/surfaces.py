"""The surfaces that are measured: a moment of a simulation on any refinement of its mesh; plates with one muscle."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import Delaunay

import facewrinkle as fw
from facewrinkle.anatomy.muscles import Muscle
from facewrinkle.geometry.interpolation import displaced, interpolated
from facewrinkle.geometry.normals import detail_normals, vertex_normals
from facewrinkle.geometry.refinement import Change, RedGreenForest
from facewrinkle.layers.base import Displacement, Layer, SurfacePoints, SurfaceState
from facewrinkle.layers.compression import StrainField
from facewrinkle.mesh import to_polydata
from facewrinkle.motion.base import NONE_BY_NAME

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

EXPRESSIONS = ("surprise", "frowning", "closing_eye", "stretching_mouth", "fear")
"""Those of Zhang, Sim, Tan, Table 1."""


@dataclass(frozen=True, eq=False)
class Laid:
    """A wrinkled surface of one moment; lengths in mm.

    Attributes
    ----------
    rest, bare, wrinkled, normals : ndarray, shape (n, 3)
        At rest, moved, moved and displaced, and the unit directions of displacement.
    rest_normals : ndarray, shape (n, 3)
    height : ndarray, shape (n,)
        W.
    triangles : ndarray of int32, shape (m, 3)
    layers, reliefs : lists of Layer and Displacement
        As they were laid on this mesh.
    """

    rest: Array
    bare: Array
    wrinkled: Array
    normals: Array
    rest_normals: Array
    height: Array
    triangles: IntArray
    layers: list[Layer]
    reliefs: list[Displacement]

    @property
    def folded(self) -> Array:
        """Vertex normals (n, 3) of the wrinkled surface, which Eq. 19 compares."""
        return detail_normals(self.bare, self.wrinkled, self.triangles, self.normals)

    @property
    def shading(self) -> Array:
        """Vertex normals (n, 3) as a frame has them, of furrows that are a little rounded."""
        rounding = sum(relief.rounding for relief in self.reliefs if relief.rounding is not None)
        shown = displaced(self.bare, self.height + rounding, self.normals)
        return detail_normals(self.bare, shown, self.triangles, self.normals)


def settled(face: fw.Face, expression: str, frames: int = 50, **options: object) -> fw.Simulation:
    """A simulation that has played an expression to its height."""
    sim = fw.Simulation(face, **options)  # type: ignore[arg-type]
    sim.express(expression)
    for _ in sim.run(frames):
        pass
    return sim


def lay(sim: fw.Simulation, forest: RedGreenForest | None = None, layers: list[Layer] | None = None) -> Laid:
    """The present moment of a simulation on its own mesh, on another refinement, or with other layers."""
    face, forest = sim.face, forest or sim.forest
    corners, weights = forest.corners, forest.barycentric
    base = sim.motion.points + sim.motion.displacement  # type: ignore[attr-defined]
    points = interpolated(face.points, corners, weights)
    sites = SurfacePoints(
        points, _unit(interpolated(vertex_normals(face.points, face.triangles), corners, weights)), corners, weights,
        forest.host,
    )  # fmt: skip
    bare = interpolated(base, corners, weights)
    normals = _unit(interpolated(vertex_normals(base, face.triangles), corners, weights))
    field = StrainField(face.points * face.unit, face.triangles)
    state = SurfaceState(sim.motion.rates, sites, forest.triangles, base, bare, sim.time, lambda: field, normals)
    laid = [copy(layer) for layer in (sim.layers if layers is None else layers)]
    for layer in laid:
        layer.attach(face)
        layer.follow(Change(slice(None), len(points)), sites)
    reliefs = [layer.displacement(state) for layer in laid]
    height = np.sum([np.zeros(len(points)), *(relief.height for relief in reliefs)], axis=0)
    wrinkled = displaced(bare, height, normals)
    return Laid(points * face.unit, bare, wrinkled, normals, sites.normals, height, forest.triangles, laid, reliefs)


def uniform(face: fw.Face, level: int) -> RedGreenForest:
    """The whole base mesh split so often."""
    return refined(face, np.ones(len(face.triangles), bool), level)


def wrinkling(face: fw.Face, rates: Mapping[str, float], level: int) -> RedGreenForest:
    """The base mesh with all triangles that these muscles may wrinkle split so often."""
    inside = np.zeros(len(face.triangles), bool)
    for name, zone in zip(face.muscles, face.zones, strict=True):
        if rates.get(name, 0.0) > 0.0:
            inside |= zone
    return refined(face, inside, level)


def refined(face: fw.Face, roots: npt.NDArray[np.bool_], level: int) -> RedGreenForest:
    """The base mesh with some of its triangles split so often."""
    forest = RedGreenForest(face.triangles, level, len(face.points))
    for _ in range(level):
        forest.split(roots[forest.root])
    return forest


def rates_of(sim: fw.Simulation) -> dict[str, float]:
    """Contraction rates by muscle that are not 0."""
    return {name: float(rate) for name, rate in zip(sim.muscles, sim.motion.rates, strict=True) if rate > 0.0}


class Given:
    """A motion in closed form: a displacement that grows in proportion to the largest contraction rate.

    Parameters
    ----------
    face : Face
    displacement : ndarray, shape (n, 3)
        Of the base mesh at full contraction, mm.
    """

    pose, gazes, parts = None, NONE_BY_NAME, NONE_BY_NAME

    def __init__(self, face: fw.Face, displacement: Array) -> None:
        self.names, self.points, self.time_step = tuple(face.muscles), face.points * face.unit, 0.02
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
        """Of the base mesh (n, 3) now, mm."""
        return np.asarray(self._full * self.rates.max(initial=0.0))

    def rates_of(self, rates: Mapping[str, float]) -> Array:
        """See :class:`facewrinkle.motion.base.Motion`."""
        return np.array([rates.get(name, 0.0) for name in self.names])

    def set_rates(self, rates: Array) -> None:
        """See :class:`facewrinkle.motion.base.Motion`."""
        self.rates = rates


def plate(muscle: Muscle, spacing: float = 4.0, size: tuple[float, float] = (60.0, 60.0), seed: int = 0) -> fw.Face:
    """An unstructured flat mesh in the plane z = 0 about the origin, with one muscle named "muscle".

    Its vertices lie nowhere in particular to the folds, `spacing` mm apart.
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
    """A simulation of a plate, its muscle fully contracted and the skin compressed by epsilon along y, once stepped."""
    motion = Given(face, face.points * [0.0, -epsilon, 0.0])
    sim = fw.Simulation(face, motion=motion, **options)  # type: ignore[arg-type]
    sim.contract({"muscle": 1.0})
    sim.step()
    return sim


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
