"""The skin that the lines of a family are drawn on: its triangles, split evenly, and smoothing on their vertices."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, diags_array

from ...anatomy.face import Face
from ...array_types import Array, BoolArray
from ...geometry.interpolation import interpolated
from ...geometry.laplacian import symmetric_factors
from ...geometry.refinement import RedGreenForest
from ...geometry.topology import side_lengths

FINE, MOST = 0.45, 4
"""Length of edges on which a wave is known well enough, in wavelengths, and the highest level."""

THIN = 1e-3
"""Least height of a triangle that counts, over its longest side."""

Smoother = Callable[[Array], Array]


def level_for(face: Face, zone: BoolArray, length: Array) -> int:
    """Return how often the triangles of a zone are to be split, for wavelengths (n0,), mm, at the base vertices.

    Half of their edges are then no longer than `FINE` wavelengths.
    """
    edges = side_lengths(face.points[face.triangles[zone]] * face.unit)
    needed = np.log2(edges / (FINE * length[face.triangles[zone]]))
    return int(np.clip(np.ceil(np.median(needed)), 0, MOST))


class Ground:
    """The triangles of a zone, each split `level` times in four.

    Parameters
    ----------
    face : Face
    zone : ndarray of bool, shape (m0,)
        Base triangles.
    level : int

    Attributes
    ----------
    level : int
    base, triangles : ndarray of int32, shape (m0, 3) and (m, 3)
        The base mesh, and the split triangles of the zone: those of a base triangle in a row, its four parts one after
        the other, each with its four parts, and so on.
    row : ndarray of int, shape (m0,)
        Number of each base triangle in the zone, -1 for those outside.
    points : ndarray, shape (n, 3)
        Places of the vertices, mm.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> ground = Ground(face, np.arange(len(face.triangles)) < 10, 2)
    >>> len(ground.triangles), ground.row[8:12].tolist()
    (160, [8, 9, -1, -1])
    """

    def __init__(self, face: Face, zone: BoolArray, level: int) -> None:
        self.level, self.base = level, face.triangles
        used, corners = np.unique(face.triangles[zone], return_inverse=True)
        forest = RedGreenForest(corners.reshape(-1, 3), level)
        for _ in range(level):
            forest.split(np.arange(len(forest.triangles)))
        self.triangles = forest.triangles
        self.row = np.where(zone, np.cumsum(zone) - 1, -1)
        self._at = used[forest.corners].astype(np.int32), forest.barycentric
        self.points = self.at(face.points * face.unit)

    def at(self, values: Array) -> Array:
        """Return values (n0,) or (n0, d) of the base vertices, interpolated at the vertices."""
        found = interpolated(values.reshape(len(values), -1), *self._at)
        return found.reshape(-1, *values.shape[1:])


class Smoothing:
    """Averages over the ground with the finite elements of its triangles.

    Parameters
    ----------
    ground : Ground

    Attributes
    ----------
    mass : ndarray, shape (n,)
        Area around each vertex, mm^2.
    """

    def __init__(self, ground: Ground) -> None:
        self._triangles = t = ground.triangles
        corners = ground.points[t]
        sides = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # each opposite a corner
        normals = np.cross(sides[:, 0], sides[:, 1])
        double = np.linalg.norm(normals, axis=1)
        normals /= np.maximum(double, 1e-300)[:, None]
        double = np.maximum(double, THIN * (sides**2).sum(axis=2).max(axis=1))
        self._area, self._slopes = 0.5 * double, np.cross(normals[:, None], sides) / double[:, None, None]
        self.mass = np.bincount(t.ravel(), np.repeat(self._area / 3.0, 3))

    def over(self, spread: Array, turns: Array | None = None) -> Smoother:
        """Return what averages values (n,) or (n, d): one step of diffusion, ``(M + K)^-1 M``.

        Parameters
        ----------
        spread : ndarray, shape (m, 3, 3)
            Half the covariance of the weights in each triangle, mm^2.
        turns : ndarray, shape (m, 3, 2, 2), optional
            What brings the values of each corner, pairs of numbers (n, 2), to the middle of the triangle before they
            are compared.
        """
        energy = np.einsum("m,mai,mij,mbj->mab", self._area, self._slopes, spread, self._slopes)
        index, mass = self._triangles[:, :, None], self.mass
        blocks = energy[:, :, None, :, None]
        if turns is not None:
            index, mass = 2 * index + np.arange(2), np.repeat(mass, 2)
            blocks = np.einsum("mab,maci,mbcj->maibj", energy, turns, turns)
        rows = np.broadcast_to(index[:, :, :, None, None], blocks.shape)
        columns = np.broadcast_to(index[:, None, None, :, :], blocks.shape)
        matrix = csc_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(len(mass),) * 2)
        factors = symmetric_factors(csc_array(matrix + diags_array(mass)))

        def smooth(values: Array) -> Array:
            flat = values.reshape(len(mass), -1)
            return np.asarray(factors.solve(mass[:, None] * flat).reshape(values.shape))

        return smooth

    def white(self, rng: np.random.Generator) -> npt.NDArray[np.float64]:
        """Return random numbers (n,) that weigh alike however the triangles lie."""
        return np.asarray(rng.normal(size=len(self.mass)) / np.sqrt(self.mass))
