"""One step of the skin against one linearly implicit step in plain numpy and scipy.

The reference linearizes springs, tethers and the tissue that keeps its volume at rest, and calls spsolve once a step
with one matrix for the three coordinates (no less stiff than any of them, which is stable), so that the matrix is
factored in every step. The skin factors a closer matrix per coordinate when it is made; its springs are biphasic, it
keeps triangles from folding, stays off bone and eyes, and iterates.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import spsolve

import facewrinkle as fw
from facewrinkle.geometry.interpolation import interpolated
from facewrinkle.geometry.refinement import RedGreenForest
from facewrinkle.mesh import to_polydata

SMILE = {"zygomaticus_major_l": 0.2, "zygomaticus_major_r": 0.2}
ROUNDS = {"built-in": 40, "refined": 10}
"""The second has ten times as many vertices."""


def skin_of(size):
    face = fw.default_face()
    if size == "built-in":
        return fw.Skin(face)
    forest = RedGreenForest(face.triangles, 2)
    forest.split(np.ones(len(face.triangles), bool))
    forest.split(np.arange(len(forest.triangles)) < 0.55 * len(forest.triangles))
    points = interpolated(face.points, forest.corners, forest.barycentric)
    return fw.Skin(fw.fit_face(to_polydata(points, forest.triangles), face.landmarks, units=face.unit), vertices=None)


class Reference:
    """(M (1 + 2 d w h) / h^2 + K') (u1 - u0) = M v / h - K u0 + f with K' >= K; M is lumped."""

    def __init__(self, skin):
        n, m, h = len(skin.points), skin.material, skin.time_step
        i, j = self.edges = skin._edges.T
        self.skin, self.along = skin, skin._rest / skin._length[:, None]
        k = skin._stiffness
        springs = csr_array((np.concatenate([k, k, -k, -k]), (np.r_[i, j, i, j], np.r_[i, j, j, i])), shape=(n, n))
        inertia = skin._mass * (1.0 + 2.0 * m.damping * m.rate * h) / h**2
        # Columns of tissue, and the most stiffness with which they couple the three coordinates.
        self.columns = skin._columns()
        sizes = np.sqrt([column.power(2).sum(axis=1) for column in self.columns])
        shares = skin._across * sizes.sum(axis=0) / np.maximum(sizes, 1e-12)
        kept = sum(c.T @ diags_array(share) @ c for c, share in zip(self.columns, shares, strict=True))
        self.matrix = (springs + skin._bending + diags_array(inertia + skin._along) + kept).tocsc()
        self.gather = csr_array(
            (np.r_[-np.ones_like(k), np.ones_like(k)], (np.r_[i, j], np.tile(np.arange(len(k)), 2)))
        )
        self.u = self.v = np.zeros_like(skin.points)

    def forces(self):
        """K u."""
        skin, (i, j), u = self.skin, self.edges, self.u
        stretch = np.einsum("ek,ek->e", self.along, u[j] - u[i])
        excess = skin._across * sum(column @ u[:, k] for k, column in enumerate(self.columns))
        tethers = skin._along[:, None] * u + np.stack([column.T @ excess for column in self.columns], axis=1)
        return self.gather @ ((skin._stiffness * stretch)[:, None] * self.along) + skin._bending @ u + tethers

    def step(self):
        h = self.skin.time_step
        right = self.skin._mass[:, None] / h * self.v - self.forces() + self.skin._force
        change = spsolve(self.matrix, right)
        self.u, self.v = self.u + change, change / h


@lru_cache(maxsize=1)
def settled(size):
    """A skin and its reference that moved for half a second, to the same place."""
    skin = skin_of(size)
    skin.contract(SMILE)
    reference = Reference(skin)
    for _ in range(25):
        skin.step()
        reference.step()
    apart = np.linalg.norm(skin.displacement - reference.u)
    assert apart < 0.1 * np.linalg.norm(reference.u), "both are the same skin"
    return skin, reference


@pytest.mark.parametrize("size", ROUNDS)
def test_step(versus, size):
    """While a smile sets in."""
    skin, reference = settled(size)
    skin.reset()
    skin.contract(SMILE)
    versus(f"skin step, {size} head", skin.step, reference.step, rounds=ROUNDS[size])
